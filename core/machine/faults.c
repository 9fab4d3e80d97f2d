/* SPDX-License-Identifier: MIT
 * Fault outputs of motor drivers and servos. */
#include "machine/faults.h"

#include "machine/motor_drivers.h"
#include "machine/parts.h"
#include "machine/place.h"
#include "machine/reset.h"

enum { FAULT_US = 2000 }; /* shorter is noise: drivers hold their fault output until they are reset */

static uint8_t faulty_lines(const struct machine *machine) {
    const unsigned wired = (1u << machine->board.digital_inputs) - 1u;
    const unsigned levels = machine->inputs.digital ^ machine->settings.fault_invert;
    return (uint8_t)(levels & machine->settings.fault_inputs & wired);
}

void faults_begin(struct machine *machine) {
    machine->faults = (struct machine_faults){.active = faulty_lines(machine)};
}

static void filter_lines(struct machine *machine) {
    struct machine_faults *faults = &machine->faults;
    const uint8_t lines = faulty_lines(machine);
    faults->active &= lines;
    const uint8_t fresh = lines & (uint8_t)~faults->active;
    faults->seen &= fresh;
    if (faults->seen == 0) {
        faults->seen = fresh;
        timer_start(machine, &faults->filter, fresh != 0 ? FAULT_US : 0);
    } else if (!timer_runs(machine, &faults->filter)) {
        faults->active |= faults->seen;
        faults->seen = 0;
    }
}

bool faults_any(const struct machine *machine) {
    return machine->faults.active != 0 || motor_drivers_is_faulty(machine);
}

bool faults_poll(struct machine *machine) {
    const enum machine_state state = machine->life.state;
    filter_lines(machine);
    if (machine->faults.active == 0 || machine->life.critical || machine->life.restart ||
        state == MACHINE_ALARM || state == MACHINE_SLEEP) /* drivers without current may say anything */
        return false;
    reset_alarm(machine, ALARM_DRIVER_FAULT);
    /* At rest, too: a motor without current may have been moved. */
    trust_lose(&machine->trust, machine->trust.axes);
    return true;
}

void faults_report(struct machine *machine) {
    const char *before = "[MSG:Check motor drivers: P";
    for (unsigned line = 0; line < DIGITAL_INPUT_COUNT; line++) {
        if ((machine->faults.active >> line & 1u) == 0)
            continue;
        text_string(&machine->out, before);
        text_int(&machine->out, (int32_t)line);
        before = " P";
    }
    if (machine->faults.active != 0)
        text_string(&machine->out, "]\r\n");
    motor_drivers_tell_again(machine);
}

uint32_t faults_wait_us(const struct machine *machine) {
    return timer_left_us(machine, &machine->faults.filter);
}
