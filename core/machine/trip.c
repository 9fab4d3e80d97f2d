/* SPDX-License-Identifier: MIT
 * Motion stops within its limits, and an alarm follows. */
#include "machine/trip.h"

#include "machine/dial.h"
#include "machine/drive.h"
#include "machine/jog.h"
#include "machine/parts.h"
#include "machine/reset.h"
#include "machine/suspend.h"

/* A feed hold takes less, unless the tool is in a thread. Then the alarm ends motion without a ramp. */
#define STOP_US 10000000u

bool trip_may(const struct machine *machine) {
    return machine->life.state != MACHINE_ALARM && machine->life.state != MACHINE_SLEEP &&
           !machine->life.restart;
}

void trip_hold(struct machine *machine) {
    const enum machine_state state = machine->life.state;
    dial_stop(machine); /* also while it brakes to turn back */
    if (state == MACHINE_RUN || state == MACHINE_IDLE)
        suspend_force_hold(machine);
    else if (state == MACHINE_JOG && !machine->suspend.cancels)
        jog_cancel(machine);
    else if (machine->park.open && (!drive_is_stopped(machine) || machine->park.resume_asked))
        park_stop(machine); /* once: it is something that happens, for which no clock advances */
}

static bool is_stopped(const struct machine *machine) {
    return machine->life.state == MACHINE_HOME || (drive_is_stopped(machine) && !machine->suspend.cancels);
}

bool trip_poll(struct machine *machine, struct machine_trip *trip, enum alarm alarm) {
    if (!trip->on)
        timer_start(machine, &trip->limit, STOP_US);
    trip->on = true;
    if (!is_stopped(machine) && timer_runs(machine, &trip->limit)) {
        trip_hold(machine);
        return false;
    }
    trip->on = false;
    reset_alarm(machine, alarm);
    return true;
}
