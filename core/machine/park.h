/* SPDX-License-Identifier: MIT
 * A parked hold: between 0xA3 and ~ the lines are the operator's, and are read before those of the job that
 * wait. They may jog, probe, set work zero and tool length, switch spindle, coolant and outputs. [task]
 *
 *   hold, M0, M6 -- 0xA3 --> parked: $J= G38 G10 G43.1 M3 .. -- ~ --> returns to where the job was left
 * (preempt.h)
 *
 * The job stays as it was: its plan in the look-ahead, its line as far as it is, its modes. The operator's
 * motion goes by the queue of network hosts, which keeps the limits and needs no plan. */
#ifndef WIFICNC_MACHINE_PARK_H
#define WIFICNC_MACHINE_PARK_H

#include "gcode/gcode.h"
#include "gcode/status.h"
#include "machine/machine.h"

struct machine_task;

struct machine_park {
    bool asked;        /* 0xA3 has come: as soon as the axes rest */
    bool open;         /* the operator's lines are read; the job's is in machine->aside */
    bool resume_asked; /* ~ has come: when the lines before it are done */
    bool tool;         /* it is that of an M6 that goes to a place ($341): open as soon as the axes rest */
    bool operators;    /* ... and a line without 0xA3 was the operator's */
    bool stops;        /* its motion slows down and is discarded */
    bool silent; /* the sender was lost: its lines are refused, and none are read before the next 0xA3 */
    int32_t top_steps;             /* the highest Z of the operator's moves */
    int32_t end_steps[AXIS_COUNT]; /* where they end */
};

/** `!`, 0x85, the door: the operator's motion slows down and is discarded. */
void park_stop(struct machine *machine);

/** ~. @return false: nothing is parked */
bool park_resume(struct machine *machine);

/** The sender is lost: its lines are refused; ~ or 0xA3 of another one leads on. */
void park_lose_sender(struct machine *machine);

/** Alarm or reset: motion is halted. The job's line is the present one. */
void park_forget(struct machine *machine);

/** M6: as if 0xA3 had come, but for the lines. */
static inline void park_ask_for_tool(struct machine_park *park) {
    park->tool = park->asked = true;
}

/** A line that needs no 0xA3 is the operator's, and so are others that follow it. */
static inline void park_know_operator(struct machine_park *park) {
    park->operators = true;
}

/** Why the line under way cannot be left here; NULL: it can. */
const char *park_refuse_stage(const struct machine *machine);

/** ~ does not count. */
void park_keep(struct machine *machine);

/** The job's line sets offsets: it would set them again, as they were when it was read. */
bool park_job_sets_offset(const struct machine *machine);

/** Whether the operator may do this now. */
enum status park_check(const struct machine *machine, const struct gcode_command *command);

/** The same of where a jog or a probing move leads. */
enum status park_check_jog(const struct machine *machine, const struct gcode_move *move);

/** A straight move of the present line. @param flags  enum segment_flags @return false: no room now */
bool park_move(struct machine *machine, uint8_t flags);

/** At rest: what is left of the operator's motion is discarded. */
void park_drop(struct machine *machine);

/** The job's line: the present one, or the one that waits aside. */
const struct machine_task *park_job_task(const struct machine *machine);

/** The operator's lines begin where the axes are. */
void park_know_place(struct machine *machine);

/** Where the joints are when the tool is there. @param near  where they come from */
void park_steps_at(const struct machine *machine, const double tool_mm[AXIS_COUNT],
                   const int32_t near[AXIS_COUNT], int32_t steps[AXIS_COUNT]);

/** No more lines are the operator's; half a line is none. */
void park_end_lines(struct machine *machine);

/** The job's line is the present one again. @param shift_mm  by which its work zero has moved */
void park_take_back(struct machine *machine, const double shift_mm[AXIS_COUNT]);

#endif
