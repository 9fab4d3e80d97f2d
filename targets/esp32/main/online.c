/* SPDX-License-Identifier: MIT
 * The network and what is offered there: Telnet, WMC3, the web page, updates. */
#include "app/device_keys.h"
#include "app/entropy.h"
#include "base/version.h"
#include "firmware.h"
#include "net/network.h"
#include "net/page.h"
#include "net/portal.h"
#include "net/wifi.h"
#include "net_dns.h"
#include "store/nvs_device.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TELNET_PORT = 23, PAGE_PORT = 80 };

static void chip_random(void *ctx, uint8_t *bytes, size_t count) {
    (void)ctx;
    entropy_fill(bytes, count);
}

/* ---- the access key ---- */

/* @param ctx  struct nvs_store */
static enum nvs_text read_text(void *ctx, const char *key, char *text, size_t size) {
    return nvs_flash_ops_find_text(ctx, key, text, size);
}

/* @param ctx  struct nvs_store */
static bool write_text(void *ctx, const char *key, const char *text) {
    return nvs_flash_ops_set_text(ctx, key, text);
}

static const struct access_store_ops access_ops = {
    .read = read_text, .write = write_text, .random = chip_random};

void firmware_keep_trust(struct firmware *firmware) {
    struct access *access = &firmware->controller.access;
    if (access->changed && machine_is_at_rest(&firmware->machine) &&
        !access_store_keep_trust(access, &access_ops, &firmware->store))
        firmware_tell(firmware, "Cannot store the trusted addresses: the next start has the old ones");
}

static void load_access(struct firmware *firmware) {
    struct access *access = &firmware->controller.access;
    uint8_t salt[ACCESS_SALT];
    enum access_found found = access_store_load(firmware->key, &access_ops, &firmware->store);
    entropy_fill(salt, sizeof salt);
    access_init(access, firmware->key, firmware->access_open != 0, salt, hal_time_us(&firmware->hal));
    access_store_load_trust(access, &access_ops, &firmware->store);
    if (found == ACCESS_LOST)
        firmware_tell(firmware, "Cannot read the stored access key, so network logins are disabled. "
                                "Write the storage again over USB: wificnc nvs build, wificnc nvs flash");
    else if (found == ACCESS_UNKEPT)
        firmware_tell(firmware, "Cannot store the access key: the next start makes another one");
}

/* ---- WMC3 ---- */

static const struct session_ops wire_ops = {.send = net_wire_send, .random = chip_random};

static struct session_options wire_options(struct firmware *firmware) {
    return (struct session_options){.name = network_name(),
                                    .access = &firmware->controller.access,
                                    .version = VERSION_WORD,
                                    .status_port = WIRE_STATUS_PORT,
                                    .channels = &firmware->channels,
                                    .device = device_keys_create(&firmware->pins, &firmware->store)};
}

/* Hosts that plan motion themselves. */
static void start_wire(struct firmware *firmware) {
    const struct session_options options = wire_options(firmware);
    char text[64];
    int error;
    if (controller_serve_wire(&firmware->controller, &options, &wire_ops, &error))
        return;
    snprintf(text, sizeof text, "Cannot start WMC3, error %d", error);
    firmware_tell(firmware, text);
}

/* ---- first contact ---- */

static bool is_at_rest(void *ctx) {
    return machine_is_at_rest(&((const struct firmware *)ctx)->machine);
}

/* The session's, which polls the device; without it no network is changed. */
static uint64_t device_time_us(void *ctx) {
    return ((const struct firmware *)ctx)->controller.session.now_us;
}

static const char *why_busy(void *ctx) {
    return controller_why_busy(&((const struct firmware *)ctx)->controller);
}

static void restart_soon(void *ctx) {
    services_restart(&((struct firmware *)ctx)->services);
}

static struct wiring_page *make_wiring_page(struct firmware *firmware) {
    const struct wiring_page_options options = {.device = firmware->controller.session.options.device,
                                                .access = &firmware->controller.access,
                                                .key_of = nvs_device_pin_key,
                                                .why_busy = why_busy,
                                                .restart = restart_soon,
                                                .now_us = device_time_us,
                                                .ctx = firmware};
    return wiring_page_create(&options);
}

static void start_portal(struct firmware *firmware) {
    const struct portal_options options = {.wiring = make_wiring_page(firmware),
                                           .device = firmware->controller.session.options.device,
                                           .access = &firmware->controller.access,
                                           .hub = &firmware->controller.hub,
                                           .page = "http://" NETWORK_OWN_TEXT "/setup.html",
                                           .address = NETWORK_OWN_TEXT,
                                           .dns_port = NET_DNS_PORT,
                                           .at_rest = is_at_rest,
                                           .now_us = device_time_us,
                                           .random = chip_random,
                                           .ctx = firmware};
    if (options.device != NULL && firmware->controller.has_wire)
        firmware->portal = portal_create(&options);
}

/* ---- updates ---- */

/* Nothing moves now, and nothing will until the end of the update. */
static const char *lock_machine(void *ctx) {
    struct firmware *firmware = ctx;
    const char *why = controller_why_busy(&firmware->controller);
    if (why != NULL)
        return why;
    if (firmware->hal.inputs.lock == HAL_LOCK_NONE)
        firmware->hal.inputs.lock = HAL_LOCK_UPDATE;
    return NULL;
}

