/* SPDX-License-Identifier: MIT
 * The bus of motor drivers as the firmware sets it up (targets/esp32/io/driver_bus.c), over models of
 * ESP-IDF's UART and SPI drivers: an SPI controller of the ESP32 has three devices, and its interrupt may be
 * late. */
#include "io/driver_bus.h"
#include "check.h"
#include "machine/motor_drivers.h"

#include "driver/gpio.h"
#include "driver/spi_master.h"
#include "driver/uart.h"
#include "esp_intr_alloc.h"

#include <stdlib.h>
#include <string.h>

enum { FIFO = 128, UART = 1, TX = 22, RX = 21, SPI = 2, MOSI = 23, MISO = 19, SCLK = 18 };
enum { DEVICES = 3, GPIOS = 64, FRAME = 5, BITS = 8, NONE = 255, MODE_OF_TMC = 3 };

/* ---- GPIOs ---- */

static struct {
    int level[GPIOS]; /* -1: not an output */
} gpio;

esp_err_t gpio_set_level(gpio_num_t pin, uint32_t level) {
    gpio.level[pin] = (int)level;
    return ESP_OK;
}

/* First the level, then the driver: a select line is never low for a moment. */
esp_err_t gpio_config(const gpio_config_t *config) {
    for (int pin = 0; pin < GPIOS; pin++)
        if ((config->pin_bit_mask >> pin & 1) != 0)
            CHECK(config->mode == GPIO_MODE_OUTPUT && gpio.level[pin] == 1);
    return ESP_OK;
}

static unsigned selected(void) {
    unsigned count = 0;
    for (int pin = 0; pin < GPIOS; pin++)
        count += gpio.level[pin] == 0;
    return count;
}

/* ---- SPI ---- */

struct spi_device {
    spi_device_interface_config_t config;
};

static struct {
    struct spi_device device[DEVICES];
    int devices;
    spi_transaction_t *queued, *done;
    struct spi_device *of;
    uint8_t answer[TMC_BYTES_MAX], seen[TMC_BYTES_MAX];
    int seen_by; /* the pin that was low while the bytes went */
    bool fails, full;
} spi;

esp_err_t spi_bus_initialize(spi_host_device_t host, const spi_bus_config_t *config, spi_dma_chan_t dma) {
    CHECK(host == (spi_host_device_t)SPI && dma == SPI_DMA_DISABLED);
    CHECK(config->mosi_io_num == MOSI && config->miso_io_num == MISO && config->sclk_io_num == SCLK);
    CHECK(config->quadwp_io_num == -1 && config->quadhd_io_num == -1);
    return spi.fails ? ESP_FAIL : ESP_OK;
}

esp_err_t spi_bus_add_device(spi_host_device_t host, const spi_device_interface_config_t *config,
                             spi_device_handle_t *device) {
    CHECK(host == (spi_host_device_t)SPI && config->mode == MODE_OF_TMC && config->queue_size > 0);
    if (spi.devices == DEVICES)
        return ESP_FAIL;
    *device = &spi.device[spi.devices++];
    (*device)->config = *config;
    return ESP_OK;
}

esp_err_t spi_device_queue_trans(spi_device_handle_t device, spi_transaction_t *transfer, TickType_t ticks) {
    CHECK(ticks == 0 && spi.queued == NULL && spi.done == NULL);
    if (spi.full)
        return ESP_FAIL;
    spi.queued = transfer;
    spi.of = device;
    return ESP_OK;
}

esp_err_t spi_device_get_trans_result(spi_device_handle_t device, spi_transaction_t **transfer,
                                      TickType_t ticks) {
    CHECK(ticks == 0 && device == spi.of);
    if (spi.done == NULL)
        return ESP_FAIL;
    *transfer = spi.done;
    spi.done = NULL;
    return ESP_OK;
}

