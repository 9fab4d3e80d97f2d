/* SPDX-License-Identifier: MIT
 * The stages of one accepted G-code line. */
#include "machine/machine.h"

static bool rest_reached(struct machine *machine) {
    if (machine_is_at_rest(machine))
        return true;
    motion_flush(&machine->motion);
    return false;
}

static uint8_t line_flags(const struct machine *machine, bool rapid) {
    uint8_t flags = rapid ? MOTION_FLAG_RAPID : 0;
    if (machine->command.next.path != PATH_BLEND)
        flags |= MOTION_FLAG_EXACT_STOP;
    return flags;
}

static bool push_line(struct machine *machine, const double target_mm[AXIS_COUNT], bool rapid,
                      float feed_mm_s, float duration_s) {
    struct motion_line line = {.feed_mm_s = feed_mm_s,
                               .duration_s = duration_s,
                               .line = machine->lines,
                               .flags = line_flags(machine, rapid)};
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        line.target_mm[ax] = target_mm[ax];
    return motion_line(&machine->motion, &line, hal_time_us(machine->hal));
}

static void set_position(struct machine *machine, const double target_mm[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        machine->gcode.position_mm[ax] = target_mm[ax];
}

static void set_outputs(struct machine *machine, enum gcode_spindle spindle, uint8_t coolant) {
    static const int direction[] = {[SPINDLE_OFF] = 0, [SPINDLE_CW] = 1, [SPINDLE_CCW] = -1};
    hal_spindle_set(machine->hal, direction[spindle], machine->command.next.spindle_rpm);
    hal_coolant_set(machine->hal, coolant);
}

static void begin_arc(struct machine *machine) {
    const struct gcode_move *move = &machine->command.move;
    arc_begin(&machine->arc, machine->gcode.position_mm, move, (double)machine->settings.arc_tolerance_mm);
    machine->arc_feed_mm_s = move->feed_mm_s;
    if (move->inverse_time_s > 0.0f)
        machine->arc_feed_mm_s = (float)arc_length_mm(&machine->arc) / move->inverse_time_s;
    machine->arc_pending = false;
}

/* Chords until the arc is done or the look-ahead is full. @return true when it is done. */
static bool push_arc(struct machine *machine) {
    for (;;) {
        if (!machine->arc_pending && !arc_next(&machine->arc, machine->arc_point_mm))
            return true;
        machine->arc_pending =
            !push_line(machine, machine->arc_point_mm, false, machine->arc_feed_mm_s, 0.0f);
        if (machine->arc_pending)
            return false;
    }
}

static bool push_move(struct machine *machine) {
    const struct gcode_move *move = &machine->command.move;
    return push_line(machine, move->target_mm, move->motion == MOTION_RAPID, move->feed_mm_s,
                     move->inverse_time_s);
}

static bool is_arc(const struct gcode_move *move) {
    return move->motion == MOTION_ARC_CW || move->motion == MOTION_ARC_CCW;
}

/* Stages of which the line has nothing to do are passed over here. */
static enum task_stage stage_after_move(const struct machine *machine) {
    return machine->command.flow == FLOW_RUN ? TASK_NONE : TASK_FLOW;
}

static enum task_stage stage_of_move(struct machine *machine) {
    const struct gcode_move *move = &machine->command.move;
    if (move->motion == MOTION_NONE)
        return stage_after_move(machine);
    if (move->via)
        return TASK_VIA;
    if (!is_arc(move))
        return TASK_MOVE;
    begin_arc(machine);
    return TASK_ARC;
}

static enum task_stage stage_after_outputs(const struct machine *machine) {
    return machine->command.dwell_s >= 0.0f ? TASK_DWELL : TASK_STORE;
}

void task_begin(struct machine *machine) {
    machine->stage = machine->command.sync ? TASK_OUTPUTS : stage_after_outputs(machine);
}

/* M2 and M30 have set their modal state through command.next; M0 waits. */
static enum task_stage end_flow(struct machine *machine) {
    if (machine->command.flow == FLOW_END) {
        set_outputs(machine, machine->command.next.spindle, machine->command.next.coolant);
        report_message(machine, "Pgm End");
        return TASK_NONE;
    }
    if (machine->command.flow == FLOW_OPTIONAL_PAUSE)
        return TASK_NONE;
    machine->state = MACHINE_HOLD;
    return TASK_PAUSED;
}

static enum task_stage store(struct machine *machine) {
    gcode_offsets_apply(&machine->gcode.offsets, &machine->command);
    return stage_of_move(machine);
}

/* The stage after this one, or this one when it must wait. */
static enum task_stage next_stage(struct machine *machine) {
    const struct gcode_move *move = &machine->command.move;
    switch (machine->stage) {
    case TASK_OUTPUTS:
        if (!rest_reached(machine))
            return TASK_OUTPUTS;
        set_outputs(machine, machine->command.spindle, machine->command.coolant);
        return stage_after_outputs(machine);
    case TASK_DWELL:
        if (!rest_reached(machine))
            return TASK_DWELL;
        motion_dwell(&machine->motion, (double)machine->command.dwell_s);
        return TASK_DWELLING;
    case TASK_DWELLING:
        return rest_reached(machine) ? TASK_STORE : TASK_DWELLING;
    case TASK_STORE:
        return store(machine);
    case TASK_VIA:
        return push_line(machine, move->via_mm, true, 0.0f, 0.0f) ? TASK_MOVE : TASK_VIA;
    case TASK_MOVE:
        if (!push_move(machine))
            return TASK_MOVE;
        set_position(machine, move->target_mm);
        return stage_after_move(machine);
    case TASK_ARC:
        if (!push_arc(machine))
            return TASK_ARC;
        set_position(machine, move->target_mm);
        return stage_after_move(machine);
    case TASK_FLOW:
        return rest_reached(machine) ? end_flow(machine) : TASK_FLOW;
    case TASK_PAUSED:
    case TASK_NONE:
    default:
        return machine->stage;
    }
}

bool task_poll(struct machine *machine) {
    enum task_stage before = machine->stage;
    machine->stage = next_stage(machine);
    if (machine->stage == TASK_NONE) {
        machine->gcode.modal = machine->command.next;
        machine_answer(machine, STATUS_OK);
    }
    return machine->stage != before;
}
