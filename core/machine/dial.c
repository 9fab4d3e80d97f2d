/* SPDX-License-Identifier: MIT
 * The dial: a hand wheel that jogs an axis by so much a detent.
 *
 *     v      $402, or what the axis can        R      way left to where the dial leads the axis
 *     a      acceleration of the axis          bound  v^2 / 2a, the most that R may be
 *
 * Counts are seen up to a look after they came, so R is measured from where the axis was at the look before:
 * then the bound is true for the moment in which the dial stops. */
#include "machine/dial.h"

#include "machine/actions.h"
#include "machine/dial_talk.h"
#include "machine/drive.h"
#include "machine/host_motion.h"
#include "machine/jog.h"
#include "machine/park.h"
#include "machine/parts.h"
#include "machine/place.h"
#include "machine/state.h"
#include "machine/stored_write.h"

#include "base/minmax.h"

#include <math.h>
#include <string.h> // memcpy

enum { DETENTS_MAX = 10000 }; /* of a poll; a counter that makes more is broken */

#define ALIKE 1e-6 /* of a detent */

static int32_t magnitude(int32_t n) {
    return n < 0 ? -n : n;
}

static unsigned bit_number(unsigned bits) {
    unsigned n = 0;
    while ((bits >> n & 1u) == 0)
        n++;
    return n;
}

static bool is_one(unsigned bits) {
    return bits != 0 && (bits & (bits - 1u)) == 0;
}

/* The axis that is selected; AXIS_COUNT: none, or one that this machine lacks. */
static unsigned selected_axis(const struct machine *machine, const struct hal_dial_state *now) {
    unsigned axis = machine->settings.dial_axis;
    if (machine->board.dial->selects_axis)
        axis = is_one(now->axes) ? bit_number(now->axes) : AXIS_COUNT;
    return axis < machine->board.axis_count ? axis : AXIS_COUNT;
}

static double selected_step_mm(const struct machine *machine, const struct hal_dial_state *now) {
    const double step_mm = (double)machine->settings.dial_step_mm;
    return now->x100 ? 100.0 * step_mm : now->x10 ? 10.0 * step_mm : step_mm;
}

/* ---- who may ---- */

static bool line_waits(const struct machine *machine) {
    const uint8_t *bytes;
    return machine->park.open ? rx_peek_aside(&machine->lines.rx, &bytes) > 0
                              : rx_peek(&machine->lines.rx, &bytes) > 0;
}

/* Nothing of anyone else is under way or waits. */
static bool is_free(const struct machine *machine) {
    const struct machine_dial *dial = machine->board.dial_state;
    if (machine->task.stage != TASK_NONE || line_waits(machine) || stored_is_busy(machine))
        return false;
    if (dial->moves)
        return true;
    if (machine->park.open)
        return host_queue_is_empty(&machine->host.queue) && machine_is_standing(machine);
    return machine->life.state == MACHINE_IDLE && machine_is_at_rest(machine);
}

static bool may_move(const struct machine *machine) {
    const struct machine_dial *dial = machine->board.dial_state;
    return action_may(machine, ACTION_JOG, ACTOR_TEXT) == REFUSAL_NONE &&
           machine->drive.joints.kinematics.curved == 0 && (dial->turns_back || state_takes_input(machine)) &&
           machine->reports.mpg != MPG_IN_CONTROL && !machine->park.silent && is_free(machine);
}

/* ---- counts ---- */

static void ignore(struct machine *machine) {
    struct machine_dial *dial = machine->board.dial_state;
    dial->wanted = 0;
    dial->locked = true;
    dial->ignored = true;
    dial_talk_soon(machine);
}

/* With a whole detent before it counts either way, a line that bounces adds nothing. */
static int32_t take_detents(struct machine_dial *dial, int32_t counts, int32_t each) {
    const int32_t turned = (int32_t)((uint32_t)counts - (uint32_t)dial->base);
    const int32_t detents = turned / each;
    dial->base = (int32_t)((uint32_t)dial->base + (uint32_t)(detents * each));
    return detents;
}

