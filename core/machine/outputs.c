/* SPDX-License-Identifier: MIT
 * Spindle (or laser) and coolant: from what was commanded to the levels of the pins. */
#include "machine/outputs.h"

#include "machine/laser.h"
#include "machine/parts.h"
#include "machine/report.h"
#include "machine/run_up.h"
#include "machine/vfd_spindle.h"

static bool spindle_is_on(const struct machine *machine) {
    const struct machine_outputs *outputs = &machine->outputs;
    return outputs->spindle != SPINDLE_OFF && !outputs->spindle_stopped && !outputs->suspended &&
           outputs->laser == machine->settings.laser_mode;
}

static float spindle_factor(const struct machine *machine) {
    bool enabled = (machine->interp.gcode.modal.overrides & OVERRIDE_SPINDLE) != 0;
    return enabled ? (float)machine->overrides.spindle_pct * 0.01f : 1.0f;
}

/* A laser's duty is that of the motion, and the step interrupt puts it out. */
static void put_spindle(struct machine *machine) {
    static const int8_t direction[] = {[SPINDLE_OFF] = 0, [SPINDLE_CW] = 1, [SPINDLE_CCW] = -1};
    const struct duty_range range = settings_duty_range(&machine->settings);
    const bool on = spindle_is_on(machine), laser = machine->settings.laser_mode;
    float asked_rpm = on && !laser ? machine->outputs.rpm * spindle_factor(machine) : 0.0f;
    float rpm = duty_limit_rpm(&range, asked_rpm);
    struct hal_spindle spindle = {.direction = on ? direction[machine->outputs.spindle] : 0,
                                  .rpm = rpm,
                                  .duty =
                                      duty_to_register(&machine->drive.prep.timing.pwm, duty_of(&range, rpm)),
                                  .keeps_duty = laser};
    const int8_t turns = (int8_t)spindle.direction;
    machine->outputs.shown_rpm = rpm;
    laser_apply(machine, on && laser, spindle_factor(machine));
    if (vfd_spindle_is_chosen(machine)) { /* the board's own outputs stay off */
        vfd_spindle_command(machine, turns, rpm);
        spindle = (struct hal_spindle){.duty = machine->drive.prep.timing.pwm.dark};
    }
    hal_spindle_set(machine->hal, &spindle);
    run_up_note(machine, turns, machine->outputs.rpm);
}

float outputs_rpm(const struct machine *machine) {
    if (machine->settings.laser_mode && spindle_is_on(machine))
        return laser_rpm(machine, spindle_factor(machine));
    return machine->outputs.shown_rpm;
}

uint8_t outputs_coolant_bits(const struct machine *machine) {
    const struct machine_outputs *outputs = &machine->outputs;
    return outputs->suspended || outputs->coolant_waits ? 0 : outputs->coolant;
}

void outputs_apply(struct machine *machine) {
    put_spindle(machine);
    hal_coolant_set(machine->hal, outputs_coolant_bits(machine));
}

void outputs_set(struct machine *machine, enum gcode_spindle spindle, float rpm, uint8_t coolant) {
    struct machine_outputs *outputs = &machine->outputs;
    outputs->spindle = spindle;
    outputs->rpm = rpm;
    outputs->coolant = coolant;
    outputs->laser = machine->settings.laser_mode;
    /* A command ends the aiming beam; laser_aim() may start it again after this. */
    outputs->aims = outputs->aim_time.on = false;
    outputs_apply(machine);
    /* From a command on the measured speed is not steady, and no thread begins until it is again. */
    spindle_disturb(&machine->drive.motion.emit.spindle, hal_time_us(machine->hal));
    report_changed_override(machine);
}

void outputs_off(struct machine *machine) {
    machine->outputs = (struct machine_outputs){.spindle = SPINDLE_OFF};
    outputs_apply(machine);
}

/* A spindle that turns becomes no beam at rest, and a beam no spindle at full speed: M5 first. */
static void leave_mode(struct machine *machine) {
    interp_know_spindle(machine, SPINDLE_OFF);
    machine->task.command.spindle = SPINDLE_OFF;
    outputs_set(machine, SPINDLE_OFF, machine->outputs.rpm, machine->outputs.coolant);
    report_message(machine, "Spindle off: $32 changed");
}

void outputs_poll(struct machine *machine) {
    struct machine_outputs *outputs = &machine->outputs;
    run_up_tend(machine);
    if (outputs->spindle != SPINDLE_OFF && outputs->laser != machine->settings.laser_mode)
        leave_mode(machine);
    if (!machine->settings.laser_mode || outputs->spindle == SPINDLE_OFF)
        return;
    laser_poll(machine);
    if (machine->drive.motion.ahead.owner != AHEAD_HOST)
        outputs->rpm =
            machine->interp.gcode.modal.spindle_rpm; /* reports: S comes with its line, without M3 */
    laser_apply(machine, spindle_is_on(machine), spindle_factor(machine));
}

void outputs_program(struct machine *machine, enum gcode_spindle spindle, uint8_t coolant) {
    if (machine->life.state == MACHINE_CHECK)
        return;
    outputs_set(machine, spindle, machine->task.command.next.spindle_rpm, coolant);
    laser_aim(machine);
}
