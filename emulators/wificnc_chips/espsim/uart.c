/* SPDX-License-Identifier: MIT
 * The three UARTs: 8N1, FIFOs of 128 bytes. Bytes take their time. What an overflow loses is lost, as on the
 * chip. Registers of lines that are not here (flow control, RS485, autobaud) keep what is written. */
#include "esp.h"

#include <string.h>

enum {
    FIFO = 0x00,
    INT_RAW = 0x04,
    INT_ST = 0x08,
    INT_ENA = 0x0C,
    INT_CLR = 0x10,
    CLKDIV = 0x14,
    STATUS = 0x1C,
    CONF0 = 0x20,
    CONF1 = 0x24,
    MEM_RX_STATUS = 0x60, /* of the ESP32 */
    MEM_CONF_S3 = 0x60,
    CLK_CONF_S3 = 0x78,
    ID_S3 = 0x80,
};
enum {
    RX_FULL = 1 << 0,
    TX_EMPTY = 1 << 1,
    RX_OVERFLOW = 1 << 4,
    RX_TIMEOUT = 1 << 8,
    TX_DONE = 1 << 14,
};
enum { FORMAT_8N1 = 0x1C, FORMAT = 0x3E, RESET_RX = 1 << 17, RESET_TX = 1 << 18, BITS = 10 };
enum { CLOCK_APB = 1 };
#define ID_UPDATE (1u << 31)

static const unsigned source[2] = {34, 27};
static const uint32_t bases[2][UARTS] = {{0x3FF40000, 0x3FF50000, 0x3FF6E000},
                                         {0x60000000, 0x60010000, 0x6002E000}};

static unsigned number_of(const struct esp *esp, const struct uart *uart) {
    return (unsigned)(uart - esp->uart);
}

static uint32_t *word(struct uart *uart, uint32_t offset) {
    return &uart->word[offset / 4];
}

static uint32_t value_of(const struct uart *uart, uint32_t offset) {
    return uart->word[offset / 4];
}

/* The S3 chooses a clock and divides it first. */
static uint64_t clock_hz(const struct esp *esp, const struct uart *uart) {
    static const uint32_t hz[4] = {ES_APB_HZ, ES_APB_HZ, 17500000, 40000000};
    const uint32_t config = value_of(uart, CLK_CONF_S3);
    return esp->chip == ES_ESP32 ? ES_APB_HZ : hz[config >> 20 & 3] / ((config >> 12 & 255) + 1);
}

static uint64_t cycles_of_bits(const struct esp *esp, const struct uart *uart, uint32_t bits) {
    const uint32_t divider = value_of(uart, CLKDIV);
    const uint64_t sixteenths = (uint64_t)(divider & 0xFFFFF) * 16 + (divider >> 20 & 15);
    return sixteenths * bits * ES_CPU_HZ / clock_hz(esp, uart) / 16;
}

/* ---- the chips differ ---- */

static uint32_t full_at(const struct esp *esp, const struct uart *uart) {
    return value_of(uart, CONF1) & (esp->chip == ES_ESP32 ? 0x7F : 0x3FF);
}

static uint32_t empty_at(const struct esp *esp, const struct uart *uart) {
    const uint32_t config = value_of(uart, CONF1);
    return esp->chip == ES_ESP32 ? config >> 8 & 0x7F : config >> 10 & 0x3FF;
}

/* Bits without a byte; 0: no timeout. */
static uint32_t timeout_bits(const struct esp *esp, const struct uart *uart) {
    const uint32_t config = value_of(uart, CONF1);
    if (esp->chip == ES_ESP32)
        return config >> 31 != 0 ? (config >> 24 & 0x7F) * 8 : 0;
    return (config >> 23 & 1) != 0 ? value_of(uart, MEM_CONF_S3) >> 17 & 0x3FF : 0;
}

/* ---- interrupts ---- */

/* FULL and EMPTY are raised for as long as it is so. */
static void update(struct esp *esp, struct uart *uart) {
    if (uart->rx_count != 0 && uart->rx_count >= full_at(esp, uart))
        uart->raw |= RX_FULL;
    if (uart->tx_count <= empty_at(esp, uart))
        uart->raw |= TX_EMPTY;
    matrix_set(esp, source[esp->chip] + number_of(esp, uart), (uart->raw & value_of(uart, INT_ENA)) != 0);
}

