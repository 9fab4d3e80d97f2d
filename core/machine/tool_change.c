/* SPDX-License-Identifier: MIT
 * M6 by $341: the way up to where a tool is changed, and the measuring of its length. */
#include "machine/tool_change.h"

#include "machine/answer.h"
#include "machine/drive.h"
#include "machine/list.h"
#include "machine/park.h"
#include "machine/parts.h"
#include "machine/place.h"
#include "machine/probe.h"
#include "machine/report.h"

#include <stddef.h>
#include <string.h>

#define SETTER_WCS   (WCS_COUNT - 1) /* G59.3 */
#define BACK_MM      2.0             /* between the touches */
#define S_PER_MIN    60.0f
#define RAPID_MM_S   1e6f /* the slowest axis limits it */
#define TOWARDS_MUST 2u   /* G38.2 */
#define TOWARDS_MAY  3u   /* G38.3 */

/* In this order; $TPW without G59.3 begins with STEP_SEEK. */
enum tool_step {
    STEP_LIFT,
    STEP_ACROSS,
    STEP_DOWN, /* to Z of G59.3; nothing may touch */
    STEP_SEEK,
    STEP_BACK,
    STEP_LOCATE,
    STEP_LEAVE,
    STEP_DONE,
};

static bool at_setter(const struct machine *machine) {
    return machine->settings.tool_change == TOOL_CHANGE_TOUCH_OFF_AT_G59_3 ||
           machine->settings.tool_change == TOOL_CHANGE_SETTER;
}

bool tool_change_goes(const struct machine *machine) {
    return at_setter(machine) || machine->settings.tool_change == TOOL_CHANGE_TOUCH_OFF;
}

static const double *setter_mm(const struct machine *machine) {
    return machine->interp.gcode.offsets.wcs_mm[SETTER_WCS];
}

/* As high as homing leaves it. */
static double top_mm(const struct machine *machine) {
    return -(double)machine->settings.homing_pull_off_mm;
}

static double higher_mm(double a_mm, double b_mm) {
    return a_mm > b_mm ? a_mm : b_mm;
}

static double deeper_mm(double a_mm, double b_mm) {
    return a_mm < b_mm ? a_mm : b_mm;
}

/* ---- whether it is possible ---- */

static enum status check_places(const struct machine *machine) {
    const unsigned z = 1u << AXIS_Z, xyz = z | 1u << AXIS_X | 1u << AXIS_Y;
    const unsigned needs = (at_setter(machine) ? xyz : z) & machine->interp.gcode.axes;
    const double *mm = setter_mm(machine);
    if (machine->drive.joints.kinematics.curved != 0)
        return STATUS_PARKED_KINEMATICS;
    if ((machine_homed(machine) & needs) != needs)
        return STATUS_TOOL_NOT_HOMED;
    if (at_setter(machine) && mm[AXIS_X] == 0.0 && mm[AXIS_Y] == 0.0 && mm[AXIS_Z] == 0.0)
        return STATUS_NO_SETTER_PLACE;
    return STATUS_OK;
}

enum status tool_change_check(const struct machine *machine, const struct gcode_command *command) {
    if (!command->tool_change || !tool_change_goes(machine))
        return STATUS_OK;
    if (command->store != STORE_NOTHING || command->store_tool_length)
        return STATUS_PARKED_OFFSET;
    return check_places(machine);
}

/* ---- from step to step ---- */

static void start(struct machine *machine, enum tool_change_work work, enum tool_step first) {
    struct machine_tool_change *change = &machine->tool_change;
    double tool_mm[AXIS_COUNT];
    int32_t steps[AXIS_COUNT];
    machine_position(machine, steps);
    place_tool_mm(machine, steps, tool_mm);
    change->work = work;
    change->step = (uint8_t)first;
    change->under_way = change->stopped = false;
    change->from_mm = tool_mm[AXIS_Z];
    task_enter(&machine->task, TASK_TOOL_MOTION);
}

void tool_change_begin(struct machine *machine) {
    machine->tool_change.measured = false;
    start(machine, TOOL_CHANGE_GOES, STEP_LIFT);
}

