/* SPDX-License-Identifier: MIT
 * The stages of one accepted G-code line. */
#include "machine/task.h"

#include "machine/answer.h"
#include "machine/await.h"
#include "machine/drill.h"
#include "machine/drive.h"
#include "machine/homing.h"
#include "machine/jog.h"
#include "machine/laser.h"
#include "machine/list.h"
#include "machine/motor_current.h"
#include "machine/moves.h"
#include "machine/notes.h"
#include "machine/outputs.h"
#include "machine/overrides.h"
#include "machine/park.h"
#include "machine/parts.h"
#include "machine/place.h"
#include "machine/probe.h"
#include "machine/reach.h"
#include "machine/report.h"
#include "machine/reset.h"
#include "machine/run_up.h"
#include "machine/spindle_sync.h"
#include "machine/state.h"
#include "machine/stored_write.h"
#include "machine/suspend.h"
#include "machine/tool_change.h"

#include "gcode/shift.h"

#include <math.h>

#define DWELL_SLICE_S 0.02  /* a hold stops a dwell within this */
#define AWAIT_SLICE_S 0.005 /* so does what it awaits */

static bool is_arc(const struct gcode_move *move) {
    return move->motion == MOTION_ARC_CW || move->motion == MOTION_ARC_CCW;
}

static bool is_spline(const struct gcode_move *move) {
    return move->motion == MOTION_CUBIC || move->motion == MOTION_QUADRATIC;
}

static void begin_curve(struct machine *machine) {
    const struct gcode_move *move = &machine->task.command.move;
    double tolerance_mm = (double)machine->settings.arc_tolerance_mm;
    if (is_spline(move))
        spline_begin(&machine->task.spline, machine->interp.gcode.position_mm, move, tolerance_mm);
    else
        arc_begin(&machine->task.arc, machine->interp.gcode.position_mm, move, tolerance_mm);
    machine->task.arc_feed_mm_s = move->feed_mm_s;
    /* G93: F is the time of the whole curve, so its chords get a feed. Only arcs: splines refuse G93
     * (gcode/resolve_spline.c). */
    if (move->inverse_time_s > 0.0f)
        machine->task.arc_feed_mm_s = (float)arc_length_mm(&machine->task.arc) / move->inverse_time_s;
    machine->task.arc_pending = false;
}

static bool next_point(struct machine *machine) {
    return is_spline(&machine->task.command.move)
               ? spline_next(&machine->task.spline, machine->task.arc_point_mm)
               : arc_next(&machine->task.arc, machine->task.arc_point_mm);
}

/* Chords until the curve is done, the look-ahead is full or the travel ends. */
static enum task_stage push_curve(struct machine *machine) {
    for (;;) {
        if (!machine->task.arc_pending && !next_point(machine))
            return TASK_NONE;
        /* Each point of a curve, not only its end: an arc may bulge out of the travel. A point that waits
         * for room was checked when it was made. */
        if (!machine->task.arc_pending && reach_leaves_travel(machine, machine->task.arc_point_mm))
            return TASK_SOFT_LIMIT;
        machine->task.arc_pending =
            !moves_push(machine, machine->task.arc_point_mm, false, machine->task.arc_feed_mm_s, 0.0f);
        if (machine->task.arc_pending)
            return TASK_ARC;
    }
}

static bool push_move(struct machine *machine) {
    const struct gcode_move *move = &machine->task.command.move;
    return moves_push(machine, move->target_mm, move->motion == MOTION_RAPID, move->feed_mm_s,
                      move->inverse_time_s);
}

/* Stages of which the line has nothing to do are passed over here. */
static enum task_stage stage_after_move(const struct machine *machine) {
    return machine->task.command.flow == FLOW_RUN ? TASK_NONE : TASK_FLOW;
}

/* The N word for reports (notes.h), or by $10 the line's place in its program. Before the line's first move,
 * which carries the number of the newest note. */
static void note_line(struct machine *machine) {
    uint32_t number = machine->task.command.line_number;
    if (number == 0 && (machine->settings.report_mask & REPORT_LINES) != 0)
        number = machine->lines.program_line;
    notes_add(&machine->notes, &(struct line_note){.line = machine->lines.count, .number = number});
}

