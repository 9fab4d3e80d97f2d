/* SPDX-License-Identifier: MIT
 * Motor drivers with registers, in words. */
#include "machine/driver_list.h"

#include "machine/motor_drivers.h"
#include "machine/parts.h"

/* In the order of enum driver_problem. */
static const struct {
    const char *word, *text;
} problems[DRIVER_PROBLEMS] = {
    {"mute", "nothing is received, not even what is sent. Check its UART wires, RX and TX"},
    {"silent", "no answer. Check the motor supply, its bus wires and its address"},
    {"garbled", "garbled answers. Check its wires, and for two drivers with this address"},
    {"other chip", "another chip than the board file has. Check driver.kind"},
    {"write lost", "it does not take what is written. Check the wire from the board to it"},
    {"reset", "it was reset. Check the motor supply"},
    {"undervoltage", "undervoltage. Check the motor supply"},
    {"short", "short circuit, its outputs are off. Switch off, check motor and cable"},
    {"shut down", "too hot, its outputs are off. Cool it, or lower $140"},
    {"hot", "it becomes too hot. Cool it, or lower $140"},
    {"open", "no current in a coil. Switch off, check the cable of the motor"},
    {"other steps", "it does not see the steps of its axis. Check its address and its step wire"},
};

static void put_name(const struct machine *machine, unsigned n) {
    const struct driver_wire *wire = &machine->board.drivers->set.wire[n];
    const char name[] = {AXIS_LETTERS[wire->axis], wire->motor != 0 ? '2' : '\0', '\0'};
    text_string(&machine->out, name);
}

void driver_list_message(const struct machine *machine, unsigned which, const char *text) {
    text_string(&machine->out, "[MSG:Driver ");
    const char *between = "";
    for (unsigned n = 0; n < machine->board.drivers->set.count; n++) {
        if ((which >> n & 1u) == 0)
            continue;
        text_string(&machine->out, between);
        put_name(machine, n);
        between = " ";
    }
    text_string(&machine->out, ": ");
    text_string(&machine->out, text);
    text_string(&machine->out, "]\r\n");
}

void driver_list_problems(const struct machine *machine, const uint16_t fresh[]) {
    for (unsigned problem = 0; problem < DRIVER_PROBLEMS; problem++) {
        unsigned which = 0;
        for (unsigned n = 0; n < machine->board.drivers->set.count; n++)
            which |= (fresh[n] >> problem & 1u) << n;
        if (which != 0)
            driver_list_message(machine, which, problems[problem].text);
    }
}

static void put_state(const struct machine *machine, const struct driver *driver) {
    const char *between = "";
    if (driver->problems == 0)
        text_string(&machine->out, driver->phase != DRIVER_WATCH  ? "wait"
                                   : driver->want.current_ma == 0 ? "left alone"
                                                                  : "ok");
    for (unsigned problem = 0; problem < DRIVER_PROBLEMS; problem++) {
        if ((driver->problems >> problem & 1u) == 0)
            continue;
        text_string(&machine->out, between);
        text_string(&machine->out, problems[problem].word);
        between = ",";
    }
}

static void put_field(const struct machine *machine, uint32_t value) {
    text_string(&machine->out, "|");
    text_int(&machine->out, (int32_t)value);
}

void driver_list(const struct machine *machine) {
    const struct machine_drivers *drivers = machine->board.drivers;
    if (drivers == NULL)
        return;
    for (unsigned n = 0; n < drivers->set.count; n++) {
        const struct driver_wire *wire = &drivers->set.wire[n];
        const struct driver *driver = &drivers->set.driver[n];
        const struct tmc_chip *chip = tmc_chip(wire->kind);
        text_string(&machine->out, "[DRIVER:");
        put_name(machine, n);
        text_string(&machine->out, "|");
        text_string(&machine->out, chip->name);
        put_field(machine, chip->uart || wire->chain > 1 ? wire->address : wire->select);
        text_string(&machine->out, "|");
        put_state(machine, driver);
        put_field(machine, driver->want.current_ma);
        put_field(machine, tmc_current_max_ma(chip, wire->sense_mohm));
        put_field(machine, driver->want.hold_pct);
        put_field(machine, driver->want.microsteps);
        put_field(machine, driver->status.current_scale);
        put_field(machine, driver->load);
        put_field(machine, driver->resets);
        text_string(&machine->out, "]\r\n");
    }
}
