/* SPDX-License-Identifier: MIT
 * Homing: find the switches, fast and then slowly, and call what was found the end of the travel.
 *
 *   per cycle ($44 ..):  seek     -> settle -> level -> back off ->
 *                        approach -> settle -> level -> back off
 *
 * Unlike Grbl the axes slow down within their limits when a switch closes: machine_edge_isr() has kept the
 * exact step at which it did, and everything is measured from there. When one of two axes has found its
 * switch, the other continues alone; so does one of two motors of an axis (square.h). */
#include "machine/homing.h"

#include "machine/axes.h"
#include "machine/drive.h"
#include "machine/inputs.h"
#include "machine/motor_drivers.h"
#include "machine/motors.h"
#include "machine/overrides.h"
#include "machine/parts.h"
#include "machine/report.h"
#include "machine/reset.h"
#include "machine/square.h"
#include "machine/state.h"
#include "machine/timer.h"

#include <math.h>
#include <string.h>

/* Grbl's HOMING_AXIS_SEARCH_SCALAR and HOMING_AXIS_LOCATE_SCALAR: how far to look for a switch. */
#define SEEK_TRAVEL       1.5 /* travels */
#define APPROACH_PULL_OFF 5.0 /* pull-offs */

enum { SEEK, SEEK_SETTLE, LEVEL, BACK_OFF, APPROACH, APPROACH_SETTLE, LAST_LEVEL, LAST_BACK_OFF };

/* Where the homing axes are planned to: the tool's where its switches are not those of the joints. */
static void axes_mm(const struct machine *machine, double mm[AXIS_COUNT]) {
    const struct kinematics *kinematics = &machine->drive.joints.kinematics;
    if (kinematics->coupled)
        kinematics->ops->forward(kinematics, machine->drive.motion.plan.position_mm, mm);
    else
        memcpy(mm, machine->drive.motion.plan.position_mm, AXIS_COUNT * sizeof mm[0]);
}

static void push(struct machine *machine, const struct motion_line *line) {
    if (machine->drive.joints.kinematics.coupled) {
        joints_stand(&machine->drive.joints, &machine->drive.motion);
        (void)motion_tool_line(&machine->drive.motion, &machine->drive.joints, line,
                               hal_time_us(machine->hal));
    } else {
        (void)motion_line(&machine->drive.motion, line, hal_time_us(machine->hal));
    }
    motion_flush(&machine->drive.motion);
}

/* One straight move of some axes by a signed distance each, each of them at the rate. */
static void move(struct machine *machine, axis_mask_t axes, const double target_mm[AXIS_COUNT],
                 float rate_mm_min) {
    unsigned linear = 0;
    for (unsigned ax = 0; ax <= AXIS_Z; ax++)
        linear += axes >> ax & 1;
    /* Feed is along the path and counts linear axes only; all of them go the same distance, hence the root
     * of their number, as in Grbl. */
    static const float root[] = {1.0f, 1.0f, 1.41421356f, 1.73205081f};
    struct motion_line line = {.feed_mm_s = rate_mm_min / 60.0f * root[linear],
                               .line = machine->lines.count,
                               .flags = MOTION_FLAG_EXACT_STOP | MOTION_FLAG_UNSHAPED};
    axes_mm(machine, line.target_mm);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        line.target_mm[ax] = (axes >> ax & 1) != 0 ? target_mm[ax] : line.target_mm[ax];
    push(machine, &line);
}

/* Towards the switches that are still looked for. */
static void look(struct machine *machine) {
    const struct settings *settings = &machine->settings;
    const struct homing *homing = &machine->homing;
    bool seek = homing->step == SEEK;
    double target_mm[AXIS_COUNT], from_mm[AXIS_COUNT],
        way_mm = APPROACH_PULL_OFF * (double)settings->homing_pull_off_mm;
    for (unsigned ax = 0; seek && ax < AXIS_COUNT; ax++) {
        double travel_mm = SEEK_TRAVEL * (double)settings->max_travel_mm[ax];
        if ((homing->left >> ax & 1) != 0 && travel_mm > way_mm)
            way_mm = travel_mm;
    }
    axes_mm(machine, from_mm);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        double reach_mm = square_is_half(machine, ax) ? square_reach_mm(machine, ax) : way_mm;
        target_mm[ax] = from_mm[ax] + axes_direction(machine, ax) * reach_mm;
    }
    move(machine, homing->left, target_mm,
         seek ? settings->homing_seek_mm_min : settings->homing_feed_mm_min);
}

