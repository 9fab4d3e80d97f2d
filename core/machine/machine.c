/* SPDX-License-Identifier: MIT */
#include "machine/machine.h"

#include "base/debug.h"

static uint16_t board_pulse_us(const struct machine_board *board) {
    return (uint16_t)((board->step_pulse_ns + 999) / 1000);
}

void machine_init(struct machine *machine, const struct machine_board *board, struct hal *hal,
                  struct hal_step *hal_step, const struct text_out *out) {
    static const struct prep_timing no_timing = {1, 1, 1};
    static const struct motion_limits no_limits = {.steps_per_mm = {1, 1, 1, 1, 1, 1}};
    machine->board = *board;
    machine->hal = hal;
    machine->out = *out;
    settings_defaults(&machine->settings);
    machine->settings.step_pulse_us = board_pulse_us(board);
    machine->gcode = (struct gcode_state){.axes = (axis_mask_t)((1u << board->axis_count) - 1)};
    gcode_modal_init(&machine->gcode.modal);
    rx_init(&machine->rx);
    line_reader_reset(&machine->reader);
    motion_init(&machine->motion, &no_limits);
    step_init(&machine->step, hal_step);
    prep_init(&machine->prep, &machine->motion.ring, &machine->step, &no_timing);
    machine->state = MACHINE_IDLE;
    machine->stage = TASK_NONE;
    machine->arc_pending = false;
    machine->lines = 0;
    report_banner(machine);
    machine_apply_settings(machine);
}

bool machine_is_at_rest(const struct machine *machine) {
    return motion_is_planned_out(&machine->motion) && machine_is_standing(machine);
}

bool machine_is_standing(const struct machine *machine) {
    return prep_is_empty(&machine->prep) && !machine->step.active;
}

void machine_position(const struct machine *machine, int32_t steps[AXIS_COUNT]) {
    step_position(&machine->step, machine->prep.position, steps);
}

void machine_input_pause(struct machine *machine) {
    motion_flush(&machine->motion);
}

void machine_answer(struct machine *machine, enum status status) {
    DEBUG(DEBUG_MACHINE, "answer: line, status", machine->lines, status);
    if (status == STATUS_OK) {
        text_string(&machine->out, "ok\r\n");
        return;
    }
    text_string(&machine->out, "error:");
    text_int(&machine->out, (int32_t)status);
    text_string(&machine->out, "\r\n");
}

static void report_clamp(struct machine *machine, unsigned axis, float mm_min) {
    text_string(&machine->out, "[MSG:$");
    text_int(&machine->out, (int32_t)(110 + axis));
    text_string(&machine->out, " is limited to ");
    text_fixed(&machine->out, (double)mm_min, 0);
    text_string(&machine->out, " mm/min by the board's step rate]\r\n");
}

/* Timer ticks that last at least this long. */
static uint32_t ticks_of(const struct machine_board *board, uint32_t ns) {
    return (uint32_t)(((uint64_t)board->timer_hz * ns + 999999999u) / 1000000000u);
}

void machine_apply_settings(struct machine *machine) {
    const struct settings *settings = &machine->settings;
    const struct machine_board *board = &machine->board;
    struct motion_limits limits = {.junction_deviation_mm = settings->junction_deviation_mm,
                                   .axis_count = board->axis_count};
    uint32_t pulse_ns = settings->step_pulse_us == board_pulse_us(board) ? board->step_pulse_ns
                                                                         : settings->step_pulse_us * 1000u;
    uint32_t pulse_rate_hz = 500000000u / pulse_ns; /* the pulse and a pause as long */
    float rate_hz =
        (float)(pulse_rate_hz < board->max_step_rate_hz ? pulse_rate_hz : board->max_step_rate_hz);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        float most_mm_min = 60.0f * rate_hz / settings->steps_per_mm[ax];
        float mm_min = settings->max_rate_mm_min[ax];
        if (mm_min > most_mm_min && ax < board->axis_count) {
            report_clamp(machine, ax, most_mm_min);
            mm_min = most_mm_min;
        }
        limits.steps_per_mm[ax] = settings->steps_per_mm[ax];
        limits.max_rate_mm_s[ax] = mm_min * (1.0f / 60.0f);
        limits.accel_mm_s2[ax] = settings->acceleration_mm_s2[ax];
    }
    motion_set_limits(&machine->motion, &limits);
    machine->prep.timing = (struct prep_timing){
        .timer_hz = board->timer_hz,
        .min_interval_ticks = ticks_of(board, 2 * pulse_ns),
        .dir_setup_ticks = ticks_of(board, board->dir_setup_ns),
    };
}

