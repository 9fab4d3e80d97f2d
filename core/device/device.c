/* SPDX-License-Identifier: MIT */
#include "device/device.h"

#include <string.h>

#define US_PER_S 1000000u

/* ---- pins ---- */

static const struct pin_row {
    uint16_t first;
    uint8_t count;
} pin_rows[] = {
#define ROW(first, count) {first, count},
    DEVICE_PIN_KEYS(ROW)
#undef ROW
};

/* @return DEVICE_PINS: no pin's key */
static unsigned pin_of(uint16_t key) {
    unsigned index = 0;
    for (size_t i = 0; i < sizeof pin_rows / sizeof pin_rows[0]; i++) {
        if (key >= pin_rows[i].first && key - pin_rows[i].first < pin_rows[i].count)
            return index + key - pin_rows[i].first;
        index += pin_rows[i].count;
    }
    return DEVICE_PINS;
}

uint16_t device_pin_key(unsigned index) {
    const struct pin_row *row = pin_rows;
    for (; index >= row->count; row++)
        index -= row->count;
    return (uint16_t)(row->first + index);
}

static bool is_legal(const struct device *device, unsigned index, uint8_t pin) {
    return pin < 64 && (device->legal[index] >> pin & 1) != 0;
}

/* Writing back what was read is no change, also where the board decides. */
static enum device_answer set_pin(struct device *device, uint16_t key, unsigned index, uint32_t value) {
    uint8_t *pin = &device->wiring.pin[index];
    if (value == *pin)
        return DEVICE_DONE;
    if (device->ops->keep_wiring == NULL || device->legal == NULL || device->legal[index] == 0)
        return DEVICE_FIXED;
    if (value > UINT8_MAX)
        return DEVICE_RANGE;
    /* An axis cannot do without. */
    const bool needed = key >= DEVICE_KEY_STEP_PIN && key < DEVICE_KEY_ENABLE_PIN;
    const bool good = value == DEVICE_NO_PIN ? !needed : is_legal(device, index, (uint8_t)value);
    if (!good)
        return DEVICE_PIN;
    *pin = (uint8_t)value;
    return DEVICE_DONE;
}

/* Where a pin is legal is in the masks; whether it is free depends on all others. */
static bool no_pin_serves_two(const struct device_wiring *wiring) {
    for (unsigned i = 0; i < DEVICE_PINS; i++)
        for (unsigned k = 0; k < i; k++)
            if (wiring->pin[i] != DEVICE_NO_PIN && wiring->pin[i] == wiring->pin[k])
                return false;
    return true;
}

bool device_take_wiring(struct device *device, const struct device_wiring *stored) {
    for (unsigned n = 0; n < DEVICE_PINS; n++) {
        const uint8_t pin = stored->pin[n];
        const bool moves = pin != device->wiring.pin[n];
        if (moves && !(pin == DEVICE_NO_PIN ? device->legal[n] != 0 : is_legal(device, n, pin)))
            return false;
    }
    if (stored->estop_high > 1 || !no_pin_serves_two(stored))
        return false;
    device->wiring = *stored;
    return true;
}

static enum device_answer set_estop(struct device *device, uint32_t value) {
    if (value == device->wiring.estop_high)
        return DEVICE_DONE;
    if (device->ops->keep_wiring == NULL || device->wiring.pin[pin_of(DEVICE_KEY_ESTOP_PIN)] == DEVICE_NO_PIN)
        return DEVICE_FIXED;
    if (value > 1)
        return DEVICE_RANGE;
    device->wiring.estop_high = (uint8_t)value;
    return DEVICE_DONE;
}

/* ---- network ---- */

/* cppcheck-suppress constParameterPointer ; what it returns is written */
static uint32_t *address_of(struct device_network *network, uint16_t key) {
    return key == DEVICE_KEY_IP_ADDRESS   ? &network->address
           : key == DEVICE_KEY_IP_GATEWAY ? &network->gateway
                                          : &network->netmask;
}

static bool is_network_number(uint16_t key) {
    return key >= DEVICE_KEY_IP_MODE && key <= DEVICE_KEY_IP_NETMASK;
}

static enum device_answer set_network_number(struct device *device, uint16_t key, uint32_t value) {
    if (device->ops->keep_network == NULL)
        return DEVICE_FIXED;
    if (key != DEVICE_KEY_IP_MODE)
        *address_of(&device->network, key) = value;
    else if (value <= 1)
        device->network.is_static = (uint8_t)value;
    else
        return DEVICE_RANGE;
    return DEVICE_DONE;
}

