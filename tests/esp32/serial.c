/* SPDX-License-Identifier: MIT
 * UART0 as the firmware sets it up (targets/esp32/link/serial_stream.c), over a model of the receiver and of
 * ESP-IDF's driver in virtual time: a FIFO of 128 bytes, an interrupt at a threshold and after a pause, a
 * ring buffer behind it. While flash is erased no task runs on core 0, and no interrupt that is not in IRAM
 * (UART_ISR_IN_IRAM in sdkconfig). What it reads goes through the hub into the controller's receive buffer
 * and its line reader. The driver reports a byte without a stop bit and an overrun in its queue of events
 * only; an overrun empties the FIFO. */
#include "check.h"
#include "input/line_reader.h"
#include "input/rx.h"
#include "link/serial_stream.h"
#include "net_hub.h"

#include "driver/uart.h"
#include "freertos/queue.h"
#include "hal/uart_ll.h"

#include <stdlib.h>
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
    bool reports_unframed, full; /* full: the ring took no more, and what did not fit is stashed */
    unsigned char stash_bytes[FIFO];
    unsigned stash;
    uart_event_t events[1 << 12];
    unsigned event_room, event_first, event_count;
} uart = {.threshold = 120, .idle_symbols = 10};

/* ---- the driver ---- */

esp_err_t uart_driver_install(uart_port_t port, int rx_size, int tx_size, int queue_size,
                              QueueHandle_t *queue, int flags) {
    (void)port, (void)flags;
    if (rx_size <= FIFO || (tx_size > 0 && tx_size <= FIFO)) /* as ESP-IDF's */
        return ESP_FAIL;
    uart.ring_size = (unsigned)rx_size;
    uart.event_room = (unsigned)queue_size;
    if (queue != NULL)
        *queue = (QueueHandle_t)&uart;
    return ESP_OK;
}

esp_err_t uart_param_config(uart_port_t port, const uart_config_t *config) {
    CHECK(config->baud_rate == (port == UART_NUM_0 ? 115200 : 1000000));
    return ESP_OK;
}

static struct {
    uart_port_t port;
    int tx, rx;
} pins;

