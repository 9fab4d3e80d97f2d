/* SPDX-License-Identifier: MIT */
#include "motion/spindle.h"

#include "base/minmax.h"

#include <math.h>

#define TAU_S     0.006f /* memory of the filter: shorter than an axis needs to follow anyway */
#define LONG_US   10000000u
#define OVERDUE   1.5f  /* counts that a spindle may be late with before it is taken for slower */
#define MIN_REV_S 0.01f /* slower is standing */

void spindle_reset(struct spindle *spindle, float per_rev) {
    *spindle = (struct spindle){.per_rev = per_rev};
}

/* The first edge gives a place, the second a speed, and from then on both are filtered. Going down, an edge
 * lies at the upper end of the count that begins there. */
static void follow_edge(struct spindle *spindle, int32_t change, float dt_s) {
    float measured = (float)(change < 0);
    if (spindle->edges < 2 || dt_s <= 0.0f) {
        bool second = spindle->edges == 1 && dt_s > 0.0f;
        spindle->rate = second ? (float)change / dt_s : spindle->rate;
        spindle->edges = second || spindle->edges == 2 ? 2 : 1;
        spindle->ahead = measured;
        return;
    }
    float predicted = spindle->ahead - (float)change + spindle->rate * dt_s;
    float wrong = measured - predicted, keep = TAU_S / (TAU_S + dt_s), gain = 1.0f - keep;
    spindle->ahead = predicted + (1.0f - keep * keep) * wrong;
    spindle->rate += gain * gain / dt_s * wrong;
}

static void watch_steadiness(struct spindle *spindle, uint32_t now_us) {
    float rate = spindle_rev_s(spindle, now_us) * spindle->per_rev;
    if (fabsf(rate - spindle->mark_rate) <= SPINDLE_STEADY_PART * fabsf(spindle->mark_rate))
        return;
    spindle->mark_rate = rate;
    spindle->mark_us = now_us;
}

void spindle_take(struct spindle *spindle, int32_t counts, uint32_t edge_us, uint32_t now_us) {
    int32_t change = (int32_t)((uint32_t)counts - (uint32_t)spindle->counts);
    if (now_us - spindle->edge_us > LONG_US && now_us - edge_us < LONG_US)
        spindle->edges = 0;
    if (change != 0) {
        follow_edge(spindle, change, (float)(int32_t)(edge_us - spindle->edge_us) * 1e-6f);
        spindle->total += change;
        spindle->counts = counts;
        spindle->edge_us = edge_us;
    } else if (now_us - spindle->edge_us > LONG_US) {
        spindle->edges = 0;
        spindle->edge_us = now_us - LONG_US;
    }
    watch_steadiness(spindle, now_us);
}

void spindle_set_zero(struct spindle *spindle, int32_t counts) {
    spindle->zero = spindle->total + (int32_t)((uint32_t)counts - (uint32_t)spindle->counts);
}

/* Counts/s, no more than an overdue edge allows. */
static float rate_now(const struct spindle *spindle, uint32_t now_us) {
    float idle_s = (float)(now_us - spindle->edge_us) * 1e-6f;
    float late = fabsf(spindle->rate) * idle_s;
    if (spindle->edges < 2)
        return 0.0f;
    return late > OVERDUE ? spindle->rate * (OVERDUE / late) : spindle->rate;
}

float spindle_rev_s(const struct spindle *spindle, uint32_t now_us) {
    if (spindle->per_rev <= 0.0f)
        return 0.0f;
    float rev_s = rate_now(spindle, now_us) / spindle->per_rev;
    return fabsf(rev_s) < MIN_REV_S ? 0.0f : rev_s;
}

/* Counts beyond `total`. */
static double ahead_at(const struct spindle *spindle, uint32_t at_us, uint32_t now_us) {
    float since_s = (float)(int32_t)(at_us - spindle->edge_us) * 1e-6f;
    return (double)(spindle->ahead + rate_now(spindle, now_us) * since_s);
}

double spindle_revs(const struct spindle *spindle, uint32_t at_us, uint32_t now_us) {
    double counts = (double)(spindle->total - spindle->zero) + ahead_at(spindle, at_us, now_us);
    return counts / (double)spindle->per_rev;
}

double spindle_turns(const struct spindle *spindle, int32_t index_counts, uint32_t now_us) {
    const int64_t per_rev = (int64_t)spindle->per_rev;
    int64_t index = spindle->total + (int32_t)((uint32_t)index_counts - (uint32_t)spindle->counts);
    int64_t phase = (index % per_rev + per_rev) % per_rev;
    return ((double)(spindle->total - phase) + ahead_at(spindle, now_us, now_us)) / (double)per_rev;
}

void spindle_disturb(struct spindle *spindle, uint32_t now_us) {
    spindle->mark_us = now_us;
}

bool spindle_is_steady(const struct spindle *spindle, uint32_t now_us) {
    return spindle_rev_s(spindle, now_us) != 0.0f && now_us - spindle->mark_us >= SPINDLE_STEADY_US;
}
