/* SPDX-License-Identifier: MIT
 * What a fault of a motor driver with registers leads to. */
#include "machine/driver_watch.h"

#include "machine/driver_list.h"
#include "machine/motor_drivers.h"
#include "machine/parts.h"
#include "machine/place.h"
#include "machine/trip.h"

/* Those that are lost answer again. What is over is forgotten, and is new when it comes back. */
static bool tell_found(struct machine *machine) {
    struct machine_drivers *drivers = machine->board.drivers;
    unsigned found = 0;
    if (motor_drivers_are_noisy(machine))
        return false;
    for (unsigned n = 0; n < drivers->set.count; n++) {
        const uint16_t problems = motor_drivers_problems(machine, n);
        if ((drivers->told[n] & DRIVER_LOST) != 0 && (problems & DRIVER_LOST) == 0 &&
            drivers->set.driver[n].phase == DRIVER_WATCH)
            found |= 1u << n;
        else if ((drivers->told[n] & DRIVER_LOST) != 0)
            continue; /* ... until then */
        drivers->told[n] &= problems;
    }
    if (found == 0)
        return false;
    driver_list_message(machine, found, "it answers again");
    motor_drivers_count_message(machine);
    return true;
}

/* By SPI, a driver without a current is off. */
static void tell_off(struct machine *machine) {
    struct machine_drivers *drivers = machine->board.drivers;
    unsigned off = 0;
    if (drivers->off_told || drivers_are_busy(&drivers->set))
        return;
    drivers->off_told = true;
    for (unsigned n = 0; n < drivers->set.count; n++)
        if (motor_drivers_axis(machine, n) < AXIS_COUNT && !motor_drivers_have_current(machine, n) &&
            !tmc_chip(drivers->set.wire[n].kind)->uart)
            off |= 1u << n;
    if (off != 0)
        driver_list_message(machine, off, "it is off until $140 .. sets its current");
}

/* A motor that does not turn, or a driver that does not show a stall, makes homing find a wrong place: that
 * is an alarm whatever $746 is, also for a fault that is older. */
static bool spoils_homing(const struct machine *machine, unsigned n, uint16_t problems) {
    const unsigned ax = motor_drivers_axis(machine, n);
    return machine->life.state == MACHINE_HOME && ax < AXIS_COUNT &&
           (machine->homing.asked >> ax & 1u) != 0 && motor_drivers_have_current(machine, n) &&
           (problems & ~(unsigned)DRIVER_WARNINGS) != 0;
}

/* Problems that have not stopped motion yet. @return enum: what they lead to */
static unsigned weigh(struct machine *machine) {
    struct machine_drivers *drivers = machine->board.drivers;
    const unsigned most = machine->settings.driver_fault;
    const enum machine_state state = machine->life.state;
    const bool moves = state == MACHINE_RUN || state == MACHINE_JOG || state == MACHINE_HOME;
    unsigned action = FAULT_MESSAGE;
    bool homes_wrong = false;
    for (unsigned n = 0; n < drivers->set.count; n++) {
        const uint16_t problems = motor_drivers_problems(machine, n);
        uint16_t fresh = motor_drivers_fresh(problems, drivers->acted[n]);
        homes_wrong |= spoils_homing(machine, n, problems);
        /* One that was never there loses nothing until something moves. */
        if ((problems & DRIVER_LOST) != 0 && !drivers->set.driver[n].found)
            fresh = moves ? (uint16_t)(problems & DRIVER_LOST) : 0;
        drivers->acted[n] = (uint16_t)((drivers->acted[n] & problems) | fresh);
        if (fresh == 0 || !motor_drivers_have_current(machine, n))
            continue;
        const unsigned wanted = (fresh & ~(unsigned)DRIVER_WARNINGS) != 0 ? FAULT_ALARM : FAULT_HOLD;
        action = wanted > action ? wanted : action;
    }
    if (homes_wrong)
        return FAULT_ALARM;
    return action < most ? action : most;
}

static void forget_resets(struct machine *machine) {
    struct machine_drivers *drivers = machine->board.drivers;
    for (unsigned n = 0; n < drivers->set.count; n++)
        if ((drivers->told[n] & drivers->acted[n] & DRIVER_WAS_RESET) != 0)
            drivers_forget_reset(&drivers->set, n);
}

/* What stops motion stops it immediately; the alarm waits until all that has the same cause is reported. */
static bool stop(struct machine *machine, unsigned action) {
    struct machine_drivers *drivers = machine->board.drivers;
    drivers->stops |= action == FAULT_ALARM;
    if (!trip_may(machine)) {
        /* Nothing is to be stopped. An emergency stop often switches the motor supply off. */
        if (drivers->stops)
            trust_lose(&machine->trust, machine->trust.axes);
        drivers->stops = drivers->trip.on = false;
        return false;
    }
    if (action == FAULT_HOLD && !drivers->stops)
        trip_hold(machine);
    if (!drivers->stops)
        return action != FAULT_MESSAGE;
    if (drivers->due && machine->life.state != MACHINE_HOME) {
        trip_hold(machine);
        return false;
    }
    (void)motor_drivers_tell(machine, true);
    if (!trip_poll(machine, &drivers->trip, ALARM_DRIVER_FAULT))
        return false;
    drivers->stops = false;
    /* A motor without current may have been moved. */
    trust_lose(&machine->trust, machine->trust.axes);
    return true;
}

bool driver_watch_poll(struct machine *machine) {
    if (machine->board.drivers == NULL)
        return false;
    motor_drivers_configure(machine);
    tell_off(machine);
    const unsigned action = weigh(machine);
    bool any = tell_found(machine);
    any |= motor_drivers_tell(machine, false);
    forget_resets(machine);
    return stop(machine, action) || any;
}
