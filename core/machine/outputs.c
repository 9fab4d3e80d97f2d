/* SPDX-License-Identifier: MIT
 * Spindle (or laser) and coolant. */
#include "machine/inner.h"

#include <stddef.h>

static bool spindle_is_on(const struct machine_outputs *outputs) {
    return outputs->spindle != SPINDLE_OFF && !outputs->spindle_stopped && !outputs->suspended;
}

/* S with override and laser power, between $31 and $30. 0 stays 0. */
float outputs_rpm(const struct machine *machine) {
    const struct machine_outputs *outputs = &machine->outputs;
    const struct settings *settings = &machine->settings;
    bool enabled = (machine->gcode.modal.overrides & OVERRIDE_SPINDLE) != 0;
    float rpm = outputs->rpm * (enabled ? (float)machine->spindle_pct * 0.01f : 1.0f) * outputs->power;
    if (!spindle_is_on(outputs) || rpm <= 0.0f)
        return 0.0f;
    if (settings->spindle_max_rpm <= settings->spindle_min_rpm) /* on or off, nothing between */
        return settings->spindle_max_rpm;
    if (rpm > settings->spindle_max_rpm)
        return settings->spindle_max_rpm;
    return rpm < settings->spindle_min_rpm ? settings->spindle_min_rpm : rpm;
}

static uint16_t duty_of(const struct settings *settings, float rpm) {
    float range = settings->spindle_max_rpm - settings->spindle_min_rpm;
    if (rpm <= 0.0f)
        return 0;
    if (range <= 0.0f)
        return HAL_DUTY_FULL;
    float duty = (rpm - settings->spindle_min_rpm) / range * (float)HAL_DUTY_FULL + 0.5f;
    return (uint16_t)(duty<1.0f ? 1.0f : duty>(float) HAL_DUTY_FULL ? (float)HAL_DUTY_FULL : duty);
}

void outputs_apply(struct machine *machine) {
    static const int8_t direction[] = {[SPINDLE_OFF] = 0, [SPINDLE_CW] = 1, [SPINDLE_CCW] = -1};
    const struct machine_outputs *outputs = &machine->outputs;
    struct hal_spindle spindle = {.rpm = outputs_rpm(machine)};
    spindle.direction = spindle_is_on(outputs) ? direction[outputs->spindle] : 0;
    spindle.duty = duty_of(&machine->settings, spindle.rpm);
    hal_spindle_set(machine->hal, &spindle);
    hal_coolant_set(machine->hal, outputs->suspended || outputs->coolant_waits ? 0 : outputs->coolant);
}

void outputs_set(struct machine *machine, enum gcode_spindle spindle, float rpm, uint8_t coolant) {
    struct machine_outputs *outputs = &machine->outputs;
    outputs->spindle = spindle;
    outputs->rpm = rpm;
    outputs->coolant = coolant;
    outputs->power = machine->settings.laser_mode ? 0.0f : 1.0f; /* outputs_poll() lights it */
    outputs_apply(machine);
    spindle_disturb(&machine->motion.emit.spindle, hal_time_us(machine->hal));
    report_changed_override(machine);
}

void outputs_off(struct machine *machine) {
    machine->outputs = (struct machine_outputs){.spindle = SPINDLE_OFF, .power = 1.0f};
    outputs_apply(machine);
}

/* Standing still. Only M3 shines then, and only in a feed mode of a program that nobody stopped: a beam that
 * is left on sets things on fire. Moves that wait for look-ahead change nothing: the next one decides. */
static float laser_power_at_rest(const struct machine *machine) {
    enum gcode_motion motion = machine->gcode.modal.motion;
    bool cuts = motion != MOTION_RAPID && motion != MOTION_NONE && motion != MOTION_PROBE;
    bool runs = machine->state == MACHINE_IDLE || machine->state == MACHINE_RUN;
    if (machine->outputs.spindle != SPINDLE_CW || !runs)
        return 0.0f;
    if (!machine_is_at_rest(machine) && !machine->step.active)
        return machine->outputs.power;
    return cuts ? 1.0f : 0.0f;
}

/* Power of the line on the pins now. With M4 it follows the speed, so that corners are not burnt, and at rest
 * there is none. With M3 it is constant. Only feed moves are lit. The speed is that of the motion emitted
 * last, a few ms ahead of the pins. */
static float laser_power(const struct machine *machine, const struct line_note *note) {
    const struct step *step = &machine->step;
    const struct span *span = &step->ring.slots[step->ring.index.tail & (SPAN_RING_SIZE - 1)];
    if (!step->active || (span->flags & SEGMENT_DWELL) != 0)
        return laser_power_at_rest(machine);
    if ((span->flags & (SEGMENT_RAPID | SEGMENT_JOG | SEGMENT_PROBE)) != 0)
        return 0.0f;
    if (machine->outputs.spindle == SPINDLE_CW || note == NULL || note->feed_mm_s <= 0.0f)
        return 1.0f;
    float asked_mm_s = note->feed_mm_s * (float)machine_feed_pct(machine) * 0.01f;
    float power = machine_speed_mm_s(machine) / asked_mm_s;
    return power > 1.0f ? 1.0f : power;
}

void outputs_poll(struct machine *machine) {
    struct machine_outputs *outputs = &machine->outputs;
    if (!machine->settings.laser_mode || outputs->spindle == SPINDLE_OFF || machine->state == MACHINE_CHECK)
        return;
    const struct line_note *note = notes_find(&machine->notes, notes_line_now(machine));
    float rpm = note != NULL ? note->rpm : machine->gcode.modal.spindle_rpm;
    float power = laser_power(machine, note);
    if (power == outputs->power && rpm == outputs->rpm)
        return;
    outputs->power = power;
    outputs->rpm = rpm;
    outputs_apply(machine);
}
