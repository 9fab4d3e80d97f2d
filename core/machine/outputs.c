/* SPDX-License-Identifier: MIT
 * Spindle (or laser) and coolant. */
#include "machine/inner.h"

static bool spindle_is_on(const struct machine_outputs *outputs) {
    return outputs->spindle != SPINDLE_OFF && !outputs->spindle_stopped && !outputs->suspended;
}

/* S with override and laser power, between $31 and $30. 0 stays 0. */
float outputs_rpm(const struct machine *machine) {
    const struct machine_outputs *outputs = &machine->outputs;
    const struct settings *settings = &machine->settings;
    float rpm = outputs->rpm * (float)machine->spindle_pct * 0.01f * outputs->power;
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
    outputs->power = machine->settings.laser_mode && spindle == SPINDLE_CCW ? 0.0f : 1.0f;
    outputs_apply(machine);
    report_changed_override(machine);
}

void outputs_off(struct machine *machine) {
    machine->outputs = (struct machine_outputs){.spindle = SPINDLE_OFF, .power = 1.0f};
    outputs_apply(machine);
}

/* Path speed of the feed move on the pins now; 0 in rapids and at rest. */
static float feed_speed_mm_s(const struct machine *machine) {
    const struct step *step = &machine->step;
    const struct span *span = &step->ring.slots[step->ring.index.tail & (SPAN_RING_SIZE - 1)];
    if (!step->active || (span->flags & (SEGMENT_RAPID | SEGMENT_DWELL | SEGMENT_JOG)) != 0)
        return 0.0f;
    return emit_speed_mm_s(&machine->motion.emit);
}

/* Laser with M4: power follows the speed, so that corners are not burnt; and none in rapids or at rest. With
 * M3 it is constant. The speed is that of the motion emitted last, a few ms ahead of the pins. */
bool outputs_poll(struct machine *machine) {
    struct machine_outputs *outputs = &machine->outputs;
    if (!machine->settings.laser_mode || outputs->spindle != SPINDLE_CCW)
        return false;
    float feed = machine->gcode.modal.feed_mm_s * (float)machine->feed_pct * 0.01f;
    float speed = feed_speed_mm_s(machine);
    float power = feed > 0.0f ? speed / feed : 0.0f;
    power = power > 1.0f ? 1.0f : power;
    float change = power - outputs->power;
    if (change > -0.002f && change < 0.002f && (power != 0.0f || outputs->power == 0.0f))
        return false;
    outputs->power = power;
    outputs_apply(machine);
    return false;
}
