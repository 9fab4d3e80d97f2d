/* SPDX-License-Identifier: MIT
 * UART 3, the console, and UART 2, the bus of a spindle drive: FIFOs of 8 bytes each way and the real time of
 * a byte, 10 bits, or 11 with parity, at PBCLK2 / (16 or 4) / (BRG + 1). */
#include "chip.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ON = 1 << 15, BRGH = 1 << 3, URXEN = 1 << 12, UTXEN = 1 << 10, UTXBF = 1 << 9, TRMT = 1 << 8 };
enum { FERR = 1 << 2, OERR = 1 << 1, URXDA = 1 << 0, STA_WRITABLE = 0x0000FC62 };
enum { UNFRAMED = 1 << 8 }; /* of a byte in the receiver */
enum { PARITY = 3 << 1 };   /* PDSEL */
enum { NO_DRIVER = 255, CONSOLE_BAUD = 115200 };

static struct uart *uart_of(struct chip *chip, const struct sfr *sfr) {
    return sfr->unit == 2 ? &chip->bus : &chip->uart;
}

static uint64_t byte_cycles(const struct chip *chip, const struct uart *uart) {
    uint64_t clocks = (uart->mode->value & BRGH) != 0 ? 4 : 16;
    uint64_t bits = (uart->mode->value & PARITY) != 0 ? 11 : 10;
    return bits * clocks * (uart->brg->value + 1) * system_bus_cycles(chip, chip->pb2div);
}

/* What the other end of the console, at 115200 baud, can make of it: only a clock that failed is wrong by
 * much. */
static bool is_readable(const struct chip *chip, const struct uart *uart) {
    if (uart != &chip->uart || !system_is_on_backup(chip))
        return true;
    int64_t baud = (int64_t)(MZ_BACKUP_HZ * (uint64_t)chip->speed * 10 / byte_cycles(chip, uart));
    return llabs(baud - CONSOLE_BAUD) * 100 <= 3 * CONSOLE_BAUD;
}

static bool receives(const struct uart *uart) {
    return (uart->mode->value & ON) != 0 && (uart->sta->value & URXEN) != 0;
}

static bool transmits(const struct uart *uart) {
    return (uart->mode->value & ON) != 0 && (uart->sta->value & UTXEN) != 0;
}

/* ---- transmitter ---- */

/* On a bus DE must be high while a byte is sent, and low while one is received. */
static void check_driver(struct chip *chip, const struct uart *uart, bool sends) {
    if (uart->driver_pin != NO_DRIVER && (mz_pin_level(chip, uart->driver_pin) != 0) != sends)
        chip_fault(chip, sends ? "a byte is sent while DE is low" : "a byte arrives while DE is high");
}

static void send_next(struct chip *chip, struct uart *uart) {
    if (uart->shifting || uart->tx_count == 0 || !transmits(uart))
        return;
    uart->shift = uart->tx_fifo[0];
    memmove(uart->tx_fifo, uart->tx_fifo + 1, --uart->tx_count);
    uart->shifting = true;
    check_driver(chip, uart, true);
    uart->tx_next = chip->cycles + byte_cycles(chip, uart) / uart->factor;
}

static void sent(struct chip *chip, struct uart *uart) {
    check_driver(chip, uart, true);
    if (!chip_grow(&uart->out, &uart->out_room, uart->out_count + 1, 1))
        return;
    uart->out[uart->out_count++] = is_readable(chip, uart) ? uart->shift : 0xFF;
    uart->shifting = false;
    uart->tx_next = NEVER;
    send_next(chip, uart);
}

static void written_tx(struct chip *chip, struct sfr *sfr, uint32_t before) {
    struct uart *uart = uart_of(chip, sfr);
    (void)before;
    if (!transmits(uart) || uart->tx_count == UART_FIFO) {
        chip_fault(chip, "%s written while the transmitter is %s", sfr->name,
                   transmits(uart) ? "full" : "off");
        return;
    }
    uart->tx_fifo[uart->tx_count++] = (uint8_t)sfr->value;
    send_next(chip, uart);
}

