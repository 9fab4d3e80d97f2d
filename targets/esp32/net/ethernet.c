/* SPDX-License-Identifier: MIT */
#include "net/ethernet.h"

#include "pin_config.h"

#if BOARD_HAS_W5500
#include "driver/spi_master.h"
#include "esp_eth.h"
#include "esp_eth_mac_spi.h"
#include "esp_eth_netif_glue.h"
#include "esp_mac.h"
#include "esp_netif.h"

#include <stddef.h>

/* The W5500 is asked, it does not interrupt: the pins' interrupt is the limit switches' alone, on the other
 * core. POLL_MS bounds what that costs an answer. SPI_HZ: data sheet W5500, 33.3 MHz guaranteed; wires are
 * wires. */
enum { SPI_HZ = 20000000, QUEUE = 20, POLL_MS = 2, NO_PIN = -1 };

static int pin(unsigned gpio) {
    return gpio == PIN_NONE ? NO_PIN : (int)gpio;
}

static bool start_bus(void) {
    const spi_bus_config_t bus = {.mosi_io_num = pin(PIN_ETH_MOSI),
                                  .miso_io_num = pin(PIN_ETH_MISO),
                                  .sclk_io_num = pin(PIN_ETH_SCLK),
                                  .quadwp_io_num = NO_PIN,
                                  .quadhd_io_num = NO_PIN};
    return spi_bus_initialize((spi_host_device_t)BOARD_ETH_SPI_HOST, &bus, SPI_DMA_CH_AUTO) == ESP_OK;
}

/* Fails when no chip answers with the W5500's version. */
static bool start_driver(esp_eth_handle_t *driver) {
    spi_device_interface_config_t device = {
        .mode = 0, .clock_speed_hz = SPI_HZ, .spics_io_num = pin(PIN_ETH_CS), .queue_size = QUEUE};
    eth_w5500_config_t chip = ETH_W5500_DEFAULT_CONFIG((spi_host_device_t)BOARD_ETH_SPI_HOST, &device);
    eth_mac_config_t mac_config = ETH_MAC_DEFAULT_CONFIG();
    eth_phy_config_t phy_config = ETH_PHY_DEFAULT_CONFIG();
    chip.int_gpio_num = NO_PIN;
    chip.poll_period_ms = POLL_MS;
    phy_config.reset_gpio_num = NO_PIN;
    mac_config.flags |= ETH_MAC_FLAG_PIN_TO_CORE; /* here: the other core is for motion */
    esp_eth_mac_t *mac = esp_eth_mac_new_w5500(&chip, &mac_config);
    esp_eth_phy_t *phy = esp_eth_phy_new_w5500(&phy_config);
    const esp_eth_config_t config = ETH_DEFAULT_CONFIG(mac, phy);
    return mac != NULL && phy != NULL && esp_eth_driver_install(&config, driver) == ESP_OK;
}

bool ethernet_start(const char *name) {
    const esp_netif_config_t config = ESP_NETIF_DEFAULT_ETH();
    uint8_t mac[6];
    esp_eth_handle_t driver;
    if (!start_bus())
        return false;
    if (!start_driver(&driver)) {
        (void)spi_bus_free((spi_host_device_t)BOARD_ETH_SPI_HOST);
        return false;
    }
    esp_netif_t *netif = esp_netif_new(&config);
    return netif != NULL && esp_read_mac(mac, ESP_MAC_ETH) == ESP_OK &&
           esp_eth_ioctl(driver, ETH_CMD_S_MAC_ADDR, mac) == ESP_OK &&
           esp_netif_attach(netif, esp_eth_new_netif_glue(driver)) == ESP_OK &&
           esp_netif_set_hostname(netif, name) == ESP_OK && esp_eth_start(driver) == ESP_OK;
}
#else
bool ethernet_start(const char *name) {
    (void)name;
    return false;
}
#endif
