/* SPDX-License-Identifier: MIT
 * One straight move of the current line, handed to the planner. */
#include "machine/moves.h"

#include "machine/parts.h"

static uint8_t line_flags(const struct machine *machine, bool rapid) {
    uint8_t flags = rapid ? MOTION_FLAG_RAPID : 0;
    if (!rapid && (machine->task.stage == TASK_MOVE || machine->task.stage == TASK_ARC))
        flags |= MOTION_FLAG_CUT;
    if (machine->task.command.next.path != PATH_BLEND || machine->task.stage == TASK_THREAD)
        flags |= MOTION_FLAG_EXACT_STOP;
    return flags;
}

/* S of a laser; of other moves it says nothing. */
static float laser_s(const struct machine *machine) {
    const struct gcode_command *command = &machine->task.command;
    return machine->settings.laser_mode && command->spindle != SPINDLE_OFF ? command->next.spindle_rpm : 0.0f;
}

bool moves_push(struct machine *machine, const double target_mm[AXIS_COUNT], bool rapid, float feed_mm_s,
                float duration_s) {
    struct motion_line line = {
        .feed_mm_s = feed_mm_s,
        .duration_s = duration_s,
        .tolerance_mm = machine->task.command.next.path_tolerance_mm,
        .line = machine->lines.count,
        .note = machine->notes.count,
        .rpm = laser_s(machine),
        .spent_mm = machine->task.stage == TASK_ARC ? machine->settings.arc_tolerance_mm : 0.0f,
        .flags = line_flags(machine, rapid)};
    /* Check mode ends here: all checks of a move have been made, and nothing is planned. */
    if (machine->life.state == MACHINE_CHECK)
        return true;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        line.target_mm[ax] = target_mm[ax];
    return motion_tool_line(&machine->drive.motion, &machine->drive.joints, &line, hal_time_us(machine->hal));
}
