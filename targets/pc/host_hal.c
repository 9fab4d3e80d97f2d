/* SPDX-License-Identifier: MIT
 * The cold tier of the HAL, and the machine behind it. */
#include "host_inner.h"

#include "base/debug.h"
#include "hal/hal.h"

#include <stddef.h>
#include <stdio.h>
#include <string.h>

/* Ticks per us are kept in 1/256, because a timer need not count a whole number of MHz. */
uint32_t hal_time_us(const struct hal *hal) {
    return (uint32_t)((hal->step.now_ticks << 8) / hal->timer_mhz_q8);
}

/* With an output period (host_set_output_period()) pins change at its multiples only: outputs_follow(). */
static void put_out(struct hal *hal) {
    if (hal->output_period_ticks == 0)
        outputs_commit(hal);
}

/* A PC shows duties, not pulses. */
struct duty_register hal_spindle_pwm(struct hal *hal, uint32_t hz) {
    (void)hal;
    (void)hz;
    return (struct duty_register){.dark = 0, .least = 1, .full = DUTY_FULL};
}

void hal_spindle_set(struct hal *hal, const struct hal_spindle *spindle) {
    hal->outputs_set.spindle_direction = spindle->direction;
    hal->outputs_set.spindle_rpm = spindle->rpm;
    hal->keeps_duty = spindle->keeps_duty;
    if (!hal->keeps_duty)
        hal->outputs_set.spindle_duty = spindle->duty;
    put_out(hal);
}

static void set_probe(struct hal *hal) {
    const int line = hal->watched == HAL_TOOLSETTER ? VIRTUAL_TOOLSETTER : VIRTUAL_PROBE;
    bool touches = (hal->virtual_machine.levels >> line & 1) != 0;
    hal->step.probe = touches != hal->probe_high; /* the line is low on contact */
}

void hal_probe_watch(struct hal *hal, enum hal_probe probe, bool high) {
    hal->watched = probe;
    hal->probe_high = high;
    set_probe(hal);
}

void hal_coolant_set(struct hal *hal, uint8_t bits) {
    hal->outputs_set.coolant = bits;
    put_out(hal);
}

void hal_digital_set(struct hal *hal, uint8_t bits) {
    hal->virtual_machine.outputs.digital = bits;
}

void hal_motors_set(struct hal *hal, bool on, bool invert) {
    hal->virtual_machine.outputs.motors = on;
    /* The enable line is low while the motors are on, unless $4 inverts it. */
    hal->virtual_machine.outputs.enable_high = on == invert;
}

void hal_estop(struct hal *hal, bool invert, uint16_t dark) {
    hal_motors_set(hal, false, invert);
    hal_step_duty(&hal->step, dark);
    hal->outputs_set.spindle_direction = 0;
    hal->outputs_set.spindle_duty = dark;
    put_out(hal);
}

static void servo_set(struct hal *hal, uint16_t pulse_us) {
    hal->virtual_machine.outputs.servo_us = pulse_us;
}

const struct hal_servo host_servo = {.set = servo_set};

static void pump_set(struct hal *hal, uint32_t ticks) {
    hal->virtual_machine.outputs.pump_ticks = ticks;
}

struct hal_pump host_pump(const struct host_board *board) {
    return (struct hal_pump){.default_hz = board->pump_hz,
                             .clock_hz = board->pump_clock_hz,
                             .ticks_min = board->pump_ticks_min,
                             .ticks_max = board->pump_ticks_max,
                             .set = pump_set};
}

const struct hal_restart *host_restart(struct host *host, const struct host_board *board) {
    host->restart = (struct hal_restart){.cause = (enum hal_restart_cause)board->restart,
                                         .address_count = board->restart_address != 0,
                                         .address = {board->restart_address}};
    return board->restart != HAL_RESTART_NONE ? &host->restart : NULL;
}

static void analog_set(struct hal *hal, unsigned output, float percent) {
    hal->virtual_machine.outputs.analog_pct[output] = percent;
}

static float analog_read(const struct hal *hal, unsigned input) {
    return hal->virtual_machine.analog_pct[input];
}