static void begin_search(struct machine *machine) {
    square_search(machine);
    if (machine->homing.left != 0)
        look(machine);
}

/* All axes of the cycle by so many steps, those with 0 not at all. */
static void move_steps(struct machine *machine, const int32_t steps[AXIS_COUNT]) {
    const struct settings *settings = &machine->settings;
    double target_mm[AXIS_COUNT];
    unsigned axes = 0;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        target_mm[ax] = (double)(machine->homing.from[ax] + steps[ax]) / (double)settings->steps_per_mm[ax];
        axes |= steps[ax] != 0 ? 1u << ax : 0;
    }
    if (axes != 0)
        move(machine, (axis_mask_t)axes, target_mm, settings->homing_seek_mm_min);
}

static void begin_step(struct machine *machine, uint8_t step) {
    int32_t steps[AXIS_COUNT];
    machine->homing.step = step;
    task_note_further(&machine->task);
    switch (step) {
    case SEEK:
    case APPROACH:
        begin_search(machine);
        return;
    case SEEK_SETTLE:
    case APPROACH_SETTLE:
        timer_start(machine, &machine->clock.timer, machine->settings.homing_debounce_ms * 1000u);
        return;
    case LEVEL:
    case LAST_LEVEL:
        square_level(machine, steps);
        break;
    default:
        square_back_off(machine, steps);
        break;
    }
    move_steps(machine, steps);
}

/* Axes asked for by their letters that are in no cycle come last. @return false: that was the last cycle */
static bool begin_cycle(struct machine *machine) {
    struct homing *homing = &machine->homing;
    while (homing->next <= CYCLE_COUNT) {
        unsigned cycle = homing->next++;
        axis_mask_t axes = cycle < CYCLE_COUNT ? axes_of_cycle(machine, cycle) : homing->asked;
        homing->axes = axes & homing->asked & (axis_mask_t)~homing->done;
        homing->done |= homing->axes;
        if (homing->axes == 0)
            continue;
        square_begin(machine);
        begin_step(machine, SEEK);
        return true;
    }
    return false;
}

/* An axis would back off from its switch into its other end. */
static bool is_pull_off_long(const struct machine *machine, unsigned axes) {
    const struct settings *settings = &machine->settings;
    const axis_mask_t ganged = inputs_ganged(machine);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        const float first_mm = square_pull_off_mm(settings, FIRST_MOTOR, ax);
        const float second_mm =
            (ganged >> ax & 1) != 0 ? square_pull_off_mm(settings, SECOND_MOTOR, ax) : 0.0f;
        const float longer_mm = first_mm > second_mm ? first_mm : second_mm;
        if ((axes >> ax & 1) != 0 && longer_mm >= settings->max_travel_mm[ax])
            return true;
    }
    return false;
}

/* Nothing stops a motor without a switch from bending the gantry: as far as squaring goes, no further. */
static bool racks(const struct machine *machine, unsigned axes) {
    const struct settings *settings = &machine->settings;
    axes &= inputs_ganged(machine) & ~(unsigned)inputs_squared(machine);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        const float apart_mm =
            square_pull_off_mm(settings, FIRST_MOTOR, ax) - square_pull_off_mm(settings, SECOND_MOTOR, ax);
        if ((axes >> ax & 1) != 0 && (double)fabsf(apart_mm) > square_crooked_mm(settings, ax))
            return true;
    }
    return false;
}

enum refusal homing_begin(struct machine *machine, axis_mask_t asked) {
    struct homing *homing = &machine->homing;
    const bool all = asked == 0;
    if ((asked & ~(unsigned)axes_with_ends(machine)) != 0)
        return REFUSAL_AXIS;
    if (all)
        asked = axes_with_ends(machine) & axes_in_cycles(machine);
    if (asked == 0)
        return REFUSAL_NO_HOMING;
    if (is_pull_off_long(machine, asked))
        return REFUSAL_PULL_OFF;
    if (racks(machine, asked))
        return REFUSAL_RACKS;
    const enum refusal refusal = motor_drivers_check_homing(machine, asked);
    if (refusal != REFUSAL_NONE)
        return refusal;
    motors_release(machine);
    *homing = (struct homing){.asked = asked, .all = all, .locked = machine->life.state == MACHINE_ALARM};
    /* From here on, whatever ends homing: where the axes are is known again only in
     * set_machine_position(). */
    trust_lose(&machine->trust, asked);
    /* Before overrides_apply(), which reads the state: homing has no overrides. */
    state_go(machine, EVENT_HOME);
    overrides_apply(machine);
    task_enter(&machine->task, TASK_HOMING);
    (void)begin_cycle(machine);
    return REFUSAL_NONE;
}