/* ---- bytes ---- */

static void begin_byte(const struct esp *esp, struct uart *uart, uint64_t now) {
    uart->tx_at = now + cycles_of_bits(esp, uart, BITS);
}

static void put(struct esp *esp, struct uart *uart, uint32_t value) {
    const unsigned number = number_of(esp, uart);
    if ((value_of(uart, CONF0) & FORMAT) != FORMAT_8N1)
        chip_fault(esp, "UART %u sends with another format than 8N1, which is not emulated", number);
    else if (uart->tx_count == UART_FIFO)
        chip_fault(esp, "a byte is written to UART %u while its FIFO is full", number);
    else {
        uart->tx[uart->tx_count++] = (uint8_t)value;
        if (uart->tx_at == NEVER)
            begin_byte(esp, uart, esp->cycles);
    }
}

void uart_print(struct esp *esp, unsigned number, uint8_t byte) {
    struct uart *uart = &esp->uart[number];
    (void)chip_grow(&uart->out, &uart->out_room, uart->out_count + 1, 1);
    uart->out[uart->out_count++] = byte;
}

static void sent(struct esp *esp, struct uart *uart) {
    uart_print(esp, number_of(esp, uart), uart->tx[0]);
    memmove(uart->tx, uart->tx + 1, --uart->tx_count);
    if (uart->tx_count != 0)
        begin_byte(esp, uart, uart->tx_at);
    else {
        uart->tx_at = NEVER;
        uart->raw |= TX_DONE;
    }
}

static uint32_t take(struct esp *esp, struct uart *uart) {
    if (uart->rx_count == 0) {
        chip_fault(esp, "UART %u is read while its FIFO is empty", number_of(esp, uart));
        return 0;
    }
    const uint8_t byte = uart->rx[0];
    memmove(uart->rx, uart->rx + 1, --uart->rx_count);
    uart->taken++;
    return byte;
}

static void received(struct esp *esp, struct uart *uart) {
    const uint32_t bits = timeout_bits(esp, uart);
    if (uart->rx_count == UART_FIFO)
        uart->raw |= RX_OVERFLOW;
    else
        uart->rx[uart->rx_count++] = uart->in[uart->in_at];
    uart->timeout_at = bits != 0 ? uart->rx_at + cycles_of_bits(esp, uart, bits) : NEVER;
    uart->rx_at = ++uart->in_at < uart->in_count ? uart->rx_at + cycles_of_bits(esp, uart, BITS) : NEVER;
}

static uint64_t next_of(const struct uart *uart) {
    const uint64_t next = uart->tx_at < uart->rx_at ? uart->tx_at : uart->rx_at;
    return uart->timeout_at < next ? uart->timeout_at : next;
}

uint64_t uart_next(const struct esp *esp) {
    uint64_t next = NEVER;
    for (unsigned i = 0; i < UARTS; i++)
        next = next_of(&esp->uart[i]) < next ? next_of(&esp->uart[i]) : next;
    return next;
}

static void event(struct esp *esp, struct uart *uart) {
    while (uart->tx_at <= esp->cycles)
        sent(esp, uart);
    while (uart->rx_at <= esp->cycles)
        received(esp, uart);
    if (uart->timeout_at <= esp->cycles) {
        uart->timeout_at = NEVER;
        if (uart->rx_count != 0)
            uart->raw |= RX_TIMEOUT;
    }
    update(esp, uart);
}

void uart_event(struct esp *esp) {
    for (unsigned i = 0; i < UARTS; i++)
        if (next_of(&esp->uart[i]) <= esp->cycles)
            event(esp, &esp->uart[i]);
}

/* ---- registers ---- */

static void reset_fifos(struct uart *uart, uint32_t value) {
    if ((value & RESET_RX) != 0) {
        uart->rx_count = 0;
        uart->taken = 0;
    }
    if ((value & RESET_TX) != 0 && uart->tx_count > 1)
        uart->tx_count = 1; /* the one that is on its way */
}

