/* SPDX-License-Identifier: MIT
 * Motion that follows the spindle: G33, G33.1 and the passes of G76 (motion/gear.h), and feed per
 * revolution, G95. A hold or an open door waits until the tool is out of the work; what cannot wait (e-stop,
 * reset) does not. A spindle that does not do what was commanded is an alarm, never a wait without end. */
#include "machine/spindle_sync.h"

#include "machine/drive.h"
#include "machine/moves.h"
#include "machine/outputs.h"
#include "machine/overrides.h"
#include "machine/parts.h"
#include "machine/reach.h"
#include "machine/reset.h"
#include "machine/state.h"
#include "machine/suspend.h"
#include "machine/timer.h"

#include "base/minmax.h"

#include <math.h>
#include <string.h>

#define PATIENCE_US   10000000u /* for a spindle to come to speed, or to turn back */
#define STANDING_US   1000000u  /* a spindle may be still for this long while the tool is in the work */
#define FASTER        1.25f     /* tapers are laid for a spindle that is so much faster than S */
#define BEND_PART     0.5f      /* of an axis' acceleration is for the bends of a taper */
#define MIN_FACTOR    0.02f     /* of feed per revolution */
#define MAX_FACTOR    2.0f
#define FACTOR_CHANGE 0.005f

static void enter(struct machine *machine, enum thread_step step) {
    machine->spindle_sync.step = step;
    task_note_further(&machine->task);
}

/* ---- the encoder ---- */

void spindle_sync_note_feed(struct machine *machine) {
    if (!WITH_ENCODER)
        return;
    const struct gcode_modal *next = &machine->task.command.next;
    struct machine_spindle_sync *thread = &machine->spindle_sync;
    float nominal = next->feed_mode == FEED_PER_REV ? next->spindle_rpm * (1.0f / 60.0f) : 0.0f;
    if (machine_is_at_rest(machine))
        timer_start(machine, &thread->patience, PATIENCE_US);
    if (nominal == thread->per_rev_nominal)
        return;
    thread->per_rev_nominal = nominal;
    /* From creeping up to the speed that the encoder shows (watch_feed()): the spindle may not turn yet. */
    thread->per_rev_factor = MIN_FACTOR;
    overrides_apply(machine);
}

/* Nothing may continue, and when all is at rest the alarm is reported. */
static void fail(struct machine *machine, enum alarm alarm) {
    machine->spindle_sync.fault = alarm;
    gear_stop(&machine->drive.motion.emit.gear);
    motion_hold(&machine->drive.motion);
}

/* Feeds follow the speed of the spindle; with one that is still they creep, and not for long. */
static void watch_feed(struct machine *machine, uint32_t now_us) {
    struct machine_spindle_sync *thread = &machine->spindle_sync;
    float rev_s = fabsf(spindle_rev_s(&machine->drive.motion.emit.spindle, now_us));
    float factor = rev_s / thread->per_rev_nominal;
    factor = factor < MIN_FACTOR ? MIN_FACTOR : factor > MAX_FACTOR ? MAX_FACTOR : factor;
    /* Only changes that matter: each one times the whole look-ahead again. */
    if (fabsf(factor - thread->per_rev_factor) > FACTOR_CHANGE * thread->per_rev_factor) {
        thread->per_rev_factor = factor;
        overrides_apply(machine);
    }
    if (rev_s > 0.0f || machine->life.state != MACHINE_RUN || motion_is_planned_out(&machine->drive.motion))
        timer_start(machine, &thread->patience, PATIENCE_US);
    else if (thread->fault == ALARM_NONE && !timer_runs(machine, &thread->patience))
        fail(machine, ALARM_SPINDLE);
}

