/* SPDX-License-Identifier: MIT */
#include "base/duty.h"

#include "base/minmax.h"

#include <stdbool.h>

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

struct duty_curve duty_curve_of(const uint8_t pct[CURVE_PIECES - 1]) {
    struct duty_curve curve;
    for (unsigned i = 0; i < CURVE_PIECES - 1; i++)
        curve.at[i] = (uint16_t)((pct[i] * (uint32_t)DUTY_FULL + 50u) / 100u);
    return curve;
}

/* A piece lies between two duties: [0] at its start. */
static void piece_duties(const struct duty_curve *curve, uint32_t piece, uint32_t duty[2]) {
    duty[0] = piece > 0 ? curve->at[piece - 1] : 0u;
    duty[1] = piece < CURVE_PIECES - 1 ? curve->at[piece] : (uint32_t)DUTY_FULL;
}

uint16_t duty_for_power(const struct duty_curve *curve, uint32_t power) {
    uint32_t piece = power / CURVE_PIECE, duty[2];
    if (power >= DUTY_FULL)
        return DUTY_FULL;
    piece_duties(curve, piece, duty);
    uint32_t rise = (power - piece * CURVE_PIECE) * (duty[1] - duty[0]);
    return (uint16_t)(duty[0] + (rise + CURVE_PIECE - 1u) / CURVE_PIECE); /* up: no power becomes dark */
}

uint16_t duty_power(const struct duty_curve *curve, uint16_t duty) {
    uint32_t piece = 0, at[2];
    while (piece < CURVE_PIECES - 1 && duty > curve->at[piece])
        piece++;
    piece_duties(curve, piece, at);
    return (uint16_t)(piece * CURVE_PIECE + (duty - at[0]) * CURVE_PIECE / (at[1] - at[0]));
}

static uint16_t register_at(const struct duty_register *chip, float pct) {
    const float least = (float)chip->least, full = (float)chip->full;
    return (uint16_t)(least + (full - least) * pct * 0.01f + 0.5f);
}

struct duty_register duty_register_within(const struct duty_register *chip, float off_pct, float least_pct,
                                          float full_pct) {
    return (struct duty_register){.dark = off_pct > 0.0f ? register_at(chip, off_pct) : chip->dark,
                                  .least = register_at(chip, least_pct),
                                  .full = register_at(chip, full_pct)};
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
    bool falls = pwm->full < pwm->least;
    uint32_t count = (uint32_t)(falls ? pwm->least - value : value - pwm->least);
    uint32_t all = (uint32_t)(falls ? pwm->least - pwm->full : pwm->full - pwm->least);
    if (value == pwm->dark || all == 0)
        return 0;
    uint32_t least =
        1 + (count * (DUTY_FULL - 1) + all - 1) / all; /* of those that the register shows alike: */
    uint32_t middle = least + (DUTY_FULL - 1) / all / 2;
    return (uint16_t)(middle < DUTY_FULL ? middle : DUTY_FULL);
}
