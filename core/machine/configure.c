/* SPDX-License-Identifier: MIT
 * What settings mean for the rest of the machine. */
#include "machine/configure.h"

#include "base/minmax.h"
#include "machine/drive.h"
#include "machine/host_motion.h"
#include "machine/motor_current.h"
#include "machine/outputs.h"
#include "machine/parts.h"
#include "machine/pump.h"
#include "machine/vfd_spindle.h"
#include "machine/wiring.h"

#include <stddef.h>

/* $0 as the board brings it: its step pulse in whole us, rounded up. */
static uint16_t board_pulse_us(const struct machine *machine) {
    return (uint16_t)((machine->board.step_pulse_ns + 999) / 1000);
}

static uint16_t configure_default_pulse_us(const struct machine *machine) {
    const uint16_t own_us = board_pulse_us(machine), us = machine->board.default_pulse_us;
    return us > own_us ? us : own_us;
}

void configure_board_defaults(struct machine *machine) {
    machine->settings.step_pulse_us = configure_default_pulse_us(machine);
    machine->settings.charge_pump_hz = pump_default_hz(machine);
}

/* What may hold an axis below its $110. */
enum rate_limit { LIMIT_BOARD, LIMIT_PULSE, LIMIT_STOP };

static void report_limit(struct machine *machine, unsigned axis, float mm_min, enum rate_limit by) {
    if (axis >= machine->board.axis_count)
        return;
    static const char *const reasons[] = {
        [LIMIT_BOARD] = " mm/min by the board's step rate",
        [LIMIT_PULSE] = " mm/min by the step pulse: $0=",
        [LIMIT_STOP] = " mm/min by its acceleration: $",
    };
    const struct text_out *out = &machine->out;
    text_string(out, "[MSG:$");
    text_int(out, (int32_t)(SETTING_MAX_RATE_MM_MIN + axis));
    text_string(out, " is limited to ");
    text_fixed(out, (double)mm_min, mm_min < 10.0f ? 3 : 0);
    text_string(out, reasons[by]);
    if (by == LIMIT_PULSE)
        text_int(out, machine->settings.step_pulse_us);
    if (by == LIMIT_STOP) {
        text_int(out, (int32_t)(SETTING_ACCELERATION_MM_S2 + axis));
        text_string(out, "=");
        text_fixed(out, (double)machine->settings.acceleration_mm_s2[axis], 3);
    }
    text_string(out, "]\r\n");
}

/* As long as asked for or longer, but no longer than the hardware can. */
static uint32_t on_grid(const struct machine_board *board, uint32_t ns) {
    const uint32_t grid = board->step_grid_ns;
    const uint32_t words = grid == 0 ? 0 : (ns + grid - 1) / grid;
    return grid == 0 ? ns : grid * (words < STEP_GRID_MAX ? words : STEP_GRID_MAX);
}

uint32_t machine_step_pulse_ns(const struct machine *machine) {
    uint16_t us = machine->settings.step_pulse_us;
    return us == board_pulse_us(machine) ? machine->board.step_pulse_ns
                                         : on_grid(&machine->board, us * 1000u);
}

/* Timer ticks that last at least this long. */
static uint32_t ticks_of(const struct machine_board *board, uint32_t ns) {
    return (uint32_t)(((uint64_t)board->timer_hz * ns + 999999999u) / 1000000000u);
}

static void set_encoder(struct machine *machine) {
    const struct settings *settings = &machine->settings;
    struct spindle *spindle = &machine->drive.motion.emit.spindle;
    machine->interp.gcode.ports.encoder =
        WITH_ENCODER && machine->board.encoder != NULL && settings->encoder_counts > 0;
    float per_rev = machine->interp.gcode.ports.encoder ? (float)settings->encoder_counts : 0.0f;
    if (spindle->per_rev != per_rev)
        /* Only when it has changed: a reset forgets the speed and angle that threads go by. */
        spindle_reset(spindle, per_rev);
}