const struct hal_analog host_analog = {
    .inputs = ANALOG_COUNT, .outputs = ANALOG_COUNT, .set = analog_set, .read = analog_read};

/* A closed contact rests at the e-stop's line; it opens when pressed. */
void hal_inputs_read(const struct hal *hal, struct hal_inputs *inputs) {
    const struct host *host = (const struct host *)((const char *)hal - offsetof(struct host, hal));
    virtual_read(&hal->virtual_machine, inputs);
    inputs->estop ^= host->machine.settings.estop_normally_open;
}

void hal_debug(enum debug_channel channel, const char *what, int32_t first, int32_t second) {
    static const char *const names[] = {
        [DEBUG_MACHINE] = "machine", [DEBUG_MOTION] = "motion", [DEBUG_STEP] = "step"};
    fprintf(stderr, "%s: %s: %ld %ld\n", names[channel], what, (long)first, (long)second);
}

/* As an interrupt of the inputs: the task that sleeps is woken, and the edge is taken at this tick. */
static void levels_changed(struct host *host) {
    set_probe(&host->hal);
    tasks_wake(&host->tasks, host->hal.step.now_ticks);
    machine_edge_isr(&host->machine);
}

void hal_switch_timer_start(struct hal *hal, uint32_t us) {
    hal->switch_ticks = hal->step.now_ticks + ((uint64_t)us * hal->timer_mhz_q8 >> 8);
}

uint64_t host_next_edge_ticks(const struct host *host) {
    uint64_t next = virtual_next_ticks(&host->hal.virtual_machine);
    return next < host->hal.switch_ticks ? next : host->hal.switch_ticks;
}

/* Behind the edges of the same moment. @return true when it has come */
static bool end_switch_time(struct host *host) {
    struct hal *hal = &host->hal;
    if (hal->switch_ticks > hal->step.now_ticks ||
        virtual_next_ticks(&hal->virtual_machine) <= hal->step.now_ticks)
        return false;
    hal->switch_ticks = UINT64_MAX;
    machine_switch_timer_isr(&host->machine);
    return true;
}

bool host_follow_edges(struct host *host) {
    bool changed = false;
    struct virtual_machine *machine = &host->hal.virtual_machine;
    for (; host->seen != host->hal.step.write; host->seen++) {
        if (host->hal.drivers.count > 0) {
            host_drivers_step(&host->hal, host->seen->step_mask, host->seen->dir_mask, host->seen->t_ticks);
            host_drivers_blind(&host->hal, machine->blind);
        }
        changed |= machine->follows && virtual_step(machine, host->seen->step_mask, host->seen->dir_mask);
    }
    changed |= virtual_events(machine, host->hal.step.now_ticks);
    if (changed)
        levels_changed(host);
    return end_switch_time(host) || changed;
}

/* From now on every edge counts. Until now the controller's own counter was true. */
static struct virtual_machine *follow(struct host *host) {
    struct virtual_machine *machine = &host->hal.virtual_machine;
    if (!machine->follows) {
        machine_position(&host->machine, machine->position);
        memcpy(machine->second, machine->position, sizeof machine->second);
    }
    machine->follows = true;
    machine->core_xy = host->machine.drive.joints.kinematics.coupled;
    return machine;
}

static void update(struct host *host) {
    if (virtual_update(follow(host)))
        levels_changed(host);
}

void virtual_set(struct host *host, int input, bool active) {
    if (input < 0 || input >= VIRTUAL_INPUT_COUNT)
        return;
    struct virtual_machine *machine = follow(host);
    uint64_t bit = (uint64_t)1 << input;
    machine->forced = active ? machine->forced | bit : machine->forced & ~bit;
    update(host);
}

void virtual_lock(struct host *host, uint8_t lock) {
    host->hal.virtual_machine.lock = lock;
}

