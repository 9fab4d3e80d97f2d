/* SPDX-License-Identifier: MIT
 * Settings by number: find the row of the descriptor table, check the value, keep it. */
#include "settings/settings.h"
#include "settings/settings_table.h"

#include <stddef.h> // NULL
#include <string.h> // memcpy

/* Grbl keeps a bool in a byte and takes any byte but 0 for on; exports of grblHAL have masks there. */
enum { BOOL_INPUT_MAX = 255 };

/** Settings of a row on a machine of axis_count axes. */
static uint8_t row_count(const struct setting_row *row, uint8_t axis_count) {
    return row->count > 1 && axis_count < row->count ? axis_count : row->count;
}

/** @return the row that holds $number on a machine of axis_count axes, or NULL. */
static const struct setting_row *row_find(uint16_t number, uint8_t axis_count) {
    for (const struct setting_row *row = setting_rows; row < setting_rows + SETTINGS_ROW_COUNT; row++) {
        if (number >= row->number && number - row->number < row_count(row, axis_count)) {
            return row;
        }
    }
    return NULL;
}

/** What the field of this row makes of a value, or why it cannot be. @return STATUS_OK and *kept written. */
static enum status row_check(const struct setting_row *row, double value, float *kept) {
    if (value < 0.0) {
        return STATUS_NEGATIVE;
    }
    /* So written that NaN ends here too. Below this bound both casts are defined. */
    if (!(value <= (double)UINT32_MAX)) {
        return STATUS_BAD_NUMBER;
    }
    const float rounded = row->type == SETTING_TYPE_FLOAT ? (float)value : (float)(uint32_t)value;
    if (rounded < row->min) {
        return (enum status)row->below;
    }
    if (rounded > (row->type == SETTING_TYPE_BOOL ? (float)BOOL_INPUT_MAX : row->max)) {
        return STATUS_BAD_NUMBER;
    }
    *kept = rounded + 0.0F; /* makes 0 of -0, which would be printed with its sign */
    return STATUS_OK;
}

/* Every value fits a float exactly: the whole types have 16 bits at most. */

static void field_write(struct settings *settings, const struct setting_row *row, uint8_t index,
                        float value) {
    void *field = (unsigned char *)settings + row->offset;
    bool *flags = field;
    uint8_t *bytes = field;
    uint16_t *words = field;
    float *floats = field;
    switch ((enum setting_type)row->type) {
    case SETTING_TYPE_BOOL:
        flags[index] = value >= 1.0F;
        break;
    case SETTING_TYPE_U8:
        bytes[index] = (uint8_t)value;
        break;
    case SETTING_TYPE_U16:
        words[index] = (uint16_t)value;
        break;
    case SETTING_TYPE_FLOAT:
        floats[index] = value;
        break;
    }
}

static float field_read(const struct settings *settings, const struct setting_row *row, uint8_t index) {
    const void *field = (const unsigned char *)settings + row->offset;
    const bool *flags = field;
    const uint8_t *bytes = field;
    const uint16_t *words = field;
    const float *floats = field;
    switch ((enum setting_type)row->type) {
    case SETTING_TYPE_BOOL:
        return flags[index] ? 1.0F : 0.0F;
    case SETTING_TYPE_U8:
        return bytes[index];
    case SETTING_TYPE_U16:
        return words[index];
    case SETTING_TYPE_FLOAT:
        break;
    }
    return floats[index];
}

void settings_defaults(struct settings *settings) {
    for (const struct setting_row *row = setting_rows; row < setting_rows + SETTINGS_ROW_COUNT; row++) {
        for (uint8_t index = 0; index < row->count; index++) {
            field_write(settings, row, index, row->fallback);
        }
    }
}

/* What off, least and full duty may be together, and with a laser. */
static enum status pwm_check(const struct settings *settings) {
    if (settings->laser_mode && settings->pwm_off_pct > 0.0F) {
        return STATUS_LASER_LEAVES_ON;
    }
    const bool apart = settings->pwm_max_pct - settings->pwm_min_pct >= 1.0F; /* ten levels at least */
    return apart ? STATUS_OK : STATUS_PWM_RANGE;
}

