/* SPDX-License-Identifier: MIT */
#include "machine/inner.h"

#include "base/debug.h"
#include "machine/wiring.h"

#include <string.h>

#define LATE_QUIET_US 1000000u /* from one report of underruns to the next */

uint16_t machine_board_pulse_us(const struct machine *machine) {
    return (uint16_t)((machine->board.step_pulse_ns + 999) / 1000);
}

static void take_planned_position(struct machine *machine) {
    joints_stand(&machine->joints, &machine->motion);
    task_set_position(machine, machine->joints.tool_mm);
}

void machine_init(struct machine *machine, const struct machine_board *board, struct hal *hal,
                  struct hal_step *hal_step, const struct text_out *out) {
    static const struct prep_timing no_timing = {1, 1, 1};
    static const struct motion_limits no_limits = {.steps_per_mm = {1, 1, 1, 1, 1, 1}};
    memset(machine, 0, sizeof *machine); /* not an assignment: clang makes a second machine on the stack */
    machine->board = *board;
    machine->hal = hal;
    machine->out = *out;
    settings_defaults(&machine->settings);
    machine->settings.step_pulse_us = machine_board_pulse_us(machine);
    machine->gcode.axes = (axis_mask_t)((1u << board->axis_count) - 1);
    machine->gcode.ports.digital_in = board->digital_inputs;
    machine->gcode.ports.digital_out = board->digital_outputs;
    if (board->analog != NULL) {
        machine->gcode.ports.analog_in = board->analog->inputs;
        machine->gcode.ports.analog_out = board->analog->outputs;
    }
    gcode_modal_init(&machine->gcode.modal);
    machine->params.numbered = machine->params_numbered;
    machine->params.numbered_room = PARAMS_NUMBERED;
    machine->params.named = machine->params_named;
    machine->params.named_room = PARAMS_NAMED;
    rx_init(&machine->rx);
    line_reader_reset(&machine->reader);
    machine->joints.kinematics.ops = &kinematics_cartesian; /* until the settings are there */
    motion_init(&machine->motion, &no_limits);
    feed_init(&machine->host.feed, &machine->motion.ahead);
    step_init(&machine->step, hal_step);
    prep_init(&machine->prep, &machine->motion.queue, &machine->step, &no_timing);
    machine->feed_pct = machine->rapid_pct = machine->spindle_pct = 100;
    keep_load(machine);
    wiring_fit(machine);
    machine->state = machine->settings.homing || keep_is_damaged(machine) ? MACHINE_ALARM : MACHINE_IDLE;
    inputs_begin(machine);
    outputs_off(machine);
    motors_init(machine);
    torque_put_out(machine);
    machine_restart(machine);
    machine_apply_settings(machine);
    take_planned_position(machine);
}

bool machine_is_at_rest(const struct machine *machine) {
    return motion_is_planned_out(&machine->motion) && feed_is_empty(&machine->host.feed) &&
           machine_is_standing(machine);
}

/* The motion side answers a batch after it has started the step timer for it. So looking for a batch first,
 * and then at the timer, misses nothing; each load is an acquire, so that they stay in this order. */
bool machine_is_standing(const struct machine *machine) {
    return !segment_queue_is_pending(&machine->motion.queue) && step_is_resting(&machine->step);
}

bool machine_is_stopped(const struct machine *machine) {
    return machine_is_standing(machine) && host_is_quiet(machine) &&
           (motion_is_held(&machine->motion) || motion_is_planned_out(&machine->motion));
}

void machine_position(const struct machine *machine, int32_t steps[AXIS_COUNT]) {
    step_position(&machine->step, steps);
}

void machine_axis_steps(const struct machine *machine, int32_t steps[AXIS_COUNT]) {
    machine_position(machine, steps);
    kinematics_axis_steps(&machine->joints.kinematics, steps);
}

void machine_tool_mm(const struct machine *machine, const int32_t steps[AXIS_COUNT], double mm[AXIS_COUNT]) {
    joints_tool_mm(&machine->joints, &machine->motion, steps, mm);
}