bool virtual_at(struct host *host, uint64_t t_ticks, int input, bool active) {
    struct virtual_machine *machine = follow(host);
    if (input < 0 || input >= VIRTUAL_INPUT_COUNT || machine->event_count == VIRTUAL_EVENTS_MAX)
        return false;
    uint32_t at = machine->event_count++;
    /* The next event is the last one of the array, so that taking it moves nothing; of those at one
     * instant the one that was set first comes first. */
    for (; at > 0 && machine->events[at - 1].t_ticks <= t_ticks; at--)
        machine->events[at] = machine->events[at - 1];
    machine->events[at] =
        (struct virtual_event){.t_ticks = t_ticks, .input = (uint8_t)input, .active = active};
    return true;
}

void virtual_travel(struct host *host, unsigned axis, int32_t low_steps, int32_t high_steps) {
    struct virtual_machine *machine = follow(host);
    axis_mask_t bit = (axis_mask_t)(1u << axis);
    machine->has_low |= bit;
    machine->has_high |= bit;
    machine->low[axis] = low_steps;
    machine->high[axis] = high_steps;
    update(host);
}

void virtual_home(struct host *host, unsigned axis, int32_t low_steps, int32_t high_steps) {
    struct virtual_machine *machine = follow(host);
    machine->has_home |= (axis_mask_t)(1u << axis);
    machine->home_low[axis] = low_steps;
    machine->home_high[axis] = high_steps;
    update(host);
}

void virtual_no_travel(struct host *host, unsigned axis) {
    struct virtual_machine *machine = follow(host);
    axis_mask_t bit = (axis_mask_t)(1u << axis);
    machine->has_low &= (axis_mask_t)~bit;
    machine->has_high &= (axis_mask_t)~bit;
    machine->has_home &= (axis_mask_t)~bit;
    update(host);
}

void virtual_surface(struct host *host, int32_t z_steps) {
    struct virtual_machine *machine = follow(host);
    machine->has_surface = true;
    machine->surface = z_steps;
    update(host);
}

void virtual_no_surface(struct host *host) {
    follow(host)->has_surface = false;
    update(host);
}

void virtual_toolsetter(struct host *host, const int32_t at_steps[AXIS_COUNT], int32_t radius_steps) {
    struct virtual_machine *machine = follow(host);
    memcpy(machine->setter, at_steps, sizeof machine->setter);
    machine->setter_radius = radius_steps;
    update(host);
}

void virtual_dial(struct host *host, int32_t detents, double detents_s) {
    struct virtual_machine *machine = follow(host);
    const int32_t each = host->hal.dial.counts_per_detent > 0 ? host->hal.dial.counts_per_detent : 4;
    if (machine->dial_left == 0)
        machine->dial_ticks = host->hal.step.now_ticks;
    machine->dial_left += each * detents;
    machine->dial_each_ticks = (uint64_t)((double)host->hal.timer_hz / (each * detents_s));
}

void virtual_dial_slip(struct host *host) {
    follow(host)->forced ^= (uint64_t)1 << VIRTUAL_DIAL_A | (uint64_t)1 << VIRTUAL_DIAL_B;
    update(host);
}

/* cppcheck-suppress constParameterCallback ; the type of read() is fixed */
static void read_dial(struct hal *hal, struct hal_dial_state *out) {
    const struct virtual_machine *machine = &hal->virtual_machine;
    *out = (struct hal_dial_state){
        .counts = machine->dial.counts,
        .slips = machine->dial.slips,
        .axes = (axis_mask_t)(machine->levels >> VIRTUAL_DIAL_AXIS & ((1u << AXIS_COUNT) - 1)),
        .x10 = (machine->levels >> VIRTUAL_DIAL_X10 & 1) != 0,
        .x100 = (machine->levels >> VIRTUAL_DIAL_X100 & 1) != 0,
    };
}

struct hal_dial host_dial(unsigned code) {
    return (struct hal_dial){.counts_per_detent = (uint8_t)(code & 7),
                             .selects_axis = (code & HOST_DIAL_SELECTS) != 0,
                             .read = read_dial};
}

