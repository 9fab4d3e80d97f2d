/* SPDX-License-Identifier: MIT
 * The stages of one accepted G-code line. */
#include "machine/inner.h"
#include "machine/laser.h"

#include <math.h>

#define DWELL_SLICE_S 0.02  /* a hold stops a dwell within this */
#define AWAIT_SLICE_S 0.005 /* so do the inputs of M66 */

bool task_rest_reached(struct machine *machine) {
    if (machine_is_at_rest(machine))
        return true;
    motion_flush(&machine->motion);
    return false;
}

static uint8_t line_flags(const struct machine *machine, bool rapid) {
    uint8_t flags = rapid ? MOTION_FLAG_RAPID : 0;
    if (!rapid && (machine->stage == TASK_MOVE || machine->stage == TASK_ARC))
        flags |= MOTION_FLAG_CUT;
    if (machine->command.next.path != PATH_BLEND || machine->stage == TASK_THREAD)
        flags |= MOTION_FLAG_EXACT_STOP;
    return flags;
}

bool task_in_travel(const struct machine *machine, const double target_mm[AXIS_COUNT]) {
    const struct settings *settings = &machine->settings;
    if (!settings->soft_limits)
        return true;
    for (unsigned ax = 0; ax < machine->board.axis_count; ax++) {
        double travel_mm = (double)settings->max_travel_mm[ax];
        if ((machine->joints.kinematics.curved >> ax & 1) != 0)
            continue; /* reach.c */
        if (travel_mm > 0.0 && (target_mm[ax] > 0.0 || target_mm[ax] < -travel_mm))
            return false;
    }
    return true;
}

/* A line that leaves the travel brings everything to a controlled stop. */
bool task_leaves_travel(struct machine *machine, const double target_mm[AXIS_COUNT]) {
    if (task_in_travel(machine, target_mm))
        return false;
    motion_hold(&machine->motion);
    return true;
}

bool task_push_line(struct machine *machine, const double target_mm[AXIS_COUNT], bool rapid, float feed_mm_s,
                    float duration_s) {
    struct motion_line line = {.feed_mm_s = feed_mm_s,
                               .duration_s = duration_s,
                               .tolerance_mm = machine->command.next.path_tolerance_mm,
                               .line = machine->lines,
                               .note = machine->notes.count,
                               .spent_mm =
                                   machine->stage == TASK_ARC ? machine->settings.arc_tolerance_mm : 0.0f,
                               .flags = line_flags(machine, rapid)};
    if (machine->state == MACHINE_CHECK)
        return true;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        line.target_mm[ax] = target_mm[ax];
    return joints_line(&machine->joints, &machine->motion, &line, hal_time_us(machine->hal));
}