void spindle_sync_watch(struct machine *machine) {
    if (!WITH_ENCODER)
        return;
    struct emit *emit = &machine->drive.motion.emit;
    struct hal_encoder_state state;
    if (!machine->interp.gcode.ports.encoder)
        return;
    machine->board.encoder->read(machine->hal, &state);
    uint32_t now_us = hal_time_us(machine->hal);
    spindle_take(&emit->spindle, state.counts, state.edge_us, now_us);
    if (gear_is_on(&emit->gear)) {
        uint32_t starts = __atomic_load_n(&machine->drive.starts, __ATOMIC_ACQUIRE);
        gear_clock(&emit->gear, now_us, machine_is_standing(machine), machine->drive.started_us, starts);
    } else if (machine->spindle_sync.per_rev_nominal > 0.0f && machine->task.stage != TASK_THREAD) {
        watch_feed(machine, now_us);
    }
    if (machine->spindle_sync.fault != ALARM_NONE && drive_is_stopped(machine))
        reset_alarm(machine, machine->spindle_sync.fault);
}

/* ---- the path of a pass ---- */

/* From here to there, joints. */
static void joint_way(const struct machine *machine, const double from_mm[AXIS_COUNT],
                      const double way_mm[AXIS_COUNT], double out_mm[AXIS_COUNT]) {
    const struct kinematics *kinematics = &machine->drive.joints.kinematics;
    const double *now = machine->drive.motion.plan.position_mm;
    double to_mm[AXIS_COUNT], from[AXIS_COUNT];
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        to_mm[ax] = from_mm[ax] + way_mm[ax];
    kinematics->ops->inverse(kinematics, from_mm, now, from);
    kinematics->ops->inverse(kinematics, to_mm, now, out_mm);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        out_mm[ax] -= from[ax];
}

/* How fast all joints may go along the drive line; tapers take their part of it. */
static void limit(const struct machine *machine, float rpm, struct gear_path *path) {
    const struct motion_limits *limits = &machine->drive.motion.plan.limits;
    bool tapers = path->depth_mm > 0.0f;
    path->speed_mm_s = path->accel_mm_s2 = path->bend_mm = 1e9f;
    for (unsigned ax = 0; ax < limits->axis_count; ax++) {
        /* This joint's share of a mm along the drive line, and of a mm of depth; in a taper both add up,
         * with `slope` mm of depth for each mm along. */
        float along = (float)fabs(path->drive_mm[ax]) / path->way_mm;
        float into = tapers ? (float)fabs(path->into_mm[ax]) / path->depth_mm : 0.0f;
        float all = along + into * path->slope, accel_mm_s2 = limits->accel_mm_s2[ax];
        if (all <= 0.0f)
            continue;
        if (into > 0.0f)
            accel_mm_s2 *= 1.0f - BEND_PART;
        path->speed_mm_s = min_f(path->speed_mm_s, limits->max_rate_mm_s[ax] / all);
        path->accel_mm_s2 = min_f(path->accel_mm_s2, accel_mm_s2 / all);
    }
    if (tapers)
        path->speed_mm_s = min_f(path->speed_mm_s, FASTER * path->pitch_mm * rpm / 60.0f);
    for (unsigned ax = 0; ax < limits->axis_count && tapers; ax++) {
        float into = (float)fabs(path->into_mm[ax]) / path->depth_mm;
        float square = path->speed_mm_s * path->speed_mm_s;
        if (into > 0.0f)
            path->bend_mm = min_f(path->bend_mm, BEND_PART * limits->accel_mm_s2[ax] / (into * square));
    }
}

/* S as it is put out. */
static float asked_rpm(const struct machine *machine, const struct gcode_command *command) {
    float most = machine->settings.spindle_max_rpm;
    return most > 0.0f && command->next.spindle_rpm > most ? most : command->next.spindle_rpm;
}