float machine_speed_mm_s(const struct machine *machine) {
    struct step_now now;
    int32_t way_steps[AXIS_COUNT];
    step_look(&machine->step, &now);
    if (!machine->step.active)
        return 0.0f;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        int32_t way = (int32_t)(now.increment[span_word(ax)] >> span_shift(ax) & 0xFFFFu);
        way_steps[ax] = (now.negative >> ax & 1) != 0 ? -way : way;
    }
    return joints_tool_speed(&machine->joints, &machine->motion, now.position, way_steps,
                             (float)now.v_um_s * 1e-3f);
}

void machine_on_motion_side(struct machine *machine, void (*work)(void *arg), void *arg) {
    const struct machine_board *board = &machine->board;
    if (board->motion_side == NULL)
        work(arg);
    else
        board->motion_side->call(board->motion_side_ctx, work, arg);
}

static void reset_motion(struct machine *machine, const int32_t position[AXIS_COUNT]) {
    prep_reset(&machine->prep, position);
    motion_reset(&machine->motion, position);
}

/* What machine_stand_at() has done on the motion side. */
struct stand {
    struct machine *machine;
    const int32_t *position;
};

/* cppcheck-suppress constParameterCallback ; the type of work() is fixed */
static void stand(void *arg) {
    const struct stand *at = arg;
    reset_motion(at->machine, at->position);
}

void machine_stand_at(struct machine *machine, const int32_t position[AXIS_COUNT]) {
    struct stand at = {.machine = machine, .position = position};
    machine_on_motion_side(machine, stand, &at);
    take_planned_position(machine);
}

/* What machine_halt() does on the motion side. */
struct halt {
    struct machine *machine;
    bool only_waited;
};

static void halt(void *arg) {
    struct halt *at = arg;
    struct machine *machine = at->machine;
    int32_t position[AXIS_COUNT];
    step_halt(&machine->step);
    at->only_waited = step_only_waits(&machine->step);
    host_note_done(machine);
    machine_position(machine, position);
    reset_motion(machine, position);
    machine->edges.latch[FIRST_MOTOR] = machine->edges.latch[SECOND_MOTOR] = 0;
    machine->edges.hard_limit = machine->edges.estop = false;
    host_drop(machine);
}

void machine_halt(struct machine *machine) {
    struct halt at = {.machine = machine};
    bool works = !machine_is_standing(machine);
    machine_on_motion_side(machine, halt, &at);
    if (works && !at.only_waited) { /* motors may have missed steps */
        machine->trusted = 0;
        machine->position_losses++;
    }
    take_planned_position(machine);
}

void machine_drop_motion(struct machine *machine) {
    int32_t position[AXIS_COUNT];
    machine_position(machine, position);
    machine_stand_at(machine, position);
}

void machine_input_pause(struct machine *machine) {
    motion_flush(&machine->motion);
}

uint8_t machine_feed_pct(const struct machine *machine) {
    return (machine->gcode.modal.overrides & OVERRIDE_FEED) != 0 ? machine->feed_pct : 100;
}

void machine_apply_override(struct machine *machine) {
    bool plain =
        machine->state == MACHINE_JOG || machine->state == MACHINE_HOME || machine->stage == TASK_PROBING;
    float feed = plain ? 1.0f : (float)machine_feed_pct(machine) * 0.01f * thread_feed_factor(machine);
    float rapid = plain ? 1.0f : (float)machine->rapid_pct * 0.01f;
    motion_set_override(&machine->motion, feed, rapid);
}

static void print_answer(const struct machine *machine, enum status status) {
    if (status == STATUS_OK) {
        text_string(&machine->out, "ok\r\n");
        return;
    }
    text_string(&machine->out, "error:");
    text_int(&machine->out, (int32_t)status);
    text_string(&machine->out, "\r\n");
}

void machine_answer(struct machine *machine, enum status status) {
    DEBUG(DEBUG_MACHINE, "answer: line, status", machine->lines, status);
    if (machine->source == LINE_STARTUP) {
        text_string(&machine->out, ">");
        text_string(&machine->out, machine->startup_lines[machine->startup - 1]);
        text_string(&machine->out, ":");
    } else if (machine->source == LINE_STORED && status == STATUS_OK) {
        machine->source = LINE_STREAM;
        keep_startup(machine);
    }
    if (keep_is_busy(machine)) { /* ok comes when it is stored */
        machine->kept.answers = true;
        return;
    }
    machine->line_open = false;
    print_answer(machine, status);
}

