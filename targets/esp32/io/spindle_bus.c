/* SPDX-License-Identifier: MIT */
#include "io/spindle_bus.h"

#include "hal/hal.h"
#include "machine/vfd_spindle.h"

#include "driver/uart.h"
#include "esp_intr_alloc.h"

#include <stdlib.h>

/* BUS_RX_SIZE: the driver wants more than its FIFO of 128 bytes; an answer has 11. BUS_RX_FULL, BUS_RX_IDLE:
 * bytes in the receiver, and character times without one, after which the driver gets them. */
enum { NO_PIN_HERE = 255, BUS_RX_SIZE = 256, BUS_RX_FULL = 8, BUS_RX_IDLE = 1, START_BAUD = 9600 };

static uart_port_t port;

static bool configure(struct hal *hal, const struct hal_bus_format *format) {
    static const uart_parity_t parity[] = {[HAL_BUS_NONE] = UART_PARITY_DISABLE,
                                           [HAL_BUS_EVEN] = UART_PARITY_EVEN,
                                           [HAL_BUS_ODD] = UART_PARITY_ODD};
    (void)hal;
    return uart_set_baudrate(port, format->baud) == ESP_OK &&
           uart_set_parity(port, parity[format->parity]) == ESP_OK && uart_flush_input(port) == ESP_OK;
}

/* Without a transmit buffer the driver puts the bytes into the FIFO, which has room for all of them: only one
 * request is under way at a time. */
static void send_bytes(struct hal *hal, const uint8_t *bytes, size_t count) {
    (void)hal;
    (void)uart_write_bytes(port, bytes, count);
}

static size_t receive_bytes(struct hal *hal, uint8_t *bytes, size_t size) {
    (void)hal;
    const int count = uart_read_bytes(port, bytes, (uint32_t)size, 0);
    return count > 0 ? (size_t)count : 0;
}

static int pin(uint8_t gpio) {
    return gpio == NO_PIN_HERE ? UART_PIN_NO_CHANGE : gpio;
}

const struct hal_bus *spindle_bus_init(const struct spindle_bus_wire *wire) {
    static const struct hal_bus ops = {.configure = configure, .send = send_bytes, .receive = receive_bytes};
    const uart_config_t config = {.baud_rate = START_BAUD,
                                  .data_bits = UART_DATA_8_BITS,
                                  .parity = UART_PARITY_DISABLE,
                                  .stop_bits = UART_STOP_BITS_1,
                                  .flow_ctrl = UART_HW_FLOWCTRL_DISABLE,
                                  .source_clk = UART_SCLK_DEFAULT};
    port = (uart_port_t)wire->uart;
    if (uart_driver_install(port, BUS_RX_SIZE, 0, 0, NULL, ESP_INTR_FLAG_IRAM) != ESP_OK ||
        uart_param_config(port, &config) != ESP_OK ||
        uart_set_pin(port, pin(wire->tx), pin(wire->rx), pin(wire->de), UART_PIN_NO_CHANGE) != ESP_OK ||
        uart_set_mode(port, UART_MODE_RS485_HALF_DUPLEX) != ESP_OK ||
        uart_set_rx_full_threshold(port, BUS_RX_FULL) != ESP_OK ||
        uart_set_rx_timeout(port, BUS_RX_IDLE) != ESP_OK)
        return NULL;
    return &ops;
}

struct machine_vfd *spindle_bus_drive(void) {
    return calloc(1, sizeof(struct machine_vfd));
}
