/* SPDX-License-Identifier: MIT
 * All between the planner and the pins as one: whether it is at rest, and how it is stopped and emptied. */
#include "machine/drive.h"

#include "machine/host_motion.h"
#include "machine/parts.h"
#include "machine/place.h"

#include <stddef.h>

/* The motion side answers a batch after it has started the step timer for it. So looking for the answer
 * first, and then at the timer, misses nothing; each load is an acquire, so that they stay in this order. An
 * answer that was not taken does not count: if the batch was refused, the source has not yet gone back to
 * where motion is. */
bool machine_is_standing(const struct machine *machine) {
    return !machine->drive.motion.ahead.pending && step_is_resting(&machine->drive.step);
}

bool machine_is_at_rest(const struct machine *machine) {
    return motion_is_planned_out(&machine->drive.motion) && host_queue_is_empty(&machine->host.queue) &&
           machine_is_standing(machine);
}

bool drive_is_stopped(const struct machine *machine) {
    return machine_is_standing(machine) && host_is_quiet(machine) &&
           (motion_is_held(&machine->drive.motion) || motion_is_planned_out(&machine->drive.motion));
}

void drive_take_position(struct machine *machine) {
    joints_stand(&machine->drive.joints, &machine->drive.motion);
    place_set_program(machine, machine->drive.joints.tool_mm);
}

void drive_on_motion_side(struct machine *machine, void (*work)(void *arg), void *arg) {
    const struct machine_board *board = &machine->board;
    if (board->motion_side == NULL)
        work(arg);
    else
        board->motion_side->call(board->motion_side_ctx, work, arg);
}

static void reset_motion(struct machine *machine, const int32_t position[AXIS_COUNT]) {
    prep_reset(&machine->drive.prep, position);
    motion_reset(&machine->drive.motion, position);
}

/* What drive_stand_at() does on the motion side. */
struct stand {
    struct machine *machine;
    const int32_t *position;
};

/* cppcheck-suppress constParameterCallback ; the type of work() is fixed */
static void stand(void *arg) {
    const struct stand *at = arg;
    reset_motion(at->machine, at->position);
}

void drive_stand_at(struct machine *machine, const int32_t position[AXIS_COUNT]) {
    struct stand at = {.machine = machine, .position = position};
    drive_on_motion_side(machine, stand, &at);
    drive_take_position(machine);
}

/* What drive_halt() does on the motion side. */
struct halt {
    struct machine *machine;
    bool only_waited;
};

/* In this order: only a step ISR that is halted has a final position; what a host's segment has done is
 * counted by the step engine's line, which reset_motion() forgets; and edges of switches are forgotten
 * together with the motion that they belonged to. */
static void halt(void *arg) {
    struct halt *at = arg;
    struct machine *machine = at->machine;
    int32_t position[AXIS_COUNT];
    step_halt(&machine->drive.step);
    at->only_waited = step_only_waits(&machine->drive.step);
    host_note_done(machine);
    machine_position(machine, position);
    reset_motion(machine, position);
    inputs_forget(&machine->edges);
    host_drop(machine);
}

void drive_halt(struct machine *machine) {
    struct halt at = {.machine = machine};
    bool works = !machine_is_standing(machine);
    drive_on_motion_side(machine, halt, &at);
    if (works && !at.only_waited) { /* pulses ended without a ramp: motors may have lost steps */
        machine->trust.axes = 0;
        machine->trust.losses++;
    }
    drive_take_position(machine);
}

void drive_shift(struct machine *machine, const int32_t steps[AXIS_COUNT]) {
    motion_shift(&machine->drive.motion, steps);
    joints_stand(&machine->drive.joints, &machine->drive.motion);
}

void drive_drop(struct machine *machine) {
    int32_t position[AXIS_COUNT];
    machine_position(machine, position);
    drive_stand_at(machine, position);
}

void drive_lengthen(struct machine *machine) {
    if (machine->drive.motion.ahead.owner == AHEAD_HOST)
        ahead_change(&machine->drive.motion.ahead);
}

bool drive_rest_reached(struct machine *machine) {
    if (machine->park.open) /* the plan is the job's, and held */
        return host_queue_is_empty(&machine->host.queue) && machine_is_standing(machine);
    if (machine_is_at_rest(machine))
        return true;
    motion_end(&machine->drive.motion);
    return false;
}
