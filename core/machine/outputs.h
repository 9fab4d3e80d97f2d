/* SPDX-License-Identifier: MIT
 * Spindle (or laser) and coolant: from what was asked for to what the pins show. [task] */
#ifndef WIFICNC_MACHINE_OUTPUTS_H
#define WIFICNC_MACHINE_OUTPUTS_H

#include "gcode/gcode.h"
#include "machine/machine.h"
#include "machine/timer.h"

/** Spindle and coolant: what the program wants and what is kept from it. */
struct machine_outputs {
    enum gcode_spindle spindle;
    float rpm;  /* S */
    bool laser; /* switched on as a laser ($32) */
    uint8_t coolant;
    bool spindle_stopped;          /* 0x9E in a hold */
    bool suspended;                /* the door is open: everything is off */
    bool coolant_waits;            /* the door was closed: the spindle runs up first */
    bool aims;                     /* the aiming beam of a laser at rest; laser.c */
    float shown_rpm;               /* of a spindle, on the pins: with override and limits */
    struct machine_timer aim_time; /* does not run: the aiming beam has no end */
};

/** 0x9E in a hold; from outputs_apply() on. */
static inline void outputs_stop_spindle(struct machine_outputs *outputs, bool stops) {
    outputs->spindle_stopped = stops;
}

/** Coolant as asked for, COOLANT_ bits; from outputs_apply() on. */
static inline void outputs_ask_coolant(struct machine_outputs *outputs, unsigned coolant) {
    outputs->coolant = (uint8_t)coolant;
}

/** Behind an open door all is off; behind a closed one coolant waits until the spindle has run up. From
 * outputs_apply() on. */
static inline void outputs_suspend(struct machine_outputs *outputs, bool suspended, bool coolant_waits) {
    outputs->suspended = suspended;
    outputs->coolant_waits = coolant_waits;
}

/** Spindle and coolant as asked for, immediately. */
void outputs_set(struct machine *machine, enum gcode_spindle spindle, float rpm, uint8_t coolant);

/** The pins are as was asked for, with overrides, door and limits. */
void outputs_apply(struct machine *machine);

/** All off, and nothing is asked for any more. */
void outputs_off(struct machine *machine);

/** Spindle speed that is put out now, rpm; 0 = off. */
float outputs_rpm(const struct machine *machine);

/** Coolant that is put out now, COOLANT_ bits. */
uint8_t outputs_coolant_bits(const struct machine *machine);

/** The laser's power follows the motion; and a change of $32 switches the spindle off. */
void outputs_poll(struct machine *machine);

/** Spindle and coolant, but not in check mode. */
void outputs_program(struct machine *machine, enum gcode_spindle spindle, uint8_t coolant);

/** What spindle and coolant were asked to do. */
const struct machine_outputs *machine_outputs(const struct machine *machine);

#endif