void machine_timer_start(const struct machine *machine, struct machine_timer *timer, uint32_t us) {
    *timer = (struct machine_timer){.on = us > 0, .from_us = hal_time_us(machine->hal), .us = us};
}

bool machine_timer_runs(const struct machine *machine, const struct machine_timer *timer) {
    return timer->on && hal_time_us(machine->hal) - timer->from_us < timer->us;
}

static uint32_t timer_left_us(const struct machine *machine, const struct machine_timer *timer) {
    if (!machine_timer_runs(machine, timer))
        return UINT32_MAX;
    return timer->us - (hal_time_us(machine->hal) - timer->from_us);
}

uint32_t machine_wait_us(const struct machine *machine) {
    uint32_t quiet = timer_left_us(machine, &machine->quiet);
    uint32_t timer = timer_left_us(machine, &machine->timer);
    uint32_t least = quiet < timer ? quiet : timer;
    uint32_t aim = timer_left_us(machine, &machine->outputs.aim);
    uint32_t motors = motors_wait_us(machine);
    if (aim < least)
        least = aim;
    if (motors > 0 && motors < least)
        least = motors;
    if (machine->motion.waits && !machine->critical && least > MOTION_START_DELAY_US)
        least = MOTION_START_DELAY_US;
    return least;
}

static void report_clamp(struct machine *machine, unsigned axis, float mm_min) {
    text_string(&machine->out, "[MSG:$");
    text_int(&machine->out, (int32_t)(110 + axis));
    text_string(&machine->out, " is limited to ");
    text_fixed(&machine->out, (double)mm_min, 0);
    text_string(&machine->out, " mm/min by the board's step rate]\r\n");
}

uint32_t machine_step_pulse_ns(const struct machine *machine) {
    uint16_t us = machine->settings.step_pulse_us;
    return us == machine_board_pulse_us(machine) ? machine->board.step_pulse_ns : us * 1000u;
}

/* Timer ticks that last at least this long. */
static uint32_t ticks_of(const struct machine_board *board, uint32_t ns) {
    return (uint32_t)(((uint64_t)board->timer_hz * ns + 999999999u) / 1000000000u);
}

void machine_apply_settings(struct machine *machine) {
    const struct settings *settings = &machine->settings;
    const struct machine_board *board = &machine->board;
    struct motion_limits limits = {.junction_deviation_mm = settings->junction_deviation_mm,
                                   .jerk_mm_s3 = settings->jerk_mm_s3,
                                   .axis_count = board->axis_count};
    uint32_t pulse_ns = machine_step_pulse_ns(machine);
    uint32_t step_ns = 2 * pulse_ns + board->step_spread_ns; /* the pulse and a pause as long */
    uint32_t pulse_rate_hz = 1000000000u / step_ns;
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
    machine->gcode.arc_radius_tolerance_mm = settings->arc_radius_tolerance_mm;
    thread_set_encoder(machine);
    wiring_apply(machine);
    const float arm_mm[2] = {settings->arm_1_mm, settings->arm_2_mm};
    kinematics_init(&machine->joints.kinematics, (enum kinematics_kind)settings->kinematics, arm_mm,
                    settings->max_travel_mm);
    joints_limit(&machine->joints, &limits);
    motion_set_limits(&machine->motion, &limits);
    host_set_limits(machine, &limits);
    machine->prep.timing = (struct prep_timing){
        .timer_hz = board->timer_hz,
        .min_interval_ticks = ticks_of(board, step_ns),
        .dir_setup_ticks = ticks_of(board, board->dir_setup_ns),
    };
}