/* Of the network, so that its first byte is the highest. */
static uint32_t in_order(uint32_t address) {
    return address << 24 | (address & 0xFF00u) << 8 | (address >> 8 & 0xFF00u) | address >> 24;
}

static bool is_usable(const struct device_network *network) {
    const uint32_t mask = in_order(network->netmask), host = ~mask, own = in_order(network->address) & host;
    const uint32_t first = in_order(network->address) >> 24;
    const bool is_mask = (host & (host + 1)) == 0 && host >= 3; /* ones, then zeros; room for two devices */
    const bool is_host = own != 0 && own != host && first != 0 && first != 127 && first < 224;
    const bool reaches =
        network->gateway == 0 || ((network->gateway ^ network->address) & network->netmask) == 0;
    return network->is_static == 0 || (is_mask && is_host && reaches && network->gateway != network->address);
}

/* A label of DNS: mDNS and DHCP have it. */
static bool is_name(const char *text, size_t length) {
    for (size_t i = 0; i < length; i++) {
        const char c = text[i];
        const bool inner = c == '-' && i > 0 && i + 1 < length;
        if (!inner && !(c >= 'a' && c <= 'z') && !(c >= 'A' && c <= 'Z') && !(c >= '0' && c <= '9'))
            return false;
    }
    return true;
}

/* cppcheck-suppress constParameterPointer ; what it returns is written */
static char *text_of(struct device_network *network, uint16_t key) {
    switch (key) {
    case DEVICE_KEY_WIFI_SSID:
        return network->ssid;
    case DEVICE_KEY_WIFI_PASSWORD:
        return network->password;
    case DEVICE_KEY_HOST_NAME:
        return network->name;
    default:
        return NULL;
    }
}

static bool is_text_good(uint16_t key, const char *text, size_t length) {
    if (key == DEVICE_KEY_WIFI_SSID)
        return length <= DEVICE_SSID_MAX;
    if (key == DEVICE_KEY_HOST_NAME)
        return length <= DEVICE_NAME_MAX && is_name(text, length);
    return length == 0 || (length >= DEVICE_PASSWORD_MIN && length <= DEVICE_PASSWORD_MAX);
}

/* ---- keys ---- */

bool device_get(const struct device *device, uint16_t key, uint32_t *value) {
    struct device_network network = device->network;
    const unsigned index = pin_of(key);
    if (index < DEVICE_PINS)
        *value = device->wiring.pin[index];
    else if (key == DEVICE_KEY_ESTOP_INVERT)
        *value = device->wiring.estop_high;
    else if (key == DEVICE_KEY_ENCODER_FILTER_NS)
        *value = device->encoder_filter_ns;
    else if (key == DEVICE_KEY_ETHERNET_SPI_HOST)
        *value = device->ethernet_host;
    else if (is_network_number(key))
        *value = key == DEVICE_KEY_IP_MODE ? network.is_static : *address_of(&network, key);
    else
        return false;
    return true;
}

bool device_get_text(const struct device *device, uint16_t key, char text[DEVICE_TEXT_SIZE]) {
    struct device_network network = device->network;
    const char *found = text_of(&network, key);
    memset(text, 0, DEVICE_TEXT_SIZE);
    if (found == NULL)
        return false;
    if (key != DEVICE_KEY_WIFI_PASSWORD)
        memcpy(text, found, strlen(found));
    return true;
}

enum device_answer device_set(struct device *device, uint16_t key, uint32_t value) {
    const unsigned index = pin_of(key);
    if (index < DEVICE_PINS)
        return set_pin(device, key, index, value);
    if (is_network_number(key))
        return set_network_number(device, key, value);
    if (key == DEVICE_KEY_ESTOP_INVERT)
        return set_estop(device, value);
    uint32_t now;
    if (!device_get(device, key, &now))
        return DEVICE_UNKNOWN;
    return now == value ? DEVICE_DONE : DEVICE_FIXED;
}

enum device_answer device_set_text(struct device *device, uint16_t key, const char text[DEVICE_TEXT_SIZE]) {
    char *to = text_of(&device->network, key);
    const char *end = memchr(text, 0, DEVICE_TEXT_SIZE);
    if (to == NULL)
        return DEVICE_UNKNOWN;
    if (device->ops->keep_network == NULL)
        return DEVICE_FIXED;
    if (end == NULL || !is_text_good(key, text, (size_t)(end - text)))
        return DEVICE_RANGE;
    memcpy(to, text, (size_t)(end - text) + 1);
    return DEVICE_DONE;
}