/* ---- receiver ---- */

static void expect_next(const struct chip *chip, struct uart *uart, uint64_t from) {
    bool more = uart->in_at < uart->in_count && receives(uart);
    uart->rx_next = more ? from + byte_cycles(chip, uart) / uart->factor : NEVER;
}

static void received(struct chip *chip, struct uart *uart) {
    check_driver(chip, uart, false);
    uint16_t byte = uart->in[uart->in_at++] | (is_readable(chip, uart) ? 0 : UNFRAMED);
    if (uart->rx_count < UART_FIFO && (uart->sta->value & OERR) == 0)
        uart->rx_fifo[uart->rx_count++] = byte;
    else
        uart->sta->value |= OERR;
    expect_next(chip, uart, uart->rx_next);
}

static uint32_t read_rx(struct chip *chip, struct sfr *sfr) {
    struct uart *uart = uart_of(chip, sfr);
    if (uart->rx_count == 0) {
        chip_fault(chip, "%s read while no byte is there", sfr->name);
        return 0;
    }
    uint8_t byte = (uint8_t)uart->rx_fifo[0];
    memmove(uart->rx_fifo, uart->rx_fifo + 1, --uart->rx_count * sizeof uart->rx_fifo[0]);
    chip_look(chip);
    return byte;
}

static size_t put(struct chip *chip, struct uart *uart, const uint8_t *bytes, size_t count, uint16_t flags) {
    if (uart->in_at == uart->in_count)
        uart->in_at = uart->in_count = 0;
    if (!chip_grow(&uart->in, &uart->in_room, uart->in_count + count, sizeof uart->in[0]))
        return 0;
    for (size_t n = 0; n < count; n++)
        uart->in[uart->in_count++] = bytes[n] | flags;
    if (uart->rx_next == NEVER)
        expect_next(chip, uart, chip->cycles);
    chip_look(chip);
    return count;
}

size_t mz_uart_put(struct chip *chip, const uint8_t *bytes, size_t count) {
    return put(chip, &chip->uart, bytes, count, 0);
}

size_t mz_uart_put_unframed(struct chip *chip, const uint8_t *bytes, size_t count) {
    return put(chip, &chip->uart, bytes, count, UNFRAMED);
}

size_t mz_uart_waiting(const struct chip *chip) {
    return chip->uart.in_count - chip->uart.in_at;
}

void mz_uart_speed(struct chip *chip, uint32_t factor) {
    chip->uart.factor = factor > 0 ? factor : 1;
}

static size_t get(struct uart *uart, uint8_t *bytes, size_t size) {
    size_t count = uart->out_count < size ? uart->out_count : size;
    memcpy(bytes, uart->out, count);
    memmove(uart->out, uart->out + count, uart->out_count - count);
    uart->out_count -= count;
    return count;
}

size_t mz_uart_get(struct chip *chip, uint8_t *bytes, size_t size) {
    return get(&chip->uart, bytes, size);
}

size_t mz_bus_put(struct chip *chip, const uint8_t *bytes, size_t count) {
    return put(chip, &chip->bus, bytes, count, 0);
}

size_t mz_bus_get(struct chip *chip, uint8_t *bytes, size_t size) {
    return get(&chip->bus, bytes, size);
}

uint32_t mz_bus_byte_cycles(const struct chip *chip) {
    return (uint32_t)byte_cycles(chip, &chip->bus);
}

void mz_bus_driver(struct chip *chip, unsigned pin) {
    chip->bus.driver_pin = pin;
}

/* ---- both ---- */

/* FERR is that of the byte which is read next (Register 22-2). */
static uint32_t read_sta(struct chip *chip, struct sfr *sfr) {
    const struct uart *uart = uart_of(chip, sfr);
    uint32_t value = sfr->value & ~(uint32_t)(UTXBF | TRMT | URXDA | FERR);
    value |= uart->tx_count == UART_FIFO ? UTXBF : 0;
    value |= uart->tx_count == 0 && !uart->shifting ? TRMT : 0;
    value |= uart->rx_count > 0 && (uart->rx_fifo[0] & UNFRAMED) != 0 ? FERR : 0;
    return value | (uart->rx_count > 0 ? URXDA : 0);
}

