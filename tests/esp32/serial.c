/* SPDX-License-Identifier: MIT
 * UART0 as the firmware sets it up (targets/esp32/link/serial_stream.c), over a model of the receiver and of
 * ESP-IDF's driver in virtual time: a FIFO of 128 bytes, an interrupt at a threshold and after a pause, a
 * ring buffer behind it. While flash is erased no task runs on core 0, and no interrupt that is not in IRAM
 * (UART_ISR_IN_IRAM in sdkconfig). */
#include "check.h"
#include "link/serial_stream.h"

#include "driver/uart.h"

#include <string.h>

enum {
    NS_PER_US = 1000,
    BYTE_NS = 86806,
    SYMBOL_NS = BYTE_NS,
    FIFO = 128,
    RING = 1 << 20,
    ROUND_NS = 1000000
};
enum { ERASE_NS = 400000000, ERASE_EVERY_NS = 900000000 }; /* the longest of a sector, flash data sheets */

static struct {
    unsigned threshold, idle_symbols, ring_size;
    unsigned fifo, ring; /* bytes in them */
    unsigned char fifo_bytes[FIFO], ring_bytes[RING];
    unsigned first;
    uint64_t now_ns, newest_ns, erase_until_ns;
    unsigned lost;
    bool isr_in_iram;
} uart = {.threshold = 120, .idle_symbols = 10};

/* ---- the driver ---- */

esp_err_t uart_driver_install(uart_port_t port, int rx_size, int tx_size, int queue_size,
                              QueueHandle_t *queue, int flags) {
    (void)port, (void)tx_size, (void)queue_size, (void)queue, (void)flags;
    uart.ring_size = (unsigned)rx_size;
    return ESP_OK;
}

esp_err_t uart_param_config(uart_port_t port, const uart_config_t *config) {
    (void)port;
    CHECK(config->baud_rate == 115200);
    return ESP_OK;
}

esp_err_t uart_set_rx_full_threshold(uart_port_t port, int threshold) {
    (void)port;
    CHECK(uart.ring_size != 0 && threshold > 0 && threshold < FIFO);
    uart.threshold = (unsigned)threshold;
    return ESP_OK;
}

esp_err_t uart_set_rx_timeout(uart_port_t port, uint8_t symbols) {
    (void)port;
    uart.idle_symbols = symbols;
    return ESP_OK;
}

esp_err_t uart_get_tx_buffer_free_size(uart_port_t port, size_t *size) {
    (void)port;
    *size = SERIAL_TX_SIZE;
    return ESP_OK;
}

int uart_write_bytes(uart_port_t port, const void *bytes, size_t size) {
    (void)port, (void)bytes;
    return (int)size;
}

int uart_read_bytes(uart_port_t port, void *bytes, uint32_t length, TickType_t ticks) {
    (void)port, (void)ticks;
    unsigned count = uart.ring < length ? uart.ring : length;
    for (unsigned n = 0; n < count; n++)
        ((unsigned char *)bytes)[n] = uart.ring_bytes[(uart.first + n) % RING];
    uart.first = (uart.first + count) % RING;
    uart.ring -= count;
    return (int)count;
}

/* ---- the receiver ---- */

static bool erases(void) {
    return uart.now_ns < uart.erase_until_ns;
}

static void interrupt_when_due(void) {
    bool idle = uart.now_ns - uart.newest_ns >= (uint64_t)uart.idle_symbols * SYMBOL_NS;
    if (uart.fifo == 0 || (uart.fifo < uart.threshold && !idle))
        return;
    if (erases() && !uart.isr_in_iram)
        return;
    if (uart.ring + uart.fifo > uart.ring_size)
        return; /* the driver leaves it in the FIFO */
    for (unsigned n = 0; n < uart.fifo; n++)
        uart.ring_bytes[(uart.first + uart.ring++) % RING] = uart.fifo_bytes[n];
    uart.fifo = 0;
}

static void receive(unsigned char byte) {
    uart.newest_ns = uart.now_ns;
    if (uart.fifo == FIFO)
        uart.lost++;
    else
        uart.fifo_bytes[uart.fifo++] = byte;
    interrupt_when_due();
}

/* ---- tests ---- */

static struct net_stream stream;
static char taken[1 << 16];

/* One round of the controller. @return bytes read */
static long take(void) {
    return erases() ? 0 : stream.ops->read(&stream, taken, sizeof taken);
}

/* So many bytes without a pause, with erases in between, and all of them arrive. */
static void nothing_is_lost_while_flash_is_erased(void) {
    unsigned expected = 0, sent = 0;
    uint64_t round_ns = uart.now_ns, erase_ns = uart.now_ns;
    bool good = true;
    while (expected < 60000) {
        uart.now_ns += BYTE_NS;
        if (sent < 60000)
            receive((unsigned char)(sent++ % 251));
        interrupt_when_due();
        if (uart.now_ns >= erase_ns) {
            uart.erase_until_ns = uart.now_ns + ERASE_NS;
            erase_ns += ERASE_EVERY_NS;
        }
        if (uart.now_ns < round_ns)
            continue;
        round_ns += ROUND_NS;
        long count = take();
        for (long n = 0; n < count; n++)
            good &= (unsigned char)taken[n] == expected++ % 251;
        if (uart.lost != 0)
            break;
    }
    CHECK(uart.lost == 0);
    CHECK(good);
}

/* From the last bit of `!` on the wire until the controller has it. */
static uint64_t time_of_hold_ns(unsigned before, unsigned behind) {
    uint64_t arrived_ns = 0, round_ns = uart.now_ns + ROUND_NS;
    for (unsigned n = 0;; n++) {
        uart.now_ns += BYTE_NS;
        if (n < before + 1 + behind)
            receive(n == before ? '!' : 'x');
        if (n == before)
            arrived_ns = uart.now_ns;
        interrupt_when_due();
        if (uart.now_ns < round_ns)
            continue;
        round_ns += ROUND_NS;
        long count = take();
        if (count > 0 && memchr(taken, '!', (size_t)count) != NULL)
            return uart.now_ns - arrived_ns;
    }
}

static void a_hold_is_seen_soon(void) {
    uint64_t longest_ns = 0;
    for (unsigned before = 0; before < 300; before++) {
        const uint64_t time_ns = time_of_hold_ns(before, 300);
        longest_ns = time_ns > longest_ns ? time_ns : longest_ns;
        uart.now_ns += 50000000;
        interrupt_when_due();
        while (take() > 0) {
        }
    }
    const uint64_t alone_ns = time_of_hold_ns(0, 0);
    printf("! in a stream: %u us at most, alone: %u us\n", (unsigned)(longest_ns / NS_PER_US),
           (unsigned)(alone_ns / NS_PER_US));
    CHECK(longest_ns <= 2500000);
    CHECK(alone_ns <= 1400000);
}

/* Arguments: the options of sdkconfig.defaults that are about the UART. */
int main(int count, char **options) {
    for (int n = 1; n < count; n++)
        uart.isr_in_iram |= strcmp(options[n], "CONFIG_UART_ISR_IN_IRAM") == 0;
    CHECK(serial_stream_uart(&stream));
    a_hold_is_seen_soon();
    nothing_is_lost_while_flash_is_erased();
    return report();
}