/* A drive has no beam. */
static enum status spindle_check(const struct settings *settings) {
    return settings->laser_mode && settings->spindle_type != 0 ? STATUS_VFD_LASER : STATUS_OK;
}

/* More duty burns more. */
static enum status curve_check(const struct settings *settings) {
    const bool ascends = settings->laser_curve_20_pct < settings->laser_curve_40_pct &&
                         settings->laser_curve_40_pct < settings->laser_curve_60_pct &&
                         settings->laser_curve_60_pct < settings->laser_curve_80_pct;
    return ascends ? STATUS_OK : STATUS_LASER_CURVE;
}

static bool is_per_axis(uint16_t number, uint16_t first) {
    return number >= first && number - first < AXIS_COUNT;
}

static bool is_power_of_two(double value) {
    const uint32_t whole = (uint32_t)value;
    return (whole & (whole - 1U)) == 0;
}

enum status settings_set(struct settings *settings, uint16_t number, double value, uint8_t axis_count) {
    const struct setting_row *row = row_find(number, axis_count);
    if (row == NULL) {
        return STATUS_UNKNOWN_COMMAND;
    }
    float kept = 0.0F;
    const enum status status = row_check(row, value, &kept);
    if (status != STATUS_OK) {
        return status;
    }
    if (is_per_axis(number, SETTING_DRIVER_MICROSTEPS) && !is_power_of_two((double)kept)) {
        return STATUS_MICROSTEPS;
    }
    /* A copy, so that a rule between settings can refuse the value and nothing has changed. */
    struct settings next;
    memcpy(&next, settings, sizeof next);
    field_write(&next, row, (uint8_t)(number - row->number), kept);
    /* Without homing no one knows where the machine is: a soft limit would stop it in the wrong place. */
    if (next.soft_limits && !settings->homing) {
        return STATUS_SOFT_LIMIT_NEEDS_HOMING;
    }
    /* As in Grbl, $22=0 also switches $20 off. */
    next.soft_limits = next.soft_limits && next.homing;
    enum status rule = pwm_check(&next);
    if (rule == STATUS_OK) {
        rule = curve_check(&next);
    }
    if (rule == STATUS_OK) {
        rule = spindle_check(&next);
    }
    if (rule != STATUS_OK) {
        return rule;
    }
    memcpy(settings, &next, sizeof next);
    return STATUS_OK;
}

bool settings_get(const struct settings *settings, uint16_t number, uint8_t axis_count, double *value,
                  uint8_t *decimals) {
    const struct setting_row *row = row_find(number, axis_count);
    if (row == NULL) {
        return false;
    }
    *value = (double)field_read(settings, row, (uint8_t)(number - row->number));
    *decimals = row->decimals;
    return true;
}

unsigned settings_effects(uint16_t number) {
    const struct setting_row *row = row_find(number, AXIS_COUNT);
    return row == NULL ? 0U : row->affects;
}

bool settings_differ(const struct settings *a, const struct settings *b, unsigned effects) {
    for (const struct setting_row *row = setting_rows; row < setting_rows + SETTINGS_ROW_COUNT; row++) {
        for (uint8_t index = 0; (row->affects & effects) != 0 && index < row->count; index++) {
            if (field_read(a, row, index) != field_read(b, row, index)) {
                return true;
            }
        }
    }
    return false;
}

bool settings_next(uint16_t *number, uint8_t axis_count) {
    const uint16_t from = (uint16_t)(*number + 1U); /* SETTINGS_BEGIN wraps to 0 */
    for (const struct setting_row *row = setting_rows; row < setting_rows + SETTINGS_ROW_COUNT; row++) {
        const uint16_t candidate = from > row->number ? from : row->number;
        if (candidate - row->number < row_count(row, axis_count)) {
            *number = candidate;
            return true;
        }
    }
    return false;
}