enum status tool_change_probe(struct machine *machine) {
    enum status status = at_setter(machine) ? check_places(machine) : STATUS_OK;
    if (status == STATUS_OK && machine->drive.joints.kinematics.curved != 0)
        status = STATUS_PARKED_KINEMATICS;
    if (status == STATUS_OK && park_job_sets_offset(machine))
        status = STATUS_PARKED_OFFSET;
    if (status == STATUS_OK)
        start(machine, TOOL_CHANGE_ANSWERS, at_setter(machine) ? STEP_LIFT : STEP_SEEK);
    return status;
}

/* The operator has set a length, or a work zero, by hand. */
static bool is_set_by_hand(const struct machine *machine) {
    double shift_mm[AXIS_COUNT];
    interp_shift_mm(&machine->interp, &machine->aside.job.interp, shift_mm);
    return shift_mm[AXIS_Z] != 0.0;
}

bool tool_change_measure(struct machine *machine) {
    if (!machine->park.tool || machine->settings.tool_change != TOOL_CHANGE_SETTER ||
        machine->tool_change.measured || is_set_by_hand(machine))
        return false;
    start(machine, TOOL_CHANGE_MEASURES, STEP_LIFT);
    return true;
}

/* After STEP_ACROSS of M6 nothing is measured. */
static enum tool_step step_after(const struct machine *machine, enum tool_step step) {
    const bool goes = machine->tool_change.work == TOOL_CHANGE_GOES;
    if (goes && step == STEP_LIFT)
        return machine->settings.tool_change == TOOL_CHANGE_TOUCH_OFF_AT_G59_3 ? STEP_ACROSS : STEP_DONE;
    return goes && step == STEP_ACROSS ? STEP_DONE : step + 1;
}

static bool is_probing(enum tool_step step) {
    return step == STEP_DOWN || step == STEP_SEEK || step == STEP_LOCATE;
}

static double probe_end_mm(const struct machine *machine, double from_mm, double by_mm) {
    const double travel_mm = (double)machine->settings.max_travel_mm[AXIS_Z];
    const bool ends = machine->settings.soft_limits && travel_mm > 0.0;
    return ends && from_mm - by_mm < -travel_mm ? -travel_mm : from_mm - by_mm;
}

/* Where the step leads, and how fast. */
static void aim(const struct machine *machine, enum tool_step step, struct gcode_move *move) {
    const struct settings *settings = &machine->settings;
    double *to = move->target_mm;
    memset(move, 0, sizeof *move);
    move->motion = MOTION_RAPID;
    move->feed_mm_s = RAPID_MM_S;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        to[ax] = machine->interp.gcode.position_mm[ax];
    switch (step) {
    case STEP_LIFT:
        to[AXIS_Z] = higher_mm(to[AXIS_Z], top_mm(machine));
        break;
    case STEP_ACROSS:
        to[AXIS_X] = setter_mm(machine)[AXIS_X];
        to[AXIS_Y] = setter_mm(machine)[AXIS_Y];
        break;
    case STEP_DOWN:
        to[AXIS_Z] = deeper_mm(to[AXIS_Z], setter_mm(machine)[AXIS_Z]);
        move->probe = TOWARDS_MAY;
        break;
    case STEP_SEEK:
        to[AXIS_Z] = probe_end_mm(machine, to[AXIS_Z], (double)settings->tool_probe_distance_mm);
        move->feed_mm_s = settings->tool_seek_mm_min / S_PER_MIN;
        move->probe = TOWARDS_MUST;
        break;
    case STEP_BACK:
        to[AXIS_Z] =
            deeper_mm(to[AXIS_Z] + BACK_MM, higher_mm(machine->tool_change.from_mm, top_mm(machine)));
        move->feed_mm_s = settings->tool_pull_off_mm_min / S_PER_MIN;
        break;
    case STEP_LOCATE:
        to[AXIS_Z] = probe_end_mm(machine, to[AXIS_Z], 2.0 * BACK_MM);
        move->feed_mm_s = settings->tool_locate_mm_min / S_PER_MIN;
        move->probe = TOWARDS_MUST;
        break;
    case STEP_LEAVE:
        to[AXIS_Z] =
            at_setter(machine) ? higher_mm(to[AXIS_Z], top_mm(machine)) : machine->tool_change.from_mm;
        if (!at_setter(machine))
            move->feed_mm_s = settings->tool_pull_off_mm_min / S_PER_MIN;
        break;
    case STEP_DONE:
        break;
    }
}

/* ---- the length ---- */