static enum task_stage stage_of_move(struct machine *machine) {
    const struct gcode_move *move = &machine->task.command.move;
    if (move->motion == MOTION_NONE)
        return stage_after_move(machine);
    if (machine->park.open) /* the reports' line and the feed per revolution are the job's */
        return TASK_PROBE;
    if (is_arc(move) || is_spline(move))
        begin_curve(machine);
    note_line(machine);
    /* Feed per revolution scales the feed of the moves that follow, so it must be in force before they are
     * pushed. */
    spindle_sync_note_feed(machine);
    if (move->via)
        return reach_leaves_travel(machine, move->via_mm) ? TASK_SOFT_LIMIT : TASK_VIA;
    if (is_arc(move) || is_spline(move))
        return TASK_ARC;
    if (reach_leaves_travel(machine, move->target_mm))
        return TASK_SOFT_LIMIT;
    if (move->motion == MOTION_CYCLE) { /* all of it lies between these two and where it starts */
        drill_begin(machine);
        return reach_leaves_travel(machine, move->via_mm) ? TASK_SOFT_LIMIT : TASK_CYCLE;
    }
    if (move->motion == MOTION_THREAD) {
        spindle_sync_start(machine);
        return reach_leaves_travel(machine, move->via_mm) ? TASK_SOFT_LIMIT : TASK_THREAD;
    }
    if (move->motion != MOTION_PROBE)
        return TASK_MOVE;
    /* In check mode nothing moves, so a probe would end in alarm 5; the line counts as done. */
    return machine->life.state == MACHINE_CHECK ? stage_after_move(machine) : TASK_PROBE;
}

static enum task_stage stage_after_input(const struct machine *machine) {
    return machine->task.command.dwell_s >= 0.0f ? TASK_DWELL : TASK_STORE;
}

static bool looks_at_input(const struct gcode_command *command) {
    return command->port >= 0 && command->port_kind >= PORT_DIGITAL_IN;
}

static enum task_stage stage_after_outputs(const struct machine *machine) {
    return looks_at_input(&machine->task.command) ? TASK_INPUT : stage_after_input(machine);
}

/* With a laser, S alone changes only the power: it comes with its line (outputs.c), without a stop. */
static bool needs_stop(const struct machine *machine) {
    const struct gcode_command *command = &machine->task.command;
    const struct gcode_modal *now = &machine->interp.gcode.modal;
    return !machine->settings.laser_mode || command->spindle != now->spindle ||
           command->coolant != now->coolant || command->next.overrides != now->overrides ||
           command->next.feed_mode != now->feed_mode || command->port_sync;
}

static void set_digital(struct machine *machine) {
    const struct gcode_command *command = &machine->task.command;
    unsigned bit = 1u << command->port;
    motor_current_set_digital(machine, command->port_on ? machine->ports.digital | bit
                                                        : machine->ports.digital & ~bit);
}

static void set_port(struct machine *machine) {
    const struct gcode_command *command = &machine->task.command;
    if (command->port < 0 || machine->life.state == MACHINE_CHECK)
        return;
    if (command->port_kind == PORT_DIGITAL_OUT)
        set_digital(machine);
    else if (command->port_kind == PORT_ANALOG_OUT)
        machine->board.analog->set(machine->hal, (unsigned)command->port, command->port_pct);
}

/* All that a line switches. */
static void switch_outputs(struct machine *machine) {
    const struct gcode_command *command = &machine->task.command;
    suspend_enable(machine, command->next.overrides);
    outputs_program(machine, command->spindle, command->coolant);
    set_port(machine);
}

/* Spindle, coolant and M53 wait for rest (TASK_OUTPUTS), so that they switch between two moves of the
 * program. A laser's S and ports of M64, M65 and M68 do not need it. */
static enum task_stage stage_of_outputs(struct machine *machine) {
    if (machine->task.command.sync && needs_stop(machine))
        return TASK_OUTPUTS;
    if (machine->task.command.sync)
        laser_aim(machine);
    set_port(machine);
    return stage_after_outputs(machine);
}

