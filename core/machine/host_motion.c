/* SPDX-License-Identifier: MIT
 * The segments of a network host: where they lead, how far they are, and how they are given up. */
#include "machine/host_motion.h"

#include "machine/host.h"
#include "machine/parts.h"
#include "machine/place.h"
#include "machine/reach.h"

#include <string.h>

bool host_is_quiet(const struct machine *machine) {
    return host_queue_is_quiet(&machine->host.queue);
}

void host_set_limits(struct machine *machine, const struct motion_limits *limits) {
    struct host_queue_limits queue_limits = {.axis_count = limits->axis_count,
                                             .rests_to_probe = limits->shape_host};
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        queue_limits.rate_steps_s[ax] = limits->max_rate_mm_s[ax] * limits->steps_per_mm[ax];
        queue_limits.accel_steps_s2[ax] = limits->accel_mm_s2[ax] * limits->steps_per_mm[ax];
    }
    host_queue_set_limits(&machine->host.queue, &queue_limits);
}

/* Segments are relative; where they lead is kept as an absolute position, in 64 bits, because a host may
 * send more steps than a counter holds (is_reachable() refuses them). */
static void know_end(struct machine *machine) {
    struct machine_host *host = &machine->host;
    int32_t position[AXIS_COUNT];
    if (host->end_known)
        return;
    machine_position(machine, position);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        host->end_steps[ax] = position[ax];
    host->end_known = true;
}

bool host_in_travel(const struct machine *machine, const int32_t steps[AXIS_COUNT]) {
    double tool_mm[AXIS_COUNT];
    place_tool_mm(machine, steps, tool_mm);
    return reach_in_travel(machine, tool_mm) &&
           (!machine->settings.soft_limits ||
            kinematics_reaches(&machine->drive.joints.kinematics, tool_mm, tool_mm));
}

/* Where the segment leads can be counted and lies within the travel. */
static bool is_reachable(const struct machine *machine, const int64_t end_steps[AXIS_COUNT]) {
    int32_t steps[AXIS_COUNT];
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        if (end_steps[ax] > INT32_MAX || end_steps[ax] < -INT32_MAX)
            return false;
        steps[ax] = (int32_t)end_steps[ax];
    }
    return host_in_travel(machine, steps);
}

static void watch_probe(struct machine *machine, const struct host_queue_slot *slot) {
    struct machine_host *host = &machine->host;
    if ((slot->flags & SEGMENT_PROBE) == 0 || host->probing)
        return;
    host->probing = true;
    /* Before the segment is taken: the step ISR may look at the probe as soon as the first span of it is
     * published. */
    hal_probe_watch(machine->hal, HAL_PROBE, machine->settings.probe_invert);
    step_watch_probe(&machine->drive.step);
}

/* Here, not when a segment is laid: segments may come in any order, and only in order is it known where
 * they end. */
bool host_take_segments(struct machine *machine) {
    struct machine_host *host = &machine->host;
    const struct host_queue_slot *slot;
    know_end(machine);
    while ((slot = host_queue_next(&host->queue)) != NULL) {
        int64_t end_steps[AXIS_COUNT];
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
            end_steps[ax] = host->end_steps[ax] + slot->steps[ax];
        if (!is_reachable(machine, end_steps))
            return false;
        memcpy(host->end_steps, end_steps, sizeof end_steps);
        watch_probe(machine, slot);
        host_queue_take(&host->queue);
    }
    return true;
}

void machine_host_forget_ahead(struct machine *machine) {
    host_queue_forget_ahead(&machine->host.queue);
}

uint32_t machine_host_taken(const struct machine *machine) {
    return machine->host.queue.head - machine->host.own;
}

bool host_move_self(struct machine *machine, const struct host_queue_segment *segment) {
    struct host_queue *queue = &machine->host.queue;
    if (host_queue_lay(queue, 0, segment) != HOST_QUEUE_OK)
        return false;
    host_queue_take(queue);
    machine->host.own++;
    return true;
}

void host_stop_self(struct machine *machine) {
    host_queue_clear(&machine->host.queue);
    machine->host.end_known = false;
}

/* The line of the first slice that is not over. @return false: none exists */
static bool find_line(const struct machine *machine, uint32_t *line) {
    const struct segment_queue *queue = &machine->drive.motion.queue;
    struct step_now now;
    if (machine->drive.motion.ahead.owner != AHEAD_HOST)
        return false;
    bool waits = segment_queue_is_pending(queue), active = machine->drive.step.active;
    step_look(&machine->drive.step, &now);
    *line = active || now.left > 0 ? now.line : queue->slots[0].line;
    return active || now.left > 0 || waits;
}

/* By the pins, not by the queue's tail: the tail has passed segments whose slices are published and not
 * stepped. */
uint32_t machine_host_done(const struct machine *machine) {
    const struct host_queue *queue = &machine->host.queue;
    uint32_t line;
    if (!machine->host.owns) /* the queue has none of a host */
        return machine_host_taken(machine);
    return (find_line(machine, &line) ? host_queue_line_number(queue, line) : queue->tail) -
           machine->host.own;
}

uint16_t machine_host_id(const struct machine *machine) {
    const struct host_queue *queue = &machine->host.queue;
    uint32_t line;
    if (find_line(machine, &line))
        return host_queue_line_id(line);
    return host_queue_is_empty(queue) ? 0 : queue->slots[queue->tail & (HOST_QUEUE_SIZE - 1)].id;
}

void host_note_done(struct machine *machine) {
    machine->host.done_at_drop = machine_host_done(machine);
}

void host_discard_queue(struct machine *machine) {
    struct machine_host *host = &machine->host;
    host_note_done(machine);
    host->dropped++;
    host_queue_clear(&host->queue);
    host->end_known = false;
}

/* As host_discard_queue(), and nothing is the host's any more. done_at_drop is noted already: drive.c has
 * done it before the step engine's line was forgotten. */
void host_drop(struct machine *machine) {
    struct machine_host *host = &machine->host;
    host->dropped++;
    host_queue_clear(&host->queue);
    host->owns = host->end_known = host->probing = false;
    host->jog.on = host->jog.waits = host->discards = false;
    host->job.step = HOST_JOB_NONE;
}
