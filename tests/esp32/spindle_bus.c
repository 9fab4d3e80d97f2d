/* SPDX-License-Identifier: MIT
 * The bus of a spindle drive as the firmware sets it up (targets/esp32/io/spindle_bus.c), over a model of
 * ESP-IDF's UART driver: which UART, pins and mode, formats, and a drive that answers through it. */
#include "io/spindle_bus.h"
#include "check.h"
#include "machine/vfd_spindle.h"

#include "driver/uart.h"
#include "esp_intr_alloc.h"

#include <string.h>

enum { FIFO = 128, UART = 2, TX = 17, RX = 16, DE = 4, NO_DE = 255, RX_SIZE_MIN = FIFO };

static struct {
    uart_port_t port;
    int rx_size, tx_size, flags, tx, rx, rts, threshold, idle;
    uint32_t baud;
    uart_parity_t parity;
    uart_mode_t mode;
    uint8_t sent[FIFO], line[FIFO];
    size_t sent_count, line_count;
    bool fails;
} uart;

esp_err_t uart_driver_install(uart_port_t port, int rx_size, int tx_size, int queue_size,
                              QueueHandle_t *queue, int flags) {
    (void)queue_size, (void)queue;
    uart.port = port;
    uart.rx_size = rx_size;
    uart.tx_size = tx_size;
    uart.flags = flags;
    return uart.fails ? ESP_FAIL : ESP_OK;
}

esp_err_t uart_param_config(uart_port_t port, const uart_config_t *config) {
    CHECK(port == uart.port && config->data_bits == UART_DATA_8_BITS &&
          config->stop_bits == UART_STOP_BITS_1);
    return ESP_OK;
}

esp_err_t uart_set_pin(uart_port_t port, int tx, int rx, int rts, int cts) {
    CHECK(port == uart.port && cts == UART_PIN_NO_CHANGE);
    uart.tx = tx;
    uart.rx = rx;
    uart.rts = rts;
    return ESP_OK;
}

esp_err_t uart_set_mode(uart_port_t port, uart_mode_t mode) {
    CHECK(port == uart.port);
    uart.mode = mode;
    return ESP_OK;
}

esp_err_t uart_set_baudrate(uart_port_t port, uint32_t baud) {
    CHECK(port == uart.port);
    uart.baud = baud;
    return ESP_OK;
}

esp_err_t uart_set_parity(uart_port_t port, uart_parity_t parity) {
    CHECK(port == uart.port);
    uart.parity = parity;
    return ESP_OK;
}

esp_err_t uart_flush_input(uart_port_t port) {
    CHECK(port == uart.port);
    uart.line_count = 0;
    return ESP_OK;
}

esp_err_t uart_set_rx_full_threshold(uart_port_t port, int threshold) {
    CHECK(port == uart.port);
    uart.threshold = threshold;
    return ESP_OK;
}

esp_err_t uart_set_rx_timeout(uart_port_t port, uint8_t symbols) {
    CHECK(port == uart.port);
    uart.idle = symbols;
    return ESP_OK;
}

/* Without a transmit buffer it waits for room in the FIFO: what is sent at a time must fit. */
int uart_write_bytes(uart_port_t port, const void *bytes, size_t size) {
    CHECK(port == uart.port && size <= FIFO);
    memcpy(uart.sent, bytes, size);
    uart.sent_count = size;
    return (int)size;
}

int uart_read_bytes(uart_port_t port, void *bytes, uint32_t length, TickType_t ticks) {
    CHECK(port == uart.port && ticks == 0); /* it never waits */
    const size_t count = uart.line_count < length ? uart.line_count : length;
    memcpy(bytes, uart.line, count);
    memmove(uart.line, uart.line + count, uart.line_count - count);
    uart.line_count -= count;
    return (int)count;
}

static void check_start(void) {
    const struct spindle_bus_wire wire = {.uart = UART, .tx = TX, .rx = RX, .de = DE};
    CHECK(spindle_bus_init(&wire) != NULL);
    CHECK(uart.port == (uart_port_t)UART && uart.tx == TX && uart.rx == RX && uart.rts == DE);
    CHECK(uart.mode == UART_MODE_RS485_HALF_DUPLEX);
    CHECK(uart.rx_size > RX_SIZE_MIN && uart.tx_size == 0 && (uart.flags & ESP_INTR_FLAG_IRAM) != 0);
    CHECK(uart.threshold > 0 && uart.threshold < FIFO && uart.idle > 0);
    const struct spindle_bus_wire no_de = {.uart = 1, .tx = TX, .rx = RX, .de = NO_DE};
    CHECK(spindle_bus_init(&no_de) != NULL && uart.rts == UART_PIN_NO_CHANGE && uart.port == UART_NUM_1);
    uart.fails = true;
    CHECK(spindle_bus_init(&wire) == NULL);
    uart.fails = false;
}

static void check_formats(const struct hal_bus *bus) {
    CHECK(bus->configure(NULL, &(struct hal_bus_format){19200, HAL_BUS_EVEN}));
    CHECK(uart.baud == 19200 && uart.parity == UART_PARITY_EVEN);
    CHECK(bus->configure(NULL, &(struct hal_bus_format){9600, HAL_BUS_ODD}) &&
          uart.parity == UART_PARITY_ODD);
    CHECK(bus->configure(NULL, &(struct hal_bus_format){9600, HAL_BUS_NONE}));
    CHECK(uart.parity == UART_PARITY_DISABLE);
}

/* Commands are echoed; a reading is 166.7 Hz. */
static void answer(void) {
    static const uint8_t reading[] = {0x03, 0x02, 0x06, 0x83};
    if (uart.sent_count == 0)
        return;
    if (uart.sent[1] == 0x03)
        uart.line_count = modbus_build(uart.line, 1, reading, sizeof reading);
    else
        memcpy(uart.line, uart.sent, uart.line_count = uart.sent_count);
    uart.sent_count = 0;
}

static void check_drive(const struct hal_bus *bus) {
    struct machine_vfd *vfd = spindle_bus_drive();
    const struct vfd_config config = {
        .model = 5, .address = 1, .format = {9600, HAL_BUS_NONE}, .timeout_ms = 50, .rpm_per_hz = 60.0f};
    uint32_t now_us = 1000;
    float rpm = 0.0f;
    CHECK(vfd != NULL && vfd_configure(&vfd->drive, NULL, bus, &config, now_us));
    vfd_command(&vfd->drive, 1, 10000.0f, 24000.0f, now_us);
    for (int n = 0; n < 400; n++, now_us += 1000) {
        (void)vfd_poll(&vfd->drive, NULL, bus, now_us);
        answer();
    }
    CHECK(vfd_is_confirmed(&vfd->drive) && vfd_measured_rpm(&vfd->drive, &rpm));
    CHECK(rpm > 10000.0f && rpm < 10004.0f);
}

int main(void) {
    const struct spindle_bus_wire wire = {.uart = UART, .tx = TX, .rx = RX, .de = DE};
    check_start();
    const struct hal_bus *bus = spindle_bus_init(&wire);
    check_formats(bus);
    check_drive(bus);
    return report();
}