static void written_mode(struct chip *chip, struct sfr *sfr, uint32_t before) {
    struct uart *uart = uart_of(chip, sfr);
    (void)before;
    send_next(chip, uart);
    if (uart->rx_next == NEVER)
        expect_next(chip, uart, chip->cycles);
}

/* Clearing OERR empties the receiver (Register 22-2). */
static void written_sta(struct chip *chip, struct sfr *sfr, uint32_t before) {
    if ((before & OERR) != 0 && (sfr->value & OERR) == 0)
        uart_of(chip, sfr)->rx_count = 0;
    written_mode(chip, sfr, before);
}

static uint32_t lines_of(const struct uart *uart) {
    static const unsigned most_held[4] = {UART_FIFO - 1, 0, 0, 0}; /* UTXISEL: room, all sent, FIFO empty */
    unsigned select = uart->sta->value >> 14 & 3;
    bool tx = transmits(uart) && uart->tx_count <= most_held[select] && (select != 1 || !uart->shifting);
    return (receives(uart) && uart->rx_count > 0 ? 1u : 0) | (tx ? 2u : 0);
}

uint32_t uart_lines(const struct chip *chip) {
    return lines_of(&chip->uart) | lines_of(&chip->bus) << 2;
}

static struct sfr *add(struct chip *chip, unsigned unit, const char *what, uint32_t offset, uint32_t at_reset,
                       uint32_t writable) {
    char name[12];
    snprintf(name, sizeof name, "U%u%s", unit, what);
    struct sfr *sfr = sfr_add(chip, name, 0x1F822000 + 0x200 * (unit - 1) + offset, at_reset, writable);
    sfr->unit = unit;
    return sfr;
}

static void create(struct chip *chip, struct uart *uart, unsigned unit) {
    uart->mode = add(chip, unit, "MODE", 0x00, 0, 0xBFFF);
    uart->sta = add(chip, unit, "STA", 0x10, TRMT, STA_WRITABLE);
    struct sfr *tx = add(chip, unit, "TXREG", 0x20, 0, 0x1FF);
    struct sfr *rx = add(chip, unit, "RXREG", 0x30, 0, 0);
    uart->brg = add(chip, unit, "BRG", 0x40, 0, 0xFFFF);
    uart->mode->written = written_mode;
    uart->sta->written = written_sta;
    uart->sta->read = read_sta;
    tx->written = written_tx;
    tx->plain = rx->plain = true;
    rx->read = read_rx;
    uart->factor = 1;
    uart->driver_pin = NO_DRIVER;
}

void uart_create(struct chip *chip) {
    create(chip, &chip->uart, 3);
    create(chip, &chip->bus, 2);
}

static void forget(struct uart *uart) {
    uart->tx_count = uart->rx_count = 0;
    uart->shifting = false;
    uart->tx_next = uart->rx_next = NEVER;
    uart->in_at = uart->in_count = 0;
}

void uart_reset(struct chip *chip) {
    forget(&chip->uart);
    forget(&chip->bus);
}

static uint64_t next_of(const struct uart *uart) {
    return uart->tx_next < uart->rx_next ? uart->tx_next : uart->rx_next;
}

uint64_t uart_next(const struct chip *chip) {
    const uint64_t uart = next_of(&chip->uart), bus = next_of(&chip->bus);
    return uart < bus ? uart : bus;
}

static void event(struct chip *chip, struct uart *uart) {
    if (uart->tx_next <= chip->cycles)
        sent(chip, uart);
    while (uart->rx_next <= chip->cycles)
        received(chip, uart);
}

void uart_event(struct chip *chip) {
    event(chip, &chip->uart);
    event(chip, &chip->bus);
    chip->look = true;
}
