/* SPDX-License-Identifier: MIT
 * Random segments through prep and the step ISR: steps exact, time exact, position true at every event. */
#include "hal/hal_step.h"
#include "segment/queue.h"
#include "step/isr.h"
#include "step/prep.h"
#include "step/prep_math.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROUNDS = 20000, TIMER_HZ = 20000000 };

static struct trace_event events[SEGMENT_MAX_STEPS * 8];
static struct hal_step hal;
static struct step step;
static struct segment_queue queue;
static struct prep prep;
static unsigned failures;

static uint32_t random_u32(void) {
    static uint64_t state = 88172645463325252u;
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (uint32_t)(state >> 16);
}

static void check(int good, const char *what, unsigned round) {
    if (!good && ++failures <= 10)
        printf("round %u: %s\n", round, what);
}

static struct segment random_segment(void) {
    struct segment segment = {.duration_ns = 1000000 + random_u32() % 9000000};
    uint32_t scale = 1 + (random_u32() % 4 == 0 ? random_u32() % SEGMENT_MAX_STEPS : random_u32() % 60);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        int steps = (int)(random_u32() % (scale + 1)) * (random_u32() % 2 != 0 ? 1 : -1);
        segment.steps[ax] = (int16_t)steps;
        segment.phase[ax] = (uint8_t)random_u32();
        segment.phase_end[ax] = (uint8_t)random_u32();
        if (random_u32() % 8 == 0) {
            segment.phase[ax] = 255;
            segment.phase_end[ax] = 0;
        }
    }
    if (scale > 60) /* the timer cannot be faster than the pulses */
        segment.duration_ns = scale * 2500;
    segment.ramp =
        (int16_t)(random_u32() % 3 == 0 ? SEGMENT_RAMP_ONE : (int32_t)(random_u32() % 65535) - 32767);
    return segment;
}

static void run_until_rest(unsigned round, int32_t counted[AXIS_COUNT]) {
    do {
        int32_t position[AXIS_COUNT];
        hal.now_ticks = hal.alarm_ticks;
        hal.write = events;
        step_isr(&step);
        if (hal.write != events)
            for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
                if (events[0].step_mask >> ax & 1)
                    counted[ax] += events[0].dir_mask >> ax & 1 ? -1 : 1;
        (void)prep_poll(&prep);
        if (random_u32() % 64 == 0) {
            step_position(&step, position);
            check(memcmp(position, counted, sizeof position) == 0, "position is not the pulses", round);
        }
    } while (step.active);
}

/* A few segments to a rest: what one leaves of a step's time is the next one's, and the last one waits. */
static void one_motion(unsigned round) {
    int32_t counted[AXIS_COUNT], wanted[AXIS_COUNT];
    uint64_t begin = hal.now_ticks, ideal_ns = 0;
    uint32_t clamped = prep.clamped;
    memcpy(counted, prep.carry.position, sizeof counted);
    memcpy(wanted, prep.carry.position, sizeof wanted);
    queue.from = round == 1 ? QUEUE_RESET_MARK : 1 + round % 2;
    queue.count = 0;
    for (unsigned left = 1 + random_u32() % 4; left != 0; left--) {
        struct segment segment = random_segment();
        segment.flags = left == 1 ? SEGMENT_LAST : 0;
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
            wanted[ax] += segment.steps[ax];
        ideal_ns += segment.duration_ns;
        segment.mark = left == 1 ? (uint8_t)(2 + (round + 1) % 2) : 0;
        queue.slots[queue.count++] = segment;
    }
    segment_queue_publish(&queue);
    while (prep_poll(&prep) && segment_queue_is_pending(&queue))
        ; /* in portions */
    check(!segment_queue_is_pending(&queue) && queue.answer == QUEUE_TAKEN, "the batch is not taken", round);
    run_until_rest(round, counted);
    check(memcmp(counted, wanted, sizeof counted) == 0, "not the segment's steps", round);
    check(memcmp(prep.carry.position, wanted, sizeof wanted) == 0, "prep lost the position", round);
    if (prep.clamped == clamped) {
        int64_t off = (int64_t)(hal.now_ticks - begin) - (int64_t)(ideal_ns * 2 / 100);
        check(off >= -1 && off <= 1, "not the segment's duration", round);
    }
}

/* What prep divides is what a division makes of it. */
static void divisions(void) {
    for (unsigned round = 0; round < 200000; round++) {
        uint64_t n = (uint64_t)random_u32() << 32 | random_u32(), rest;
        uint32_t d = 1 + random_u32() % 16383, hz = 1000000 + random_u32() % 400000000,
                 bits = random_u32() % 48;
        n >>= 3 + bits;
        check(prep_divide_by_ns(n, &rest) == (uint32_t)(n / 1000000000u) && rest == n % 1000000000u,
              "nanoseconds", round);
        uint64_t few = n % ((uint64_t)d << 32) & ((1ull << 48) - 1u);
        check(prep_divide(few, d) == (uint32_t)(few / d), "a division", round);
        check(prep_divide(few - few % d, d) == (uint32_t)(few / d), "a division without rest", round);
        uint32_t ticks = (uint32_t)((uint64_t)random_u32() * hz >> 32);
        check(prep_scale(ticks, 32000, hz) == (uint32_t)((uint64_t)ticks * 32000 / hz), "a scale", round);
    }
}

static void position_before_the_first_event(void) {
    struct span span = {.at = (0u - 5u) << 16 | 3u,
                        .events = 5,
                        .interval_q16 = 100u << 16,
                        .increment = {SPAN_PHASE_ONE},
                        .position = {7, 8, 9, 10, 11, 12}};
    int32_t position[AXIS_COUNT];
    step_init(&step, &hal);
    step.pool[3] = span;
    step_start(&step, &step.pool[3]);
    step_position(&step, position);
    check(memcmp(position, span.position, sizeof position) == 0, "a span that waits counts already", 0);
}

int main(void) {
    const struct prep_timing timing = {.timer_hz = TIMER_HZ, .min_interval_ticks = 20, .dir_setup_ticks = 10};
    divisions();
    position_before_the_first_event();
    step_init(&step, &hal);
    prep_init(&prep, &queue, &step, &timing);
    for (unsigned round = 1; round <= ROUNDS; round++)
        one_motion(round);
    printf("%u failures, %u intervals clamped\n", failures, prep.clamped);
    return failures == 0 ? 0 : 1;
}
