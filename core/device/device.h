/* SPDX-License-Identifier: MIT
 * What a target is by itself, as keys of the binary protocol: pins, the e-stop's sense, its network. [task]
 * Pure: the target stores and joins.
 *
 * What is set is staged; device_save() checks it as a whole, and stores it or discards it. Pins and the
 * e-stop's sense take effect at the next start, and are the target's to take back. A change of the network
 * takes effect a second later and is on trial: if no one comes back within DEVICE_TRIAL_S, the settings
 * before return. */
#ifndef WIFICNC_DEVICE_DEVICE_H
#define WIFICNC_DEVICE_DEVICE_H

#include "device/device_gen.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    DEVICE_NO_PIN = 0xFF,
    DEVICE_SSID_MAX = 32,
    DEVICE_PASSWORD_MIN = 8, /* WPA2; none: a network without a password */
    DEVICE_PASSWORD_MAX = 63,
    DEVICE_NAME_MAX = 31,
    DEVICE_TEXT_SIZE = 64,
    DEVICE_APPLY_S = 1, /* the reply goes out first */
    DEVICE_TRIAL_S = 120
};

/** Pins in the order of DEVICE_PIN_KEYS; DEVICE_NO_PIN: none. */
struct device_wiring {
    uint8_t pin[DEVICE_PINS];
    uint8_t estop_high; /* 1: the e-stop counts while its line is high */
};

/** Texts end with a zero. Addresses: the first byte is the lowest. */
struct device_network {
    char ssid[DEVICE_SSID_MAX + 1];
    char password[DEVICE_PASSWORD_MAX + 1];
    char name[DEVICE_NAME_MAX + 1]; /* of the device; empty: its own */
    uint8_t is_static;
    uint32_t address, gateway, netmask;
};

struct device_ops {
    /** Store it, in one step. NULL: this target's pins are fixed.
     * @param before  what is to return if no one comes after the next start */
    bool (*keep_wiring)(void *ctx, const struct device_wiring *wiring, const struct device_wiring *before);
    /** Store it, in one step. NULL: this target has no network of its own.
     * @param before  what is to return if no one comes back; NULL: it is not on trial */
    bool (*keep_network)(void *ctx, const struct device_network *network,
                         const struct device_network *before);
    /** Use what was stored, from now on. */
    void (*join)(void *ctx);
};

/** What a board fixes. */
struct device_board {
    struct device_wiring wiring;
    uint64_t legal[DEVICE_PINS]; /* bit = pin to which the rules of boards let this signal move; 0: fixed */
    uint16_t encoder_filter_ns;  /* 0: no filter */
    uint8_t ethernet_host;
};

struct device {
    const struct device_ops *ops;
    void *ctx;
    const uint64_t *legal; /* as in struct device_board */
    uint16_t encoder_filter_ns;
    uint8_t ethernet_host;
    struct device_wiring wiring, kept_wiring; /* as staged, as stored */
    struct device_network network, kept_network;
    struct device_network before; /* on_trial: what returns */
    bool on_trial, joins;         /* joins: at due_us; else the trial ends then */
    uint64_t due_us;
    uint8_t came; /* bit = connection that came after the change */
};

enum device_answer {
    DEVICE_DONE,
    DEVICE_UNKNOWN, /* no key of this room */
    DEVICE_FIXED,
    DEVICE_RANGE,
    DEVICE_PIN,
    DEVICE_NOT_STORED
};

/** wiring, network and before are in place, and the rest is 0. @param trial  the network of the last start
 * was on trial: it is again */
void device_begin(struct device *device, bool trial, uint64_t now_us);

/** Wiring that was stored, perhaps on another board. @return false: it does not fit this one, and nothing
 * changes */
bool device_take_wiring(struct device *device, const struct device_wiring *stored);

/** @param index  below DEVICE_PINS, as in struct device_wiring */
uint16_t device_pin_key(unsigned index);

/** A number. @return false: no key of this room */
bool device_get(const struct device *device, uint16_t key, uint32_t *value);

/** A text; secrets are empty. @return false: no key of this room */
bool device_get_text(const struct device *device, uint16_t key, char text[DEVICE_TEXT_SIZE]);

enum device_answer device_set(struct device *device, uint16_t key, uint32_t value);
enum device_answer device_set_text(struct device *device, uint16_t key, const char text[DEVICE_TEXT_SIZE]);

/** Something is staged. */
bool device_differs(const struct device *device);

/** Store what is staged. What cannot be is discarded as a whole, and nothing changes. */
enum device_answer device_save(struct device *device, uint64_t now_us);

/** A connection begins. @param place  0 .. 7 */
void device_connected(struct device *device, unsigned place);

/** Someone who may command was heard on this connection: if it is a new one, the trial is passed. */
void device_contact(struct device *device, unsigned place);

/** Give up what is staged. */
void device_discard(struct device *device);

/** Someone who may command has come by the new network: the trial is passed. @return false: none is under
 * way, the network is not changed yet, or it cannot be stored */
bool device_confirm(struct device *device);

/** How long the trial lasts from now on. @return 0: there is none */
uint32_t device_trial_s(const struct device *device, uint64_t now_us);

/** @param at_rest  the network may change */
void device_poll(struct device *device, uint64_t now_us, bool at_rest);

#endif
