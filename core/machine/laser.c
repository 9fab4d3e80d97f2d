/* SPDX-License-Identifier: MIT
 * The beam rule. Whatever is not named here is dark: the beam needs the state Run, M3 or M4, and a span of
 * cutting motion (SEGMENT_CUT) that the step interrupt executes at this moment. The one exception is off by
 * default: the aiming beam, weak, at rest in Idle, for some seconds after an M3 or S that asked for it. */
#include "machine/laser.h"

#include "machine/notes.h"
#include "machine/overrides.h"
#include "machine/parts.h"
#include "machine/report.h"
#include "machine/timer.h"

#include <stddef.h>

/* The span that the step interrupt executes. @return false: nothing is executed, or it is not a cut */
static bool is_cutting(const struct step *step, uint32_t *line) {
    struct step_now now;
    if (!step->active)
        return false;
    step_look(step, &now);
    *line = now.line;
    return (now.flags & (SEGMENT_CUT | SEGMENT_DWELL)) == SEGMENT_CUT;
}

/* M4: part of the power that the speed asks for, so that corners are not burnt. */
static float part_at_speed(const struct machine *machine, float feed_mm_s) {
    float asked_mm_s = feed_mm_s * (float)overrides_feed_pct(machine) * 0.01f;
    float part = asked_mm_s > 0.0f ? machine_speed_mm_s(machine) / asked_mm_s : 0.0f;
    return part > 1.0f ? 1.0f : part;
}

/* As in Grbl, only where the next axis word would be a cut. */
static bool is_aiming(const struct machine *machine) {
    enum gcode_motion motion = machine->interp.gcode.modal.motion;
    return machine->outputs.aim.on && machine->life.state == MACHINE_IDLE && motion >= MOTION_LINEAR &&
           motion <= MOTION_ARC_CCW;
}

static float aim_rpm(const struct machine *machine, float factor) {
    float most_rpm = machine->settings.spindle_max_rpm * (float)machine->settings.aim_power_pct * 0.01f;
    float rpm = machine->outputs.rpm * factor;
    return rpm < most_rpm ? rpm : most_rpm;
}

void laser_aim(struct machine *machine) {
    const struct settings *settings = &machine->settings;
    bool can_be_weak = settings->spindle_max_rpm > settings->spindle_min_rpm; /* else it is on or off */
    if (settings->laser_mode && settings->aim_power_pct > 0 && can_be_weak &&
        machine->outputs.spindle == SPINDLE_CW)
        timer_start(machine, &machine->outputs.aim, settings->aim_time_s * 1000000u);
}

void laser_poll(struct machine *machine) {
    struct machine_timer *aim = &machine->outputs.aim;
    bool may = machine->life.state == MACHINE_IDLE || machine->life.state == MACHINE_RUN;
    if (!aim->on || (may && machine_is_at_rest(machine) && timer_runs(machine, aim)))
        return;
    if (may && machine_is_at_rest(machine))
        report_message(machine, "Aiming beam off: $90");
    aim->on = false;
}

/* Of the line on the pins. */
static float cut_rpm(const struct machine *machine) {
    uint32_t line;
    if (machine->life.state != MACHINE_RUN || !is_cutting(&machine->drive.step, &line))
        return 0.0f;
    if (machine->drive.motion.ahead.owner == AHEAD_HOST) /* it plans the speed, so it scales S by it */
        return machine->outputs.rpm;
    const struct line_note *note = notes_find(&machine->notes, line);
    if (note == NULL) /* every cut has one, as there are more notes than pieces */
        return 0.0f;
    return machine->outputs.spindle == SPINDLE_CW ? note->rpm
                                                  : note->rpm * part_at_speed(machine, note->feed_mm_s);
}

float laser_rpm(const struct machine *machine, float factor) {
    return is_aiming(machine) ? aim_rpm(machine, factor) : cut_rpm(machine) * factor;
}
