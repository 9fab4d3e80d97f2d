/* SPDX-License-Identifier: MIT
 * Motor drivers with registers: what is wanted of them, and what is wrong with them. */
#include "machine/motor_drivers.h"

#include "machine/driver_list.h"
#include "machine/parts.h"

#include <string.h>

#define GATHER_US      150000u  /* what has one cause is reported in one message */
#define RECENT_US      5000000u /* a loose plug makes a hundred faults a second; so many messages ... */
#define RECENT_MAX     4        /* ... in this time, then only of faults that are not reported yet */
#define STEALTH_ALWAYS UINT16_MAX
#define SLOW_STEPS_S   100.0f /* full steps: half a turn of a motor with 200 */

/* ---- what is wanted ---- */

unsigned motor_drivers_axis(const struct machine *machine, unsigned n) {
    const unsigned own = machine->board.drivers->set.wire[n].axis;
    for (unsigned ax = 0; ax < machine->board.axis_count; ax++)
        if (machine->settings.second_motor[ax] == own + 1u)
            return ax;
    return own < machine->board.axis_count ? own : AXIS_COUNT;
}

/* $260 .., or as slow as the motor's back-EMF allows. */
static float slowest_mm_min(const struct settings *settings, unsigned ax) {
    if (settings->driver_stall_mm_min[ax] != 0)
        return settings->driver_stall_mm_min[ax];
    return 60.0f * SLOW_STEPS_S * settings->driver_microsteps[ax] / settings->steps_per_mm[ax];
}

static uint32_t tstep_at(const struct settings *settings, unsigned ax, float mm_min) {
    return tmc_tstep(mm_min / 60.0f * settings->steps_per_mm[ax], settings->driver_microsteps[ax]);
}

static uint32_t stealth_tstep(const struct settings *settings, unsigned ax) {
    const uint16_t mm_min = settings->driver_stealth_mm_min[ax];
    if (mm_min == 0 || mm_min == STEALTH_ALWAYS)
        return mm_min == 0 ? 0 : UINT32_MAX;
    return tstep_at(settings, ax, mm_min);
}

/* Set up for StallGuard while its axis homes, and only then: DIAG would be a limit switch that closes. */
static bool is_armed(const struct machine *machine, unsigned n, unsigned ax) {
    return machine->life.state == MACHINE_HOME && (machine->homing.axes >> ax & 1u) != 0 &&
           machine->settings.driver_stall[ax] != 0 && machine->board.drivers->set.wire[n].diag;
}

static void want(struct machine *machine, unsigned n) {
    const struct settings *settings = &machine->settings;
    const unsigned ax = motor_drivers_axis(machine, n);
    struct tmc_want wanted;
    memset(&wanted, 0, sizeof wanted);
    wanted.microsteps = 1;
    if (ax < AXIS_COUNT) {
        wanted.current_ma = settings->driver_current_ma[ax];
        wanted.microsteps = settings->driver_microsteps[ax];
        wanted.hold_pct = settings->driver_hold_pct[ax];
        wanted.coolstep = settings->driver_coolstep[ax];
        wanted.stall = settings->driver_stall[ax];
        wanted.stall_armed = is_armed(machine, n, ax);
        wanted.stealth_tstep = stealth_tstep(settings, ax);
        wanted.load_tstep = tstep_at(settings, ax, slowest_mm_min(settings, ax));
    }
    drivers_want(&machine->board.drivers->set, n, &wanted);
}

void motor_drivers_configure(struct machine *machine) {
    for (unsigned n = 0; n < machine->board.drivers->set.count; n++)
        want(machine, n);
}

static void position(const void *ctx, int32_t steps[AXIS_COUNT]) {
    const struct machine *machine = ctx;
    machine_position(machine, steps);
    for (unsigned ax = 0; ax < machine->board.axis_count; ax++)
        if (machine->settings.second_motor[ax] != 0)
            steps[machine->settings.second_motor[ax] - 1] = steps[ax];
}

bool motor_drivers_talk(struct machine *machine) {
    struct machine_drivers *drivers = machine->board.drivers;
    if (drivers == NULL)
        return false;
    drivers->set.squares = machine->life.state == MACHINE_HOME;
    return drivers_poll(&drivers->set, machine->hal, hal_time_us(machine->hal), position, machine);
}

bool motor_drivers_holds(const struct machine *machine) {
    const struct machine_drivers *drivers = machine->board.drivers;
    return drivers != NULL && drivers_are_busy(&drivers->set) && machine_is_standing(machine);
}

enum status motor_drivers_check_current(const struct machine *machine, unsigned axis, double current_ma) {
    const struct machine_drivers *drivers = machine->board.drivers;
    enum status status = STATUS_NO_DRIVER;
    for (unsigned n = 0; drivers != NULL && n < drivers->set.count; n++) {
        if (motor_drivers_axis(machine, n) != axis)
            continue;
        const struct driver_wire *wire = &drivers->set.wire[n];
        if (current_ma > (double)tmc_current_max_ma(tmc_chip(wire->kind), wire->sense_mohm))
            return STATUS_DRIVER_CURRENT;
        status = STATUS_OK;
    }
    return status;
}

/* ---- homing ---- */

