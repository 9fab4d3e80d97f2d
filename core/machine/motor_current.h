/* SPDX-License-Identifier: MIT
 * Full current only while a motor works: each digital output of $83 is the torque line of an axis. It is on
 * from the moment that a step of its axis is planned until $84 has passed since the last one. [task] [task]
 */
#ifndef WIFICNC_MACHINE_MOTOR_CURRENT_H
#define WIFICNC_MACHINE_MOTOR_CURRENT_H

#include "gcode/gcode.h"
#include "machine/machine.h"

/** Outputs that are not those of spindle and coolant. A reset leaves them. */
struct machine_ports {
    uint8_t digital;   /* outputs of M62 .. M65: bit n = Pn; a reset leaves them */
    uint16_t servo_us; /* pulse put out; 0: none */
};

/** Current of the motors, $83. */
struct machine_motor_current {
    axis_mask_t full;                /* axes with full current */
    uint32_t seen;                   /* segments of the ring looked at */
    uint32_t until_us[OUTPUT_COUNT]; /* full until then */
};

/** Full current where something moves, and a while longer. */
void motor_current_poll(struct machine *machine);

/** Digital outputs that are torque lines. */
axis_mask_t torque_mask(const struct machine *machine);

/** All digital outputs, torque lines among them. */
void motor_current_put_out(struct machine *machine);

/** Digital outputs as a line or a host wants them: bit n = Pn. */
void motor_current_set_digital(struct machine *machine, unsigned digital);

#endif