/* Stop at once and forget what was planned; the position is what the pins have made. */
static void reset(struct machine *machine) {
    int32_t position[AXIS_COUNT];
    bool moving = !machine_is_standing(machine);
    step_halt(&machine->step);
    machine_position(machine, position);
    step_flush(&machine->step);
    prep_reset(&machine->prep, position);
    motion_reset(&machine->motion, position);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        machine->gcode.position_mm[ax] = machine->motion.plan.position_mm[ax];
        machine->gcode.offsets.g92_mm[ax] = 0.0;
    }
    machine->gcode.offsets.tool_length_mm = 0.0;
    gcode_modal_init(&machine->gcode.modal);
    hal_spindle_set(machine->hal, 0, 0.0f);
    hal_coolant_set(machine->hal, 0);
    rx_flush(&machine->rx);
    line_reader_reset(&machine->reader);
    machine->stage = TASK_NONE;
    machine->arc_pending = false;
    if (moving) {
        machine->state = MACHINE_ALARM;
        text_string(&machine->out, "ALARM:3\r\n");
    } else if (machine->state != MACHINE_ALARM) {
        machine->state = MACHINE_IDLE;
    }
    report_banner(machine);
}

static void resume(struct machine *machine) {
    machine->state = MACHINE_IDLE;
    motion_resume(&machine->motion);
    if (machine->stage != TASK_PAUSED)
        return;
    machine->stage = TASK_NONE;
    machine->gcode.modal = machine->command.next;
    machine_answer(machine, STATUS_OK);
}

static bool take_realtime(struct machine *machine) {
    if (machine->rx.realtime == 0)
        return false;
    uint32_t bits = rx_take_realtime(&machine->rx);
    if ((bits & REALTIME_RESET) != 0)
        reset(machine);
    if ((bits & REALTIME_STATUS) != 0)
        report_status(machine);
    if ((bits & REALTIME_HOLD) != 0 && machine->state != MACHINE_ALARM) {
        machine->state = MACHINE_HOLD;
        motion_hold(&machine->motion);
    }
    if ((bits & REALTIME_RESUME) != 0 && machine->state == MACHINE_HOLD)
        resume(machine);
    return true;
}

static bool in_range(const struct machine *machine, const struct gcode_move *move) {
    if (move->motion == MOTION_NONE)
        return true;
    return motion_in_range(&machine->motion, move->target_mm) &&
           (!move->via || motion_in_range(&machine->motion, move->via_mm));
}

static void take_gcode(struct machine *machine, const char *line) {
    if (machine->state == MACHINE_ALARM) {
        machine_answer(machine, STATUS_LOCKED);
        return;
    }
    enum status status = gcode_line(&machine->gcode, line, &machine->command);
    if (status == STATUS_OK && !in_range(machine, &machine->command.move))
        status = STATUS_BAD_TARGET;
    if (status != STATUS_OK) {
        machine_answer(machine, status);
        return;
    }
    task_begin(machine);
}

/* Read up to the end of one line and begin it. @return false: no whole line there. */
static bool take_line(struct machine *machine) {
    for (;;) {
        int byte = rx_get(&machine->rx);
        if (byte < 0)
            return false;
        enum line_result result = line_reader_put(&machine->reader, (uint8_t)byte);
        if (result == LINE_NONE)
            continue;
        machine->lines++;
        if (result == LINE_OVERFLOW)
            machine_answer(machine, STATUS_LINE_TOO_LONG);
        else if (machine->reader.text[0] == '\0')
            machine_answer(machine, STATUS_OK);
        else if (machine->reader.text[0] == '$')
            machine_dollar(machine, machine->reader.text);
        else
            take_gcode(machine, machine->reader.text);
        return true;
    }
}

static void update_state(struct machine *machine) {
    if (machine->state == MACHINE_IDLE && !machine_is_at_rest(machine))
        machine->state = MACHINE_RUN;
    else if (machine->state == MACHINE_RUN && machine_is_at_rest(machine))
        machine->state = MACHINE_IDLE;
}

bool machine_poll(struct machine *machine) {
    bool any = take_realtime(machine);
    for (;;) {
        bool further = machine->stage != TASK_NONE ? task_poll(machine) : take_line(machine);
        if (!further)
            break;
        any = true;
    }
    any |= motion_poll(&machine->motion, hal_time_us(machine->hal));
    any |= prep_poll(&machine->prep);
    update_state(machine);
    return any;
}
