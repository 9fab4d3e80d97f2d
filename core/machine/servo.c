/* SPDX-License-Identifier: MIT
 * An RC servo in the place of an axis' motor, such as a pen lift: its pulse says where the axis is.
 * [task]
 *
 *     -travel .. 0 mm of the axis $85  ->  $86 .. $87 us, 50 times a second
 *
 * The axis moves, is limited and counts as if its motor were there. */
#include "machine/servo.h"

#include "machine/parts.h"

#include "base/minmax.h"

#include <stddef.h>

/* 0: no servo */
static uint16_t pulse_us(const struct machine *machine) {
    const struct settings *settings = &machine->settings;
    int32_t steps[AXIS_COUNT];
    unsigned ax = settings->servo_axis - 1u;
    if (settings->servo_axis == 0 || ax >= machine->board.axis_count || settings->max_travel_mm[ax] <= 0.0f)
        return 0;
    machine_position(machine, steps);
    /* By the steps that have left the pins, not by the plan: the pen moves with the other axes. */
    float part = (float)steps[ax] / (settings->steps_per_mm[ax] * settings->max_travel_mm[ax]) + 1.0f;
    part = max_f(0.0f, min_f(part, 1.0f));
    float least_us = settings->servo_low_us, most_us = settings->servo_high_us;
    return (uint16_t)(least_us + part * (most_us - least_us) + 0.5f);
}

void servo_poll(struct machine *machine) {
    const struct hal_servo *servo = machine->board.servo;
    if (servo == NULL)
        return;
    uint16_t us = pulse_us(machine);
    if (us == machine->ports.servo_us)
        return;
    machine->ports.servo_us = us;
    servo->set(machine->hal, us);
}
