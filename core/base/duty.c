/* SPDX-License-Identifier: MIT */
#include "base/duty.h"

#include "base/minmax.h"

float duty_limit_rpm(const struct duty_range *range, float rpm) {
    if (rpm <= 0.0f)
        return 0.0f;
    if (range->max_rpm <= range->min_rpm) /* on or off, nothing between */
        return range->max_rpm;
    return max_f(min_f(rpm, range->max_rpm), range->min_rpm);
}

uint16_t duty_of(const struct duty_range *range, float rpm) {
    float width_rpm = range->max_rpm - range->min_rpm;
    if (rpm <= 0.0f)
        return 0;
    if (width_rpm <= 0.0f)
        return DUTY_FULL;
    float duty = (rpm - range->min_rpm) / width_rpm * (float)DUTY_FULL + 0.5f;
    return (uint16_t)max_f(min_f(duty, (float)DUTY_FULL), 1.0f);
}

float duty_rpm(const struct duty_range *range, uint16_t duty) {
    float width_rpm = range->max_rpm - range->min_rpm;
    if (duty == 0)
        return 0.0f;
    if (width_rpm <= 0.0f)
        return range->max_rpm;
    return range->min_rpm + (float)duty * (1.0f / (float)DUTY_FULL) * width_rpm;
}

uint16_t duty_to_register(const struct duty_register *pwm, uint32_t duty) {
    const uint32_t up = pwm->full - pwm->least, down = pwm->least - pwm->full; /* one of them wraps */
    if (duty == 0)
        return pwm->dark;
    if (pwm->full < pwm->least)
        return (uint16_t)(pwm->least - (duty - 1) * down / (DUTY_FULL - 1));
    return (uint16_t)(pwm->least + (duty - 1) * up / (DUTY_FULL - 1));
}

uint16_t duty_from_register(const struct duty_register *pwm, uint16_t value) {
    const uint32_t up = pwm->full - pwm->least, down = pwm->least - pwm->full;
    if (value == pwm->dark || up == 0)
        return 0;
    if (pwm->full < pwm->least)
        return (uint16_t)(1 + (uint32_t)(pwm->least - value) * (DUTY_FULL - 1) / down);
    return (uint16_t)(1 + (uint32_t)(value - pwm->least) * (DUTY_FULL - 1) / up);
}
