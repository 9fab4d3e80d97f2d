/* SPDX-License-Identifier: MIT */
#include "app/services.h"

#include "app/entropy.h"
#include "net/network.h"
#include "net_mdns_udp.h"
#include "net_tcp.h"
#include "pin_config.h"

#include "esp_mac.h"
#include "esp_system.h"
#include "sdkconfig.h"

#include <stdio.h>
#include <string.h>

/* Chip ids of images: ESP-IDF, esp_app_format.h. RESTART_US: the last word must get out. */
#ifdef CONFIG_IDF_TARGET_ESP32S3
enum { CHIP_ID = 9 };
#else
enum { CHIP_ID = 0 };
#endif
enum { RESTART_US = 500000 };

/* The chip's own MAC address: names can be changed, and two chips can be given the same one. */
static void set_id(struct net_mdns *mdns) {
    uint8_t mac[6] = {0};
    (void)esp_read_mac(mac, ESP_MAC_WIFI_SOFTAP);
    snprintf(mdns->id, sizeof mdns->id, "%02x%02x%02x%02x%02x%02x", mac[0], mac[1], mac[2], mac[3], mac[4],
             mac[5]);
}

void services_start(struct services *services, struct access *access, const struct ota_flash *flash,
                    uint16_t telnet_port) {
    const struct ota_image image = {
        .board = BOARD_ID, .chip_id = CHIP_ID, .project = "wificnc", .digest = ota_flash_digest()};
    char address[NET_ADDRESS_SIZE], port[8];
    int error;
    memset(services, 0, sizeof *services); /* by value it would be a temporary of 1 KB on the stack */
    services->flash = *flash;
    services->mdns.telnet_port = telnet_port;
    services->trial.on = ota_flash_is_on_trial();
    ota_init(&services->ota, &ota_flash_ops, &services->flash, &image, access);
    services->ota.on_trial = services->trial.on;
    snprintf(port, sizeof port, "%d", OTA_PORT);
    services->ota_listener = net_tcp_listen(NULL, port, address, &error);
    snprintf(services->mdns.name, sizeof services->mdns.name, "%s", network_name());
    snprintf(services->mdns.board, sizeof services->mdns.board, "%s", BOARD_ID);
    set_id(&services->mdns);
    services->mdns_socket = net_mdns_open("0.0.0.0", NET_MDNS_PORT);
}

void services_announce_page(struct services *services, uint16_t port) {
    services->mdns.http_port = port;
}

void services_update(void *ctx, const struct net_stream *stream) {
    struct services *services = ctx;
    uint8_t nonce[OTA_NONCE_SIZE];
    if (services->ota_listener < 0) {
        stream->ops->close(stream);
        return;
    }
    entropy_fill(nonce, sizeof nonce);
    (void)ota_connect(&services->ota, stream, nonce, services->now_us);
}

void services_restart(struct services *services) {
    services->restarts = true;
}

static bool poll_updates(struct services *services, uint32_t now_us) {
    struct net_stream stream;
    char name[NET_ADDRESS_SIZE];
    if (services->ota_listener >= 0 && net_tcp_accept(services->ota_listener, &stream, name))
        services_update(services, &stream);
    bool any = ota_poll(&services->ota, now_us);
    if (!(services->ota.done || services->restarts) || services->ota.state != OTA_FREE)
        services->done_us = now_us;
    else if (now_us - services->done_us >= RESTART_US)
        esp_restart();
    return any;
}

static void poll_name(struct services *services, uint32_t now_us) {
    uint32_t address = network_address();
    if (services->mdns_socket < 0)
        return;
    if (address != services->address) {
        services->address = address;
        memcpy(services->mdns.address, &address, sizeof services->mdns.address);
        net_mdns_join(services->mdns_socket, &services->mdns);
    }
    net_mdns_poll(services->mdns_socket, &services->mdns, now_us);
}

bool services_poll(struct services *services, uint32_t now_us, bool reached, bool at_rest) {
    services->now_us = now_us;
    poll_name(services, now_us);
    reached |= services->ota.reached;
    const enum update_verdict verdict = update_trial_poll(&services->trial, now_us, reached, at_rest);
    if (verdict == UPDATE_CONFIRM) {
        ota_flash_confirm();
        services->ota.on_trial = ota_flash_is_on_trial(); /* what the flash says: it may have failed */
    } else if (verdict == UPDATE_REVERT)
        ota_flash_revert();
    return poll_updates(services, now_us);
}
