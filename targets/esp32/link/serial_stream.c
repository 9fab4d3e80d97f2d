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

/* USB_MAX: the driver takes a piece whole or not at all. UART_RX_FULL, UART_RX_IDLE: bytes in the receiver,
 * and character times without one, after which the driver gets them: a realtime byte waits for no more. */
enum { UART = UART_NUM_0, NO_FD = -1, USB_MAX = 512, UART_RX_FULL = 16, UART_RX_IDLE = 2 };

/* UART_FIFO: bytes in the receiver. UART_EVENTS: more than come in the 400 ms of an erase, one for each
 * UART_RX_FULL bytes. */
enum { UART_FIFO = 128, UART_EVENTS = 320 };

static void close_nothing(const struct net_stream *stream) {
    (void)stream;
}

/* ---- UART0 ---- */

/* The driver reports that bytes were lost or damaged, but not which: one of those that wait, or the next. */
static struct {
    QueueHandle_t events;
    size_t doubtful; /* bytes that wait and may be it */
    bool spoils;     /* NET_SPOILED comes before the next byte */
} uart0;

/* What the driver has reported since the last call. @return NET_LOST, NET_UNFRAMED, or 0 @param[out] stashed
 * bytes that the driver keeps where no one can count them */
static long take_events(size_t *stashed) {
    uart_event_t event;
    /* no room: some may be missing */
    long loss = uxQueueSpacesAvailable(uart0.events) == 0 ? NET_LOST : 0;
    *stashed = 0;
    while (xQueueReceive(uart0.events, &event, 0) == pdTRUE) {
        if (event.type == UART_FIFO_OVF)
            loss = NET_LOST;
        else if (event.type == UART_BREAK || event.type == UART_FRAME_ERR || event.type == UART_PARITY_ERR)
            loss = loss == 0 ? NET_UNFRAMED : loss;
        else if (event.type == UART_BUFFER_FULL)
            *stashed = UART_FIFO;
    }
    return loss;
}

static void doubt(size_t stashed) {
    size_t in_fifo = uart_ll_get_rxfifo_len(UART_LL_GET_HW(UART)), in_ring = 0;
    (void)uart_get_buffered_data_len((uart_port_t)UART, &in_ring);
    uart0.doubtful = in_fifo + in_ring + stashed;
    uart0.spoils = false;
}

/* What noise must not do: start, resume, change a speed. Whatever stops is obeyed. */
static bool is_start(char byte) {
    return byte == '~' || (uint8_t)byte >= RX_OVERRIDE_FIRST;
}

/* Of the doubtful bytes one line at a time: each of them begins with NET_SPOILED, and so does the line after
 * them, for the last one may be a damaged byte that reads as an end of a line. */
static long read_doubtful(char *bytes, size_t size) {
    long count = 0;
    char byte = 0;
    while ((size_t)count < size && uart0.doubtful > 0 && byte != '\n' && byte != '\r') {
        if (uart_read_bytes((uart_port_t)UART, &byte, 1, 0) <= 0) {
            if (uart_ll_get_rxfifo_len(UART_LL_GET_HW(UART)) == 0)
                uart0.doubtful = 0;
            break;
        }
        uart0.doubtful--;
        if (!is_start(byte))
            bytes[count++] = byte;
    }
    uart0.spoils = byte == '\n' || byte == '\r';
    return count;
}

static long uart_stream_read(const struct net_stream *stream, char *bytes, size_t size) {
    size_t stashed;
    const long loss = take_events(&stashed);
    (void)stream;
    if (loss != 0) {
        doubt(stashed);
        return loss;
    }
    if (uart0.spoils) {
        uart0.spoils = false;
        return NET_SPOILED;
    }
    if (uart0.doubtful > 0)
        return read_doubtful(bytes, size);
    int count = uart_read_bytes((uart_port_t)UART, bytes, (uint32_t)size, 0);
    return count > 0 ? count : 0;
}

/* Never more than the driver's buffer takes in one call: uart_write_bytes() would wait. */
static long uart_stream_write(const struct net_stream *stream, const char *bytes, size_t count) {
    size_t room = 0;
    (void)stream;
    if (uart_get_tx_buffer_free_size((uart_port_t)UART, &room) != ESP_OK || room == 0)
        return 0;
    return uart_write_bytes((uart_port_t)UART, bytes, count < room ? count : room);
}

bool serial_stream_uart(struct net_stream *stream) {
    static const struct net_stream_ops ops = {
        .read = uart_stream_read, .write = uart_stream_write, .close = close_nothing};
    const uart_config_t config = {.baud_rate = SERIAL_BAUD,
                                  .data_bits = UART_DATA_8_BITS,
                                  .parity = UART_PARITY_DISABLE,
                                  .stop_bits = UART_STOP_BITS_1,
                                  .flow_ctrl = UART_HW_FLOWCTRL_DISABLE,
                                  .source_clk = UART_SCLK_DEFAULT};
    const uart_port_t port = (uart_port_t)UART;
    if (uart_driver_install(port, UART_RX_SIZE, SERIAL_TX_SIZE, UART_EVENTS, &uart0.events,
                            ESP_INTR_FLAG_IRAM) != ESP_OK ||
        uart_param_config(port, &config) != ESP_OK ||
        uart_enable_intr_mask(port, UART_INTR_FRAM_ERR) != ESP_OK ||
        uart_set_rx_full_threshold(port, UART_RX_FULL) != ESP_OK ||
        uart_set_rx_timeout(port, UART_RX_IDLE) != ESP_OK)
        return false;
    *stream = (struct net_stream){.ops = &ops, .fd = NO_FD, .local = true};
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
