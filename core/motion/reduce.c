/* SPDX-License-Identifier: MIT */
#include "motion/reduce.h"

#include <string.h>

void reduce_reset(struct reduce *reduce, const double position_mm[AXIS_COUNT]) {
    memcpy(reduce->anchor_mm, position_mm, sizeof reduce->anchor_mm);
    reduce->open = reduce->aimed = false;
}

VEC_INLINE vec from_anchor(const struct reduce *reduce, const double point_mm[AXIS_COUNT]) {
    vec out = {0};
    for (unsigned ax = 0; ax < CORE_AXES; ax++)
        out[ax] = (float)(point_mm[ax] - reduce->anchor_mm[ax]);
    return out;
}

/* Keep a ball inside the intersection of the present one with the ball (unit, radius), whose middles lie
 * `apart`: the smaller one if it is inside the other, or the ball that touches both borders of the lens. */
VEC_INLINE void narrow(struct reduce *reduce, vec off, float apart, float radius) {
    if (apart + radius <= reduce->radius) {
        reduce->middle += off;
        reduce->radius = radius;
    } else if (apart + reduce->radius > radius) {
        reduce->middle += off * (0.5f * (apart - radius + reduce->radius) / apart);
        reduce->radius = 0.5f * (reduce->radius + radius - apart);
    }
}

bool reduce_accepts(struct reduce *reduce, const double point_mm[AXIS_COUNT], float tolerance_mm,
                    float longest_mm) {
    vec chord = from_anchor(reduce, point_mm);
    float distance_mm = vec_length(chord);
    if (reduce->open && distance_mm > longest_mm)
        return false;
    if (distance_mm <= tolerance_mm) {
        if (reduce->aimed) /* back at the start */
            return false;
    } else {
        float radius = tolerance_mm / distance_mm;
        vec off = chord * (1.0f / distance_mm) - reduce->middle;
        if (reduce->aimed) {
            if (distance_mm < reduce->reach_mm - 0.5f * tolerance_mm)
                return false;
            float apart = vec_length(off);
            if (apart > reduce->radius)
                return false;
            narrow(reduce, off, apart, radius);
        } else {
            reduce->middle += off;
            reduce->radius = radius;
            reduce->aimed = true;
        }
    }
    reduce->reach_mm = reduce->open ? max_f(reduce->reach_mm, distance_mm) : distance_mm;
    if (!reduce->open)
        reduce->dropped = 0;
    else if (++reduce->dropped <= REDUCE_KEPT)
        reduce->kept[reduce->dropped - 1] = reduce->chord;
    reduce->open = true;
    reduce->chord = chord;
    return true;
}

float reduce_away_mm(const struct reduce *reduce, float length_mm, float tolerance_mm) {
    if (reduce->dropped > REDUCE_KEPT)
        return tolerance_mm;
    const vec unit = reduce->chord * (1.0f / length_mm);
    float most_sq = 0.0f;
    for (uint32_t i = 0; i < reduce->dropped; i++) {
        const vec point = reduce->kept[i];
        float along_mm = max_f(0.0f, min_f(vec_dot(point, unit), length_mm));
        const vec away = point - unit * along_mm;
        most_sq = max_f(most_sq, vec_dot(away, away));
    }
    return min_f(sqrtf(most_sq), tolerance_mm);
}

void reduce_close(struct reduce *reduce) {
    for (unsigned ax = 0; ax < CORE_AXES; ax++)
        reduce->anchor_mm[ax] += (double)reduce->chord[ax];
    reduce->open = reduce->aimed = false;
}