/* Axes of a diagonal step at common events (step/prep.c), so a segment, 2 ms or longer, may have one event
 * more than any axis has steps over its time. Without room for it motion would be later and later, and its
 * stop too late and too short. */
static uint32_t steps_of_events_hz(uint32_t events_hz) {
    const uint32_t spare_hz = 500;
    return events_hz - (events_hz / 4 < spare_hz ? events_hz / 4 : spare_hz);
}

/* The pulse and a pause as long. */
static uint32_t step_ns(const struct machine *machine) {
    return 2 * machine_step_pulse_ns(machine) + machine->board.step_spread_ns;
}

/* Of $110 and following, and tells when it is less. */
static float max_rate_mm_min(struct machine *machine, unsigned axis) {
    const struct settings *settings = &machine->settings;
    const uint32_t board_hz = machine->board.max_step_rate_hz;
    const uint32_t pulse_hz = steps_of_events_hz(1000000000u / step_ns(machine));
    const float hz = (float)(pulse_hz < board_hz ? pulse_hz : board_hz);
    const float by_steps = 60.0f * hz / settings->steps_per_mm[axis];
    const float by_stop = 60.0f * MOTION_LONGEST_STOP_S * settings->acceleration_mm_s2[axis];
    const float most = min_f(by_steps, by_stop), set = settings->max_rate_mm_min[axis];
    if (set <= most)
        return set;
    report_limit(machine, axis, most,
                 by_stop < by_steps    ? LIMIT_STOP
                 : pulse_hz < board_hz ? LIMIT_PULSE
                                       : LIMIT_BOARD);
    return most;
}

static void apply_motion(struct machine *machine) {
    const struct settings *settings = &machine->settings;
    const struct machine_board *board = &machine->board;
    struct motion_limits limits = {.junction_deviation_mm = settings->junction_deviation_mm,
                                   .jerk_mm_s3 = settings->jerk_mm_s3,
                                   .shape_host = settings->shape_host,
                                   .axis_count = board->axis_count};
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        limits.steps_per_mm[ax] = settings->steps_per_mm[ax];
        limits.max_rate_mm_s[ax] = max_rate_mm_min(machine, ax) * (1.0f / 60.0f);
        limits.accel_mm_s2[ax] = settings->acceleration_mm_s2[ax];
        limits.shaper[ax] = (struct shaper_mode){(enum shaper_kind)settings->shaper[ax],
                                                 settings->shaper_hz[ax], settings->shaper_damping[ax]};
    }
    const float arm_mm[2] = {settings->arm_1_mm, settings->arm_2_mm};
    kinematics_init(&machine->drive.joints.kinematics, (enum kinematics_kind)settings->kinematics, arm_mm,
                    settings->max_travel_mm);
    /* After kinematics_init(): limits of the tool become those of the joints by it. The host queue gets
     * the result. */
    joints_limit(&machine->drive.joints, &limits);
    motion_set_limits(&machine->drive.motion, &limits);
    host_set_limits(machine, &limits);
    machine->drive.prep.timing = (struct prep_timing){
        .timer_hz = board->timer_hz,
        .min_interval_ticks = ticks_of(board, step_ns(machine)),
        .dir_setup_ticks = ticks_of(board, board->dir_setup_ns),
        .pwm = machine->drive.prep.timing.pwm,
        .curve = machine->drive.prep.timing.curve,
    };
}

static void apply_program(struct machine *machine) {
    machine->interp.gcode.arc_radius_tolerance_mm = machine->settings.arc_radius_tolerance_mm;
    machine->interp.gcode.ports.no_tool_change = machine->settings.tool_change == TOOL_CHANGE_IGNORE;
    set_encoder(machine);
    wiring_apply(machine);
}

/* The steps stay, so the machine is at another place in mm. */
static void apply_position(struct machine *machine) {
    trust_lose(&machine->trust, machine->trust.axes);
    drive_drop(machine);
}