/* Where an axis is, a pull-off before the switch at the end of its travel, steps. */
static int32_t homed_steps(const struct machine *machine, unsigned ax) {
    const struct settings *settings = &machine->settings;
    bool positive = axes_direction(machine, ax) > 0.0;
    double end_mm =
        kinematics_end(&machine->drive.joints.kinematics, ax, positive, (double)settings->max_travel_mm[ax]);
    double mm = end_mm - axes_direction(machine, ax) * (double)settings->homing_pull_off_mm;
    double steps = mm * (double)settings->steps_per_mm[ax];
    return (int32_t)(steps < 0.0 ? steps - 0.5 : steps + 0.5);
}

/* What was found is the end of the travel: the counters get there without a pulse. */
static void set_machine_position(struct machine *machine) {
    const struct kinematics *kinematics = &machine->drive.joints.kinematics;
    const axis_mask_t axes = machine->homing.axes;
    struct kinematics mixed = *kinematics;
    int32_t position[AXIS_COUNT], before[AXIS_COUNT];
    mixed.coupled = kinematics->coupled && (axes & (1u << AXIS_X | 1u << AXIS_Y)) != 0;
    machine_position(machine, before);
    memcpy(position, before, sizeof position);
    kinematics_axis_steps(&mixed, position);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        if ((axes >> ax & 1) != 0)
            position[ax] = homed_steps(machine, ax);
    kinematics_joint_steps(&mixed, position);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        machine->trust.shift_steps[ax] += position[ax] - before[ax];
    machine->trust.axes |= axes;
    drive_stand_at(machine, position);
    report_changed_offset(machine);
}

static enum task_stage fail(struct machine *machine, enum alarm alarm) {
    reset_machine(machine, alarm);
    return TASK_NONE;
}

static enum task_stage end_back_off(struct machine *machine) {
    unsigned closed = inputs_homing(machine, FIRST_MOTOR) | inputs_homing(machine, SECOND_MOTOR);
    if ((closed & machine->homing.axes) != 0)
        return fail(machine, ALARM_HOMING_PULL_OFF);
    if (machine->homing.step == BACK_OFF) {
        begin_step(machine, APPROACH);
        return TASK_HOMING;
    }
    square_end(machine);
    set_machine_position(machine);
    if (begin_cycle(machine))
        return TASK_HOMING;
    bool stays_locked = machine->homing.locked && axes_not_homed(machine) != 0;
    state_go(machine, stays_locked ? EVENT_ALARM : EVENT_REST);
    if (stays_locked)
        report_not_homed(machine);
    overrides_apply(machine);
    lines_run_startup(&machine->lines, machine->homing.all && !stays_locked);
    return TASK_NONE;
}

/* Nothing within reach: if only second switches are missing, the gantry is too crooked, or one is broken. */
static enum alarm alarm_missed(const struct machine *machine) {
    const struct homing *homing = &machine->homing;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        if ((homing->left >> ax & 1) != 0 && !square_is_half(machine, ax))
            return ALARM_HOMING_MISSED;
    return ALARM_SQUARING;
}

/* Standing: some switch was found, or none within reach. */
static enum task_stage end_search(struct machine *machine) {
    const struct homing *homing = &machine->homing;
    drive_drop(machine);
    if (!square_take(machine) && homing->left != 0)
        return fail(machine, alarm_missed(machine));
    if (homing->left != 0)
        look(machine);
    else
        begin_step(machine, (uint8_t)(homing->step + 1));
    return TASK_HOMING;
}

enum task_stage homing_poll(struct machine *machine) {
    const struct homing *homing = &machine->homing;
    bool searches = homing->step == SEEK || homing->step == APPROACH;
    if (searches && square_has_news(machine))
        motion_hold(&machine->drive.motion);
    if (timer_runs(machine, &machine->clock.timer) || !drive_is_stopped(machine))
        return TASK_HOMING;
    if (searches)
        return end_search(machine);
    square_stand(machine);
    if (homing->step == BACK_OFF || homing->step == LAST_BACK_OFF)
        return end_back_off(machine);
    begin_step(machine, (uint8_t)(homing->step + 1));
    return TASK_HOMING;
}