void task_shift(struct machine_task *task, const double shift_mm[AXIS_COUNT]) {
    struct gcode_move *move = &task->command.move;
    const bool cycles =
        task->stage == TASK_CYCLE || (task->stage == TASK_DWELLING && task->after_dwell == TASK_CYCLE);
    if (task->stage == TASK_NONE)
        return;
    shift_move(move, shift_mm);
    if (move->motion == MOTION_CYCLE)
        shift_sticky(&task->command.sticky, shift_mm);
    if (cycles) {
        shift_cycle(&task->cycle, shift_mm);
        shift_point(task->action.target_mm, shift_mm);
    } else if (task->stage == TASK_ARC) {
        shift_point(task->arc_point_mm, shift_mm);
        if (is_arc(move))
            shift_arc(&task->arc, shift_mm);
        else
            shift_spline(&task->spline, shift_mm);
    }
}

/* Before another line can come. The text of a stored line is not the reader's. */
static void take_note(struct machine *machine) {
    struct machine_task *task = &machine->task;
    const bool is_read = machine->lines.source == LINE_STREAM && task->command.store_tool_noted;
    task->note.is_given =
        is_read && line_reader_comment(&machine->lines.reader, task->note.text, sizeof task->note.text);
}

void task_begin(struct machine *machine) {
    if (machine->task.command.store == STORE_TOOL)
        take_note(machine);
    machine->task.stage = machine->task.command.tool_change ? TASK_TOOL : stage_of_outputs(machine);
}

/* M6: the operator changes the tool when the spindle is still, and ~ continues. */
static enum task_stage stop_for_tool(struct machine *machine) {
    const struct machine_outputs before = machine->outputs;
    if (machine->life.state == MACHINE_CHECK)
        return stage_of_outputs(machine);
    outputs_program(machine, SPINDLE_OFF, 0);
    if (before.spindle != SPINDLE_OFF) {
        const enum task_stage waits = await_outputs(machine, &before, TASK_TOOL);
        if (waits != TASK_TOOL)
            return waits;
    }
    interp_set_tools(&machine->interp, SPINDLE_OFF, machine->interp.gcode.modal.spindle_rpm, 0);
    report_tool_change(machine);
    state_go(machine, EVENT_START);
    state_go(machine, EVENT_HOLD);
    if (tool_change_goes(machine))
        park_ask_for_tool(&machine->park);
    return TASK_TOOL_WAIT;
}

/* M2 and M30 have set their modal state through command.next; M0 waits, and so does M1 while its switch is
 * on. */
static enum task_stage end_flow(struct machine *machine) {
    if (machine->task.command.flow == FLOW_END) {
        const struct machine_outputs before = machine->outputs;
        suspend_enable(machine, machine->task.command.next.overrides);
        overrides_reset(machine);
        outputs_program(machine, machine->task.command.next.spindle, machine->task.command.next.coolant);
        report_message(machine, "Pgm End");
        lines_end_program(&machine->lines);
        report_forget_coolant(&machine->reports);
        report_changed_offset(machine);
        return await_outputs(machine, &before, TASK_NONE);
    }
    const bool passes =
        machine->task.command.flow == FLOW_OPTIONAL_PAUSE && !overrides_pause(&machine->overrides);
    if (passes || machine->life.state == MACHINE_CHECK)
        return TASK_NONE;
    if (machine->lines.source == LINE_STREAM && !line_reader_has_message(&machine->lines.reader))
        report_line_comment(machine); /* what the operator is to do; a message was shown already */
    state_go(machine, EVENT_START);
    state_go(machine, EVENT_HOLD);
    return TASK_PAUSED;
}

/* STORED_BIT()s of what the line changes and what is stored. */
static unsigned keys_of(const struct gcode_command *command) {
    switch (command->store) {
    case STORE_NOTHING:
    case STORE_G92:
    case STORE_G92_ALONE:
        /* G92 is not stored: a reset clears it (interp_forget()). */
        return 0;
    case STORE_TOOL:
        return STORED_BIT(STORED_TOOLS);
    default:
        return STORED_ALL_OFFSETS;
    }
}

