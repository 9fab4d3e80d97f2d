/* SPDX-License-Identifier: MIT
 * UART 0: 8N1, FIFOs of 128 bytes, the APB clock divided by CLKDIV. Bytes take their time. What an overflow
 * loses is lost, as on the chip. */
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
    MEM_CONF_S3 = 0x60,
};
enum {
    RX_FULL = 1 << 0,
    TX_EMPTY = 1 << 1,
    RX_OVERFLOW = 1 << 4,
    RX_TIMEOUT = 1 << 8,
    TX_DONE = 1 << 14,
};
enum { FORMAT_8N1 = 0x1C, FORMAT = 0x3E, RESET_RX = 1 << 17, RESET_TX = 1 << 18, BITS = 10 };

static const unsigned source[2] = {34, 27};

static uint64_t cycles_of_bits(const struct uart *uart, uint32_t bits) {
    const uint64_t sixteenths = (uint64_t)(uart->divider & 0xFFFFF) * 16 + (uart->divider >> 20 & 15);
    return sixteenths * bits * (ES_CPU_HZ / ES_APB_HZ) / 16;
}

/* ---- the chips differ ---- */

static uint32_t full_at(const struct esp *esp) {
    return esp->uart.config1 & (esp->chip == ES_ESP32 ? 0x7F : 0x3FF);
}

static uint32_t empty_at(const struct esp *esp) {
    return esp->chip == ES_ESP32 ? esp->uart.config1 >> 8 & 0x7F : esp->uart.config1 >> 10 & 0x3FF;
}

/* Bits without a byte; 0: no timeout. */
static uint32_t timeout_bits(const struct esp *esp) {
    const struct uart *uart = &esp->uart;
    if (esp->chip == ES_ESP32)
        return uart->config1 >> 31 != 0 ? (uart->config1 >> 24 & 0x7F) * 8 : 0;
    return (uart->config1 >> 23 & 1) != 0 ? uart->memory_config >> 17 & 0x3FF : 0;
}

/* ---- interrupts ---- */

/* FULL and EMPTY are raised for as long as it is so. */
static void update(struct esp *esp) {
    struct uart *uart = &esp->uart;
    if (uart->rx_count != 0 && uart->rx_count >= full_at(esp))
        uart->raw |= RX_FULL;
    if (uart->tx_count <= empty_at(esp))
        uart->raw |= TX_EMPTY;
    matrix_set(esp, source[esp->chip], (uart->raw & uart->enabled) != 0);
}

/* ---- bytes ---- */

static void begin_byte(struct uart *uart, uint64_t now) {
    uart->tx_at = now + cycles_of_bits(uart, BITS);
}

static void put(struct esp *esp, uint32_t value) {
    struct uart *uart = &esp->uart;
    if ((uart->config0 & FORMAT) != FORMAT_8N1)
        chip_fault(esp, "UART 0 sends with another format than 8N1, which is not emulated");
    else if (uart->tx_count == UART_FIFO)
        chip_fault(esp, "a byte is written to UART 0 while its FIFO is full");
    else {
        uart->tx[uart->tx_count++] = (uint8_t)value;
        if (uart->tx_at == NEVER)
            begin_byte(uart, esp->cycles);
    }
}

static void sent(struct esp *esp) {
    struct uart *uart = &esp->uart;
    (void)chip_grow(&uart->out, &uart->out_room, uart->out_count + 1, 1);
    uart->out[uart->out_count++] = uart->tx[0];
    memmove(uart->tx, uart->tx + 1, --uart->tx_count);
    if (uart->tx_count != 0)
        begin_byte(uart, uart->tx_at);
    else {
        uart->tx_at = NEVER;
        uart->raw |= TX_DONE;
    }
}

static uint32_t take(struct esp *esp) {
    struct uart *uart = &esp->uart;
    if (uart->rx_count == 0) {
        chip_fault(esp, "UART 0 is read while its FIFO is empty");
        return 0;
    }
    const uint8_t byte = uart->rx[0];
    memmove(uart->rx, uart->rx + 1, --uart->rx_count);
    return byte;
}

static void received(struct esp *esp) {
    struct uart *uart = &esp->uart;
    const uint32_t bits = timeout_bits(esp);
    if (uart->rx_count == UART_FIFO)
        uart->raw |= RX_OVERFLOW;
    else
        uart->rx[uart->rx_count++] = uart->in[uart->in_at];
    uart->timeout_at = bits != 0 ? uart->rx_at + cycles_of_bits(uart, bits) : NEVER;
    uart->rx_at = ++uart->in_at < uart->in_count ? uart->rx_at + cycles_of_bits(uart, BITS) : NEVER;
}

