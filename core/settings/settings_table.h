/* SPDX-License-Identifier: MIT
 * The descriptor of a setting. Private to core/settings: others ask settings.h. */
#ifndef WIFICNC_SETTINGS_SETTINGS_TABLE_H
#define WIFICNC_SETTINGS_SETTINGS_TABLE_H

#include "gcode/status.h"
#include "settings/settings_gen.h"

#include <stdint.h>

/** Type of the field. */
enum setting_type { SETTING_TYPE_BOOL, SETTING_TYPE_U8, SETTING_TYPE_U16, SETTING_TYPE_FLOAT };

/** One row of protocol/settings.toml. Limits are inclusive. */
struct setting_row {
    uint16_t number;  /* $N; of axis X in a per-axis row, the other axes follow */
    uint16_t offset;  /* of the field in struct settings; a per-axis field is an array */
    uint8_t type;     /* enum setting_type */
    uint8_t count;    /* 1, or AXIS_COUNT in a per-axis row */
    uint8_t decimals; /* of a float in the $$ report */
    uint8_t below;    /* enum status of a value below min */
    float min;
    float max;
    float fallback;   /* the default */
    uint16_t affects; /* enum setting_effect, added up */
};

/** Ascending by number. */
extern const struct setting_row setting_rows[SETTINGS_ROW_COUNT];

#endif