/* @return false: the line says nothing of a tool but its length */
static bool save_note(struct machine *machine, unsigned keys) {
    const struct machine_task *task = &machine->task;
    if (task->command.store != STORE_TOOL) /* and the note is another member of the union */
        return false;
    const struct tool_note_edit edit = {.tool = task->command.store_tool,
                                        .diameter_mm = task->command.store_tool_diameter_mm,
                                        .text = task->note.is_given ? task->note.text : NULL};
    if (edit.diameter_mm < 0.0f && edit.text == NULL)
        return false;
    stored_save_note(machine, keys | STORED_BIT(STORED_NOTES + tool_notes_key(edit.tool)), &edit);
    return true;
}

/* As in Grbl, a line that is stored waits for rest: what moves still has the offsets of its line. */
static enum task_stage store(struct machine *machine) {
    const struct gcode_command *command = &machine->task.command;
    const bool stores = command->store != STORE_NOTHING || command->store_tool_length;
    const unsigned keys = keys_of(command);
    if (keys != 0 && !drive_rest_reached(machine))
        return TASK_STORE;
    if (stores)
        gcode_offsets_apply(&machine->interp.gcode.offsets, command);
    if (stores || command->next.wcs != machine->interp.gcode.modal.wcs)
        report_changed_offset(machine);
    if (keys != 0 && machine->life.state != MACHINE_CHECK)
        (void)(save_note(machine, keys) || stored_save(machine, keys));
    return stage_of_move(machine);
}

static enum task_stage after_dwell(struct machine *machine) {
    const bool missed = machine->task.awaits == AWAIT_SPINDLE;
    machine->task.awaits = AWAIT_NOTHING;
    if (!missed)
        return machine->task.after_dwell;
    run_up_report_miss(machine);
    reset_alarm(machine, ALARM_SPINDLE);
    return machine->task.stage;
}

/* Slice by slice, so that a hold can come between. */
static enum task_stage dwell(struct machine *machine) {
    if (machine->life.state == MACHINE_CHECK)
        return machine->task.after_dwell;
    await_poll(machine);
    /* One slice in the planner at a time: what is planned already cannot be held back by a hold any more. */
    if (!motion_is_planned_out(&machine->drive.motion))
        return TASK_DWELLING;
    /* The last slice is planned; the dwell is over when the step engine has waited it out. */
    if (machine->task.dwell_left_s <= 0.0 && !drive_rest_reached(machine))
        return TASK_DWELLING;
    if (machine->task.dwell_left_s <= 0.0)
        return after_dwell(machine);
    double slice_s = machine->task.awaits != AWAIT_NOTHING ? AWAIT_SLICE_S : DWELL_SLICE_S;
    if (machine->task.dwell_left_s < slice_s)
        slice_s = machine->task.dwell_left_s;
    machine->task.dwell_left_s -= slice_s;
    task_note_further(&machine->task);
    motion_dwell(&machine->drive.motion, slice_s);
    return TASK_DWELLING;
}

/* First leg of G28 and G30. Its end was checked when the line began, that of the second leg is checked
 * only when the first one is in the planner. */
static enum task_stage via(struct machine *machine) {
    const struct gcode_move *move = &machine->task.command.move;
    if (!moves_push(machine, move->via_mm, true, 0.0f, 0.0f))
        return TASK_VIA;
    place_set_program(machine, move->via_mm);
    return reach_leaves_travel(machine, move->target_mm) ? TASK_SOFT_LIMIT : TASK_MOVE;
}

static enum task_stage finish_move(struct machine *machine) {
    place_set_program(machine, machine->task.command.move.target_mm);
    return stage_after_move(machine);
}

/* After the stop nothing is lost; but the program is wrong, so only a reset leads on. */
static enum task_stage soft_limit(struct machine *machine) {
    if (!drive_is_stopped(machine))
        return TASK_SOFT_LIMIT;
    reset_alarm(machine, ALARM_SOFT_LIMIT);
    return machine->task.stage;
}

/* ---- the stages: each returns the one that follows, or itself while it must wait ---- */

static enum task_stage stage_tool(struct machine *machine) {
    return drive_rest_reached(machine) ? stop_for_tool(machine) : TASK_TOOL;
}

static enum task_stage stage_outputs(struct machine *machine) {
    if (!drive_rest_reached(machine))
        return TASK_OUTPUTS;
    const enum task_stage turns_back = await_reversal(machine);
    if (turns_back != TASK_NONE)
        return turns_back;
    const struct machine_outputs before = machine->outputs;
    switch_outputs(machine);
    return await_outputs(machine, &before, stage_after_outputs(machine));
}

