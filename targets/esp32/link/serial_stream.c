/* SPDX-License-Identifier: MIT */
#include "link/serial_stream.h"

#include "driver/uart.h"
#include "esp_intr_alloc.h"
#include "sdkconfig.h"
#include "soc/soc_caps.h"
#if SOC_USB_SERIAL_JTAG_SUPPORTED
#include "driver/usb_serial_jtag.h"
#endif

/* USB_MOST: the driver takes a piece whole or not at all. UART_RX_FULL, UART_RX_IDLE: bytes in the receiver,
 * and character times without one, after which the driver gets them: a realtime byte waits for no more. */
enum { UART = UART_NUM_0, NO_FD = -1, USB_MOST = 512, UART_RX_FULL = 16, UART_RX_IDLE = 2 };

static void close_nothing(const struct net_stream *stream) {
    (void)stream;
}

/* ---- UART0 ---- */

static long uart_stream_read(const struct net_stream *stream, char *bytes, size_t size) {
    (void)stream;
    int count = uart_read_bytes((uart_port_t)UART, bytes, (uint32_t)size, 0);
    return count > 0 ? count : 0;
}

/* Never more than the driver's buffer takes at once: uart_write_bytes() would wait. */
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
    if (uart_driver_install(port, UART_RX_SIZE, SERIAL_TX_SIZE, 0, NULL, ESP_INTR_FLAG_IRAM) != ESP_OK ||
        uart_param_config(port, &config) != ESP_OK ||
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

/* With no computer at the port nobody takes the bytes: they are dropped, or answers would pile up for ever.
 */
static long usb_stream_write(const struct net_stream *stream, const char *bytes, size_t count) {
    (void)stream;
    if (!usb_serial_jtag_is_connected())
        return (long)count;
    int taken = usb_serial_jtag_write_bytes(bytes, count < USB_MOST ? count : USB_MOST, 0);
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
