/* SPDX-License-Identifier: MIT */
#include "link/serial_stream.h"

#include "input/rx.h" // RX_OVERRIDE_FIRST

#include "driver/uart.h"
#include "esp_intr_alloc.h"
#include "freertos/queue.h"
#include "hal/uart_ll.h"
#include "sdkconfig.h"
#include "soc/soc_caps.h"
#if SOC_USB_SERIAL_JTAG_SUPPORTED
#include "driver/usb_serial_jtag.h"
#endif

#include <stdlib.h>

/* USB_MAX: the driver takes a piece whole or not at all. UART_RX_FULL, UART_RX_IDLE: bytes in the receiver,
 * and character times without one, after which the driver gets them: a realtime byte waits for no more. */
enum { NO_FD = -1, USB_MAX = 512, UART_RX_FULL = 16, UART_RX_IDLE = 2 };

/* UART_FIFO: bytes in the receiver. UART_EVENTS: more than come in the 400 ms of an erase, one for each
 * UART_RX_FULL bytes. */
enum { UART_FIFO = 128, UART_EVENTS = 320 };

enum { MPG_TOGGLE = 0x8B }; /* of a pendant (net_hub_pendant.c) */

/* A pendant sends a line and waits for its answer. Short answers: it may say at any time that it reads no
 * more (XOFF). */
enum { PENDANT_RX_SIZE = 1024, PENDANT_TX_SIZE = 256, PENDANT_EVENTS = 64 };

static void close_nothing(const struct net_stream *stream) {
    (void)stream;
}

/* ---- UARTs ---- */

/* The driver reports that bytes were lost or damaged, but not which: one of those that wait, or the next. */
struct uart_line {
    QueueHandle_t events;
    size_t doubtful; /* bytes that wait and may be it */
    uart_port_t port;
    bool spoils; /* NET_SPOILED comes before the next byte */
};

static uint32_t bytes_in_fifo(const struct uart_line *line) {
    return uart_ll_get_rxfifo_len(UART_LL_GET_HW(line->port));
}

/* What the driver has reported since the last call. @return NET_LOST, NET_UNFRAMED, or 0 @param[out] stashed
 * bytes that the driver keeps where no one can count them */
static long take_events(const struct uart_line *line, size_t *stashed) {
    uart_event_t event;
    /* no room: some may be missing */
    long loss = uxQueueSpacesAvailable(line->events) == 0 ? NET_LOST : 0;
    *stashed = 0;
    while (xQueueReceive(line->events, &event, 0) == pdTRUE) {
        if (event.type == UART_FIFO_OVF)
            loss = NET_LOST;
        else if (event.type == UART_BREAK || event.type == UART_FRAME_ERR || event.type == UART_PARITY_ERR)
            loss = loss == 0 ? NET_UNFRAMED : loss;
        else if (event.type == UART_BUFFER_FULL)
            *stashed = UART_FIFO;
    }
    return loss;
}

static void doubt(struct uart_line *line, size_t stashed) {
    size_t in_ring = 0;
    (void)uart_get_buffered_data_len(line->port, &in_ring);
    line->doubtful = bytes_in_fifo(line) + in_ring + stashed;
    line->spoils = false;
}

/* What noise must not do: start, resume, change a speed, take control. Whatever stops is obeyed. */
static bool is_start(char byte) {
    return byte == '~' || (uint8_t)byte == MPG_TOGGLE || (uint8_t)byte >= RX_OVERRIDE_FIRST;
}

/* Of the doubtful bytes one line at a time: each of them begins with NET_SPOILED, and so does the line after
 * them, for the last one may be a damaged byte that reads as an end of a line. */
static long read_doubtful(struct uart_line *line, char *bytes, size_t size) {
    long count = 0;
    char byte = 0;
    while ((size_t)count < size && line->doubtful > 0 && byte != '\n' && byte != '\r') {
        if (uart_read_bytes(line->port, &byte, 1, 0) <= 0) {
            if (bytes_in_fifo(line) == 0)
                line->doubtful = 0;
            break;
        }
        line->doubtful--;
        if (!is_start(byte))
            bytes[count++] = byte;
    }
    line->spoils = byte == '\n' || byte == '\r';
    return count;
}

static long uart_stream_read(const struct net_stream *stream, char *bytes, size_t size) {
    struct uart_line *line = stream->ctx;
    size_t stashed;
    const long loss = take_events(line, &stashed);
    if (loss != 0) {
        doubt(line, stashed);
        return loss;
    }
    if (line->spoils) {
        line->spoils = false;
        return NET_SPOILED;
    }
    if (line->doubtful > 0)
        return read_doubtful(line, bytes, size);
    int count = uart_read_bytes(line->port, bytes, (uint32_t)size, 0);
    return count > 0 ? count : 0;
}

