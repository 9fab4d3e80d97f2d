/* SPDX-License-Identifier: MIT
 * The configuration keys of the binary protocol as a table. Private to core/session; keys_gen.c is generated
 * from protocol/wmc3.toml and protocol/settings.toml. */
#ifndef WIFICNC_SESSION_KEYS_H
#define WIFICNC_SESSION_KEYS_H

#include "wire/wire_gen.h"

enum session_key_kind { KEY_SETTING, KEY_FIXED, KEY_TARGET, KEY_PIN, KEY_STORED, KEY_STATE };

/** How a wire value w follows from a setting's value s. */
enum session_key_as {
    KEY_AS_VALUE,     /* w = s */
    KEY_AS_MAGNITUDE, /* w = s; a negative w counts by its size */
    KEY_AS_MASK_ANY,  /* s is on or off; w any axis, all axes when on */
    KEY_AS_MASK_NONE, /* s is on when w has no axis */
    KEY_AS_MASK_FLIP, /* w has the axes that s has not */
    KEY_AS_IDLE_MS,   /* w = 0 is s = 255: never */
    KEY_AS_STEPS,     /* s in mm, w in steps, by the axis' steps/mm (X's when the key has no axis) */
    KEY_AS_STEPS_S,   /* s in mm/min, w in steps/s */
    KEY_AS_STEPS_S2,  /* s in mm/s2, w in steps/s2 */
    KEY_AS_DIR_SETUP, /* the board's, whole us */
    KEY_AS_PWM_HZ,    /* w = s; 0: the spindle has no PWM */
    KEY_AS_QUARTER,   /* w = s / 4: pulses of an encoder's line and its counts */
};

/** Keys from `key` on, one an axis (or a pin). */
struct session_key {
    uint16_t key;
    uint8_t count;
    uint8_t type;    /* enum wire_value_type */
    uint8_t kind;    /* enum session_key_kind */
    uint8_t as;      /* enum session_key_as */
    uint16_t number; /* KEY_SETTING: $N of the first */
    uint32_t fallback;
};

/** Ascending by key. */
extern const struct session_key session_keys[];
extern const unsigned session_key_rows;

#endif