esp_err_t uart_set_pin(uart_port_t port, int tx, int rx, int rts, int cts) {
    CHECK(rts == UART_PIN_NO_CHANGE && cts == UART_PIN_NO_CHANGE);
    pins.port = port;
    pins.tx = tx;
    pins.rx = rx;
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

esp_err_t uart_enable_intr_mask(uart_port_t port, uint32_t mask) {
    (void)port;
    uart.reports_unframed |= mask == UART_INTR_FRAM_ERR;
    return ESP_OK;
}

esp_err_t uart_get_buffered_data_len(uart_port_t port, size_t *size) {
    (void)port;
    *size = uart.ring;
    return ESP_OK;
}

struct uart_dev_t {
    char unused;
};

uart_dev_t UART0;

uint32_t uart_ll_get_rxfifo_len(uart_dev_t *hw) {
    (void)hw;
    return uart.fifo;
}

static void post(uart_event_type_t type) {
    if (uart.event_count < uart.event_room) {
        unsigned place = (uart.event_first + uart.event_count++) % (1 << 12);
        uart.events[place] = (uart_event_t){.type = type};
    }
}

UBaseType_t uxQueueSpacesAvailable(QueueHandle_t queue) {
    (void)queue;
    return uart.event_room - uart.event_count;
}

BaseType_t xQueueReceive(QueueHandle_t queue, void *item, TickType_t ticks) {
    (void)queue, (void)ticks;
    if (uart.event_count == 0)
        return 0;
    memcpy(item, &uart.events[uart.event_first], sizeof uart.events[0]);
    uart.event_first = (uart.event_first + 1) % (1 << 12);
    uart.event_count--;
    return pdTRUE;
}

static void to_ring(const unsigned char *bytes, unsigned count) {
    for (unsigned n = 0; n < count; n++)
        uart.ring_bytes[(uart.first + uart.ring++) % RING] = bytes[n];
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
    if (uart.full && uart.ring + uart.stash <= uart.ring_size) {
        to_ring(uart.stash_bytes, uart.stash);
        uart.full = false;
        uart.stash = 0;
    }
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
    if (uart.full)
        return; /* it stays in the FIFO */
    if (uart.ring + uart.fifo > uart.ring_size) {
        memcpy(uart.stash_bytes, uart.fifo_bytes, uart.stash = uart.fifo);
        uart.full = true;
    } else {
        to_ring(uart.fifo_bytes, uart.fifo);
    }
    post(uart.full ? UART_BUFFER_FULL : UART_DATA);
    uart.fifo = 0;
}

static void receive(unsigned char byte) {
    uart.newest_ns = uart.now_ns;
    if (uart.fifo == FIFO) {
        uart.lost += FIFO + 1;
        uart.fifo = 0;
        post(UART_FIFO_OVF);
    } else {
        uart.fifo_bytes[uart.fifo++] = byte;
    }
    interrupt_when_due();
}

/* A byte without its stop bit; an interrupt of its own, which takes nothing out of the FIFO. */
static void receive_unframed(unsigned char byte) {
    receive(byte);
    if (uart.reports_unframed)
        post(UART_FRAME_ERR);
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

/* ---- as far as lines ---- */

enum { LINES = 4000, LINE_BYTES = 10 };

static struct net_hub hub;
static struct rx rx;
static struct line_reader reader;
static unsigned answers, refused, taken_lines, first_wrong, next_line;
static bool spoilt[LINES]; /* lines with a damaged byte, or of which one was lost */

static size_t put(void *ctx, const char *bytes, size_t count) {
    size_t n = 0;
    (void)ctx;
    while (n < count && rx_put(&rx, (uint8_t)bytes[n]))
        n++;
    return n;
}

static void lost(void *ctx, long what) {
    (void)ctx;
    rx_count(&rx, what == NET_LOST ? RX_OVERRUN : RX_UNFRAMED);
}

static bool spoil(void *ctx) {
    (void)ctx;
    if (rx_free(&rx) == 0)
        return false;
    rx_spoil(&rx);
    return true;
}

static size_t hear(void *ctx, char *bytes, size_t size) {
    (void)ctx;
    if (answers == 0 || size < 4)
        return 0;
    memcpy(bytes, "ok\r\n", 4);
    answers--;
    return 4;
}

static void act(void *ctx) {
    (void)ctx;
}

static void event(void *ctx, const char *what, const char *who) {
    (void)ctx, (void)what, (void)who;
}

/* The controller: a line that it takes is whole, as it was sent, and after those before it. */
static void take_lines(void) {
    const uint8_t *bytes;
    size_t count;
    while ((count = rx_peek(&rx, &bytes)) > 0) {
        enum line_result result;
        rx_drop(&rx, line_reader_take(&reader, bytes, count, &result));
        if (result == LINE_NONE)
            continue;
        answers++;
        refused += result == LINE_BROKEN;
        if (result != LINE_READY || reader.length == 0)
            continue;
        const unsigned number = (unsigned)strtoul(reader.text + 3, NULL, 10);
        char sent[LINE_BYTES + 1];
        snprintf(sent, sizeof sent, "G1X%06u", number);
        if (number >= LINES || strcmp(reader.text, sent) != 0 || spoilt[number] || number < next_line) {
            first_wrong = first_wrong == 0 ? number + 1 : first_wrong;
            printf("executed: %s\n", reader.text);
        }
        next_line = number + 1;
        taken_lines++;
    }
}

static void round_of_task(void) {
    if (erases())
        return;
    (void)net_hub_read(&hub, &hub.client[0]);
    for (unsigned n = 0; n < 4; n++) {
        (void)net_hub_feed(&hub);
        take_lines();
        net_hub_hear(&hub);
    }
    net_hub_flush(&hub);
}

static void start_hub(void) {
    static const struct net_hub_ops ops = {
        .put = put, .lost = lost, .spoil = spoil, .hear = hear, .act = act, .event = event};
    static const struct net_hub_sizes sizes = {.clients = 1, .in = 2048, .out = 16384, .left = 2048};
    rx_init(&rx);
    line_reader_reset(&reader);
    net_hub_init(&hub, &sizes, &ops, NULL);
    CHECK(net_hub_connect(&hub, &stream, "UART"));
}

static unsigned random_below(unsigned end) {
    static uint64_t state = 88172645463325252u;
    state ^= state << 13, state ^= state >> 7, state ^= state << 17;
    return (unsigned)(state % end);
}

/* @param damaged_in  one of so many bytes is damaged, 0: none @param stall_ns, stall_every_ns  the
 * controller's task does not run */
static void send_lines(unsigned damaged_in, uint64_t stall_ns, uint64_t stall_every_ns) {
    static const char noise[] = "\n\r5 ;(~!?GX\0.-\x91\xff";
    uint64_t round_ns = uart.now_ns, stall_at_ns = uart.now_ns + stall_every_ns;
    for (unsigned n = 0; n < LINES; n++) {
        char line[LINE_BYTES + 1];
        snprintf(line, sizeof line, "G1X%06u\n", n);
        for (unsigned at = 0; at < LINE_BYTES; at++) {
            uart.now_ns += BYTE_NS;
            const unsigned lost_before = uart.lost;
            const bool damaged = damaged_in != 0 && random_below(damaged_in) == 0;
            if (damaged)
                receive_unframed((unsigned char)noise[random_below(sizeof noise - 1)]);
            else
                receive((unsigned char)line[at]);
            spoilt[n] |= damaged;
            for (unsigned back = 0; uart.lost != lost_before && back <= (FIFO + at) / LINE_BYTES + 1; back++)
                spoilt[n - back] = true;
            if (stall_every_ns != 0 && uart.now_ns >= stall_at_ns) {
                uart.erase_until_ns = uart.now_ns + stall_ns;
                stall_at_ns += stall_every_ns;
            }
            for (; uart.now_ns >= round_ns; round_ns += ROUND_NS)
                round_of_task();
        }
        if (random_below(100) == 0)
            uart.now_ns += 5000000, interrupt_when_due();
    }
    for (unsigned n = 0; n < 10; n++) {
        uart.now_ns = uart.erase_until_ns + 10000000;
        interrupt_when_due();
        uart.erase_until_ns = 0;
        round_of_task();
    }
}

static void begin_lines(void) {
    taken_lines = refused = first_wrong = next_line = answers = 0;
    memset(spoilt, 0, sizeof spoilt);
    net_hub_close(&hub);
    start_hub();
}

static void a_line_with_a_damaged_byte_is_refused(void) {
    begin_lines();
    send_lines(0, 0, 0);
    CHECK(taken_lines == LINES && refused == 0);
    begin_lines();
    send_lines(1000, 0, 0);
    printf("one of 1000 bytes damaged: %u lines taken, %u refused\n", taken_lines, refused);
    CHECK(first_wrong == 0);
    CHECK(taken_lines > LINES * 8 / 10 && refused > 0);
    CHECK(rx_gaps(&rx, RX_UNFRAMED) > 0 && rx_gaps(&rx, RX_OVERRUN) == 0);
    begin_lines();
    send_lines(400, 50000000, 700000000);
    printf("the same of 400, with erases: %u lines taken, %u refused\n", taken_lines, refused);
    CHECK(first_wrong == 0);
}

static void a_line_with_a_lost_byte_is_refused(void) {
    begin_lines();
    uart.lost = 0;
    send_lines(0, 900000000, 2000000000);
    printf("overruns: %u lines taken, %u refused, %u bytes lost\n", taken_lines, refused, uart.lost);
    CHECK(uart.lost > 0 && first_wrong == 0);
    CHECK(taken_lines > 0 && refused > 0 && rx_gaps(&rx, RX_OVERRUN) > 0);
    begin_lines();
    send_lines(0, 0, 0);
    CHECK(taken_lines >= LINES - 1 && refused <= 1);
}

/* Its UART, pins and baud rate, and what the hub knows it by. */
static void a_pendant_has_a_uart_of_its_own(void) {
    const struct serial_pendant wire = {
        .baud = 1000000, .uart = 2, .tx = 17, .rx = 16, .kind = NET_PENDANT_MPG};
    struct net_stream its;
    CHECK(serial_stream_pendant(&wire, &its));
    CHECK(pins.port == UART_NUM_2 && pins.tx == 17 && pins.rx == 16);
    CHECK(its.pendant == NET_PENDANT_MPG && its.local && stream.pendant == NET_PENDANT_NONE);
    CHECK(its.ctx != stream.ctx);
}

/* A damaged byte that reads as 0x8B is none. */
static void noise_takes_no_control(void) {
    char bytes[8];
    long count;
    receive_unframed(0x8B);
    uart.now_ns += 10000000;
    interrupt_when_due();
    bool reported = false;
    while ((count = stream.ops->read(&stream, bytes, sizeof bytes)) != 0) {
        reported |= count == NET_UNFRAMED;
        CHECK(count < 0 || memchr(bytes, 0x8B, (size_t)count) == NULL);
    }
    CHECK(reported);
}

/* Arguments: the options of sdkconfig.defaults that are about the UART. */
int main(int count, char **options) {
    for (int n = 1; n < count; n++)
        uart.isr_in_iram |= strcmp(options[n], "CONFIG_UART_ISR_IN_IRAM") == 0;
    CHECK(serial_stream_uart(&stream));
    a_hold_is_seen_soon();
    nothing_is_lost_while_flash_is_erased();
    a_line_with_a_damaged_byte_is_refused();
    a_line_with_a_lost_byte_is_refused();
    noise_takes_no_control();
    a_pendant_has_a_uart_of_its_own();
    return report();
}
