/* SPDX-License-Identifier: MIT
 * The serial ports: clients of the controller, and by Improv's packets a way to join a network. */
#include "app/board.h"
#include "base/version.h"
#include "firmware.h"
#include "hal/hal.h"
#include "link/improv.h"
#include "link/serial_stream.h"
#include "net/network.h"
#include "pin_config.h"
#include "store/nvs_device.h"
#include "store/nvs_names.h"

#include <stdio.h>
#include <string.h>

/* Writing to flash stops the other core for milliseconds: not in motion. */
static bool join_network(void *ctx, const char *network, const char *wifi_password) {
    struct firmware *firmware = ctx;
    const struct nvs_store *store = &firmware->store;
    if (store->ops == NULL || !firmware->has_network || !machine_is_at_rest(&firmware->machine))
        return false;
    bool kept = nvs_flash_ops_set_text(store, NVS_WIFI_SSID, network);
    if (wifi_password[0] == '\0')
        (void)store->ops->erase(store->ctx, NVS_WIFI_PASSWORD);
    else
        kept = kept && nvs_flash_ops_set_text(store, NVS_WIFI_PASSWORD, wifi_password);
    if (kept) {
        nvs_device_end_trial(store);
        network_join_stored();
    }
    return kept;
}

/* The radio is elsewhere for two seconds. */
static bool scan_networks(void *ctx) {
    const struct firmware *firmware = ctx;
    return firmware->has_network && machine_is_at_rest(&firmware->machine) && network_scan();
}

static enum improv_scan scanned_network(void *ctx, size_t index, struct improv_network *network) {
    struct wifi_network found;
    (void)ctx;
    enum network_scan state = network_scanned(index, &found);
    if (state != NETWORK_FOUND)
        return state == NETWORK_SCANNING ? IMPROV_SCANNING : IMPROV_NO_MORE;
    *network = (struct improv_network){.rssi_dbm = found.rssi_dbm, .secured = found.secured};
    memcpy(network->name, found.name, sizeof network->name);
    return IMPROV_NETWORK;
}

static bool joined_network(void *ctx, char *text) {
    uint32_t address = network_station_address();
    (void)ctx;
    snprintf(text, IMPROV_TEXT_MAX, "http://%u.%u.%u.%u/", (unsigned)(address & 0xFF),
             (unsigned)(address >> 8 & 0xFF), (unsigned)(address >> 16 & 0xFF), (unsigned)(address >> 24));
    return address != 0;
}

static uint32_t port_time_us(void *ctx) {
    const struct firmware *firmware = ctx;
    return hal_time_us(&firmware->hal);
}

static void add_port(struct firmware *firmware, struct improv *improv, const struct net_stream *port,
                     const char *name) {
    static struct improv_ops ops = {.join = join_network,
                                    .joined = joined_network,
                                    .scan = scan_networks,
                                    .scanned = scanned_network,
                                    .now_us = port_time_us};
    static struct improv_info info = {.firmware = "WiFiCNC", .version = VERSION_TEXT, .chip = BOARD_CHIP};
    struct net_stream stream;
    ops.ctx = firmware;
    info.name = network_name(); /* filled in later */
    improv_init(improv, port, &info, &ops, &stream);
    controller_add_port(&firmware->controller, &stream, name);
}

/* Without Improv: a pendant knows nothing of networks. */
static void add_pendant(struct firmware *firmware) {
    struct serial_pendant wire;
    struct net_stream stream;
    if (!board_pendant(&wire))
        return;
    if (serial_stream_pendant(&wire, &stream))
        controller_add_port(&firmware->controller, &stream, "pendant");
    else
        firmware_tell(firmware, "Cannot start the UART of the pendant");
}

void firmware_start_ports(struct firmware *firmware) {
    static struct improv uart, usb;
    struct net_stream port;
    add_pendant(firmware);
    if (serial_stream_uart(&port))
        add_port(firmware, &uart, &port, "UART");
    if (serial_stream_usb(&port))
        add_port(firmware, &usb, &port, "USB");
}
