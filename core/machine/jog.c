/* SPDX-License-Identifier: MIT
 * $J=: moves that can be called off. */
#include "machine/jog.h"

#include "machine/answer.h"
#include "machine/drive.h"
#include "machine/host_motion.h"
#include "machine/notes.h"
#include "machine/overrides.h"
#include "machine/park.h"
#include "machine/parts.h"
#include "machine/place.h"
#include "machine/reach.h"
#include "machine/report.h"
#include "machine/state.h"

#include <string.h> // memcpy, memset, memcmp

#define RELEASED_US 500000u /* who holds a key asks again sooner */

static bool is_jogging(const struct machine *machine) {
    return machine->life.state == MACHINE_JOG || (machine->park.open && !machine_is_standing(machine));
}

/* A key that is held asks again, or has more than one of its jogs under way. */
static bool is_held(const struct machine *machine) {
    const struct machine_jogs *jogs = &machine->jogs;
    return is_jogging(machine) || (jogs->asked && hal_time_us(machine->hal) - jogs->asked_us < RELEASED_US);
}

static void note_asked(struct machine *machine) {
    machine->jogs.asked = true;
    machine->jogs.asked_us = hal_time_us(machine->hal);
}

void machine_stopped_by_other(struct machine *machine) {
    const bool held = is_held(machine), parked = machine->park.open;
    /* In a parked hold the state does not change: who moves step by step learns of it from the message alone.
     */
    machine->jogs.tells |= (is_jogging(machine) || parked) && !machine->host.owns;
    if (!held)
        return;
    machine->jogs.lock = JOG_LOCK_ON;
    note_asked(machine);
}

static void tell_stopped(struct machine *machine) {
    if (machine->jogs.lock == JOG_LOCK_ON)
        machine->jogs.lock = JOG_LOCK_TOLD;
    machine->jogs.tells = false;
    report_message(machine, "Another client or a button stopped the jog: release the key");
}

bool jog_tell_stopped(struct machine *machine) {
    if (!machine->jogs.tells || !machine_is_standing(machine))
        return false;
    tell_stopped(machine);
    return true;
}

bool jog_is_locked(struct machine *machine) {
    struct machine_jogs *jogs = &machine->jogs;
    if (hal_time_us(machine->hal) - jogs->asked_us >= RELEASED_US)
        jogs->lock = JOG_LOCK_OFF;
    note_asked(machine);
    if (jogs->lock == JOG_LOCK_ON)
        tell_stopped(machine);
    return jogs->lock != JOG_LOCK_OFF;
}

enum status jog_begin(struct machine *machine, const char *text) {
    struct gcode_command *command = &machine->task.command;
    if (jog_is_locked(machine))
        return STATUS_JOG_STOPPED;
    enum status status = gcode_jog(&machine->interp.gcode, text, command);
    if (status != STATUS_OK)
        return status;
    if (machine->settings.jog_clamp)
        reach_shorten(machine, machine->interp.gcode.position_mm, command->move.target_mm);
    status = reach_move(machine, &command->move);
    if (status != STATUS_OK)
        return status;
    if (machine->park.open) {
        status = park_check_jog(machine, &command->move);
        if (status == STATUS_OK)
            task_enter(&machine->task, TASK_JOG);
        return status;
    }
    if (!reach_in_travel(machine, command->move.target_mm))
        return STATUS_JOG_TRAVEL;
    /* Before overrides_apply(): jogs run without overrides, and the state says so. */
    state_go(machine, EVENT_JOG);
    overrides_apply(machine);
    task_enter(&machine->task, TASK_JOG);
    return STATUS_OK;
}

bool jog_aim(struct machine *machine, const double target_mm[AXIS_COUNT], float feed) {
    struct gcode_move *move = &machine->task.command.move;
    const double *from_mm = machine->interp.gcode.position_mm;
    memset(move, 0, sizeof *move);
    move->motion = MOTION_LINEAR;
    move->feed_mm_s = feed;
    memcpy(move->target_mm, target_mm, sizeof move->target_mm);
    if (machine->settings.jog_clamp)
        reach_shorten(machine, from_mm, move->target_mm);
    if (reach_move(machine, move) != STATUS_OK)
        return false;
    const bool inside = machine->park.open ? park_check_jog(machine, move) == STATUS_OK
                                           : reach_in_travel(machine, move->target_mm);
    return inside && memcmp(move->target_mm, from_mm, sizeof move->target_mm) != 0;
}

enum task_stage jog_poll(struct machine *machine) {
    const struct gcode_move *move = &machine->task.command.move;
    if (machine->park.open)
        return park_move(machine, SEGMENT_JOG) ? TASK_NONE : TASK_JOG;
    notes_add(&machine->notes,
              &(struct line_note){.line = machine->lines.count, .number = machine->task.command.line_number});
    struct motion_line line = {.feed_mm_s = move->feed_mm_s,
                               .line = machine->lines.count,
                               .note = machine->notes.count,
                               .flags = MOTION_FLAG_JOG};
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        line.target_mm[ax] = move->target_mm[ax];
    if (!motion_tool_line(&machine->drive.motion, &machine->drive.joints, &line, hal_time_us(machine->hal)))
        return TASK_JOG;
    place_set_program(machine, move->target_mm);
    return TASK_NONE;
}

void jog_cancel(struct machine *machine) {
    suspend_cancel(&machine->suspend, true);
    motion_hold(&machine->drive.motion);
    if (machine->task.stage != TASK_JOG)
        return;
    task_enter(&machine->task, TASK_NONE); /* the jog that waited for room */
    answer_line(machine, STATUS_OK);
}

void jog_end_cancel(struct machine *machine) {
    suspend_cancel(&machine->suspend, false);
    host_stop_self(machine); /* the dial's */
    /* What is left of the cancelled jogs is given up; the planner continues from where the axes are. */
    drive_drop(machine);
    state_go(machine, EVENT_REST); /* a door that cancelled it stays open */
    overrides_apply(machine);
}
