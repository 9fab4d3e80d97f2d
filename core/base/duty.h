/* SPDX-License-Identifier: MIT
 * From S to the duty of the PWM output, and back: $30, $31 and $34 to $36. [any] Pure.
 *
 * $31 is the least S that anything is made of, and has the least duty above 0; $30 is full duty. Where both
 * are alike the output is on or off.
 *
 *   S    --duty_of()-->    0, 1 .. DUTY_FULL    --duty_to_register()-->    what the PWM's register shows
 *
 * A laser's duty is the power that it burns with until duty_for_power() makes it what the PWM needs for that.
 *
 * What the register shows for the three of them is $34, $35 and $36: duty_register_within(). */
#ifndef WIFICNC_BASE_DUTY_H
#define WIFICNC_BASE_DUTY_H

#include <stdint.h>

enum { DUTY_FULL = 65535 };

/** $31 and $30. */
struct duty_range {
    float min_rpm, max_rpm; /* >= 0 */
};

/** @return S within the range, rpm; 0 stays 0, and less than 0 is 0 */
float duty_limit_rpm(const struct duty_range *range, float rpm);

/** @param rpm  as duty_limit_rpm() returns it @return 0 .. DUTY_FULL; 0 for 0 rpm alone */
uint16_t duty_of(const struct duty_range *range, float rpm);

/** @return S that has this duty, rpm */
float duty_rpm(const struct duty_range *range, uint16_t duty);

/** Pieces of equal power that a laser's curve is made of, and the power of one. */
enum { CURVE_PIECES = 5, CURVE_PIECE = DUTY_FULL / CURVE_PIECES };
_Static_assert(CURVE_PIECE *CURVE_PIECES == DUTY_FULL, "a straight curve changes nothing");

/** A laser's power is not proportional to its duty: the duties of 1/5 .. 4/5 of full power, $94 to $97. They
 * ascend; between them the curve is linear, from 0 to DUTY_FULL. */
struct duty_curve {
    uint16_t at[CURVE_PIECES - 1];
};

/** @param pct  % of full duty, ascending */
struct duty_curve duty_curve_of(const uint8_t pct[CURVE_PIECES - 1]);

/** @param power  0 .. DUTY_FULL @return duty that burns with it; 0 for 0 alone */
uint16_t duty_for_power(const struct duty_curve *curve, uint32_t power);

/** @return power of this duty */
uint16_t duty_power(const struct duty_curve *curve, uint16_t duty);

/** What a PWM's register shows for a duty of 0, 1 and DUTY_FULL; between the last two it is linear, up or
 * down. All 0: there is no PWM. */
struct duty_register {
    uint16_t dark, least, full;
};

/** What is left of a chip's range. @param off, least, full  $34, $35, $36: % of the period. 0, 0 and 100 are
 * the chip's own dark, least and full; off is exactly dark for 0 alone */
struct duty_register duty_register_within(const struct duty_register *chip, float off_pct, float least_pct,
                                          float full_pct);

/** @param duty  0 .. DUTY_FULL */
uint16_t duty_to_register(const struct duty_register *pwm, uint32_t duty);

/** @return 0 .. DUTY_FULL */
uint16_t duty_from_register(const struct duty_register *pwm, uint16_t value);

#endif