/* A way that follows the spindle, from here; depth_mm along X, signed, with tapers. */
static void lay_path(const struct machine *machine, const struct gcode_command *command,
                     const double from_mm[AXIS_COUNT], const double to_mm[AXIS_COUNT], double depth_mm,
                     struct gear_path *path) {
    const struct gcode_thread *thread = &command->move.thread;
    double way_mm[AXIS_COUNT] = {0}, into_mm[AXIS_COUNT] = {0}, begin_mm[AXIS_COUNT], square = 0.0;
    *path = (struct gear_path){.pitch_mm = thread->pitch_mm,
                               .slope = thread->taper_mm > 0.0f ? thread->depth_mm / thread->taper_mm : 0.0f,
                               .entry = thread->entry,
                               .exit = thread->exit,
                               .reverses = thread->kind == THREAD_TAP,
                               .sense = command->spindle == SPINDLE_CCW ? -1 : 1,
                               .line = machine->lines.count};
    bool tapers = thread->entry || thread->exit;
    memcpy(begin_mm, from_mm, sizeof begin_mm);
    if (tapers) {
        path->depth_mm = (float)fabs(depth_mm);
        into_mm[AXIS_X] = depth_mm;
        begin_mm[AXIS_X] -= thread->entry ? 0.0 : depth_mm;
    }
    for (unsigned ax = 0; ax < AXIS_A; ax++) {
        way_mm[ax] = tapers && ax == AXIS_X ? 0.0 : to_mm[ax] - from_mm[ax];
        square += way_mm[ax] * way_mm[ax];
    }
    path->way_mm = (float)sqrt(square);
    machine->drive.joints.kinematics.ops->inverse(&machine->drive.joints.kinematics, begin_mm,
                                                  machine->drive.motion.plan.position_mm, path->from_mm);
    joint_way(machine, begin_mm, way_mm, path->drive_mm);
    joint_way(machine, begin_mm, into_mm, path->into_mm);
    limit(machine, asked_rpm(machine, command), path);
}

enum status spindle_sync_check(const struct machine *machine, const struct gcode_command *command) {
    if (!WITH_ENCODER)
        return STATUS_OK;
    const struct gcode_move *move = &command->move;
    const double *from_mm = machine->interp.gcode.position_mm;
    struct gear_path path;
    if (move->motion != MOTION_THREAD)
        return STATUS_OK;
    double depth_mm = move->via_mm[AXIS_X] - from_mm[AXIS_X] - (double)move->thread.peak_mm;
    bool cycle = move->thread.kind == THREAD_CYCLE; /* along the drive line */
    lay_path(machine, command, from_mm, cycle ? move->target_mm : move->via_mm, depth_mm, &path);
    float rev_s = asked_rpm(machine, command) * (1.0f / 60.0f);
    /* All passes of a cycle are equally long: what a pass begins later, or ends earlier, is slide * depth
     * together (gcode/thread.c). */
    float way_mm = path.way_mm - move->thread.slide * move->thread.depth_mm;
    bool fits =
        !(path.entry || path.exit) || (float)(path.entry + path.exit) * gear_taper_mm(&path) <= way_mm;
    return rev_s * path.pitch_mm <= path.speed_mm_s && fits ? STATUS_OK : STATUS_SPINDLE_TOO_FAST;
}

/* ---- a pass ---- */

bool spindle_sync_defers(struct machine *machine) {
    if (!WITH_ENCODER)
        return false;
    struct gear *gear = &machine->drive.motion.emit.gear;
    struct machine_spindle_sync *thread = &machine->spindle_sync;
    /* A pass that still waits for the spindle has not touched the work: it is given up, and begins again
     * after the resume. */
    if (gear->phase == GEAR_WAITS) {
        gear_stop(gear);
        thread->again = true;
        thread->cutting = false;
    }
    return thread->cutting;
}

/* The tool is out of the work: now comes what has waited. */
static void come_out(struct machine *machine) {
    struct machine_spindle_sync *thread = &machine->spindle_sync;
    bool door = thread->door_waits;
    thread->cutting = thread->door_waits = false;
    if (door)
        suspend_open_door(machine);
    suspend_release(machine);
}

static void begin_pass(struct machine *machine, const double to_mm[AXIS_COUNT], double depth_mm) {
    struct machine_spindle_sync *thread = &machine->spindle_sync;
    struct gear_path path;
    lay_path(machine, &machine->task.command, machine->drive.joints.tool_mm, to_mm, depth_mm, &path);
    motion_gear(&machine->drive.motion, &path);
    /* At rest: this pass begins with the next start of the step timer. */
    gear_clock(&machine->drive.motion.emit.gear, hal_time_us(machine->hal), true, 0, machine->drive.starts);
    timer_start(machine, &thread->patience, PATIENCE_US);
    thread->cutting = true;
    thread->again = false;
    enter(machine, THREAD_PASSING);
}