static void tell_length(struct machine *machine, bool is_reference) {
    text_string(&machine->out,
                is_reference ? "[MSG:Tool length reference set, tool length: " : "[MSG:Tool length: ");
    report_length(machine, machine->interp.gcode.offsets.tool_length_mm);
    text_string(&machine->out, "]\r\n");
}

static void take_length(struct machine *machine) {
    struct machine_tool_change *change = &machine->tool_change;
    const bool is_reference = !change->has_reference;
    double touch_mm[AXIS_COUNT];
    place_tool_mm(machine, machine->probe.steps, touch_mm);
    if (is_reference)
        change->reference_mm = touch_mm[AXIS_Z] - machine->interp.gcode.offsets.tool_length_mm;
    change->has_reference = change->measured = true;
    interp_set_tool_length(&machine->interp, touch_mm[AXIS_Z] - change->reference_mm);
    list_probe(machine);
    report_changed_offset(machine);
    tell_length(machine, is_reference);
}

/* ---- TASK_TOOL_MOTION ---- */

static enum task_stage end(struct machine *machine, const char *wrong) {
    struct machine_tool_change *change = &machine->tool_change;
    const enum tool_change_work work = change->work;
    tool_change_end(change);
    if (wrong != NULL)
        report_message(machine, wrong);
    if (wrong != NULL && work == TOOL_CHANGE_MEASURES)
        park_keep(machine);
    if (work == TOOL_CHANGE_ANSWERS)
        answer_line(machine, wrong != NULL ? STATUS_PARKED_PROBE : STATUS_OK);
    return TASK_NONE;
}

static enum task_stage next_step(struct machine *machine) {
    struct machine_tool_change *change = &machine->tool_change;
    change->step = (uint8_t)step_after(machine, (enum tool_step)change->step);
    change->under_way = false;
    task_note_further(&machine->task);
    return change->step == STEP_DONE ? end(machine, NULL) : TASK_TOOL_MOTION;
}

static enum task_stage probe_ended(struct machine *machine, bool began) {
    const enum tool_step step = (enum tool_step)machine->tool_change.step;
    if (!began)
        return end(machine, "Tool not measured: it is in contact already");
    if (step == STEP_DOWN)
        return machine->probe.ok ? end(machine, "Tool not measured: it touched above Z of G59.3")
                                 : next_step(machine);
    if (!machine->probe.ok)
        return end(machine, "Tool not measured: no contact within $342");
    if (step == STEP_LOCATE)
        take_length(machine);
    return next_step(machine);
}

static enum task_stage begin_step(struct machine *machine) {
    struct machine_tool_change *change = &machine->tool_change;
    struct gcode_command *command = &machine->task.command;
    aim(machine, (enum tool_step)change->step, &command->move);
    command->next = machine->interp.gcode.modal;
    command->next.toolsetter = at_setter(machine) && machine->board.toolsetter;
    const enum status status = park_check_jog(machine, &command->move);
    if (status != STATUS_OK)
        return end(machine, "Tool change: the way leads out of the travel");
    if (is_probing((enum tool_step)change->step)) {
        const enum task_stage probes = probe_begin(machine);
        task_enter(&machine->task, TASK_TOOL_MOTION);
        change->under_way = probes == TASK_PROBING;
        return probes == TASK_ALARMED ? probe_ended(machine, false) : TASK_TOOL_MOTION;
    }
    change->under_way = park_move(machine, SEGMENT_JOG);
    return TASK_TOOL_MOTION;
}

enum task_stage tool_change_poll(struct machine *machine) {
    const struct machine_tool_change *change = &machine->tool_change;
    if (machine->park.stops)
        return TASK_TOOL_MOTION;
    if (!change->under_way && !drive_rest_reached(machine))
        return TASK_TOOL_MOTION;
    if (change->stopped && drive_rest_reached(machine))
        return end(machine, change->work == TOOL_CHANGE_GOES ? "Tool change: stopped on its way"
                                                             : "Tool not measured: stopped");
    if (!change->under_way)
        return begin_step(machine);
    if (is_probing((enum tool_step)change->step))
        return probe_poll(machine) == TASK_PROBED ? probe_ended(machine, true) : TASK_TOOL_MOTION;
    return drive_rest_reached(machine) ? next_step(machine) : TASK_TOOL_MOTION;
}
