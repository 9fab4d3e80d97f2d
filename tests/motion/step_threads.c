/* SPDX-License-Identifier: MIT
 * The hand-over to the step ISR with real threads, under ThreadSanitizer: a producer publishes batches, the
 * motion side cuts them and swaps the end of the chain, the step ISR runs, and a reader looks at the position
 * all the time.
 *
 * All motion is along one line, X = Y = -Z, upward, so each position that a reader sees is known to be one:
 * the axes agree, and it never goes back. An ISR stopped between any two of its stores, on its own thread, is
 * the worst case. */
#include "hal/hal_step.h"
#include "segment/queue.h"
#include "step/isr.h"
#include "step/prep.h"

#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>

enum { BATCHES = 6000, SEGMENTS = 6, COMMITTED = 3, MARKS = 20 };

static struct trace_event events[64];
static struct hal_step hal;
static struct step step;
static struct segment_queue queue;
static struct prep prep;
static atomic_bool over;
static atomic_uint wrong;
static unsigned taken, refused;

static struct segment make(unsigned n, unsigned place, uint32_t end_us) {
    struct segment segment = {.duration_ns = 100000,
                              .end_us = end_us,
                              .line = n,
                              .mark = (uint8_t)(place + 1),
                              .steps = {3, 3, -3}};
    memset(segment.phase, SEGMENT_PHASE_HALF, sizeof segment.phase);
    memset(segment.phase_end, SEGMENT_PHASE_HALF, sizeof segment.phase_end);
    return segment;
}

/* Each batch branches off after the committed part of the one before, or, if that was passed, at its end. */
static void *produce(void *unused) {
    unsigned branch = QUEUE_RESET_MARK, end = QUEUE_RESET_MARK, next = 0;
    uint32_t branch_us = 0, end_us = 0;
    (void)unused;
    for (unsigned n = 0; n < BATCHES; n++) {
        queue.from = branch;
        queue.count = 0;
        for (unsigned k = 0; k < SEGMENTS; k++)
            queue.slots[queue.count++] = make(n, 1 + (next + k) % MARKS, branch_us + 100 * (k + 1));
        segment_queue_publish(&queue);
        while (segment_queue_is_pending(&queue))
            sched_yield();
        if (queue.answer != QUEUE_TAKEN) {
            refused++;
            branch = end;
            branch_us = end_us;
            continue;
        }
        taken++;
        branch = 1 + (next + COMMITTED - 1) % MARKS;
        end = 1 + (next + SEGMENTS - 1) % MARKS;
        end_us = branch_us + 100 * SEGMENTS;
        branch_us += 100 * COMMITTED;
        next = (next + SEGMENTS) % MARKS;
    }
    atomic_store(&over, true);
    return NULL;
}

static void *read_positions(void *unused) {
    int32_t last = 0, position[AXIS_COUNT];
    (void)unused;
    while (!atomic_load(&over)) {
        step_position(&step, position);
        if (position[0] != position[1] || position[0] != -position[2] || position[0] < last)
            atomic_fetch_add(&wrong, 1);
        last = position[0];
    }
    return NULL;
}

/* The ISR and the motion side share a core; here the ISR comes between any two polls. */
static void run_motion_side(void) {
    unsigned n = 0;
    while (!atomic_load(&over) || step.active) {
        (void)prep_poll(&prep);
        for (unsigned k = n++ % 7; k > 0 && step.active; k--) {
            hal.now_ticks = hal.alarm_ticks;
            hal.write = events;
            step_isr(&step);
        }
        sched_yield();
    }
}

int main(void) {
    const struct prep_timing timing = {.timer_hz = 20000000, .min_interval_ticks = 20, .dir_setup_ticks = 10};
    pthread_t producer, reader;
    int32_t position[AXIS_COUNT];
    step_init(&step, &hal);
    prep_init(&prep, &queue, &step, &timing);
    if (pthread_create(&producer, NULL, produce, NULL) != 0 ||
        pthread_create(&reader, NULL, read_positions, NULL) != 0)
        return 2;
    run_motion_side();
    pthread_join(producer, NULL);
    pthread_join(reader, NULL);
    step_position(&step, position);
    printf("%u wrong, %u batches taken, %u refused, at %d\n", atomic_load(&wrong), taken, refused,
           (int)position[0]);
    return atomic_load(&wrong) == 0 && taken > 0 && refused > 0 ? 0 : 1;
}