/* The spindle is steady and turns the right way, and it is known where: the pass may start. */
static void await_spindle(struct machine *machine, uint32_t now_us) {
    struct emit *emit = &machine->drive.motion.emit;
    struct hal_encoder_state state;
    machine->board.encoder->read(machine->hal, &state);
    float rev_s = spindle_rev_s(&emit->spindle, now_us) * (float)emit->gear.path.sense;
    bool found = state.index_seen || !machine->board.encoder->has_index;
    if (emit->gear.may_start || rev_s <= 0.0f || !found || !spindle_is_steady(&emit->spindle, now_us))
        return;
    /* Each pass counts the angle from the same mark, so that all of them cut the same thread. */
    if (machine->board.encoder->has_index)
        spindle_set_zero(&emit->spindle, state.index_counts);
    gear_start(&emit->gear);
}

static void turn_spindle(struct machine *machine, bool back) {
    const struct gcode_command *command = &machine->task.command;
    enum gcode_spindle other = command->spindle == SPINDLE_CW ? SPINDLE_CCW : SPINDLE_CW;
    float times = back ? command->move.thread.return_speed : 1.0f;
    outputs_set(machine, back ? other : command->spindle, command->next.spindle_rpm * times,
                command->coolant);
    timer_start(machine, &machine->spindle_sync.patience, PATIENCE_US);
}

/* A tap: in, back out beyond the start, and the spindle turns as before. */
static void tap(struct machine *machine, uint32_t now_us) {
    struct emit *emit = &machine->drive.motion.emit;
    const struct machine_spindle_sync *thread = &machine->spindle_sync;
    double line_mm = gear_line_mm(&emit->gear, &emit->spindle, now_us);
    float rev_s = spindle_rev_s(&emit->spindle, now_us) * (float)emit->gear.path.sense;
    /* By the angle of the spindle, not by the axis: the axis follows it in any case, and the spindle needs
     * time to turn. */
    if (thread->step == THREAD_PASSING && line_mm >= (double)emit->gear.path.way_mm) {
        turn_spindle(machine, true);
        enter(machine, THREAD_OUT);
    } else if (thread->step == THREAD_OUT && line_mm <= 0.0) {
        turn_spindle(machine, false);
        enter(machine, THREAD_TURNING);
    } else if (thread->step == THREAD_TURNING && rev_s >= 0.0f) {
        gear_stop(&emit->gear);
        enter(machine, THREAD_STANDING);
    }
}

static void watch_pass(struct machine *machine, uint32_t now_us) {
    struct emit *emit = &machine->drive.motion.emit;
    struct machine_spindle_sync *thread = &machine->spindle_sync;
    float rev_s = spindle_rev_s(&emit->spindle, now_us) * (float)emit->gear.path.sense;
    bool waits = emit->gear.phase == GEAR_WAITS;
    /* As long as the spindle turns in the direction of this step, a standstill of STANDING_US is still
     * allowed. Before, and while it turns round, PATIENCE_US of the command counts. */
    if (!waits &&
        (thread->step == THREAD_OUT ? rev_s < 0.0f : thread->step == THREAD_PASSING && rev_s > 0.0f))
        timer_start(machine, &thread->patience, STANDING_US);
    if (waits)
        await_spindle(machine, now_us);
    else if (emit->gear.path.reverses)
        tap(machine, now_us);
    if (thread->fault != ALARM_NONE)
        return;
    if (emit->gear.lost)
        fail(machine, ALARM_THREAD);
    else if (!timer_runs(machine, &thread->patience))
        fail(machine, ALARM_SPINDLE);
}

/* ---- the line ---- */