/* The line was resolved into machine->command. */
static void begin_gcode(struct machine *machine) {
    const struct gcode_command *command = &machine->command;
    enum status status = reach_move(machine, &command->move);
    if (status == STATUS_OK)
        status = thread_check(machine, command);
    if (command->port >= 0 && command->port_kind == PORT_DIGITAL_OUT &&
        (torque_mask(machine) >> command->port & 1) != 0)
        status = STATUS_NO_PORT; /* it is a torque line */
    if (status == STATUS_OK) {
        wiring_report_coolant(machine);
        task_begin(machine);
    } else {
        machine_answer(machine, status);
    }
}

static void take_gcode(struct machine *machine, const char *line) {
    if (machine->state == MACHINE_ALARM || machine->state == MACHINE_JOG) {
        machine_answer(machine, STATUS_LOCKED);
        return;
    }
    enum status status = gcode_line(&machine->gcode, line, &machine->command);
    if (status != STATUS_OK)
        status = compute_line(machine, line, status);
    if (status == STATUS_OK)
        begin_gcode(machine);
    else
        machine_answer(machine, status);
}

/* Next startup line after the banner or homing. @return false: there is none. */
static bool take_startup(struct machine *machine) {
    while (machine->startup < STARTUP_LINE_COUNT) {
        const char *line = machine->startup_lines[machine->startup++];
        if (line[0] == '\0')
            continue;
        machine->source = LINE_STARTUP;
        machine->line_open = true;
        take_gcode(machine, line);
        return true;
    }
    if (!machine->homed_line)
        return false;
    machine->homed_line = false;
    machine->source = LINE_STREAM;
    machine_answer(machine, STATUS_OK);
    return true;
}

/* Began in the buffer before the jog was cancelled. */
static bool is_flushed(struct machine *machine, const char *line) {
    if (!machine->flushing)
        return false;
    machine->flushing = (int32_t)(machine->flush_until - machine->line_from) > 0;
    return machine->flushing && line[0] == '$' && line[1] == 'J' && line[2] == '=';
}

static void open_line(struct machine *machine) {
    machine->lines++;
    machine->source = LINE_STREAM;
    machine->line_open = true;
}

static void take_text(struct machine *machine, enum line_result result) {
    const char *line = machine->reader.text;
    open_line(machine);
    if (result == LINE_BROKEN)
        report_gaps(machine);
    if (result == LINE_OVERFLOW || result == LINE_BROKEN)
        machine_answer(machine, STATUS_LINE_TOO_LONG);
    else if (line[0] == '\0' || is_flushed(machine, line))
        machine_answer(machine, STATUS_OK);
    else if (line[0] == '$')
        command_line(machine, line);
    else
        take_gcode(machine, line);
}

/* A line that found no room in the receive buffer: its place in the row of answers. One at a time, as there
 * is room for answers: a thousand of them would hold everything up. */
static bool answer_lost(struct machine *machine) {
    if (!rx_take_lost(&machine->rx))
        return false;
    line_reader_reset(&machine->reader);
    if (!machine->overflow_told)
        report_message(machine, "Receive buffer overflow");
    machine->overflow_told = true;
    take_text(machine, LINE_OVERFLOW);
    return true;
}

/* A plain line of G-code that has come whole needs no filter. @return bytes taken; 0: it is none */
static size_t take_plain(struct machine *machine, const uint8_t *bytes, size_t count) {
    const uint8_t *line = line_reader_whole(&machine->reader, bytes, count);
    if (line == NULL || machine->flushing || machine->state == MACHINE_ALARM || machine->state == MACHINE_JOG)
        return 0;
    const char *end = gcode_plain_line(&machine->gcode, (const char *)line, &machine->command);
    if (end == NULL)
        return 0;
    line_reader_pass(&machine->reader, (uint8_t)*end);
    open_line(machine);
    begin_gcode(machine);
    return (size_t)((const uint8_t *)end - bytes) + 1;
}

/* Read up to the end of one line and begin it. @return false: no whole line there. */
static bool take_line(struct machine *machine) {
    for (;;) {
        const uint8_t *bytes;
        enum line_result result;
        size_t count = rx_peek(&machine->rx, &bytes);
        if (count == 0)
            return answer_lost(machine);
        machine->overflow_told = false;
        size_t plain = take_plain(machine, bytes, count);
        rx_drop(&machine->rx, plain > 0 ? plain : line_reader_take(&machine->reader, bytes, count, &result));
        if (plain == 0 && result == LINE_NONE)
            continue;
        if (plain == 0)
            take_text(machine, result);
        machine->line_from = rx_taken(&machine->rx);
        return true;
    }
}