static enum task_stage stage_input(struct machine *machine) {
    return drive_rest_reached(machine) ? await_begin(machine, stage_after_input(machine)) : TASK_INPUT;
}

static enum task_stage stage_dwell(struct machine *machine) {
    machine->task.dwell_left_s = (double)machine->task.command.dwell_s;
    machine->task.after_dwell = TASK_STORE;
    return drive_rest_reached(machine) ? TASK_DWELLING : TASK_DWELL;
}

static enum task_stage stage_move(struct machine *machine) {
    return push_move(machine) ? finish_move(machine) : TASK_MOVE;
}

/* Stages that end with the motion of their line. */
static enum task_stage ends_move(struct machine *machine, enum task_stage stage) {
    return stage == TASK_NONE ? finish_move(machine) : stage;
}

static enum task_stage stage_arc(struct machine *machine) {
    return ends_move(machine, push_curve(machine));
}

static enum task_stage stage_cycle(struct machine *machine) {
    return ends_move(machine, drill_poll(machine));
}

static enum task_stage stage_thread(struct machine *machine) {
    return ends_move(machine, spindle_sync_poll(machine));
}

static enum task_stage stage_flow(struct machine *machine) {
    return drive_rest_reached(machine) ? end_flow(machine) : TASK_FLOW;
}

static enum task_stage stage_probed(struct machine *machine) {
    list_probe(machine);
    return stage_after_move(machine);
}

/* No task is carried on in a hold: `~` has come, or the quiet time is over. */
static enum task_stage stage_ends(struct machine *machine) {
    (void)machine;
    return TASK_NONE;
}

typedef enum task_stage stage_poll(struct machine *machine);
static stage_poll *const stages[TASK_STAGE_COUNT] = {
    [TASK_NONE] = stage_ends,       [TASK_TOOL] = stage_tool,    [TASK_TOOL_WAIT] = stage_of_outputs,
    [TASK_OUTPUTS] = stage_outputs, [TASK_INPUT] = stage_input,  [TASK_DWELL] = stage_dwell,
    [TASK_DWELLING] = dwell,        [TASK_STORE] = store,        [TASK_VIA] = via,
    [TASK_MOVE] = stage_move,       [TASK_ARC] = stage_arc,      [TASK_CYCLE] = stage_cycle,
    [TASK_THREAD] = stage_thread,   [TASK_FLOW] = stage_flow,    [TASK_PAUSED] = stage_ends,
    [TASK_JOG] = jog_poll,          [TASK_PROBE] = probe_begin,  [TASK_PROBING] = probe_poll,
    [TASK_PROBED] = stage_probed,   [TASK_ALARMED] = stage_ends, [TASK_SOFT_LIMIT] = soft_limit,
    [TASK_HOMING] = homing_poll,    [TASK_LOCKED] = stage_ends,  [TASK_TOOL_MOTION] = tool_change_poll,
};

/* The line is done. */
static void finish(struct machine *machine, enum task_stage last) {
    if (last == TASK_TOOL_MOTION) /* no line, or it is answered already */
        return;
    if (last == TASK_HOMING) {
        lines_answer_homing(&machine->lines, true); /* after the startup lines */
        return;
    }
    /* Modes of the line are in force only now: as long as it runs, $G has those before it. A line that a
     * critical alarm has ended sets none. */
    if (last != TASK_LOCKED)
        gcode_modal_apply(&machine->interp.gcode, &machine->task.command);
    const bool probed = last == TASK_PROBED || last == TASK_ALARMED;
    if (machine->park.open && probed && probe_has_failed(machine))
        answer_line(machine, STATUS_PARKED_PROBE);
    else
        answer_line(machine, last == TASK_LOCKED ? STATUS_LOCKED : STATUS_OK);
}

bool task_poll(struct machine *machine) {
    const enum task_stage before = machine->task.stage;
    machine->task.further = false;
    const enum task_stage after = stages[before](machine);
    if (machine->life.restart) /* an alarm inside has reset everything */
        return true;
    machine->task.stage = after;
    if (after == TASK_NONE)
        finish(machine, before);
    return after != before || machine->task.further;
}