static void look(struct machine *machine, const struct hal_dial_state *now) {
    struct machine_dial *dial = machine->board.dial_state;
    const bool turned = now->counts != dial->counts;
    dial->rest.on = timer_runs(machine, &dial->rest);
    if (!dial->rest.on)
        dial->locked = false;
    if (turned)
        timer_start(machine, &dial->rest, DIAL_REST_US);
    if (now->slips != dial->slips) {
        dial->slipped += now->slips - dial->slips;
        dial_talk_soon(machine);
    }
    dial->counts = now->counts;
    dial->slips = now->slips;
}

static double place_mm(const struct machine *machine, unsigned axis) {
    int32_t steps[AXIS_COUNT];
    double tool_mm[AXIS_COUNT];
    machine_position(machine, steps);
    place_tool_mm(machine, steps, tool_mm);
    return tool_mm[axis];
}

static void know_place(struct machine *machine) {
    struct machine_dial *dial = machine->board.dial_state;
    if (!dial->moves)
        return;
    dial->before_mm = dial->at_mm;
    dial->at_mm = place_mm(machine, dial->axis);
}

/* A switch that is turned while the axis moves counts when it rests. */
static bool is_selected(const struct machine *machine, const struct hal_dial_state *now) {
    const struct machine_dial *dial = machine->board.dial_state;
    const unsigned axis = selected_axis(machine, now);
    if (axis == AXIS_COUNT || (now->x10 && now->x100))
        return false;
    return !dial->moves || (axis == dial->axis && selected_step_mm(machine, now) == dial->step_mm);
}

void dial_begin(struct machine *machine) {
    struct machine_dial *dial = machine->board.dial_state;
    struct hal_dial_state now;
    if (dial == NULL)
        return;
    machine->board.dial->read(machine->hal, &now);
    dial->counts = dial->base = now.counts;
    dial->slips = now.slips;
}

void dial_read(struct machine *machine) {
    struct machine_dial *dial = machine->board.dial_state;
    struct hal_dial_state now;
    if (dial == NULL)
        return;
    machine->board.dial->read(machine->hal, &now);
    look(machine, &now);
    know_place(machine);
    const int32_t detents = take_detents(dial, now.counts, machine->board.dial->counts_per_detent);
    if (detents == 0)
        return;
    if (dial->locked || !is_selected(machine, &now) || !may_move(machine) || detents > DETENTS_MAX ||
        detents < -DETENTS_MAX) {
        ignore(machine);
        return;
    }
    if (!dial->moves) {
        dial->axis = (uint8_t)selected_axis(machine, &now);
        dial->step_mm = selected_step_mm(machine, &now);
    }
    dial->wanted += detents;
}

/* ---- motion ---- */

static double feed_mm_s(const struct machine *machine, unsigned axis) {
    const float most = machine->drive.motion.plan.limits.max_rate_mm_s[axis];
    return (double)min_f(machine->settings.dial_feed_mm_min / 60.0f, most);
}

/* To where motion leads from there. */
static double way_left_mm(const struct machine *machine, double at_mm) {
    return machine->interp.gcode.position_mm[machine->board.dial_state->axis] - at_mm;
}

/* Half a step of the motor: what rounding leaves. */
static double rounding_mm(const struct machine *machine, unsigned axis) {
    return 0.51 / (double)machine->drive.motion.plan.limits.steps_per_mm[axis];
}

/* Detents that may be added in this direction to the motion that leads to end_mm; one when nothing is left of
 * it. */
static int32_t room(const struct machine *machine, double end_mm, double direction) {
    const struct machine_dial *dial = machine->board.dial_state;
    const double left_mm = (end_mm - dial->before_mm) * direction;
    const double v = feed_mm_s(machine, dial->axis);
    const double a = (double)machine->drive.motion.plan.limits.accel_mm_s2[dial->axis];
    const double bound_mm = v * v / (2.0 * a);
    const bool arrived = (end_mm - dial->at_mm) * direction <= rounding_mm(machine, dial->axis);
    const double detents = floor((bound_mm - left_mm) / dial->step_mm + ALIKE);
    if (detents < 1.0)
        return arrived ? 1 : 0;
    return detents < (double)DETENTS_MAX ? (int32_t)detents : DETENTS_MAX;
}

