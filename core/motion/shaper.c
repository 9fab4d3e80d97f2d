/* SPDX-License-Identifier: MIT */
#include "motion/shaper.h"

#include "base/minmax.h"
#include "base/pow.h"
#include "base/trig.h"

#include <math.h>
#include <string.h>

#define SAMPLE_S 0.002f /* or as much longer as the window must have */
#define EI_LEFT  0.05   /* EI, two-hump EI: of the vibration, at the frequency itself */

/* K: what is left of a vibration after half a period of it. */
static double left_after(double periods, double damping) {
    return power_exp(-2.0 * TRIG_PI * periods * damping / sqrt(1.0 - damping * damping));
}

/* Weights before they are made to sum 1, for times that are these parts of the damped period. */
struct recipe {
    uint8_t count;
    double period[SHAPER_TAPS], weight[SHAPER_TAPS];
};

static struct recipe recipe_of(enum shaper_kind kind) {
    const double v = EI_LEFT, root = 0.70710678118654752440; /* 1 / sqrt(2) */
    if (kind == SHAPER_ZV)
        return (struct recipe){2, {0.0, 0.5}, {1.0, 1.0}};
    if (kind == SHAPER_MZV)
        return (struct recipe){3, {0.0, 0.375, 0.75}, {1.0 - root, 2.0 * root - 1.0, 1.0 - root}};
    if (kind == SHAPER_EI)
        return (struct recipe){3, {0.0, 0.5, 1.0}, {(1.0 + v) / 4.0, (1.0 - v) / 2.0, (1.0 + v) / 4.0}};
    double square = v * v, x = power_raise(square * (sqrt(1.0 - square) + 1.0), 1.0 / 3.0);
    double first = (3.0 * x * x + 2.0 * x + 3.0 * square) / (16.0 * x);
    return (struct recipe){4, {0.0, 0.5, 1.0, 1.5}, {first, 0.5 - first, 0.5 - first, first}};
}

/* As if its first delay were 0. */
static struct shaper_row row_of(const struct shaper_mode *mode) {
    struct shaper_row row = {.count = 1, .weight = {1.0f}};
    if (mode->kind == SHAPER_OFF)
        return row;
    struct recipe recipe = recipe_of(mode->kind);
    double damping = (double)mode->damping, sum = 0.0;
    double period_s = 1.0 / ((double)mode->hz * sqrt(1.0 - damping * damping));
    for (unsigned i = 0; i < recipe.count; i++) {
        recipe.weight[i] *= left_after(recipe.period[i], damping);
        sum += recipe.weight[i];
    }
    float left = 1.0f;
    row.count = recipe.count;
    for (unsigned i = 0; i < recipe.count; i++) {
        row.delay_ns[i] = (uint32_t)(recipe.period[i] * period_s * 1e9 + 0.5);
        row.weight[i] = i + 1 < recipe.count ? (float)(recipe.weight[i] / sum) : left;
        left -= row.weight[i];
    }
    return row;
}

static float mean_delay_ns(const struct shaper_row *row) {
    float mean_ns = 0.0f;
    for (unsigned i = 0; i < row->count; i++)
        mean_ns += row->weight[i] * (float)row->delay_ns[i];
    return mean_ns;
}

static void set_spread(struct shaper_row *row) {
    float mean_ns = mean_delay_ns(row);
    row->spread_s2 = 0.0f;
    for (unsigned i = 0; i < row->count; i++) {
        float off_s = ((float)row->delay_ns[i] - mean_ns) * 1e-9f;
        row->spread_s2 += row->weight[i] * off_s * off_s;
    }
}

static bool is_same(const struct shaper_mode *a, const struct shaper_mode *b) {
    return a->kind == b->kind && (a->kind == SHAPER_OFF || (a->hz == b->hz && a->damping == b->damping));
}

/* An axis without a frequency of its own follows the first that has one: they stay together in all that they
 * do, and it does no harm. */
static struct shaper_mode mode_of(const struct motion_limits *limits, unsigned axis) {
    struct shaper_mode mode = limits->shaper[axis];
    for (unsigned ax = 0; ax < limits->axis_count && mode.kind == SHAPER_OFF; ax++)
        mode = limits->shaper[ax];
    return mode;
}

static void set_rows(struct shaper *shaper, const struct motion_limits *limits) {
    struct shaper_mode modes[CORE_AXES];
    shaper->row_count = 0;
    for (unsigned ax = 0; ax < CORE_AXES; ax++) {
        const struct shaper_mode mode = mode_of(limits, ax);
        unsigned row = 0;
        while (row < shaper->row_count && !is_same(&modes[row], &mode))
            row++;
        if (row == shaper->row_count) {
            modes[row] = mode;
            shaper->rows[row] = row_of(&mode);
            set_spread(&shaper->rows[row]);
            shaper->row_count++;
        }
        shaper->rows[row].lanes |= (uint8_t)(1u << ax);
    }
    shaper->rows[0].lanes |= 1u << SHAPER_PLACE;
}

/* The same mean delay for all. @return the longest delay */
static uint32_t align_rows(struct shaper *shaper) {
    float late_ns = 0.0f;
    uint32_t longest_ns = 0;
    for (unsigned row = 0; row < shaper->row_count; row++)
        late_ns = max_f(late_ns, mean_delay_ns(&shaper->rows[row]));
    for (unsigned n = 0; n < shaper->row_count; n++) {
        struct shaper_row *row = &shaper->rows[n];
        uint32_t wait_ns = (uint32_t)(late_ns - mean_delay_ns(row) + 0.5f);
        for (unsigned i = 0; i < row->count; i++) {
            row->delay_ns[i] += wait_ns;
            longest_ns = row->delay_ns[i] > longest_ns ? row->delay_ns[i] : longest_ns;
        }
    }
    shaper->late_ns = (uint32_t)late_ns + shaper->mean_ns / 2;
    return longest_ns;
}

void shaper_set(struct shaper *shaper, const struct motion_limits *limits, float mean_s, uint32_t samples) {
    memset(shaper, 0, sizeof *shaper);
    shaper->mean_ns = (uint32_t)(mean_s * 1e9f);
    set_rows(shaper, limits);
    shaper->sums = limits->coupled && shaper->row_count > 1;
    shaper->window_ns = align_rows(shaper) + shaper->mean_ns;
    shaper->sample_s = max_f(SAMPLE_S, (float)shaper->window_ns * 1e-9f / (float)samples);
}

float shaper_spread_s2(const struct shaper *shaper, unsigned axis) {
    float spread_s2 = 0.0f;
    for (unsigned n = 0; n < shaper->row_count; n++) {
        const struct shaper_row *row = &shaper->rows[n];
        bool mixed = shaper->sums && axis <= AXIS_Y && (row->lanes & 3u) != 0;
        if (mixed || (row->lanes >> axis & 1u) != 0)
            spread_s2 = max_f(spread_s2, row->spread_s2);
    }
    float mean_s = (float)shaper->mean_ns * 1e-9f;
    return spread_s2 + mean_s * mean_s * (1.0f / 12.0f);
}

float shaper_reach_s(const struct shaper *shaper) {
    uint32_t rest_ns = shaper->window_ns - shaper->late_ns;
    return (float)(shaper->late_ns > rest_ns ? shaper->late_ns : rest_ns) * 1e-9f;
}
