/* SPDX-License-Identifier: MIT
 * The motion side polled once a tick, as a task of an RTOS is, while the step interrupt takes its events when
 * they are due: the span ring never runs dry in motion, and the motion takes exactly its time. */
#include "hal/hal_step.h"
#include "segment/ring.h"
#include "step/isr.h"
#include "step/prep.h"

#include <stdio.h>

enum { TIMER_HZ = 20000000, TICK_NS = 1000000000 / TIMER_HZ };
enum { POLL_TICKS = TIMER_HZ / 1000 }; /* 1 ms */
enum { RAMP_SEGMENTS = 12, CRUISE_SEGMENTS = 60, SHAPES = 400 };

static struct trace_event events[2];
static struct hal_step hal;
static struct step step;
static struct segment_ring ring;
static struct prep prep;
static unsigned failures;

static uint32_t random_below(uint32_t below) {
    static uint64_t state = 88172645463325252u;
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (uint32_t)(state >> 16) % below;
}

/* One axis up to a speed, on at it and down again; all lengths in 1/256 step. */
struct motion {
    uint32_t speed_hz; /* of the cruise */
    uint32_t duration_ns;
    uint32_t phase;
    unsigned made;
    uint64_t total_ns;
};

/* Speed at the beginning of a segment as a part of the cruise's. */
static double part_at(unsigned segment) {
    const unsigned all = 2 * RAMP_SEGMENTS + CRUISE_SEGMENTS;
    unsigned from_end = all - segment, near = segment < from_end ? segment : from_end;
    return near < RAMP_SEGMENTS ? (double)near / RAMP_SEGMENTS : 1.0;
}

/* @return false: the motion has no further segment */
static bool next_segment(struct motion *motion, struct segment *out) {
    const unsigned all = 2 * RAMP_SEGMENTS + CRUISE_SEGMENTS;
    if (motion->made == all)
        return false;
    double from = part_at(motion->made), to = part_at(motion->made + 1);
    double mean = 0.5 * (from + to) * motion->speed_hz;
    uint32_t end = motion->phase + (uint32_t)(256.0 * mean * motion->duration_ns * 1e-9 + 0.5);
    *out = (struct segment){
        .steps = {(int16_t)(end >> 8)},
        .phase = {(uint8_t)motion->phase},
        .phase_end = {(uint8_t)end},
        .duration_ns = motion->duration_ns,
        .ramp = (int16_t)((to - from) / (to + from) * SEGMENT_RAMP_ONE),
        .flags = motion->made + 1 == all ? SEGMENT_LAST : 0,
    };
    motion->phase = end & 255u;
    motion->total_ns += motion->duration_ns;
    motion->made++;
    return true;
}

static void fill_ring(struct motion *motion) {
    struct segment segment;
    while (ring_free(&ring.index, SEGMENT_RING_SIZE) > 0 && next_segment(motion, &segment))
        (void)segment_ring_push(&ring, RING_OWNER_PLANNER, &segment);
}

/* All step events that are due before this time. @return time of the last of them */
static uint64_t run_events(uint64_t until_ticks) {
    uint64_t last_ticks = hal.now_ticks;
    while (step.active && hal.alarm_ticks < until_ticks) {
        last_ticks = hal.now_ticks = hal.alarm_ticks;
        hal.write = events;
        step_isr(&step);
    }
    hal.now_ticks = until_ticks;
    return last_ticks;
}

static void one_motion(uint32_t speed_hz, uint32_t duration_ns) {
    struct motion motion = {.speed_hz = speed_hz, .duration_ns = duration_ns, .phase = SEGMENT_PHASE_HALF};
    uint64_t begin = hal.now_ticks, end = begin;
    uint32_t underruns = step.underruns, clamped = prep.clamped;
    do {
        fill_ring(&motion);
        (void)prep_poll(&prep);
        end = run_events(hal.now_ticks + POLL_TICKS);
    } while (step.active || !prep_is_empty(&prep));
    int64_t late = (int64_t)(end - begin) - (int64_t)(motion.total_ns / TICK_NS);
    bool timely = prep.clamped != clamped || (late >= -1 && late <= 1);
    if (step.underruns != underruns || !timely)
        if (++failures <= 10)
            printf("%lu steps/s in segments of %lu us: the ring ran dry %lu times, %lld ticks late\n",
                   (unsigned long)speed_hz, (unsigned long)(duration_ns / 1000),
                   (unsigned long)(step.underruns - underruns), (long long)late);
}

int main(void) {
    const struct prep_timing timing = {.timer_hz = TIMER_HZ, .min_interval_ticks = 20, .dir_setup_ticks = 10};
    segment_ring_init(&ring);
    (void)segment_ring_claim(&ring, RING_OWNER_PLANNER);
    step_init(&step, &hal);
    prep_init(&prep, &ring, &step, &timing);
    one_motion(417, 12000000); /* G1 F100 at 250 steps/mm */
    for (unsigned shape = 0; shape < SHAPES; shape++)
        one_motion(20u << random_below(12), 1000000 + random_below(14000) * 1000);
    printf("%u of %u motions failed\n", failures, SHAPES + 1);
    return failures == 0 ? 0 : 1;
}