/* The move to `goal` and so many detents more. @return false: it leaves the travel, or the kinematics' reach
 */
static bool aim(struct machine *machine, int32_t more) {
    const struct machine_dial *dial = machine->board.dial_state;
    double target_mm[AXIS_COUNT];
    memcpy(target_mm, machine->interp.gcode.position_mm, sizeof target_mm);
    target_mm[dial->axis] = dial->start_mm + (double)(dial->goal + more) * dial->step_mm;
    return jog_aim(machine, target_mm, (float)feed_mm_s(machine, dial->axis));
}

/* By the queue of network hosts, as a parked hold does: it keeps the limits, and what it has may grow while
 * it moves without a stop between two detents. */
static bool push_jog(struct machine *machine) {
    struct machine_dial *dial = machine->board.dial_state;
    const double *target_mm = machine->task.command.move.target_mm;
    struct host_queue_segment segment = {.flags = SEGMENT_JOG | SEGMENT_LAST};
    int32_t target[AXIS_COUNT], most = 0;
    park_steps_at(machine, target_mm, dial->end_steps, target);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        segment.steps[ax] = target[ax] - dial->end_steps[ax];
        const int32_t way = magnitude(segment.steps[ax]);
        most = way > most ? way : most;
    }
    const double steps_s =
        feed_mm_s(machine, dial->axis) * (double)machine->drive.motion.plan.limits.steps_per_mm[dial->axis];
    segment.duration_us = (uint32_t)(1e6 * (double)most / steps_s) + 1;
    if (most > 0 && !host_move_self(machine, &segment))
        return false;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        dial->end_steps[ax] = target[ax];
    place_set_program(machine, target_mm);
    (void)state_go(machine, EVENT_JOG);
    return true;
}

/* As far as there is room; the move is in machine->task.command. */
static bool push(struct machine *machine) {
    struct machine_dial *dial = machine->board.dial_state;
    dial->pushes = !(machine->park.open ? park_move(machine, SEGMENT_JOG) : push_jog(machine));
    if (!dial->pushes)
        drive_lengthen(machine);
    return !dial->pushes;
}

static void begin(struct machine *machine) {
    struct machine_dial *dial = machine->board.dial_state;
    dial->start_mm = machine->interp.gcode.position_mm[dial->axis];
    dial->goal = 0;
    dial->moves = true;
    machine_position(machine, dial->end_steps);
    dial->at_mm = dial->before_mm = place_mm(machine, dial->axis);
}

static void drop(struct machine *machine, int32_t detents) {
    struct machine_dial *dial = machine->board.dial_state;
    if (detents == 0)
        return;
    dial->dropped += (uint32_t)magnitude(detents);
    dial_talk_soon(machine);
}

static void turn_back(struct machine *machine) {
    struct machine_dial *dial = machine->board.dial_state;
    const int32_t wanted = dial->wanted;
    if (machine->park.open)
        park_stop(machine);
    else
        jog_cancel(machine);
    dial->locked = false; /* that was the dial itself */
    dial->moves = dial->turns_back = true;
    dial->wanted = wanted;
}

/* It rests between two detents: the one that it has not reached yet is the goal, the others are dropped. */
static void stand(struct machine *machine) {
    struct machine_dial *dial = machine->board.dial_state;
    const double at = (machine->interp.gcode.position_mm[dial->axis] - dial->start_mm) / dial->step_mm;
    const double part = rounding_mm(machine, dial->axis) / dial->step_mm;
    const int32_t goal = (int32_t)(dial->goal > at ? ceil(at - part) : floor(at + part));
    drop(machine, dial->goal - goal);
    dial->goal = goal;
    dial->turns_back = false;
    machine_position(machine, dial->end_steps);
}