static void store(struct esp *esp, unsigned number, uint32_t offset, uint32_t value) {
    struct uart *uart = &esp->uart[number];
    if (offset == FIFO)
        put(esp, uart, value);
    else if (offset == INT_CLR)
        uart->raw &= ~value;
    else
        *word(uart, offset) = esp->chip == ES_ESP32S3 && offset == ID_S3 ? value & ~ID_UPDATE : value;
    if (offset == CONF0)
        reset_fifos(uart, value);
    update(esp, uart);
}

/* Pointers into the ESP32's FIFO: its driver counts with them. */
static uint32_t pointers(const struct uart *uart) {
    const uint32_t read = uart->taken % UART_FIFO, written = (uart->taken + uart->rx_count) % UART_FIFO;
    return read << 2 | written << 13;
}

static uint32_t load(struct esp *esp, unsigned number, uint32_t offset) {
    struct uart *uart = &esp->uart[number];
    switch (offset) {
    case FIFO: {
        const uint32_t byte = take(esp, uart);
        update(esp, uart);
        return byte;
    }
    case INT_RAW:
        return uart->raw;
    case INT_ST:
        return uart->raw & value_of(uart, INT_ENA);
    case STATUS:
        return uart->rx_count | uart->tx_count << 16;
    case MEM_RX_STATUS:
        return esp->chip == ES_ESP32 ? pointers(uart) : value_of(uart, offset);
    default:
        return value_of(uart, offset);
    }
}

#define REGISTERS(n)                                                                                         \
    static uint32_t load##n(struct esp *esp, uint32_t offset) {                                              \
        return load(esp, n, offset);                                                                         \
    }                                                                                                        \
    static void store##n(struct esp *esp, uint32_t offset, uint32_t value) {                                 \
        store(esp, n, offset, value);                                                                        \
    }
REGISTERS(0)
REGISTERS(1)
REGISTERS(2)

static const struct block blocks[UARTS] = {{"UART 0", 0, 4 * UART_WORDS, load0, store0, NULL},
                                           {"UART 1", 0, 4 * UART_WORDS, load1, store1, NULL},
                                           {"UART 2", 0, 4 * UART_WORDS, load2, store2, NULL}};

/* Thresholds of 96 bytes, 115200 baud. What was to be received, and what was sent, is outside. */
static void reset(struct esp *esp, struct uart *uart) {
    const struct uart before = *uart;
    memset(uart, 0, sizeof *uart);
    uart->in = before.in;
    uart->in_room = before.in_room;
    uart->out = before.out;
    uart->out_count = before.out_count;
    uart->out_room = before.out_room;
    *word(uart, CONF0) = FORMAT_8N1;
    *word(uart, CONF1) = esp->chip == ES_ESP32 ? 0x6060 : 0x60 | 0x60 << 10;
    *word(uart, CLKDIV) = 694;
    if (esp->chip == ES_ESP32S3)
        *word(uart, CLK_CONF_S3) = CLOCK_APB << 20;
    uart->tx_at = uart->rx_at = uart->timeout_at = NEVER;
}

void uart_create(struct esp *esp) {
    for (unsigned i = 0; i < UARTS; i++) {
        struct block block = blocks[i];
        block.base = bases[esp->chip][i];
        bus_add(esp, &block);
        reset(esp, &esp->uart[i]);
    }
}

/* ---- from outside ---- */

void es_uart_put(struct esp *esp, unsigned number, const uint8_t *bytes, size_t count) {
    struct uart *uart = &esp->uart[number % UARTS];
    if (count == 0)
        return;
    if (uart->in_at == uart->in_count)
        uart->in_at = uart->in_count = 0;
    (void)chip_grow(&uart->in, &uart->in_room, uart->in_count + count, 1);
    memcpy(uart->in + uart->in_count, bytes, count);
    uart->in_count += count;
    if (uart->rx_at == NEVER)
        uart->rx_at = esp->cycles + cycles_of_bits(esp, uart, BITS);
    chip_look(esp);
}

size_t es_uart_get(struct esp *esp, unsigned number, uint8_t *bytes, size_t size) {
    struct uart *uart = &esp->uart[number % UARTS];
    const size_t count = uart->out_count < size ? uart->out_count : size;
    if (count == 0)
        return 0;
    memcpy(bytes, uart->out, count);
    memmove(uart->out, uart->out + count, uart->out_count - count);
    uart->out_count -= count;
    return count;
}
