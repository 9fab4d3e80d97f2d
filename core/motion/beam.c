/* SPDX-License-Identifier: MIT */
#include "motion/beam.h"

uint16_t beam_duty(const struct beam *beam, float rpm, float v_mm_s, float feed_mm_s) {
    float part = 1.0f, full_mm_s = feed_mm_s * beam->feed_part;
    bool scales = beam->with_speed && beam->range.max_rpm > beam->range.min_rpm; /* else it is on or off */
    if (!beam->on)
        return 0;
    if (scales && v_mm_s < full_mm_s)
        part = v_mm_s / full_mm_s;
    return duty_of(&beam->range, duty_limit_rpm(&beam->range, rpm * beam->factor * part));
}

bool beam_is_same(const struct beam *a, const struct beam *b) {
    return a->on == b->on && a->with_speed == b->with_speed && a->factor == b->factor &&
           a->feed_part == b->feed_part && a->rise_s == b->rise_s && a->range.min_rpm == b->range.min_rpm &&
           a->range.max_rpm == b->range.max_rpm;
}
