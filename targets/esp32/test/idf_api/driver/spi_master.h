/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's driver/spi_master.h, declared again: enough to compile against, checked
 * against the real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include "esp_err.h"
#include "freertos/FreeRTOS.h"

#include <stddef.h>
#include <stdint.h>

typedef enum { SPI1_HOST, SPI2_HOST, SPI3_HOST } spi_host_device_t;
typedef enum { SPI_DMA_DISABLED = 0, SPI_DMA_CH_AUTO = 3 } spi_dma_chan_t;

typedef struct {
    int mosi_io_num, miso_io_num, sclk_io_num, quadwp_io_num, quadhd_io_num;
} spi_bus_config_t;

typedef struct spi_transaction_t spi_transaction_t;
struct spi_transaction_t {
    size_t length; /* bits */
    void *user;
    const void *tx_buffer;
    void *rx_buffer;
};

typedef struct {
    uint8_t mode;
    int clock_speed_hz, spics_io_num, queue_size;
    void (*pre_cb)(spi_transaction_t *transaction); /* [ISR] once clock and mode are set */
    void (*post_cb)(spi_transaction_t *transaction);
} spi_device_interface_config_t;

typedef struct spi_device *spi_device_handle_t;

esp_err_t spi_bus_initialize(spi_host_device_t host, const spi_bus_config_t *config, spi_dma_chan_t dma);
esp_err_t spi_bus_free(spi_host_device_t host);
esp_err_t spi_bus_add_device(spi_host_device_t host, const spi_device_interface_config_t *config,
                             spi_device_handle_t *device);
esp_err_t spi_device_queue_trans(spi_device_handle_t device, spi_transaction_t *transaction,
                                 TickType_t ticks);
esp_err_t spi_device_get_trans_result(spi_device_handle_t device, spi_transaction_t **transaction,
                                      TickType_t ticks);
