/* SPDX-License-Identifier: MIT
 * Configuration keys: settings in the wire's units. */
#include "session/inner.h"
#include "session/keys.h"

#include "wire/bytes.h"

#include <math.h>
#include <string.h>

#define ALL_AXES   0x3Fu
#define NEVER_IDLE 255.0 /* $1: the motors stay on */

static const struct session_key *row_of(uint16_t key) {
    for (unsigned i = 0; i < session_key_rows; i++)
        if (key >= session_keys[i].key && key - session_keys[i].key < session_keys[i].count)
            return &session_keys[i];
    return NULL;
}

/* Of the key's axis: in a row with a key for each axis, axes count from row->key; a single key has those of
 * X (keys.h). */
static double steps_per_mm(const struct session *session, const struct session_key *row, uint16_t key) {
    unsigned axis = row->count > 1 ? (unsigned)(key - row->key) : 0;
    return (double)session->settings->steps_per_mm[axis < AXIS_COUNT ? axis : 0];
}

static bool has_pwm(const struct session *session) {
    return !session_is_module(session) && (machine_board(session->machine)->outputs & BOARD_OUTPUT_PWM) != 0;
}

static double to_wire(const struct session *session, const struct session_key *row, uint16_t key,
                      double value) {
    double steps = steps_per_mm(session, row, key);
    switch ((enum session_key_as)row->as) {
    case KEY_AS_MASK_ANY:
        return value != 0.0 ? (double)ALL_AXES : 0.0;
    case KEY_AS_MASK_NONE:
        return value != 0.0 ? 0.0 : (double)ALL_AXES;
    case KEY_AS_MASK_FLIP:
        return (double)(~(unsigned)value & ALL_AXES);
    case KEY_AS_IDLE_MS:
        return value == NEVER_IDLE ? 0.0 : value;
    case KEY_AS_STEPS:
    case KEY_AS_STEPS_S2:
        return value * steps;
    case KEY_AS_STEPS_S:
        return value * steps / 60.0;
    /* The board has ns; rounded up, because the driver needs at least this long. */
    case KEY_AS_DIR_SETUP:
        return session_is_module(session)
                   ? value
                   : (double)((machine_board(session->machine)->dir_setup_ns + 999) / 1000);
    case KEY_AS_QUARTER:
        return floor(value / 4.0);
    case KEY_AS_PWM_HZ:
        return has_pwm(session) ? value : 0.0;
    case KEY_AS_VALUE:
    case KEY_AS_MAGNITUDE:
    default:
        return value;
    }
}

static double from_wire(const struct session *session, const struct session_key *row, uint16_t key,
                        double value) {
    double steps = steps_per_mm(session, row, key);
    switch ((enum session_key_as)row->as) {
    case KEY_AS_MAGNITUDE:
        return value < 0.0 ? -value : value;
    case KEY_AS_MASK_ANY:
        return value != 0.0;
    case KEY_AS_MASK_NONE:
        return value == 0.0;
    case KEY_AS_MASK_FLIP:
        return value >= 0.0 && value <= (double)ALL_AXES ? (double)(~(unsigned)value & ALL_AXES) : -1.0;
    case KEY_AS_IDLE_MS: /* 255 ms is none of ours: there it means never */
        return value == 0.0 ? NEVER_IDLE : value == NEVER_IDLE ? NEVER_IDLE - 1.0 : value;
    case KEY_AS_STEPS:
    case KEY_AS_STEPS_S2:
        return value / steps;
    case KEY_AS_STEPS_S:
        return value * 60.0 / steps;
    case KEY_AS_QUARTER:
        return value * 4.0;
    case KEY_AS_VALUE:
    case KEY_AS_PWM_HZ:
    case KEY_AS_DIR_SETUP: /* KEY_FIXED: config_set() refuses it before */
    default:
        return value;
    }
}