void task_set_position(struct machine *machine, const double target_mm[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        machine->gcode.position_mm[ax] = target_mm[ax];
}

void task_set_outputs(struct machine *machine, enum gcode_spindle spindle, uint8_t coolant) {
    if (machine->state == MACHINE_CHECK)
        return;
    outputs_set(machine, spindle, machine->command.next.spindle_rpm, coolant);
    laser_aim(machine);
}

static bool is_arc(const struct gcode_move *move) {
    return move->motion == MOTION_ARC_CW || move->motion == MOTION_ARC_CCW;
}

static bool is_spline(const struct gcode_move *move) {
    return move->motion == MOTION_CUBIC || move->motion == MOTION_QUADRATIC;
}

static void begin_curve(struct machine *machine) {
    const struct gcode_move *move = &machine->command.move;
    double tolerance_mm = (double)machine->settings.arc_tolerance_mm;
    if (is_spline(move))
        spline_begin(&machine->spline, machine->gcode.position_mm, move, tolerance_mm);
    else
        arc_begin(&machine->arc, machine->gcode.position_mm, move, tolerance_mm);
    machine->arc_feed_mm_s = move->feed_mm_s;
    if (move->inverse_time_s > 0.0f)
        machine->arc_feed_mm_s = (float)arc_length_mm(&machine->arc) / move->inverse_time_s;
    machine->arc_pending = false;
}

static bool next_point(struct machine *machine) {
    return is_spline(&machine->command.move) ? spline_next(&machine->spline, machine->arc_point_mm)
                                             : arc_next(&machine->arc, machine->arc_point_mm);
}

/* Chords until the curve is done, the look-ahead is full or the travel ends. */
static enum task_stage push_curve(struct machine *machine) {
    for (;;) {
        if (!machine->arc_pending && !next_point(machine))
            return TASK_NONE;
        if (!machine->arc_pending && task_leaves_travel(machine, machine->arc_point_mm))
            return TASK_SOFT_LIMIT;
        machine->arc_pending =
            !task_push_line(machine, machine->arc_point_mm, false, machine->arc_feed_mm_s, 0.0f);
        if (machine->arc_pending)
            return TASK_ARC;
    }
}

static bool push_move(struct machine *machine) {
    const struct gcode_move *move = &machine->command.move;
    return task_push_line(machine, move->target_mm, move->motion == MOTION_RAPID, move->feed_mm_s,
                          move->inverse_time_s);
}

/* Stages of which the line has nothing to do are passed over here. */
static enum task_stage stage_after_move(const struct machine *machine) {
    return machine->command.flow == FLOW_RUN ? TASK_NONE : TASK_FLOW;
}

/* The feed that the line asks for, mm/s; of a curve after begin_curve(). */
static float asked_feed_mm_s(const struct machine *machine) {
    const struct gcode_move *move = &machine->command.move;
    if (move->inverse_time_s <= 0.0f)
        return move->feed_mm_s;
    if (is_arc(move) || is_spline(move))
        return machine->arc_feed_mm_s;
    double sum = 0.0;
    for (unsigned ax = 0; ax <= AXIS_Z; ax++) {
        double way_mm = move->target_mm[ax] - machine->gcode.position_mm[ax];
        sum += way_mm * way_mm;
    }
    return (float)sqrt(sum) / move->inverse_time_s;
}

static void note_line(struct machine *machine) {
    const struct gcode_command *command = &machine->command;
    bool laser = machine->settings.laser_mode && command->spindle != SPINDLE_OFF;
    notes_add(&machine->notes, &(struct line_note){.line = machine->lines,
                                                   .number = command->line_number,
                                                   .rpm = laser ? command->next.spindle_rpm : 0.0f,
                                                   .feed_mm_s = laser ? asked_feed_mm_s(machine) : 0.0f});
}

static enum task_stage stage_of_move(struct machine *machine) {
    const struct gcode_move *move = &machine->command.move;
    if (move->motion == MOTION_NONE)
        return stage_after_move(machine);
    if (is_arc(move) || is_spline(move))
        begin_curve(machine);
    note_line(machine);
    thread_note_feed(machine);
    if (move->via)
        return task_leaves_travel(machine, move->via_mm) ? TASK_SOFT_LIMIT : TASK_VIA;
    if (is_arc(move) || is_spline(move))
        return TASK_ARC;
    if (task_leaves_travel(machine, move->target_mm))
        return TASK_SOFT_LIMIT;
    if (move->motion == MOTION_CYCLE) { /* all of it lies between these two and where it starts */
        drill_begin(machine);
        return task_leaves_travel(machine, move->via_mm) ? TASK_SOFT_LIMIT : TASK_CYCLE;
    }
    if (move->motion == MOTION_THREAD) {
        thread_start(machine);
        return task_leaves_travel(machine, move->via_mm) ? TASK_SOFT_LIMIT : TASK_THREAD;
    }
    if (move->motion != MOTION_PROBE)
        return TASK_MOVE;
    return machine->state == MACHINE_CHECK ? stage_after_move(machine) : TASK_PROBE;
}

static enum task_stage stage_after_input(const struct machine *machine) {
    return machine->command.dwell_s >= 0.0f ? TASK_DWELL : TASK_STORE;
}

static bool looks_at_input(const struct gcode_command *command) {
    return command->port >= 0 && command->port_kind >= PORT_DIGITAL_IN;
}

static enum task_stage stage_after_outputs(const struct machine *machine) {
    return looks_at_input(&machine->command) ? TASK_INPUT : stage_after_input(machine);
}

/* With a laser, S alone changes only the power: it comes with its line (outputs.c), without a stop. */
static bool needs_stop(const struct machine *machine) {
    const struct gcode_command *command = &machine->command;
    const struct gcode_modal *now = &machine->gcode.modal;
    return !machine->settings.laser_mode || command->spindle != now->spindle ||
           command->coolant != now->coolant || command->next.overrides != now->overrides ||
           command->next.feed_mode != now->feed_mode || command->port_sync;
}

static void set_digital(struct machine *machine) {
    const struct gcode_command *command = &machine->command;
    unsigned bit = 1u << command->port;
    machine->digital = (uint8_t)(command->port_on ? machine->digital | bit : machine->digital & ~bit);
    torque_put_out(machine);
}

static void set_port(struct machine *machine) {
    const struct gcode_command *command = &machine->command;
    if (command->port < 0 || machine->state == MACHINE_CHECK)
        return;
    if (command->port_kind == PORT_DIGITAL_OUT)
        set_digital(machine);
    else if (command->port_kind == PORT_ANALOG_OUT)
        machine->board.analog->set(machine->hal, (unsigned)command->port, command->port_pct);
}

/* All that a line switches. */
static void switch_outputs(struct machine *machine) {
    const struct gcode_command *command = &machine->command;
    realtime_enable(machine, command->next.overrides);
    task_set_outputs(machine, command->spindle, command->coolant);
    set_port(machine);
}

static enum task_stage stage_of_outputs(struct machine *machine) {
    if (machine->command.sync && needs_stop(machine))
        return TASK_OUTPUTS;
    if (machine->command.sync)
        laser_aim(machine);
    set_port(machine);
    return stage_after_outputs(machine);
}

void task_begin(struct machine *machine) {
    machine->stage = machine->command.tool_change ? TASK_TOOL : stage_of_outputs(machine);
}

/* M6: the operator changes the tool, and ~ goes on. */
static enum task_stage stop_for_tool(struct machine *machine) {
    struct gcode_modal *modal = &machine->gcode.modal;
    if (machine->state == MACHINE_CHECK)
        return stage_of_outputs(machine);
    task_set_outputs(machine, SPINDLE_OFF, 0);
    modal->spindle = SPINDLE_OFF;
    modal->coolant = 0;
    report_tool_change(machine);
    machine_transition(machine, MACHINE_STARTS);
    machine_transition(machine, MACHINE_HOLDS);
    return TASK_TOOL_WAIT;
}

static void reset_overrides(struct machine *machine) {
    machine->feed_pct = machine->rapid_pct = machine->spindle_pct = 100;
    machine_apply_override(machine);
    report_changed_override(machine);
}

/* M2 and M30 have set their modal state through command.next; M0 waits. */
static enum task_stage end_flow(struct machine *machine) {
    if (machine->command.flow == FLOW_END) {
        realtime_enable(machine, machine->command.next.overrides);
        reset_overrides(machine);
        task_set_outputs(machine, machine->command.next.spindle, machine->command.next.coolant);
        report_message(machine, "Pgm End");
        machine->coolant_told = 0;
        report_changed_offset(machine);
        return TASK_NONE;
    }
    if (machine->command.flow == FLOW_OPTIONAL_PAUSE || machine->state == MACHINE_CHECK)
        return TASK_NONE;
    machine_transition(machine, MACHINE_STARTS);
    machine_transition(machine, MACHINE_HOLDS);
    return TASK_PAUSED;
}

/* KEEP_BIT()s of what the line changes and what is stored. */
static unsigned keys_of(const struct gcode_command *command) {
    switch (command->store) {
    case STORE_NOTHING:
    case STORE_G92:
    case STORE_G92_ALONE:
        return 0;
    case STORE_TOOL:
        return KEEP_BIT(KEEP_TOOLS);
    default:
        return KEEP_ALL_OFFSETS;
    }
}

/* As in Grbl, a line that is stored waits for rest: what moves still has the offsets of its line. */
static enum task_stage store(struct machine *machine) {
    const struct gcode_command *command = &machine->command;
    const bool stores = command->store != STORE_NOTHING || command->store_tool_length;
    const unsigned keys = keys_of(command);
    if (keys != 0 && !task_rest_reached(machine))
        return TASK_STORE;
    if (stores)
        gcode_offsets_apply(&machine->gcode.offsets, command);
    if (stores || command->next.wcs != machine->gcode.modal.wcs)
        report_changed_offset(machine);
    if (keys != 0 && machine->state != MACHINE_CHECK)
        (void)keep_save(machine, keys);
    return stage_of_move(machine);
}

/* Slice by slice, so that a hold can come between. */
static enum task_stage dwell(struct machine *machine) {
    if (machine->state == MACHINE_CHECK)
        return machine->after_dwell;
    await_poll(machine);
    if (!motion_is_planned_out(&machine->motion))
        return TASK_DWELLING;
    if (machine->dwell_left_s <= 0.0 && !task_rest_reached(machine))
        return TASK_DWELLING;
    if (machine->dwell_left_s <= 0.0) {
        machine->input_awaited = false;
        return machine->after_dwell;
    }
    double slice_s = machine->input_awaited ? AWAIT_SLICE_S : DWELL_SLICE_S;
    if (machine->dwell_left_s < slice_s)
        slice_s = machine->dwell_left_s;
    machine->dwell_left_s -= slice_s;
    motion_dwell(&machine->motion, slice_s);
    return TASK_DWELLING;
}

static enum task_stage via(struct machine *machine) {
    const struct gcode_move *move = &machine->command.move;
    if (!task_push_line(machine, move->via_mm, true, 0.0f, 0.0f))
        return TASK_VIA;
    task_set_position(machine, move->via_mm);
    return task_leaves_travel(machine, move->target_mm) ? TASK_SOFT_LIMIT : TASK_MOVE;
}

static enum task_stage finish_move(struct machine *machine) {
    task_set_position(machine, machine->command.move.target_mm);
    return stage_after_move(machine);
}

/* After the stop nothing is lost; but the program is wrong, so only a reset leads on. */
static enum task_stage soft_limit(struct machine *machine) {
    if (!machine_is_stopped(machine))
        return TASK_SOFT_LIMIT;
    machine_alarm_critical(machine, ALARM_SOFT_LIMIT);
    return machine->stage;
}

/* The stage after this one, or this one when it must wait. */
static enum task_stage next_stage(struct machine *machine) {
    enum task_stage stage;
    switch (machine->stage) {
    case TASK_TOOL:
        return task_rest_reached(machine) ? stop_for_tool(machine) : TASK_TOOL;
    case TASK_OUTPUTS:
        if (!task_rest_reached(machine))
            return TASK_OUTPUTS;
        switch_outputs(machine);
        return stage_after_outputs(machine);
    case TASK_INPUT:
        return task_rest_reached(machine) ? await_begin(machine, stage_after_input(machine)) : TASK_INPUT;
    case TASK_DWELL:
        machine->dwell_left_s = (double)machine->command.dwell_s;
        machine->after_dwell = TASK_STORE;
        return task_rest_reached(machine) ? TASK_DWELLING : TASK_DWELL;
    case TASK_DWELLING:
        return dwell(machine);
    case TASK_STORE:
        return store(machine);
    case TASK_VIA:
        return via(machine);
    case TASK_MOVE:
        return push_move(machine) ? finish_move(machine) : TASK_MOVE;
    case TASK_ARC:
        stage = push_curve(machine);
        return stage == TASK_NONE ? finish_move(machine) : stage;
    case TASK_CYCLE:
        stage = drill_poll(machine);
        return stage == TASK_NONE ? finish_move(machine) : stage;
    case TASK_THREAD:
        stage = thread_poll(machine);
        return stage == TASK_NONE ? finish_move(machine) : stage;
    case TASK_FLOW:
        return task_rest_reached(machine) ? end_flow(machine) : TASK_FLOW;
    case TASK_JOG:
        return jog_poll(machine);
    case TASK_PROBE:
        return probe_begin(machine);
    case TASK_PROBING:
        return probe_poll(machine);
    case TASK_PROBED:
        list_probe(machine);
        return stage_after_move(machine);
    case TASK_ALARMED:
        return TASK_NONE;
    case TASK_SOFT_LIMIT:
        return soft_limit(machine);
    case TASK_HOMING:
        return homing_poll(machine);
    case TASK_TOOL_WAIT:
    case TASK_PAUSED:
    case TASK_NONE:
    default:
        return machine->stage;
    }
}

static void finish(struct machine *machine) {
    machine->stage = TASK_NONE;
    gcode_modal_apply(&machine->gcode, &machine->command);
    machine_answer(machine, STATUS_OK);
}

void task_resume(struct machine *machine) {
    if (machine->stage == TASK_PAUSED)
        finish(machine);
    else if (machine->stage == TASK_TOOL_WAIT)
        machine->stage = stage_of_outputs(machine);
}

bool task_poll(struct machine *machine) {
    if (machine->stage == TASK_LOCKED) {
        machine->stage = TASK_NONE;
        machine_answer(machine, STATUS_LOCKED);
        return true;
    }
    enum task_stage before = machine->stage;
    double dwell_before_s = machine->dwell_left_s;
    uint8_t homing_before = machine->homing.step, cycle_before = machine->thread.cycle.step;
    enum thread_step thread_before = machine->thread.step;
    enum task_stage after = next_stage(machine);
    if (machine->restart) /* an alarm inside has reset everything */
        return true;
    machine->stage = after;
    if (after == TASK_NONE && before == TASK_HOMING)
        machine->homed_line = true; /* after the startup lines */
    else if (after == TASK_NONE)
        finish(machine);
    return after != before || machine->dwell_left_s != dwell_before_s ||
           machine->homing.step != homing_before || machine->thread.step != thread_before ||
           machine->thread.cycle.step != cycle_before;
}