static void unlock_machine(void *ctx) {
    struct firmware *firmware = ctx;
    if (firmware->hal.inputs.lock == HAL_LOCK_UPDATE)
        firmware->hal.inputs.lock = HAL_LOCK_NONE;
}

static const char *lock_outputs(void *ctx) {
    io_module_lock(ctx);
    return NULL;
}

static void unlock_outputs(void *ctx) {
    io_module_unlock(ctx);
}

/* ---- pins that are on trial ---- */

void firmware_poll_wiring(struct firmware *firmware, uint32_t now_us, bool reached, bool at_rest) {
    const enum update_verdict verdict = update_trial_poll(&firmware->wiring, now_us, reached, at_rest);
    if (verdict == UPDATE_WAIT)
        return;
    if (!nvs_device_end_wiring_trial(&firmware->store, verdict == UPDATE_CONFIRM))
        firmware_tell(firmware, "Cannot store which pins are used from now on");
    else if (verdict == UPDATE_REVERT)
        services_restart(&firmware->services);
}

/* ---- start ---- */

/* Most boards have none, and need no memory for them. @return NULL: none; else it is never freed */
static const char *load_names(struct nvs_store *store) {
    char names[HTTP_NAMES_MAX + 1];
    return read_text(store, NVS_HTTP_NAMES, names, sizeof names) == NVS_TEXT_GOOD ? strdup(names) : NULL;
}

static void start_servers(struct firmware *firmware) {
    char text[64], port[8];
    int error;
    snprintf(port, sizeof port, "%d", TELNET_PORT);
    if (!controller_listen(&firmware->controller, NULL, port, &error)) {
        snprintf(text, sizeof text, "Cannot start Telnet, error %d", error);
        firmware_tell(firmware, text);
    }
    struct page_names names = {
        .own = network_name(), .others = load_names(&firmware->store), .digest = ota_flash_digest()};
    if (firmware->portal != NULL) {
        names.network = portal_network;
        names.portal = portal_page;
        names.setup = firmware->portal;
        names.has_pins = true;
    }
    names.update = services_update;
    names.updates = &firmware->services;
    snprintf(port, sizeof port, "%d", PAGE_PORT);
    if (page_start(&firmware->controller.hub, NULL, &names, port, &error)) {
        services_announce_page(&firmware->services, PAGE_PORT);
        return;
    }
    snprintf(text, sizeof text, "Cannot start the web page, error %d", error);
    firmware_tell(firmware, text);
}

static bool page_address(char *text, size_t size) {
    const uint32_t address = network_address();
    snprintf(text, size, "http://%u.%u.%u.%u/", (unsigned)(address & 0xFF), (unsigned)(address >> 8 & 0xFF),
             (unsigned)(address >> 16 & 0xFF), (unsigned)(address >> 24));
    return address != 0;
}

void firmware_start_network(struct firmware *firmware) {
    const struct ota_flash flash = {.lock = lock_machine, .unlock = unlock_machine, .ctx = firmware};
    const struct controller_options options = {.key = firmware->key, .page = page_address};
    char text[128];
    firmware->wiring.on = nvs_device_wiring_is_on_trial(&firmware->store);
    firmware->has_network = network_start(&firmware->store);
    if (!firmware->has_network) {
        firmware_tell(firmware, "Cannot start WiFi or Ethernet");
        return;
    }
    if (wifi_own_password()[0] != '\0')
        snprintf(text, sizeof text, "Own network: %s password: %s", network_name(), wifi_own_password());
    else
        snprintf(text, sizeof text, "Cannot start WiFi: Ethernet only");
    firmware_tell(firmware, text);
    load_access(firmware);
    controller_set(&firmware->controller, &options);
    services_start(&firmware->services, &firmware->controller.access, &flash, TELNET_PORT);
    start_wire(firmware);
    start_portal(firmware);
    start_servers(firmware);
}

void firmware_start_io_module(struct firmware *firmware) {
    struct io_module *module = calloc(1, sizeof *module);
    struct controller *controller = &firmware->controller;
    const struct ota_flash flash = {.lock = lock_outputs, .unlock = unlock_outputs, .ctx = module};
    firmware->wiring.on = nvs_device_wiring_is_on_trial(&firmware->store);
    firmware->io_module = module;
    firmware->has_network = module != NULL && network_start(&firmware->store);
    if (!firmware->has_network)
        return; /* no one can command: the outputs stay safe */
    load_access(firmware);
    const struct session_options options = wire_options(firmware);
    *module = (struct io_module){
        .channels = &firmware->channels, .session = &controller->session, .wire = &controller->wire};
    io_module_start(module, &firmware->store, &options, &wire_ops);
    services_start(&firmware->services, &controller->access, &flash, 0);
}

void firmware_tell_address(struct firmware *firmware) {
    static uint32_t told;
    uint32_t address = network_address();
    char text[128];
    if (address == told)
        return;
    told = address;
    snprintf(text, sizeof text,
             "Address %u.%u.%u.%u or %s.local: Grbl at port %d, web page at port 80, $QR for a phone",
             (unsigned)(address & 0xFF), (unsigned)(address >> 8 & 0xFF), (unsigned)(address >> 16 & 0xFF),
             (unsigned)(address >> 24), network_name(), TELNET_PORT);
    firmware_tell(firmware, address != 0 ? text : "No network");
}