/* A number in the key's type: whole ones rounded, and as near as the type comes. */
static void encode(uint16_t type, double value, uint8_t bytes[64]) {
    static const double most[] = {UINT8_MAX, UINT16_MAX, UINT32_MAX, INT32_MAX};
    memset(bytes, 0, 64);
    if (type == WIRE_VALUE_TYPE_FLOAT) {
        float real = (float)value;
        uint32_t bits;
        memcpy(&bits, &real, sizeof bits);
        put_u32(bytes, bits);
        return;
    }
    if (type == WIRE_VALUE_TYPE_STRING)
        return;
    double whole = value < 0.0 ? 0.0 : value + 0.5;
    put_u32(bytes, (uint32_t)(whole > most[type] ? most[type] : whole));
}

/* @return false: not a number, or no such type */
static bool decode(uint16_t type, const uint8_t bytes[64], double *value) {
    uint32_t bits = get_u32(bytes);
    float real;
    switch (type) {
    case WIRE_VALUE_TYPE_U8:
        *value = get_u8(bytes);
        return true;
    case WIRE_VALUE_TYPE_U16:
        *value = get_u16(bytes);
        return true;
    case WIRE_VALUE_TYPE_U32:
        *value = bits;
        return true;
    case WIRE_VALUE_TYPE_I32:
        *value = get_i32(bytes);
        return true;
    case WIRE_VALUE_TYPE_FLOAT:
        memcpy(&real, &bits, sizeof real);
        *value = (double)real;
        return real - real == 0.0f; /* neither infinity nor NaN */
    default:
        return false;
    }
}

static bool is_target(const struct session *session, const struct session_key *row) {
    return session->options.device != NULL && (row->kind == KEY_TARGET || row->kind == KEY_PIN);
}

static double value_of(const struct session *session, const struct session_key *row, uint16_t key) {
    const struct channels *channels = session->options.channels;
    unsigned axis = row->as == KEY_AS_MASK_NONE ? 0 : (unsigned)(key - row->key);
    uint8_t decimals;
    double value = row->fallback;
    uint32_t number;
    if (is_target(session, row) && device_get(session->options.device, key, &number))
        value = number;
    else if (row->kind == KEY_SETTING)
        (void)settings_get(session->settings, (uint16_t)(row->number + axis), AXIS_COUNT, &value, &decimals);
    else if (row->kind == KEY_STORED && channels != NULL)
        value = channels->config.value[channels_find(key)];
    else if (row->kind == KEY_STATE && session_is_module(session))
        value = channels->faults;
    return to_wire(session, row, key, value);
}

void config_get(const struct session *session, uint16_t key, struct wire_config_value *value) {
    const struct session_key *row = row_of(key);
    value->key = key;
    value->value_type = row != NULL ? row->type : WIRE_VALUE_TYPE_U32;
    if (row != NULL && row->type == WIRE_VALUE_TYPE_STRING && is_target(session, row) &&
        device_get_text(session->options.device, key, (char *)value->value))
        return;
    encode(value->value_type, row != NULL ? value_of(session, row, key) : 0.0, value->value);
}

static enum wire_refusal set_stored(const struct session *session, uint16_t key, double value) {
    struct channels *channels = session->options.channels;
    if (channels == NULL)
        return WIRE_REFUSAL_READ_ONLY;
    if (!(value >= 0.0 && value <= (double)UINT16_MAX))
        return WIRE_REFUSAL_RANGE;
    /* Not effective yet: pins are set one by one, and config_save() checks the configuration as a whole. */
    bool good = channels_set_value(channels, channels_find(key), (uint32_t)value);
    return good ? WIRE_REFUSAL_NONE : WIRE_REFUSAL_RANGE;
}

static enum wire_refusal device_refusal(enum device_answer answer) {
    static const uint8_t refusals[] = {
        [DEVICE_DONE] = WIRE_REFUSAL_NONE,       [DEVICE_UNKNOWN] = WIRE_REFUSAL_READ_ONLY,
        [DEVICE_FIXED] = WIRE_REFUSAL_READ_ONLY, [DEVICE_RANGE] = WIRE_REFUSAL_RANGE,
        [DEVICE_PIN] = WIRE_REFUSAL_PIN,         [DEVICE_NOT_STORED] = WIRE_REFUSAL_NOT_STORED};
    return (enum wire_refusal)refusals[answer];
}