/* What the controller and its interrupt do with what is queued. */
static void run_transfer(void) {
    spi_transaction_t *transfer = spi.queued;
    const spi_device_interface_config_t *config = &spi.of->config;
    CHECK(transfer != NULL && selected() == 0);
    if (config->pre_cb != NULL)
        config->pre_cb(transfer);
    spi.seen_by = config->spics_io_num;
    for (int pin = 0; pin < GPIOS; pin++)
        if (gpio.level[pin] == 0)
            spi.seen_by = pin;
    CHECK(selected() <= 1);
    memcpy(spi.seen, transfer->tx_buffer, transfer->length / BITS);
    memcpy(transfer->rx_buffer, spi.answer, transfer->length / BITS);
    if (config->post_cb != NULL)
        config->post_cb(transfer);
    CHECK(selected() == 0);
    spi.queued = NULL;
    spi.done = transfer;
}

static const struct hal_driver_bus *start_spi(unsigned count) {
    static const uint8_t pins[] = {5, 4, 2, 15, 13, 14};
    struct driver_bus_wire wire = {.number = SPI, .mosi = MOSI, .miso = MISO, .sclk = SCLK};
    wire.select_count = (uint8_t)count;
    memset(wire.select, NONE, sizeof wire.select);
    memcpy(wire.select, pins, count);
    memset(&spi, 0, sizeof spi);
    memset(&gpio, -1, sizeof gpio);
    return driver_bus_init(&wire);
}

/* Six drivers, each with a select line for itself: more than the controller has of its own. */
static void check_selects(void) {
    const struct hal_driver_bus *bus = start_spi(6);
    static const int pins[] = {5, 4, 2, 15, 13, 14};
    CHECK(bus != NULL);
    if (bus == NULL)
        return;
    CHECK(selected() == 0);
    for (uint8_t n = 0; n < 6; n++) {
        const uint8_t frame[FRAME] = {0x6C, n, 2, 3, 4};
        uint8_t got[TMC_BYTES_MAX] = {0};
        memset(spi.answer, 0x40 + n, sizeof spi.answer);
        bus->send(NULL, n, frame, sizeof frame);
        CHECK(bus->receive(NULL, got, sizeof got) == 0); /* not yet, and it does not wait */
        run_transfer();
        CHECK(spi.seen_by == pins[n] && memcmp(spi.seen, frame, sizeof frame) == 0);
        CHECK(bus->receive(NULL, got, sizeof got) == FRAME && got[0] == 0x40 + n &&
              got[FRAME - 1] == 0x40 + n);
        CHECK(bus->receive(NULL, got, sizeof got) == 0); /* once */
    }
}

/* Given up: the next one is not sent into it, and its answer is none to what was asked since. */
static void check_late(void) {
    const struct hal_driver_bus *bus = start_spi(2);
    const uint8_t first[FRAME] = {1}, second[FRAME] = {2}, third[FRAME] = {3};
    uint8_t got[TMC_BYTES_MAX];
    CHECK(bus != NULL);
    if (bus == NULL)
        return;
    bus->send(NULL, 0, first, FRAME);
    bus->send(NULL, 1, second, FRAME);
    run_transfer();
    CHECK(spi.seen[0] == 1 && bus->receive(NULL, got, sizeof got) == 0);
    bus->send(NULL, 1, third, FRAME);
    run_transfer();
    CHECK(spi.seen[0] == 3 && bus->receive(NULL, got, sizeof got) == FRAME);
    spi.full = true;
    bus->send(NULL, 0, first, FRAME);
    CHECK(bus->receive(NULL, got, sizeof got) == 0 && selected() == 0);
    spi.full = false;
    bus->send(NULL, 0, first, FRAME);
    run_transfer();
    CHECK(bus->receive(NULL, got, 2) == 2); /* no more than there is room for */
    bus->send(NULL, 6, first, FRAME);       /* no such driver */
    CHECK(spi.queued == NULL);
}

