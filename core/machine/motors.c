/* SPDX-License-Identifier: MIT
 * Power of the motors: on before the first step, off when $1 has passed since the last one. [motion side] */
#include "machine/motors.h"

#include "machine/parts.h"

#define MOTORS_STAY_ON_MS 255u /* $1: as in Grbl */
#define US_PER_MS         1000u

/* They hold what homing has found so far, and in sleep nothing. */
static bool stay_on(const struct machine *machine) {
    return machine->life.state == MACHINE_HOME ||
           (machine->settings.idle_delay_ms == MOTORS_STAY_ON_MS && machine->life.state != MACHINE_SLEEP);
}

/* As machine_is_standing(), but of what the motion side itself knows: the answer to a batch is the task's. */
static bool stands(const struct machine *machine) {
    return !segment_queue_is_pending(&machine->drive.motion.queue) && step_is_resting(&machine->drive.step);
}

/* By the e-stop, from its edge to the reset behind its release. */
static bool are_cut(const struct machine *machine) {
    const enum alarm alarm = machine->life.alarm;
    return machine->edges.estop || machine->inputs.estop || alarm == ALARM_ESTOP || alarm == ALARM_LOCKED;
}

static bool wanted(const struct machine *machine, bool rests, uint32_t now_us) {
    const struct machine_motors *motors = &machine->motors;
    if (are_cut(machine))
        return false;
    if (!rests || stay_on(machine))
        return true;
    return motors->on && machine->life.state != MACHINE_SLEEP &&
           now_us - motors->moved_us < machine->settings.idle_delay_ms * US_PER_MS;
}

static void put_out(struct machine *machine, bool on) {
    struct machine_motors *motors = &machine->motors;
    motors->on = on;
    motors->inverted = machine->settings.enable_invert;
    hal_motors_set(machine->hal, on, motors->inverted);
    if (on && machine->edges.cuts != motors->cuts) /* meanwhile */
        hal_motors_set(machine->hal, false, motors->inverted);
}

bool motors_poll(struct machine *machine) {
    struct machine_motors *motors = &machine->motors;
    uint32_t now_us = hal_time_us(machine->hal);
    const uint8_t cuts = machine->edges.cuts;
    if (cuts != motors->cuts) /* the e-stop's interrupt has switched them off */
        motors->on = false;
    motors->cuts = cuts;
    bool rests = stands(machine), on = wanted(machine, rests, now_us);
    /* A driver needs time between enable and the first step (motors_wake_us); until then no batch is cut
     * into spans. */
    if (on && !motors->on) {
        motors->awake = false;
        motors->woken_us = now_us;
    }
    if (!rests)
        motors->moved_us = now_us;
    if (on != motors->on || machine->settings.enable_invert != motors->inverted)
        put_out(machine, on);
    motors->awake |= now_us - motors->woken_us >= machine->board.motors_wake_us; /* before the clock wraps */
    return !on || motors->awake;
}

uint32_t motors_wait_us(const struct machine *machine) {
    const struct machine_motors *motors = &machine->motors;
    uint32_t awake_us = hal_time_us(machine->hal) - motors->woken_us;
    if (motors->awake || !motors->on || awake_us >= machine->board.motors_wake_us)
        return 0;
    return machine->board.motors_wake_us - awake_us;
}

void motors_init(struct machine *machine) {
    put_out(machine, false);
}

void motors_hold(struct machine *machine, axis_mask_t first, axis_mask_t second) {
    axis_mask_t *held = machine->motors.held;
    if (first == held[FIRST_MOTOR] && second == held[SECOND_MOTOR])
        return;
    held[FIRST_MOTOR] = first;
    held[SECOND_MOTOR] = second;
    machine->board.ganged->hold(machine->hal, first, second);
}

void motors_release(struct machine *machine) {
    motors_hold(machine, 0, 0);
}

void motors_keep_ahead(struct machine *machine, unsigned ax, int32_t steps) {
    machine->motors.ahead[ax] = steps;
}
