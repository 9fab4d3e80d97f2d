/* SPDX-License-Identifier: MIT
 * The beam rule. Whatever is not named here is dark: the beam needs M3 or M4, one of the states of
 * may_burn(), and a span of cutting motion (SEGMENT_CUT), which the step interrupt executes and whose duty it
 * puts out with the span's first event. The one exception is off by default: the aiming beam, no stronger
 * than $89, at rest in Idle, for $90 after an M3 or S that asked for it. */
#include "machine/laser.h"

#include "base/minmax.h"
#include "machine/overrides.h"
#include "machine/parts.h"
#include "machine/report.h"
#include "machine/timer.h"

/* Idle is where motion begins, and in a hold the cut continues until it rests. An open door ends it
 * immediately. */
static bool may_burn(const struct machine *machine) {
    enum machine_state state = machine->life.state;
    return state == MACHINE_IDLE || state == MACHINE_RUN || state == MACHINE_HOLD;
}

/* As in Grbl, only where the next axis word would be a cut. */
static bool is_aiming(const struct machine *machine) {
    enum gcode_motion motion = machine->interp.gcode.modal.motion;
    return machine->outputs.aims && machine->life.state == MACHINE_IDLE && motion >= MOTION_LINEAR &&
           motion <= MOTION_ARC_CCW;
}

static float aim_rpm(const struct machine *machine, float factor) {
    float most_rpm = machine->settings.spindle_max_rpm * (float)machine->settings.aim_power_pct * 0.01f;
    return min_f(machine->outputs.rpm * factor, most_rpm);
}

void laser_aim(struct machine *machine) {
    const struct settings *settings = &machine->settings;
    bool can_be_weak = settings->spindle_max_rpm > settings->spindle_min_rpm; /* else it is on or off */
    if (settings->laser_mode && settings->aim_power_pct > 0 && can_be_weak &&
        machine->outputs.spindle == SPINDLE_CW) {
        machine->outputs.aims = true;
        timer_start(machine, &machine->outputs.aim_time, settings->aim_time_s * 1000000u);
    }
}

void laser_poll(struct machine *machine) {
    struct machine_outputs *outputs = &machine->outputs;
    bool may = (machine->life.state == MACHINE_IDLE || machine->life.state == MACHINE_RUN) &&
               machine_is_at_rest(machine);
    bool over = outputs->aim_time.on && !timer_runs(machine, &outputs->aim_time);
    if (!outputs->aims || (may && !over))
        return;
    if (may)
        report_message(machine, "Aiming beam off after $90: M3 or S switches it on again");
    outputs->aims = outputs->aim_time.on = false;
}

void laser_apply(struct machine *machine, bool on, float factor) {
    const struct beam beam = {.on = on,
                              .with_speed = machine->outputs.spindle == SPINDLE_CCW,
                              .factor = factor,
                              .feed_part = (float)overrides_feed_pct(machine) * 0.01f,
                              .rise_s = (float)machine->settings.laser_rise_us * 1e-6f,
                              .range = settings_duty_range(&machine->settings)};
    emit_set_beam(&machine->drive.motion.emit, &beam);
    struct beam host = beam; /* a network host plans the speed, so it scales S by it */
    host.with_speed = false;
    host_queue_set_duty(&machine->host.queue, beam_duty(&host, machine->outputs.rpm, 0.0f, 1.0f));
    float rest_rpm = on && is_aiming(machine) ? aim_rpm(machine, factor) : 0.0f;
    prep_set_rest_duty(&machine->drive.prep, duty_of(&beam.range, duty_limit_rpm(&beam.range, rest_rpm)));
    enum step_beam rule = !machine->settings.laser_mode ? STEP_BEAM_NONE
                          : on && may_burn(machine)     ? STEP_BEAM_ALLOWED
                                                        : STEP_BEAM_DARK;
    step_set_beam(&machine->drive.step, rule, machine->drive.prep.timing.pwm.dark);
}

float laser_rpm(const struct machine *machine, float factor) {
    const struct duty_range range = settings_duty_range(&machine->settings);
    struct step_now now;
    if (!machine->drive.step.active)
        return is_aiming(machine) ? duty_limit_rpm(&range, aim_rpm(machine, factor)) : 0.0f;
    if (!may_burn(machine))
        return 0.0f;
    step_look(&machine->drive.step, &now);
    const struct prep_timing *timing = &machine->drive.prep.timing;
    return duty_rpm(&range, duty_power(&timing->curve, duty_from_register(&timing->pwm, now.duty)));
}
