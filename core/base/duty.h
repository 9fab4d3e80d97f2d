/* SPDX-License-Identifier: MIT
 * From S to the duty of the PWM output, and back: $30 and $31. [any] Pure.
 *
 * $31 is the least S that anything is made of, and has the least duty above 0; $30 is full duty. Where both
 * are alike the output is on or off. */
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

/** What a PWM's register shows for a duty of 0, 1 and DUTY_FULL; between the last two it is linear, up or
 * down. All 0: there is no PWM. */
struct duty_register {
    uint16_t dark, least, full;
};

/** @param duty  0 .. DUTY_FULL */
uint16_t duty_to_register(const struct duty_register *pwm, uint32_t duty);

/** @return 0 .. DUTY_FULL */
uint16_t duty_from_register(const struct duty_register *pwm, uint16_t value);

#endif