static bool update_state(struct machine *machine) {
    if (machine->state == MACHINE_IDLE)
        return (machine->stage != TASK_NONE || !machine_is_at_rest(machine)) &&
               machine_transition(machine, MACHINE_STARTS);
    bool works = !machine_is_at_rest(machine) || machine->stage != TASK_NONE;
    if (works || machine->cancelling || machine->state == MACHINE_HOME)
        return false;
    bool jogged = machine->state == MACHINE_JOG;
    if (!machine_transition(machine, MACHINE_RESTS))
        return false;
    if (jogged)
        machine_apply_override(machine);
    return true;
}

static bool lines_poll(struct machine *machine) {
    bool any = false;
    while (!machine->restart && !machine->quiet.on && !keep_is_busy(machine)) {
        bool further = false;
        if (machine->stage != TASK_NONE)
            further = machine_works(machine) && task_poll(machine);
        else if (machine_reads(machine) && text_has_room(&machine->out))
            further = take_startup(machine) || take_line(machine);
        if (!further)
            break;
        update_state(machine); /* the next line sees what this one began */
        any = true;
    }
    return any;
}

/* @return true while nothing may be said or read after an alarm */
static bool is_quiet(struct machine *machine) {
    machine->quiet.on = machine_timer_runs(machine, &machine->quiet); /* off before the clock wraps */
    machine->timer.on = machine_timer_runs(machine, &machine->timer);
    return machine->quiet.on;
}

bool machine_poll_motion(struct machine *machine) {
    bool rested = !machine->step.active;
    bool any = motors_poll(machine) && prep_poll(&machine->prep);
    if (rested && machine->step.active) {
        machine->motion_started_us = hal_time_us(machine->hal);
        __atomic_store_n(&machine->motion_starts, machine->motion_starts + 1, __ATOMIC_RELEASE);
    }
    return any;
}

/* What leads out of a critical alarm. While the e-stop is pressed a reset only leads into the next one, and
 * programs that reset at this message would go on so for ever. */
static void tell_way_out(struct machine *machine) {
    bool pressed = machine->alarm == ALARM_ESTOP && machine->inputs.estop;
    if (!machine->critical_untold || (pressed && machine->release_told))
        return;
    machine->release_told = pressed;
    machine->critical_untold = pressed;
    report_message(machine, pressed ? "Release the emergency stop" : "Reset to continue");
}

/* Underruns, not more often than once in LATE_QUIET_US. */
static void tell_late(struct machine *machine) {
    machine->late_quiet.on = machine_timer_runs(machine, &machine->late_quiet); /* before the clock wraps */
    if (machine->late_told == machine->motion.ahead.late || machine->late_quiet.on)
        return;
    machine->late_told = machine->motion.ahead.late;
    report_underruns(machine);
    machine_timer_start(machine, &machine->late_quiet, LATE_QUIET_US);
}

bool machine_poll(struct machine *machine) {
    bool any = inputs_poll(machine);
    if (is_quiet(machine))
        return any;
    tell_way_out(machine);
    any |= realtime_poll(machine);
    if (is_quiet(machine))
        return any;
    any |= keep_poll(machine);
    if (machine->restart && !keep_is_busy(machine)) {
        machine_restart(machine);
        any = true;
    }
    any |= suspend_poll(machine);
    any |= sender_lost_poll(machine);
    thread_watch(machine);
    any |= lines_poll(machine);
    outputs_poll(machine);
    if (machine->critical)
        return any;
    any |= host_poll(machine);
    any |= motion_poll(&machine->motion, hal_time_us(machine->hal));
    tell_late(machine);
    torque_poll(machine);
    servo_poll(machine);
    if (machine->board.motion_side == NULL)
        any |= machine_poll_motion(machine);
    any |= update_state(machine);
    return any;
}
