/* SPDX-License-Identifier: MIT
 * The settings: $N of Grbl, one struct in readable units. [task] No state: the machine owns the struct.
 *
 *   protocol/settings.toml --generate--> struct settings, the descriptor table, docs/settings.md
 *
 * This file knows numbers, ranges and the rules between settings. What a board can do (step rate, PWM for
 * laser mode) is checked by the machine.
 *
 * settings/store.h keeps them over a power cut. */
#ifndef WIFICNC_SETTINGS_SETTINGS_H
#define WIFICNC_SETTINGS_SETTINGS_H

#include "base/duty.h"
#include "gcode/status.h"
#include "settings/settings_gen.h" // struct settings

#include <stdbool.h>
#include <stdint.h>

/** Every setting to its default. */
void settings_defaults(struct settings *settings);

/** $number=value. As in Grbl, whole-number settings drop the fraction, and 1..255 switch a bool on.
 *  Rules between settings: $20=1 needs $22=1; $22=0 also switches $20 off. $32=1 needs $34=0, and $36 is at
 *  least 1 above $35; $94 to $97 ascend.
 *  @param axis_count 0 .. AXIS_COUNT: settings of further axes do not exist.
 *  @return STATUS_OK, or one of these, and then nothing has changed:
 *          STATUS_UNKNOWN_COMMAND          no such setting
 *          STATUS_NEGATIVE                 below 0
 *          STATUS_STEP_PULSE_SHORT         $0 below 3
 *          STATUS_SOFT_LIMIT_NEEDS_HOMING  $20=1 while $22=0
 *          STATUS_LASER_LEAVES_ON          $32=1 with $34 above 0
 *          STATUS_PWM_RANGE                $35 not 1 below $36
 *          STATUS_LASER_CURVE              $94 to $97 would not ascend
 *          STATUS_MICROSTEPS               $150 .. is no power of two
 *          STATUS_BAD_NUMBER               out of range in any other way; NaN, infinity */
enum status settings_set(struct settings *settings, uint16_t number, double value, uint8_t axis_count);

/** The value behind $number, and the decimals that the $$ report prints of it.
 *  @return false and nothing written: no such setting. */
bool settings_get(const struct settings *settings, uint16_t number, uint8_t axis_count, double *value,
                  uint8_t *decimals);

/** $31 and $30. */
static inline struct duty_range settings_duty_range(const struct settings *settings) {
    return (struct duty_range){settings->spindle_min_rpm, settings->spindle_max_rpm};
}

/** What $number affects: enum setting_effect, added up. 0: no such setting. */
unsigned settings_effects(uint16_t number);

/** Do settings with one of these effects differ? */
bool settings_differ(const struct settings *a, const struct settings *b, unsigned effects);

/** Where a walk through all settings begins. */
enum { SETTINGS_BEGIN = UINT16_MAX };

/** The next setting in ascending order, the order of $$:
 *  `uint16_t number = SETTINGS_BEGIN; while (settings_next(&number, axis_count)) ...`
 *  @return false and *number unchanged: that was the last one. */
bool settings_next(uint16_t *number, uint8_t axis_count);

#endif