/* Never more than the driver's buffer takes in one call: uart_write_bytes() would wait. */
static long uart_stream_write(const struct net_stream *stream, const char *bytes, size_t count) {
    const struct uart_line *line = stream->ctx;
    size_t room = 0;
    if (uart_get_tx_buffer_free_size(line->port, &room) != ESP_OK || room == 0)
        return 0;
    return uart_write_bytes(line->port, bytes, count < room ? count : room);
}

struct uart_sizes {
    int baud, rx, tx, events;
};

static bool start_uart(struct uart_line *line, const struct uart_sizes *sizes) {
    const uart_config_t config = {.baud_rate = sizes->baud,
                                  .data_bits = UART_DATA_8_BITS,
                                  .parity = UART_PARITY_DISABLE,
                                  .stop_bits = UART_STOP_BITS_1,
                                  .flow_ctrl = UART_HW_FLOWCTRL_DISABLE,
                                  .source_clk = UART_SCLK_DEFAULT};
    return uart_driver_install(line->port, sizes->rx, sizes->tx, sizes->events, &line->events,
                               ESP_INTR_FLAG_IRAM) == ESP_OK &&
           uart_param_config(line->port, &config) == ESP_OK &&
           uart_enable_intr_mask(line->port, UART_INTR_FRAM_ERR) == ESP_OK &&
           uart_set_rx_full_threshold(line->port, UART_RX_FULL) == ESP_OK &&
           uart_set_rx_timeout(line->port, UART_RX_IDLE) == ESP_OK;
}

static struct net_stream stream_of(struct uart_line *line) {
    static const struct net_stream_ops ops = {
        .read = uart_stream_read, .write = uart_stream_write, .close = close_nothing};
    return (struct net_stream){.ops = &ops, .ctx = line, .fd = NO_FD, .local = true};
}

bool serial_stream_uart(struct net_stream *stream) {
    static const struct uart_sizes sizes = {
        .baud = SERIAL_BAUD, .rx = UART_RX_BYTES, .tx = SERIAL_TX_SIZE, .events = UART_EVENTS};
    static struct uart_line uart0 = {.port = UART_NUM_0};
    if (!start_uart(&uart0, &sizes))
        return false;
    *stream = stream_of(&uart0);
    return true;
}

bool serial_stream_pendant(const struct serial_pendant *wire, struct net_stream *stream) {
    const struct uart_sizes sizes = {
        .baud = (int)wire->baud, .rx = PENDANT_RX_SIZE, .tx = PENDANT_TX_SIZE, .events = PENDANT_EVENTS};
    struct uart_line *line = calloc(1, sizeof *line); /* boards without a pendant have none */
    if (line == NULL)
        return false;
    line->port = (uart_port_t)wire->uart;
    if (!start_uart(line, &sizes) ||
        uart_set_pin(line->port, wire->tx, wire->rx, UART_PIN_NO_CHANGE, UART_PIN_NO_CHANGE) != ESP_OK) {
        free(line);
        return false;
    }
    *stream = stream_of(line);
    stream->pendant = wire->kind;
    return true;
}

/* ---- USB-Serial-JTAG ---- */

#if SOC_USB_SERIAL_JTAG_SUPPORTED
static long usb_stream_read(const struct net_stream *stream, char *bytes, size_t size) {
    (void)stream;
    int count = usb_serial_jtag_read_bytes(bytes, (uint32_t)size, 0);
    return count > 0 ? count : 0;
}

/* With no computer at the port no one takes the bytes: they are dropped, or answers would pile up for ever.
 */
static long usb_stream_write(const struct net_stream *stream, const char *bytes, size_t count) {
    (void)stream;
    if (!usb_serial_jtag_is_connected())
        return (long)count;
    int taken = usb_serial_jtag_write_bytes(bytes, count < USB_MAX ? count : USB_MAX, 0);
    return taken > 0 ? taken : 0;
}

bool serial_stream_usb(struct net_stream *stream) {
    static const struct net_stream_ops ops = {
        .read = usb_stream_read, .write = usb_stream_write, .close = close_nothing};
    usb_serial_jtag_driver_config_t config = {.tx_buffer_size = SERIAL_TX_SIZE,
                                              .rx_buffer_size = SERIAL_RX_SIZE};
    if (usb_serial_jtag_driver_install(&config) != ESP_OK)
        return false;
    *stream = (struct net_stream){.ops = &ops, .fd = NO_FD, .local = true};
    return true;
}
#else
bool serial_stream_usb(struct net_stream *stream) {
    (void)stream;
    return false;
}
#endif
