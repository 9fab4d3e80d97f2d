/* SPDX-License-Identifier: MIT */
#include "store/nvs_device.h"

#include "pin_config.h"
#include "store/nvs_names.h"

#include <string.h>

static const char pending[] = "pins_pending", trial[] = "net_before", pins_trial[] = "pins_before";

/* ---- pins ---- */

const char *nvs_device_pin_key(unsigned index) {
    static const uint8_t signals[DEVICE_PINS] = {
#define SIGNAL(pin, signal, legal) signal,
        BOARD_PIN_KEYS(SIGNAL)};
    static const struct {
        char key[6];
        uint8_t signal;
    } rows[] = {
#define ROW(key, signal, name, pin, output) {key, signal},
        NVS_PINS(ROW)};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
        if (rows[i].signal == signals[index])
            return rows[i].key;
    return NULL;
}

static bool put_u8(const struct nvs_store *store, const char *key, uint8_t value) {
    uint32_t kept;
    return (store->ops->get(store->ctx, key, NVS_U8, &kept) && kept == value) ||
           store->ops->set(store->ctx, key, NVS_U8, value);
}

static bool put_wiring(const struct nvs_store *store, const struct device_wiring *wiring) {
    for (unsigned n = 0; n < DEVICE_PINS; n++) {
        const char *key = nvs_device_pin_key(n);
        if (key != NULL && !put_u8(store, key, wiring->pin[n]))
            return false;
    }
    return put_u8(store, NVS_ESTOP_INVERT, wiring->estop_high);
}

void nvs_device_finish(const struct nvs_store *store) {
    struct device_wiring wiring;
    if (store->ops != NULL &&
        store->ops->get_blob(store->ctx, pending, &wiring, sizeof wiring) == sizeof wiring &&
        put_wiring(store, &wiring))
        (void)store->ops->erase(store->ctx, pending);
}

static bool has_before(const struct nvs_store *store, struct device_wiring *before) {
    return store->ops != NULL &&
           store->ops->get_blob(store->ctx, pins_trial, before, sizeof *before) == sizeof *before;
}

bool nvs_device_wiring_is_on_trial(const struct nvs_store *store) {
    struct device_wiring before;
    return has_before(store, &before);
}

bool nvs_device_end_wiring_trial(const struct nvs_store *store, bool stays) {
    struct device_wiring before;
    if (!has_before(store, &before))
        return false;
    /* As in nvs_device_keep_wiring(): a power cut leaves all old or all new pins. */
    if (!stays && !store->ops->set_blob(store->ctx, pending, &before, sizeof before))
        return false;
    return store->ops->erase(store->ctx, pins_trial) &&
           (stays || (put_wiring(store, &before) && store->ops->erase(store->ctx, pending)));
}

/* Of several changes in a row the first's old values return: those are known to work. */
bool nvs_device_keep_wiring(const struct nvs_store *store, const struct device_wiring *wiring,
                            const struct device_wiring *before) {
    struct device_wiring first;
    return store->ops != NULL &&
           (has_before(store, &first) ||
            store->ops->set_blob(store->ctx, pins_trial, before, sizeof *before)) &&
           store->ops->set_blob(store->ctx, pending, wiring, sizeof *wiring) && put_wiring(store, wiring) &&
           store->ops->erase(store->ctx, pending);
}

/* ---- network ---- */

static uint32_t get_u32(const struct nvs_store *store, const char *key) {
    uint32_t value;
    return store->ops->get(store->ctx, key, NVS_FLOAT, &value) ? value : 0;
}

/* NVS_FLOAT: a u32 as it is. */
static bool put_u32(const struct nvs_store *store, const char *key, uint32_t value) {
    return get_u32(store, key) == value || store->ops->set(store->ctx, key, NVS_FLOAT, value);
}

static void get_text(const struct nvs_store *store, const char *key, char *text, size_t size) {
    if (store->ops->get_text(store->ctx, key, text, size) == 0)
        text[0] = '\0';
}

/* A key that is not there cannot be erased. */
static bool put_text(const struct nvs_store *store, const char *key, const char *text) {
    char kept[DEVICE_TEXT_SIZE];
    get_text(store, key, kept, sizeof kept);
    if (strcmp(kept, text) == 0)
        return true;
    return text[0] == '\0' ? store->ops->erase(store->ctx, key) : store->ops->set_text(store->ctx, key, text);
}

static bool put_network(const struct nvs_store *store, const struct device_network *network) {
    return put_text(store, NVS_WIFI_SSID, network->ssid) &&
           put_text(store, NVS_WIFI_PASSWORD, network->password) &&
           put_text(store, NVS_HOST_NAME, network->name) && put_u8(store, NVS_IP_MODE, network->is_static) &&
           put_u32(store, NVS_IP_ADDRESS, network->address) &&
           put_u32(store, NVS_IP_GATEWAY, network->gateway) &&
           put_u32(store, NVS_IP_NETMASK, network->netmask);
}

bool nvs_device_load_network(const struct nvs_store *store, struct device_network *network,
                             struct device_network *before) {
    uint32_t mode = 0;
    memset(network, 0, sizeof *network);
    if (store->ops == NULL)
        return false;
    get_text(store, NVS_WIFI_SSID, network->ssid, sizeof network->ssid);
    get_text(store, NVS_WIFI_PASSWORD, network->password, sizeof network->password);
    get_text(store, NVS_HOST_NAME, network->name, sizeof network->name);
    network->is_static = store->ops->get(store->ctx, NVS_IP_MODE, NVS_U8, &mode) && mode == 1;
    network->address = get_u32(store, NVS_IP_ADDRESS);
    network->gateway = get_u32(store, NVS_IP_GATEWAY);
    network->netmask = get_u32(store, NVS_IP_NETMASK);
    return store->ops->get_blob(store->ctx, trial, before, sizeof *before) == sizeof *before;
}

bool nvs_device_keep_network(const struct nvs_store *store, const struct device_network *network,
                             const struct device_network *before) {
    struct device_network kept;
    if (store->ops == NULL ||
        (before != NULL && !store->ops->set_blob(store->ctx, trial, before, sizeof *before)) ||
        !put_network(store, network))
        return false;
    return before != NULL || store->ops->get_blob(store->ctx, trial, &kept, sizeof kept) == 0 ||
           store->ops->erase(store->ctx, trial);
}

void nvs_device_end_trial(const struct nvs_store *store) {
    (void)store->ops->erase(store->ctx, trial);
}