uint64_t uart_next(const struct esp *esp) {
    const struct uart *uart = &esp->uart;
    uint64_t next = uart->tx_at < uart->rx_at ? uart->tx_at : uart->rx_at;
    return uart->timeout_at < next ? uart->timeout_at : next;
}

void uart_event(struct esp *esp) {
    struct uart *uart = &esp->uart;
    if (uart_next(esp) > esp->cycles)
        return;
    while (uart->tx_at <= esp->cycles)
        sent(esp);
    while (uart->rx_at <= esp->cycles)
        received(esp);
    if (uart->timeout_at <= esp->cycles) {
        uart->timeout_at = NEVER;
        if (uart->rx_count != 0)
            uart->raw |= RX_TIMEOUT;
    }
    update(esp);
}

/* ---- registers ---- */

static void unknown(struct esp *esp, uint32_t offset) {
    chip_fault(esp, "the register %02x of UART 0 is not emulated", offset);
}

static void configure(struct uart *uart, uint32_t value) {
    uart->config0 = value;
    if ((value & RESET_RX) != 0)
        uart->rx_count = 0;
    if ((value & RESET_TX) != 0 && uart->tx_count > 1)
        uart->tx_count = 1; /* the one that is on its way */
}

static void store(struct esp *esp, uint32_t offset, uint32_t value) {
    struct uart *uart = &esp->uart;
    if (offset == FIFO)
        put(esp, value);
    else if (offset == INT_ENA)
        uart->enabled = value;
    else if (offset == INT_CLR)
        uart->raw &= ~value;
    else if (offset == CLKDIV)
        uart->divider = value;
    else if (offset == CONF0)
        configure(uart, value);
    else if (offset == CONF1)
        uart->config1 = value;
    else if (offset == MEM_CONF_S3 && esp->chip == ES_ESP32S3)
        uart->memory_config = value;
    else
        unknown(esp, offset);
    update(esp);
}

static uint32_t load(struct esp *esp, uint32_t offset) {
    const struct uart *uart = &esp->uart;
    switch (offset) {
    case FIFO: {
        const uint32_t byte = take(esp);
        update(esp);
        return byte;
    }
    case INT_RAW:
        return uart->raw;
    case INT_ST:
        return uart->raw & uart->enabled;
    case INT_ENA:
        return uart->enabled;
    case CLKDIV:
        return uart->divider;
    case STATUS:
        return uart->rx_count | uart->tx_count << 16;
    case CONF0:
        return uart->config0;
    case CONF1:
        return uart->config1;
    default:
        if (offset == MEM_CONF_S3 && esp->chip == ES_ESP32S3)
            return uart->memory_config;
        unknown(esp, offset);
        return 0;
    }
}

void uart_create(struct esp *esp) {
    const uint32_t base = esp->chip == ES_ESP32 ? 0x3FF40000 : 0x60000000;
    bus_add(esp, &(struct block){"UART 0", base, 0x84, load, store});
    esp->uart.config0 = FORMAT_8N1;
    esp->uart.config1 = esp->chip == ES_ESP32 ? 0x6060 : 0x60 | 0x60 << 10; /* thresholds of 96 bytes */
    esp->uart.divider = 694;                                                /* 115200 baud */
    esp->uart.tx_at = esp->uart.rx_at = esp->uart.timeout_at = NEVER;
}

/* ---- from outside ---- */

void es_uart_put(struct esp *esp, const uint8_t *bytes, size_t count) {
    struct uart *uart = &esp->uart;
    if (count == 0)
        return;
    if (uart->in_at == uart->in_count)
        uart->in_at = uart->in_count = 0;
    (void)chip_grow(&uart->in, &uart->in_room, uart->in_count + count, 1);
    memcpy(uart->in + uart->in_count, bytes, count);
    uart->in_count += count;
    if (uart->rx_at == NEVER)
        uart->rx_at = esp->cycles + cycles_of_bits(uart, BITS);
    chip_look(esp);
}

size_t es_uart_get(struct esp *esp, uint8_t *bytes, size_t size) {
    struct uart *uart = &esp->uart;
    const size_t count = uart->out_count < size ? uart->out_count : size;
    if (count == 0)
        return 0;
    memcpy(bytes, uart->out, count);
    memmove(uart->out, uart->out + count, uart->out_count - count);
    uart->out_count -= count;
    return count;
}
