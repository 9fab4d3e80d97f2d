/* SPDX-License-Identifier: MIT
 * Figures of a motion, taken from nothing but its step edges.
 *
 * Speed and acceleration: the position of each axis is interpolated linearly between events and looked at on
 * a grid of 1 ms that begins at the first event. With a box window of W = 10 ms
 *
 *     v(t) = (p(t + W/2) - p(t - W/2)) / W        a(t) = (v(t + W/2) - v(t - W/2)) / W
 *
 * and the figures are the largest |v| and |a| of the whole run, with standstill before and after. Nothing
 * shorter than W is resolved, and a single step is a jump: an axis in steady motion shows up to 1 step / W of
 * speed and 2 steps / W^2 of acceleration that are only rounding. Of an axis with few steps/mm that would be
 * more than its limit (250 mm/s^2 with 80 steps/mm in 10 ms). So its acceleration is measured over a longer
 * W: that in which it makes MEASURE_WINDOW_STEPS from rest at the acceleration expected of it, 10 to 100 ms.
 * Rounding is at most a tenth of that acceleration then, unless 100 ms were not enough.
 *
 * Memory is that of two windows, whatever the length of the run, plus the path samples if they are asked for.
 * Work per event is a few integer operations for every axis that steps; the window is checked once a
 * millisecond, and not at all in the middle of a long gap, where nothing can change. */
#ifndef WIFICNC_SIM_MEASURE_H
#define WIFICNC_SIM_MEASURE_H

#include "base/axis.h"
#include "trace.h"

/** A point of the path, for pictures. Positions and speed are means over the window above, so speed is what a
 * machinist calls the feed, all axes taken together as F does. */
struct path_sample {
    float t_s; /* since measure_begin() */
    float position_mm[AXIS_COUNT];
    float speed_mm_s;
    uint32_t rapid; /* how it was reached, 0 or 1; this wide so that no byte of a sample is undefined */
};

/** The most samples kept: where more would come, every second one is dropped and the interval doubles. */
enum { MEASURE_MAX_SAMPLES = 1 << 20 };

struct measured {
    uint64_t events;
    uint64_t cutting_ticks;          /* time between two events belongs to the flags of the later one; when */
    uint64_t rapid_ticks;            /* its dwell count differs, a dwell came between them: neither */
    uint64_t last_ticks;             /* of the last event */
    int64_t steps_total[AXIS_COUNT]; /* pulses, both directions */
    int32_t position_steps[AXIS_COUNT];
    int32_t min_steps[AXIS_COUNT], max_steps[AXIS_COUNT]; /* visited, the start included */
    uint64_t min_interval_ticks[AXIS_COUNT]; /* between two edges of the axis; 0: fewer than two */
    double max_speed_steps_s[AXIS_COUNT];
    double max_accel_steps_s2[AXIS_COUNT];
    double accel_window_s[AXIS_COUNT]; /* W of it */
};

struct measure;

/** @param timer_hz  >= 1 MHz. @return NULL when memory is short. All axes are at 0. */
struct measure *measure_create(uint32_t timer_hz);
void measure_destroy(struct measure *measure);

/** Time and figures start to count here, at the place where the machine is at rest now. @param steps_per_mm
 * for the samples, > 0 */
void measure_begin(struct measure *measure, uint64_t t_ticks, const double steps_per_mm[AXIS_COUNT]);

/** Steps from rest in the window of acceleration: W^2 a / 2, so that 2 steps / W^2 are a / 10. */
#define MEASURE_WINDOW_STEPS 10.0

/** The acceleration that an axis is allowed: it sets the axis' window. Before the first event; without it W
 * is 10 ms. */
void measure_expect_accel(struct measure *measure, int axis, double accel_steps_s2);

/** Keep a sample every interval_ms (rounded to whole ms, at least 1) while something moves; first and last
 * always. A standstill costs a few samples, however long it is. */
void measure_sample_every(struct measure *measure, double interval_ms);

/** A trace_consumer; ctx is the struct measure. */
void measure_events(void *ctx, const struct trace_event *events, size_t count);

/** The motion is over: look at what is left in the window. May be called again.
 * @param dwells  as trace_event has them; without a dwell since the last event the time until end_ticks is
 * motion */
void measure_end(struct measure *measure, uint64_t end_ticks, uint8_t dwells);

void measure_result(const struct measure *measure, struct measured *out);

/** The samples so far. @return how many; *out stays good until the next call of any other function. */
size_t measure_samples(const struct measure *measure, const struct path_sample **out);

/** @return 0, or 1: memory was too short for all samples. */
int measure_samples_lost(const struct measure *measure);

#endif