/* ---- store ---- */

static bool same_wiring(const struct device_wiring *a, const struct device_wiring *b) {
    return memcmp(a, b, sizeof *a) == 0; /* bytes only, so without gaps */
}

static bool same_network(const struct device_network *a, const struct device_network *b) {
    return strcmp(a->ssid, b->ssid) == 0 && strcmp(a->password, b->password) == 0 &&
           strcmp(a->name, b->name) == 0 && a->is_static == b->is_static && a->address == b->address &&
           a->gateway == b->gateway && a->netmask == b->netmask;
}

bool device_differs(const struct device *device) {
    return !same_wiring(&device->wiring, &device->kept_wiring) ||
           !same_network(&device->network, &device->kept_network);
}

void device_discard(struct device *device) {
    device->wiring = device->kept_wiring;
    device->network = device->kept_network;
}

static enum device_answer discard(struct device *device, enum device_answer answer) {
    device_discard(device);
    return answer;
}

/* Of several changes in a row the first's old values return: those are known to work. */
static bool save_network(struct device *device, uint64_t now_us) {
    const struct device_network *before = device->on_trial ? &device->before : &device->kept_network;
    if (!device->ops->keep_network(device->ctx, &device->network, before))
        return false;
    if (!device->on_trial)
        device->before = device->kept_network;
    device->kept_network = device->network;
    device->on_trial = device->joins = true;
    device->due_us = now_us + DEVICE_APPLY_S * US_PER_S;
    device->came = 0;
    return true;
}

enum device_answer device_save(struct device *device, uint64_t now_us) {
    if (!no_pin_serves_two(&device->wiring))
        return discard(device, DEVICE_PIN);
    if (!is_usable(&device->network))
        return discard(device, DEVICE_RANGE);
    if (!same_wiring(&device->wiring, &device->kept_wiring)) {
        if (!device->ops->keep_wiring(device->ctx, &device->wiring, &device->kept_wiring))
            return discard(device, DEVICE_NOT_STORED);
        device->kept_wiring = device->wiring;
    }
    if (!same_network(&device->network, &device->kept_network) && !save_network(device, now_us))
        return discard(device, DEVICE_NOT_STORED);
    return DEVICE_DONE;
}

/* ---- trial ---- */

void device_begin(struct device *device, bool trial, uint64_t now_us) {
    device->kept_wiring = device->wiring;
    device->kept_network = device->network;
    device->on_trial = trial;
    device->due_us = now_us + DEVICE_TRIAL_S * (uint64_t)US_PER_S;
}

void device_connected(struct device *device, unsigned place) {
    if (device->on_trial && !device->joins)
        device->came |= (uint8_t)(1u << place);
}

bool device_confirm(struct device *device) {
    if (!device->on_trial || device->joins)
        return false;
    device->on_trial = !device->ops->keep_network(device->ctx, &device->kept_network, NULL);
    return !device->on_trial;
}

void device_contact(struct device *device, unsigned place) {
    if ((device->came >> place & 1) != 0)
        (void)device_confirm(device);
}

uint32_t device_trial_s(const struct device *device, uint64_t now_us) {
    const uint64_t left_us = device->due_us > now_us ? device->due_us - now_us : 0;
    const uint32_t left_s = (uint32_t)((left_us + US_PER_S - 1) / US_PER_S);
    return !device->on_trial ? 0 : device->joins ? left_s + DEVICE_TRIAL_S : left_s > 0 ? left_s : 1;
}

/* As long as the old values cannot be stored they are tried again each second. */
static void revert(struct device *device, uint64_t now_us) {
    if (!device->ops->keep_network(device->ctx, &device->before, NULL)) {
        device->due_us = now_us + US_PER_S;
        return;
    }
    device->network = device->kept_network = device->before;
    device->on_trial = false;
    device->ops->join(device->ctx);
}

void device_poll(struct device *device, uint64_t now_us, bool at_rest) {
    if (!device->on_trial || now_us < device->due_us || !at_rest)
        return;
    if (!device->joins) {
        revert(device, now_us);
        return;
    }
    device->joins = false;
    device->due_us = now_us + DEVICE_TRIAL_S * (uint64_t)US_PER_S;
    device->ops->join(device->ctx);
}