static void check_no_spi(void) {
    struct driver_bus_wire wire = {
        .number = SPI, .mosi = MOSI, .miso = MISO, .sclk = SCLK, .select_count = 1};
    wire.select[0] = NONE;
    CHECK(driver_bus_init(&wire) == NULL);
    wire.select[0] = 5;
    spi.fails = true;
    CHECK(driver_bus_init(&wire) == NULL);
    spi.fails = false;
}

/* ---- UART ---- */

static struct {
    uint8_t line[FIFO], sent[FIFO];
    size_t line_count, sent_count;
    bool fails;
} uart;

esp_err_t uart_driver_install(uart_port_t port, int rx_size, int tx_size, int queue_size,
                              QueueHandle_t *queue, int flags) {
    CHECK(port == (uart_port_t)UART && rx_size > FIFO && tx_size == 0 && queue_size == 0 && queue == NULL);
    CHECK((flags & ESP_INTR_FLAG_IRAM) != 0);
    return uart.fails ? ESP_FAIL : ESP_OK;
}

esp_err_t uart_param_config(uart_port_t port, const uart_config_t *config) {
    CHECK(port == (uart_port_t)UART && config->baud_rate == 115200);
    CHECK(config->data_bits == UART_DATA_8_BITS && config->parity == UART_PARITY_DISABLE);
    return ESP_OK;
}

esp_err_t uart_set_pin(uart_port_t port, int tx, int rx, int rts, int cts) {
    CHECK(port == (uart_port_t)UART && tx == TX && rx == RX);
    CHECK(rts == UART_PIN_NO_CHANGE && cts == UART_PIN_NO_CHANGE);
    return ESP_OK;
}

esp_err_t uart_flush_input(uart_port_t port) {
    CHECK(port == (uart_port_t)UART);
    uart.line_count = 0;
    return ESP_OK;
}

/* An echo (4) and an answer (8) are there as soon as they are complete. */
esp_err_t uart_set_rx_full_threshold(uart_port_t port, int threshold) {
    CHECK(port == (uart_port_t)UART && threshold <= 12);
    return ESP_OK;
}

esp_err_t uart_set_rx_timeout(uart_port_t port, uint8_t symbols) {
    CHECK(port == (uart_port_t)UART && symbols > 0);
    return ESP_OK;
}

int uart_write_bytes(uart_port_t port, const void *bytes, size_t size) {
    CHECK(port == (uart_port_t)UART && size <= FIFO);
    memcpy(uart.sent, bytes, size);
    uart.sent_count = size;
    return (int)size;
}

int uart_read_bytes(uart_port_t port, void *bytes, uint32_t length, TickType_t ticks) {
    CHECK(port == (uart_port_t)UART && ticks == 0);
    const size_t count = uart.line_count < length ? uart.line_count : length;
    memcpy(bytes, uart.line, count);
    uart.line_count -= count;
    return (int)count;
}

static void check_uart(void) {
    const struct driver_bus_wire wire = {.number = UART, .uart = true, .tx = TX, .rx = RX};
    const struct hal_driver_bus *bus = driver_bus_init(&wire);
    const uint8_t request[] = {5, 0, 6, 0x6F};
    uint8_t got[FIFO];
    CHECK(bus != NULL);
    if (bus == NULL)
        return;
    uart.line_count = 3; /* of an answer that came too late */
    bus->send(NULL, 0, request, sizeof request);
    CHECK(uart.sent_count == sizeof request && memcmp(uart.sent, request, sizeof request) == 0);
    CHECK(bus->receive(NULL, got, sizeof got) == 0);
    memcpy(uart.line, "\5\1\2", 3);
    uart.line_count = 3;
    CHECK(bus->receive(NULL, got, sizeof got) == 3 && got[0] == 5);
    uart.fails = true;
    CHECK(driver_bus_init(&wire) == NULL);
}

int main(void) {
    check_selects();
    check_late();
    check_no_spi();
    check_uart();
    CHECK(driver_bus_drivers() != NULL);
    return report();
}