/* As aim(), for as many of them as the travel has. By halves: a bound of thousands of detents must not keep
 * the task from what stops motion. @return false: the axis is there already */
static bool aim_within(struct machine *machine, int32_t *more) {
    int32_t inside = 0, outside = *more;
    if (aim(machine, *more))
        return true;
    while (magnitude(outside - inside) > 1) {
        const int32_t middle = inside + (outside - inside) / 2;
        if (aim(machine, middle))
            inside = middle;
        else
            outside = middle;
    }
    *more = inside;
    return aim(machine, inside);
}

/* To `goal` and what is wanted; the rest of it is dropped. */
static void go(struct machine *machine) {
    struct machine_dial *dial = machine->board.dial_state;
    const int32_t wanted = dial->wanted;
    const double goal_mm = dial->start_mm + (double)dial->goal * dial->step_mm;
    const int32_t most = wanted != 0 ? room(machine, goal_mm, wanted > 0 ? 1.0 : -1.0) : 0;
    const int32_t taken = wanted > most ? most : wanted < -most ? -most : wanted;
    int32_t more = taken;
    drop(machine, wanted - taken);
    dial->wanted = 0;
    const bool somewhere = taken != 0 || fabs(way_left_mm(machine, goal_mm)) > 0.0;
    const bool moves = somewhere && aim_within(machine, &more);
    dial->ends = dial->ends || more != taken;
    if (more != taken)
        dial_talk_soon(machine);
    if (!moves)
        return;
    const double *target_mm = machine->task.command.move.target_mm;
    dial->goal += more;
    const double short_mm = target_mm[dial->axis] - dial->start_mm - (double)dial->goal * dial->step_mm;
    if (fabs(short_mm) > ALIKE * dial->step_mm) {
        dial->start_mm = target_mm[dial->axis]; /* $56: the end of the travel is between two detents */
        dial->goal = 0;
        dial->ends = true;
        dial_talk_soon(machine);
    }
    (void)push(machine);
}

static bool is_at_rest(const struct machine *machine) {
    if (machine->park.open)
        return host_queue_is_empty(&machine->host.queue) && machine_is_standing(machine);
    return machine->life.state != MACHINE_JOG;
}

/* The planner continues from here, the program from the exact place of the detent: fractions of a step add
 * up.
 */
static void arrive(struct machine *machine) {
    double target_mm[AXIS_COUNT];
    memcpy(target_mm, machine->interp.gcode.position_mm, sizeof target_mm);
    drive_drop(machine);
    place_set_program(machine, target_mm);
}

/* Motion that was the dial's has ended. @return true when it turns back now */
static bool end(struct machine *machine) {
    struct machine_dial *dial = machine->board.dial_state;
    if (!dial->moves || dial->pushes || !is_at_rest(machine) || machine->park.stops ||
        machine->suspend.cancels)
        return false;
    if (dial->turns_back && may_move(machine)) {
        stand(machine);
        go(machine);
        return true;
    }
    if (!machine->park.open && machine->life.state == MACHINE_IDLE)
        arrive(machine);
    dial->moves = dial->turns_back = false;
    return false;
}

bool dial_poll(struct machine *machine) {
    const struct machine_dial *dial = machine->board.dial_state;
    if (dial == NULL)
        return false;
    dial_talk_poll(machine);
    if (dial->pushes)
        return push(machine);
    if (end(machine))
        return true;
    if (dial->wanted == 0 || dial->turns_back)
        return false;
    if (!may_move(machine)) {
        ignore(machine);
        return false;
    }
    if (!dial->moves)
        begin(machine);
    const double left_mm = way_left_mm(machine, dial->at_mm);
    if (left_mm * dial->wanted < 0.0 && fabs(left_mm) > rounding_mm(machine, dial->axis)) {
        turn_back(machine);
        return true;
    }
    go(machine);
    return true;
}
