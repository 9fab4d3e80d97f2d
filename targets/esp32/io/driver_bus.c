/* SPDX-License-Identifier: MIT */
#include "io/driver_bus.h"

#include "machine/motor_drivers.h"

#include "driver/gpio.h"
#include "driver/spi_master.h"
#include "driver/uart.h"
#include "esp_intr_alloc.h"

#include <stdlib.h>
#include <string.h>

/* BUS_RX_SIZE: the driver wants more than its FIFO of 128 bytes; an echo and an answer have 12. BUS_RX_FULL,
 * BUS_RX_IDLE: bytes in the receiver, and character times without one, after which the driver gets them. */
enum { BUS_RX_SIZE = 256, BUS_RX_FULL = 12, BUS_RX_IDLE = 1, BAUD = 115200 };
enum { SPI_HZ = 1000000, SPI_MODE = 3, QUEUE = 1, BITS = 8, NO_PIN_HERE = 255 };

/* All of it is from the heap: boards with plain drivers have none. */
struct driver_bus {
    uart_port_t port;
    spi_device_handle_t device;
    uint8_t select[DRIVER_COUNT_MAX]; /* GPIO */
    uint8_t select_count;
    bool busy; /* a transfer is under way */
    bool late; /* ... which was given up: what it returns is no answer to what was asked since */
    spi_transaction_t transfer;
    uint8_t sent[TMC_BYTES_MAX], received[TMC_BYTES_MAX];
};

static struct driver_bus *bus;

/* ---- UART ---- */

static void send_uart(struct hal *hal, uint8_t select, const uint8_t *bytes, size_t count) {
    (void)hal;
    (void)select;
    (void)uart_flush_input(bus->port);
    (void)uart_write_bytes(bus->port, bytes, count); /* into the FIFO, which has room for all of them */
}

static size_t receive_uart(struct hal *hal, uint8_t *bytes, size_t size) {
    (void)hal;
    const int count = uart_read_bytes(bus->port, bytes, (uint32_t)size, 0);
    return count > 0 ? (size_t)count : 0;
}

static const struct hal_driver_bus *start_uart(const struct driver_bus_wire *wire) {
    static const struct hal_driver_bus ops = {.send = send_uart, .receive = receive_uart};
    const uart_config_t config = {.baud_rate = BAUD,
                                  .data_bits = UART_DATA_8_BITS,
                                  .parity = UART_PARITY_DISABLE,
                                  .stop_bits = UART_STOP_BITS_1,
                                  .flow_ctrl = UART_HW_FLOWCTRL_DISABLE,
                                  .source_clk = UART_SCLK_DEFAULT};
    bus->port = (uart_port_t)wire->number;
    if (uart_driver_install(bus->port, BUS_RX_SIZE, 0, 0, NULL, ESP_INTR_FLAG_IRAM) != ESP_OK ||
        uart_param_config(bus->port, &config) != ESP_OK ||
        uart_set_pin(bus->port, wire->tx, wire->rx, UART_PIN_NO_CHANGE, UART_PIN_NO_CHANGE) != ESP_OK ||
        uart_set_rx_full_threshold(bus->port, BUS_RX_FULL) != ESP_OK ||
        uart_set_rx_timeout(bus->port, BUS_RX_IDLE) != ESP_OK)
        return NULL;
    return &ops;
}

/* ---- SPI ---- */

/* @return the transfer that was under way is over, or none was */
static bool end_transfer(void) {
    spi_transaction_t *done;
    if (bus->busy && spi_device_get_trans_result(bus->device, &done, 0) == ESP_OK)
        bus->busy = false;
    return !bus->busy;
}

/* A transfer that was given up is not over, as when interrupts were off for long: the next one is lost, too,
 * and tried again later. */
static void send_spi(struct hal *hal, uint8_t select, const uint8_t *bytes, size_t count) {
    (void)hal;
    bus->late = !end_transfer();
    if (bus->late || count > sizeof bus->sent || select >= bus->select_count)
        return;
    memcpy(bus->sent, bytes, count);
    memset(&bus->transfer, 0, sizeof bus->transfer);
    bus->transfer.length = count * BITS;
    bus->transfer.tx_buffer = bus->sent;
    bus->transfer.rx_buffer = bus->received;
    bus->transfer.user = &bus->select[select];
    bus->busy = spi_device_queue_trans(bus->device, &bus->transfer, 0) == ESP_OK;
}

static size_t receive_spi(struct hal *hal, uint8_t *bytes, size_t size) {
    (void)hal;
    const bool under_way = bus->busy;
    const size_t count = bus->transfer.length / BITS;
    if (!under_way || !end_transfer() || bus->late)
        return 0;
    memcpy(bytes, bus->received, count < size ? count : size);
    return count < size ? count : size;
}

/* [ISR] The controller of an ESP32 has three select lines of its own: a GPIO for each driver instead. Its
 * interrupt is not one that runs while the flash is written. */
static void put_select(const spi_transaction_t *transfer, uint32_t level) {
    const uint8_t *pin = transfer->user;
    (void)gpio_set_level((gpio_num_t)*pin, level);
}

static void select_driver(spi_transaction_t *transfer) {
    put_select(transfer, 0);
}

static void release_driver(spi_transaction_t *transfer) {
    put_select(transfer, 1);
}

static bool start_select(uint8_t pin) {
    if (pin == NO_PIN_HERE)
        return false;
    const gpio_config_t config = {.pin_bit_mask = 1ull << pin, .mode = GPIO_MODE_OUTPUT};
    return gpio_set_level((gpio_num_t)pin, 1) == ESP_OK && gpio_config(&config) == ESP_OK;
}

/* Without DMA: 30 bytes are in the controller's own buffer. */
static const struct hal_driver_bus *start_spi(const struct driver_bus_wire *wire) {
    static const struct hal_driver_bus ops = {.send = send_spi, .receive = receive_spi};
    const spi_host_device_t host = (spi_host_device_t)wire->number;
    const spi_bus_config_t config = {.mosi_io_num = wire->mosi,
                                     .miso_io_num = wire->miso,
                                     .sclk_io_num = wire->sclk,
                                     .quadwp_io_num = -1,
                                     .quadhd_io_num = -1};
    const spi_device_interface_config_t device = {.mode = SPI_MODE,
                                                  .clock_speed_hz = SPI_HZ,
                                                  .spics_io_num = -1,
                                                  .queue_size = QUEUE,
                                                  .pre_cb = select_driver,
                                                  .post_cb = release_driver};
    /* All of them before the first transfer: two drivers that are selected would both answer. */
    for (unsigned n = 0; n < wire->select_count; n++)
        if (!start_select(wire->select[n]))
            return NULL;
    memcpy(bus->select, wire->select, sizeof bus->select);
    bus->select_count = wire->select_count;
    return spi_bus_initialize(host, &config, SPI_DMA_DISABLED) == ESP_OK &&
                   spi_bus_add_device(host, &device, &bus->device) == ESP_OK
               ? &ops
               : NULL;
}

const struct hal_driver_bus *driver_bus_init(const struct driver_bus_wire *wire) {
    bus = calloc(1, sizeof *bus);
    if (bus == NULL)
        return NULL;
    return wire->uart ? start_uart(wire) : start_spi(wire);
}

struct machine_drivers *driver_bus_drivers(void) {
    return calloc(1, sizeof(struct machine_drivers));
}