static void report_slow(const struct machine *machine, unsigned n, float mm_min) {
    text_string(&machine->out, "[MSG:StallGuard of axis ");
    text_string(&machine->out, (const char[]){AXIS_LETTERS[motor_drivers_axis(machine, n)], '\0'});
    text_string(&machine->out, ": below ");
    text_fixed(&machine->out, (double)mm_min, 0);
    text_string(&machine->out, " mm/min it cannot be trusted. Raise $24 and $25, or lower $260 ..]\r\n");
}

enum refusal motor_drivers_check_homing(struct machine *machine, axis_mask_t axes) {
    const struct settings *settings = &machine->settings;
    const struct machine_drivers *drivers = machine->board.drivers;
    for (unsigned n = 0; drivers != NULL && n < drivers->set.count; n++) {
        const unsigned ax = motor_drivers_axis(machine, n);
        if (ax >= AXIS_COUNT || (axes >> ax & 1u) == 0 || settings->driver_stall[ax] == 0)
            continue;
        if (!drivers->set.wire[n].diag || settings->driver_current_ma[ax] == 0)
            return REFUSAL_NO_STALL;
        const float slowest = slowest_mm_min(settings, ax);
        if (settings->homing_feed_mm_min < slowest || settings->homing_seek_mm_min < slowest ||
            settings->max_rate_mm_min[ax] < slowest) {
            report_slow(machine, n, slowest);
            return REFUSAL_STALL_SLOW;
        }
    }
    return REFUSAL_NONE;
}

/* ---- faults ---- */

bool motor_drivers_have_current(const struct machine *machine, unsigned n) {
    return machine->board.drivers->set.driver[n].want.current_ma != 0;
}

/* A driver without a motor has none; and one way of being lost is as good as another. */
uint16_t motor_drivers_problems(const struct machine *machine, unsigned n) {
    return motor_drivers_axis(machine, n) < AXIS_COUNT ? machine->board.drivers->set.driver[n].problems : 0;
}

uint16_t motor_drivers_fresh(uint16_t problems, uint16_t before) {
    const bool lost_before = (before & DRIVER_LOST) != 0;
    return (uint16_t)(problems & ~(unsigned)before & ~(lost_before ? (unsigned)DRIVER_LOST : 0u));
}

bool motor_drivers_is_faulty(const struct machine *machine) {
    const struct machine_drivers *drivers = machine->board.drivers;
    if (drivers == NULL || machine->settings.driver_fault != FAULT_ALARM)
        return false;
    for (unsigned n = 0; n < drivers->set.count; n++)
        if (motor_drivers_have_current(machine, n) &&
            (motor_drivers_problems(machine, n) & ~(unsigned)DRIVER_WARNINGS) != 0)
            return true;
    return false;
}

void motor_drivers_count_message(struct machine *machine) {
    struct machine_drivers *drivers = machine->board.drivers;
    if (!drivers->recent.on) {
        timer_start(machine, &drivers->recent, RECENT_US);
        drivers->messages = 0;
    }
    if (drivers->messages < RECENT_MAX)
        drivers->messages++;
}

bool motor_drivers_are_noisy(struct machine *machine) {
    struct machine_drivers *drivers = machine->board.drivers;
    drivers->recent.on = timer_runs(machine, &drivers->recent); /* before the clock wraps */
    return drivers->recent.on && drivers->messages == RECENT_MAX;
}

bool motor_drivers_tell(struct machine *machine, bool now) {
    struct machine_drivers *drivers = machine->board.drivers;
    unsigned any = 0;
    for (unsigned n = 0; n < drivers->set.count; n++) {
        const uint16_t known = drivers->told[n] | drivers->pending[n];
        drivers->pending[n] |= motor_drivers_fresh(motor_drivers_problems(machine, n), known);
        any |= drivers->pending[n];
    }
    if (any != 0 && !drivers->due)
        timer_start(machine, &drivers->gather, GATHER_US);
    drivers->due = any != 0;
    if (any == 0 || (!now && timer_runs(machine, &drivers->gather)))
        return false;
    driver_list_problems(machine, drivers->pending);
    motor_drivers_count_message(machine);
    for (unsigned n = 0; n < drivers->set.count; n++)
        drivers->told[n] |= drivers->pending[n];
    memset(drivers->pending, 0, sizeof drivers->pending);
    drivers->due = false;
    return true;
}

void motor_drivers_tell_again(struct machine *machine) {
    struct machine_drivers *drivers = machine->board.drivers;
    if (drivers == NULL)
        return;
    memset(drivers->told, 0, sizeof drivers->told);
    (void)motor_drivers_tell(machine, true);
}

uint32_t motor_drivers_wait_us(const struct machine *machine) {
    const struct machine_drivers *drivers = machine->board.drivers;
    if (drivers == NULL)
        return UINT32_MAX;
    const uint32_t poll_us = drivers_wait_us(&drivers->set, hal_time_us(machine->hal));
    const uint32_t tell_us = timer_left_us(machine, &drivers->gather);
    return poll_us < tell_us ? poll_us : tell_us;
}

uint32_t motor_drivers_event_us(const struct machine *machine) {
    const struct machine_drivers *drivers = machine->board.drivers;
    if (drivers == NULL || !(drivers_are_busy(&drivers->set) || drivers->due))
        return UINT32_MAX;
    return motor_drivers_wait_us(machine);
}
