/* SPDX-License-Identifier: MIT
 * Shows the segments that are stepped. What is published may still be replaced, so they wait until they are.
 */
#include "host_inner.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct host_published {
    struct segment segment;
    double from_steps[AXIS_COUNT], to_steps[AXIS_COUNT];
};

/* Exact way of a segment, whole steps and 1/256: signed steps, and how far the phase has moved on in the
 * direction of the steps. */
static double way_steps(const struct segment *segment, unsigned ax) {
    double phases = (segment->phase_end[ax] - segment->phase[ax]) / 256.0;
    return segment->steps[ax] < 0 ? segment->steps[ax] - phases : segment->steps[ax] + phases;
}

/* Segments of the batch up to where the planner's state is now. */
static uint32_t committed(const struct machine *machine) {
    const struct segment_queue *queue = &machine->drive.motion.queue;
    for (uint32_t i = 0; i < queue->count; i++)
        if (queue->slots[i].mark == machine->drive.motion.ahead.commit + 1)
            return i + 1;
    return 0;
}

/* Where the committed part ends. A fraction of 1/2 is exactly on a step. */
static void commit_steps(const struct emit *emit, double steps[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        steps[ax] = emit->axes.steps[ax] + emit->axes.fraction[ax] / 256.0 - 0.5;
}

/* When a part of a segment's way is done, as a part of its time: segment/segment.h. */
static double time_of(const struct segment *segment, double way) {
    double r = (double)segment->ramp / (double)SEGMENT_RAMP_ONE, start = 1.0 - r;
    return fabs(r) < 1e-6 ? way : (sqrt(fmax(start * start + 4.0 * r * way, 0.0)) - start) / (2.0 * r);
}

/* A part of a segment with one S. */
struct part {
    double way[2]; /* of its segment, 0 .. 1 */
    const uint16_t *duty;
};

static void append(struct host *host, const struct segment *segment, const struct part *part,
                   const double at_steps[AXIS_COUNT]) {
    if (host->planned_count == host->planned_size) {
        host->planned_size = 2 * host->planned_size + SEGMENT_QUEUE_SIZE;
        host->planned = realloc(host->planned, host->planned_size * sizeof *host->planned);
        if (host->planned == NULL)
            abort(); /* no memory for what the machine does */
    }
    struct host_published *published = &host->planned[host->planned_count++];
    double from = time_of(segment, part->way[0]), to = time_of(segment, part->way[1]);
    double more = (double)part->duty[1] - (double)part->duty[0];
    published->segment = *segment;
    published->segment.duration_ns =
        (uint32_t)(to * segment->duration_ns + 0.5) - (uint32_t)(from * segment->duration_ns + 0.5);
    published->segment.duty[0] = (uint16_t)((double)part->duty[0] + more * from + 0.5);
    published->segment.duty[1] = (uint16_t)((double)part->duty[0] + more * to + 0.5);
    published->segment.power_count = 0;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        published->from_steps[ax] = at_steps[ax] + part->way[0] * way_steps(segment, ax);
        published->to_steps[ax] = at_steps[ax] + part->way[1] * way_steps(segment, ax);
    }
}

/* All parts of a segment. */
static void append_parts(struct host *host, const struct segment *segment, double at_steps[AXIS_COUNT]) {
    const struct segment_power *power = &host->machine.drive.motion.queue.power[segment->power_first];
    struct part part = {.duty = segment->duty};
    for (unsigned i = 0; i < segment->power_count; i++, power++) {
        part.way[1] = power->at / 65536.0;
        if (part.way[1] > part.way[0])
            append(host, segment, &part, at_steps);
        part = (struct part){.way = {part.way[1]}, .duty = power->duty};
    }
    part.way[1] = 1.0;
    append(host, segment, &part, at_steps);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        at_steps[ax] += way_steps(segment, ax);
}

/* The batch that was published last: it continues within what was before. */
static void take_batch(struct host *host) {
    const struct segment_queue *queue = &host->machine.drive.motion.queue;
    double at_steps[AXIS_COUNT];
    uint32_t branch_us = queue->slots[0].end_us - (queue->slots[0].duration_ns + 999u) / 1000u;
    /* What was published after the branch and is not stepped has been replaced by this batch. */
    while (host->planned_count > 0 &&
           (int32_t)(host->planned[host->planned_count - 1].segment.end_us - branch_us) > 0)
        host->planned_count--;
    commit_steps(&host->machine.drive.motion.emit, at_steps);
    for (uint32_t i = 0; i < committed(&host->machine); i++)
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
            at_steps[ax] -= way_steps(&queue->slots[i], ax);
    for (uint32_t i = 0; i < queue->count; i++)
        append_parts(host, &queue->slots[i], at_steps);
}

static void show(struct host *host, const struct host_published *published) {
    struct host_segment moved = {.segment = &published->segment};
    memcpy(moved.from_steps, published->from_steps, sizeof moved.from_steps);
    memcpy(moved.to_steps, published->to_steps, sizeof moved.to_steps);
    host->watch(host->watch_ctx, &moved);
}

void host_show_segments(struct host *host) {
    const struct segment_queue *queue = &host->machine.drive.motion.queue;
    if (host->watch == NULL)
        return;
    if (host->watched != queue->published && !segment_queue_is_pending(queue)) {
        host->watched = queue->published;
        if (queue->answer == QUEUE_TAKEN)
            take_batch(host);
    }
    uint32_t shown = 0, now_us = segment_queue_now_us(queue);
    while (shown < host->planned_count && (int32_t)(host->planned[shown].segment.end_us - now_us) <= 0)
        show(host, &host->planned[shown++]);
    host->planned_count -= shown;
    memmove(host->planned, host->planned + shown, host->planned_count * sizeof *host->planned);
}
