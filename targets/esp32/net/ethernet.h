/* SPDX-License-Identifier: MIT
 * A W5500 on SPI. [task, core 0] Its addresses come by DHCP, as events of ESP-IDF. */
#ifndef WIFICNC_ESP32_ETHERNET_H
#define WIFICNC_ESP32_ETHERNET_H

#include <stdbool.h>

/** [start, behind esp_netif_init()] @param name  of this controller in the network
 *  @return false: the board has none, or nothing answers on its SPI bus */
bool ethernet_start(const char *name);

#endif