void spindle_sync_start(struct machine *machine) {
    if (!WITH_ENCODER)
        return;
    struct machine_spindle_sync *thread = &machine->spindle_sync;
    thread->step = THREAD_NEXT;
    thread->action_pending = thread->again = false;
    thread->fault = ALARM_NONE;
    if (machine->task.command.move.thread.kind == THREAD_CYCLE)
        thread_begin(&thread->cycle, machine->interp.gcode.position_mm, &machine->task.command.move);
}

/* G76: rapids, and passes from rest. @return TASK_NONE when the cycle is done */
static enum task_stage next_action(struct machine *machine) {
    struct machine_spindle_sync *thread = &machine->spindle_sync;
    for (;;) {
        const struct thread_action *action = &thread->action;
        /* A pass and its withdrawal are done: the tool is out of the work. A hold or the door that has
         * waited comes now, and afterwards the cycle continues here. */
        if (thread->cutting && !thread_withdraws(&thread->cycle) && !thread->action_pending) {
            if (!drive_rest_reached(machine))
                return TASK_THREAD;
            come_out(machine);
            if (!state_works(machine))
                return TASK_THREAD;
        }
        if (!thread->action_pending && !thread_next(&thread->cycle, &thread->action))
            return TASK_NONE;
        if (!thread->action_pending)
            task_note_further(&machine->task);
        thread->action_pending = true;
        if (action->kind == THREAD_PASS) {
            if (drive_rest_reached(machine))
                begin_pass(machine, action->target_mm, action->depth_mm);
            return TASK_THREAD;
        }
        if (reach_leaves_travel(machine, action->target_mm))
            return TASK_SOFT_LIMIT;
        if (!moves_push(machine, action->target_mm, true, 0.0f, 0.0f))
            return TASK_THREAD;
        thread->action_pending = false;
    }
}

/* What follows when the axes rest after a pass. */
static enum task_stage end_pass(struct machine *machine) {
    struct machine_spindle_sync *thread = &machine->spindle_sync;
    /* The planner has not seen this motion: it continues from where the axes are. */
    drive_drop(machine);
    enter(machine, THREAD_NEXT);
    if (thread->again)
        return TASK_THREAD;
    thread->action_pending = false;
    if (machine->task.command.move.thread.kind == THREAD_CYCLE)
        return TASK_THREAD;
    if (machine->task.command.move.thread.kind == THREAD_TAP) {
        enter(machine, THREAD_BACK);
        return TASK_THREAD;
    }
    come_out(machine);
    return TASK_NONE;
}

static enum task_stage return_tap(struct machine *machine) {
    struct machine_spindle_sync *thread = &machine->spindle_sync;
    if (!thread->action_pending)
        thread->action_pending = moves_push(machine, machine->task.command.move.target_mm, true, 0.0f, 0.0f);
    if (!thread->action_pending || !drive_rest_reached(machine))
        return TASK_THREAD;
    come_out(machine);
    return TASK_NONE;
}

enum task_stage spindle_sync_poll(struct machine *machine) {
    if (!WITH_ENCODER)
        return TASK_NONE;
    const struct gcode_move *move = &machine->task.command.move;
    const struct machine_spindle_sync *thread = &machine->spindle_sync;
    if (machine->life.state == MACHINE_CHECK)
        return TASK_NONE;
    if (thread->fault != ALARM_NONE)
        return TASK_THREAD; /* spindle_sync_watch() tells it */
    if (thread->step == THREAD_BACK)
        return return_tap(machine);
    if (thread->step == THREAD_NEXT && move->thread.kind == THREAD_CYCLE)
        return next_action(machine);
    if (thread->step == THREAD_NEXT) {
        if (drive_rest_reached(machine))
            begin_pass(machine, move->via_mm, 0.0);
        return TASK_THREAD;
    }
    if (!gear_is_on(&machine->drive.motion.emit.gear))
        return machine_is_at_rest(machine) ? end_pass(machine) : TASK_THREAD;
    watch_pass(machine, hal_time_us(machine->hal));
    return TASK_THREAD;
}