void virtual_place(struct host *host, const int32_t steps[AXIS_COUNT]) {
    memcpy(follow(host)->position, steps, sizeof host->hal.virtual_machine.position);
    memcpy(host->hal.virtual_machine.second, steps, sizeof host->hal.virtual_machine.second);
    update(host);
}

void virtual_skew(struct host *host, unsigned axis, int32_t steps) {
    struct virtual_machine *machine = follow(host);
    machine->second[axis] = machine->position[axis] + steps;
    update(host);
}

void virtual_second_position(const struct host *host, int32_t steps[AXIS_COUNT]) {
    const struct virtual_machine *machine = &host->hal.virtual_machine;
    virtual_position(host, steps);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        steps[ax] = machine->follows && (machine->ganged >> ax & 1) != 0 ? machine->second[ax] : steps[ax];
}

void virtual_take_motor(struct hal *hal, unsigned axis, unsigned from) {
    const axis_mask_t bit = (axis_mask_t)(1u << axis);
    hal->virtual_machine.ganged |= bit;
    hal->ganged.axes |= bit;
    hal->ganged.switched |= (hal->switchless >> from & 1) != 0 ? 0 : bit;
}

void virtual_hold_motors(struct hal *hal, axis_mask_t first, axis_mask_t second) {
    hal->virtual_machine.first_waits = first;
    hal->virtual_machine.second_waits = second;
}

void virtual_position(const struct host *host, int32_t steps[AXIS_COUNT]) {
    const struct virtual_machine *machine = &host->hal.virtual_machine;
    if (machine->follows)
        memcpy(steps, machine->position, sizeof machine->position);
    else
        machine_position(&host->machine, steps);
}

void virtual_analog(struct host *host, unsigned input, float percent) {
    if (input < ANALOG_COUNT)
        host->hal.virtual_machine.analog_pct[input] = percent;
}

void virtual_spindle_ramp(struct host *host, float rpm_s) {
    struct hal *hal = &host->hal;
    vspindle_note(&hal->virtual_machine.spindle, hal->step.now_ticks, hal->timer_hz);
    hal->virtual_machine.spindle.ramp_rpm_s = (double)rpm_s;
}

void virtual_spindle_load(struct host *host, float percent) {
    struct hal *hal = &host->hal;
    vspindle_note(&hal->virtual_machine.spindle, hal->step.now_ticks, hal->timer_hz);
    hal->virtual_machine.spindle.load = 0.01 * (double)percent;
}

void virtual_spindle_encoder(struct host *host, uint32_t counts_per_rev) {
    host->hal.virtual_machine.spindle.counts_per_rev = counts_per_rev;
}

double virtual_spindle_angle(const struct host *host, uint64_t t_ticks) {
    return vspindle_angle(&host->hal.virtual_machine.spindle, t_ticks, host->hal.timer_hz);
}

float virtual_spindle_rpm(const struct host *host) {
    const struct hal *hal = &host->hal;
    return (float)vspindle_rpm(&hal->virtual_machine.spindle, hal->step.now_ticks, hal->timer_hz);
}

/* cppcheck-suppress constParameterCallback ; the type of read() is fixed */
static void encoder_read(struct hal *hal, struct hal_encoder_state *out) {
    struct virtual_spindle spindle = hal->virtual_machine.spindle;
    struct vspindle_encoder encoder;
    if (spindle.counts_per_rev == 0)
        spindle.counts_per_rev = hal->settings->encoder_counts;
    vspindle_read(&spindle, hal->step.now_ticks, hal->timer_hz, &encoder);
    *out = (struct hal_encoder_state){.counts = (int32_t)encoder.counts,
                                      .edge_us = (uint32_t)((encoder.edge_ticks << 8) / hal->timer_mhz_q8),
                                      .index_counts = (int32_t)encoder.index_counts,
                                      .index_seen = encoder.index_seen};
}

const struct hal_encoder host_encoder = {.has_index = true, .read = encoder_read};

void virtual_outputs(const struct host *host, struct virtual_outputs *out) {
    *out = host->hal.virtual_machine.outputs;
}

uint64_t virtual_levels(const struct host *host) {
    return host->hal.virtual_machine.levels;
}
