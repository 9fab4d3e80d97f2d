/* SPDX-License-Identifier: MIT
 * Full current only while a motor works: each digital output of $83 is the torque line of an axis. It is on
 * from the moment that a step of its axis is planned until $84 has passed since the last one. [task] */
#include "machine/motor_current.h"

#include "machine/parts.h"

#define US_PER_MS 1000u
#define SPANS_US  20000u /* so much later than planned a step may be on the pins */

static axis_mask_t moved_axes(const struct segment *segment) {
    unsigned axes = 0;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        axes |= segment->steps[ax] != 0 ? 1u << ax : 0;
    return (axis_mask_t)axes;
}

/* Axes that move in the batches published since the last look. */
static axis_mask_t fresh_axes(struct machine *machine) {
    const struct segment_queue *queue = &machine->drive.motion.queue;
    struct machine_motor_current *current = &machine->motor_current;
    unsigned axes = 0;
    if (current->seen == queue->published)
        return 0;
    current->seen = queue->published; /* the next one is published after the next look */
    for (uint32_t i = 0; i < queue->count; i++)
        axes |= moved_axes(&queue->slots[i]);
    return (axis_mask_t)axes;
}

axis_mask_t torque_mask(const struct machine *machine) {
    return (axis_mask_t)(machine->settings.torque_mask & ((1u << OUTPUT_COUNT) - 1));
}

void motor_current_poll(struct machine *machine) {
    struct machine_motor_current *current = &machine->motor_current;
    uint32_t now_us = hal_time_us(machine->hal);
    /* When the last step of what is published now will have left the pins, and $84 later. */
    uint32_t after_us = ahead_queued_us(&machine->drive.motion.ahead) + SPANS_US +
                        machine->settings.torque_delay_ms * US_PER_MS;
    unsigned fresh = fresh_axes(machine), full = current->full | fresh;
    for (unsigned ax = 0; ax < OUTPUT_COUNT; ax++) {
        if ((fresh >> ax & 1) != 0)
            current->until_us[ax] = now_us + after_us;
        else if ((int32_t)(now_us - current->until_us[ax]) >= 0)
            full &= ~(1u << ax);
    }
    if (full == current->full)
        return;
    current->full = (axis_mask_t)full;
    motor_current_put_out(machine);
}

void motor_current_put_out(struct machine *machine) {
    unsigned mask = torque_mask(machine);
    hal_digital_set(machine->hal,
                    (uint8_t)((machine->ports.digital & ~mask) | (machine->motor_current.full & mask)));
}

void motor_current_set_digital(struct machine *machine, unsigned digital) {
    machine->ports.digital = (uint8_t)digital;
    motor_current_put_out(machine);
}