/* Staged: pins are set one by one, and config_save() checks them as a whole. */
static enum wire_refusal set_target(const struct session *session, const struct session_key *row,
                                    const struct wire_config_set *set) {
    struct device *device = session->options.device;
    double value;
    if (device == NULL)
        return WIRE_REFUSAL_READ_ONLY;
    if (!session_is_module(session)) {
        enum refusal busy = action_may(session->machine, ACTION_STORE, ACTOR_HOST);
        if (busy != REFUSAL_NONE)
            return session_refusal(busy);
    }
    if (row->type == WIRE_VALUE_TYPE_STRING)
        return set->value_type == row->type
                   ? device_refusal(device_set_text(device, set->key, (const char *)set->value))
                   : WIRE_REFUSAL_RANGE;
    if (!decode(set->value_type, set->value, &value) || value != floor(value) || value < 0.0 ||
        value > (double)UINT32_MAX)
        return WIRE_REFUSAL_RANGE;
    return device_refusal(device_set(device, set->key, (uint32_t)value));
}

static enum status set_setting(const struct session *session, uint16_t number, double value) {
    if (session_is_module(session))
        return settings_set(&session->module->settings, number, value, session->module->axis_count);
    return action_set(session->machine, ACTOR_HOST, number, value);
}

/* Speeds and ways are whole on the wire only: they are kept in mm, with their fractions. */
static bool loses_fraction(const struct session_key *row, double value) {
    bool in_steps = row->as == KEY_AS_STEPS || row->as == KEY_AS_STEPS_S || row->as == KEY_AS_STEPS_S2;
    return row->type != WIRE_VALUE_TYPE_FLOAT && !in_steps && value != floor(value);
}

enum wire_refusal config_set(const struct session *session, const struct wire_config_set *set) {
    const struct session_key *row = row_of(set->key);
    double value;
    if (row == NULL)
        return WIRE_REFUSAL_UNKNOWN_KEY;
    if (row->kind == KEY_TARGET || row->kind == KEY_PIN)
        return set_target(session, row, set);
    if (row->kind != KEY_SETTING && row->kind != KEY_STORED)
        return WIRE_REFUSAL_READ_ONLY;
    if (!decode(set->value_type, set->value, &value) || loses_fraction(row, value))
        return WIRE_REFUSAL_RANGE;
    if (row->kind == KEY_STORED)
        return set_stored(session, set->key, value);
    if (row->as == KEY_AS_PWM_HZ && !has_pwm(session) && !session_is_module(session))
        return WIRE_REFUSAL_NO_OUTPUT;
    /* A mask of all axes is one setting with one key (count 1), so the difference is an axis or 0. */
    uint16_t number = (uint16_t)(row->number + (set->key - row->key));
    return session_refusal(
        refusal_of(set_setting(session, number, from_wire(session, row, set->key, value))));
}

static bool save_settings(const struct session *session) {
    if (!session_is_module(session))
        return action_save(session->machine);
    const struct session_module *module = session->module;
    return store_save_settings(&module->store, &module->settings);
}

static enum wire_refusal save_device(const struct session *session) {
    struct device *device = session->options.device;
    if (device == NULL || !device_differs(device))
        return WIRE_REFUSAL_NONE;
    return device_refusal(device_save(device, session->now_us));
}

/* Channels, pins or a network that cannot be are refused as a whole, and nothing is kept. */
enum wire_refusal config_save(const struct session *session) {
    struct channels *channels = session->options.channels;
    if (channels != NULL && channels_faults(channels) != 0)
        return WIRE_REFUSAL_PIN;
    enum wire_refusal refusal = save_device(session);
    if (refusal != WIRE_REFUSAL_NONE)
        return refusal;
    /* Both are written whatever becomes of the first, so that the reply is about all of it. */
    bool kept = save_settings(session);
    if (channels != NULL)
        kept = channels->ops->keep(channels->ctx, &channels->config) && kept;
    if (session_is_module(session))
        channels_apply(channels);
    return kept ? WIRE_REFUSAL_NONE : WIRE_REFUSAL_NOT_STORED;
}