void configure_pwm(struct machine *machine) {
    const struct settings *settings = &machine->settings;
    const uint8_t curve_pct[] = {settings->laser_curve_20_pct, settings->laser_curve_40_pct,
                                 settings->laser_curve_60_pct, settings->laser_curve_80_pct};
    const struct duty_register chip = hal_spindle_pwm(machine->hal, settings->pwm_hz);
    machine->drive.prep.timing.pwm =
        duty_register_within(&chip, settings->pwm_off_pct, settings->pwm_min_pct, settings->pwm_max_pct);
    machine->drive.prep.timing.curve = duty_curve_of(curve_pct);
}

static void apply_outputs(struct machine *machine) {
    configure_pwm(machine);
    vfd_spindle_configure(machine);
    outputs_apply(machine);
    motor_current_put_out(machine);
    pump_apply(machine);
}

void configure_apply(struct machine *machine) {
    vfd_spindle_configure(machine);
    apply_program(machine);
    apply_motion(machine);
}

/* In this order: the position in mm follows from the steps per mm that apply_motion() has passed on. Settings
 * with other effects are read where they are needed. */
static void apply_effects(struct machine *machine, unsigned effects) {
    if ((effects & SETTING_AFFECTS_PROGRAM) != 0)
        apply_program(machine);
    if ((effects & SETTING_AFFECTS_MOTION) != 0)
        apply_motion(machine);
    if ((effects & SETTING_AFFECTS_POSITION) != 0)
        apply_position(machine);
    if ((effects & SETTING_AFFECTS_OUTPUTS) != 0)
        apply_outputs(machine);
}

static bool is_pulse_long(const struct machine *machine, uint16_t number, double value) {
    const uint32_t grid_ns = machine->board.step_grid_ns;
    return number == SETTING_STEP_PULSE_US && grid_ns != 0 &&
           value * 1000.0 > (double)(grid_ns * STEP_GRID_MAX);
}

/* Grbl refuses $0 below 3; a board whose own pulse is shorter takes just that one back. */
static bool is_pulse_short(const struct machine *machine, uint16_t number, double value) {
    return number == SETTING_STEP_PULSE_US && value >= 0.0 && value < 3.0 &&
           value != (double)board_pulse_us(machine);
}

/* Its pulses would change under way, or what a laser makes of them. */
static bool is_pwm_in_use(const struct machine *machine, uint16_t number) {
    bool pwm = number >= SETTING_PWM_HZ && number <= SETTING_PWM_MAX_PCT;
    bool laser = number >= SETTING_LASER_CURVE_20_PCT && number <= SETTING_LASER_RISE_US;
    return (pwm || laser) && machine->outputs.spindle != SPINDLE_OFF;
}

/* A board's own pulse may be shorter than the whole microseconds that stand for it, and a grid makes it
 * longer. */
static void report_short_pulse(struct machine *machine) {
    const uint32_t ns = machine_step_pulse_ns(machine);
    if (ns == machine->settings.step_pulse_us * 1000u ||
        machine->settings.step_pulse_us == configure_default_pulse_us(machine))
        return;
    text_string(&machine->out, "[MSG:Step pulses of ");
    text_fixed(&machine->out, (double)ns * 1e-3, 1);
    text_string(&machine->out, " us]\r\n");
}

enum status configure_set(struct machine *machine, uint16_t number, double value) {
    if (is_pulse_short(machine, number, value))
        return STATUS_STEP_PULSE_SHORT;
    if (is_pulse_long(machine, number, value))
        return STATUS_STEP_PULSE_LONG;
    if (is_pwm_in_use(machine, number))
        return STATUS_PWM_IN_USE;
    if (vfd_spindle_has_setting(number) && machine->outputs.spindle != SPINDLE_OFF)
        return STATUS_VFD_IN_USE;
    /* Before anything is changed: what the board cannot do is refused as a whole. */
    enum status status = wiring_check(machine, number, value);
    if (status != STATUS_OK)
        return status;
    status = settings_set(&machine->settings, number, value, machine->board.axis_count);
    if (status != STATUS_OK)
        return status;
    apply_effects(machine, settings_effects(number));
    if (number == SETTING_STEP_PULSE_US)
        report_short_pulse(machine);
    return STATUS_OK;
}
