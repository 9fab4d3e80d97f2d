/* SPDX-License-Identifier: MIT
 * M6 by $341: the way up to where a tool is changed, and the measuring of its length. Both are motion of a
 * parked hold (park.h), so the job stays as it was and returns as from any of them. [task]
 *
 *   M6 --> up (and above G59.3) --> the operator changes the tool --> ~ or $TPW: two touches --> tool length
 *
 * The first touch after a reset or $TLR is the reference: tool lengths are how much later or earlier the next
 * ones touch. */
#ifndef WIFICNC_MACHINE_TOOL_CHANGE_H
#define WIFICNC_MACHINE_TOOL_CHANGE_H

#include "gcode/gcode.h"
#include "gcode/status.h"
#include "machine/machine.h"
#include "machine/task.h"

/** $341. */
enum tool_change_mode {
    TOOL_CHANGE_NORMAL,
    TOOL_CHANGE_TOUCH_OFF,
    TOOL_CHANGE_TOUCH_OFF_AT_G59_3,
    TOOL_CHANGE_SETTER,
    TOOL_CHANGE_IGNORE,
};

/** What the motion is for. */
enum tool_change_work {
    TOOL_CHANGE_RESTS,
    TOOL_CHANGE_GOES,     /* to where the tool is changed */
    TOOL_CHANGE_ANSWERS,  /* $TPW: its line is answered */
    TOOL_CHANGE_MEASURES, /* ~ with $341=3: then the job continues */
};

struct machine_tool_change {
    enum tool_change_work work;
    uint8_t step;        /* enum of tool_change.c */
    bool under_way;      /* the motion of the step has begun */
    bool stopped;        /* !, a jog cancel or the door: the rest is left out */
    bool measured;       /* since M6 */
    bool has_reference;  /* since the reset */
    double reference_mm; /* machine Z at which a tool of length 0 touches */
    double from_mm;      /* machine Z where $TPW began */
};

/** `!`, 0x85, the door: what is under way ends. */
static inline void tool_change_stop(struct machine_tool_change *change) {
    change->stopped = change->work != TOOL_CHANGE_RESTS;
}

/** An alarm or the end of the hold. */
static inline void tool_change_end(struct machine_tool_change *change) {
    change->work = TOOL_CHANGE_RESTS;
}

/** Reset: tool lengths are forgotten, and the reference with them. */
static inline void tool_change_forget(struct machine_tool_change *change) {
    *change = (struct machine_tool_change){.work = TOOL_CHANGE_RESTS};
}

/** $TLR: the next touch is the reference. */
static inline void tool_change_new_reference(struct machine_tool_change *change) {
    change->has_reference = false;
}

/** M6 goes to a place first, by $341. */
bool tool_change_goes(const struct machine *machine);

/** Whether the M6 of this line is possible. */
enum status tool_change_check(const struct machine *machine, const struct gcode_command *command);

/** The hold of M6 is the operator's: to where the tool is changed. */
void tool_change_begin(struct machine *machine);

/** $TPW. @return why not; STATUS_OK: TASK_TOOL_MOTION answers */
enum status tool_change_probe(struct machine *machine);

/** ~ has come. @return true: the tool is measured first */
bool tool_change_measure(struct machine *machine);

/** TASK_TOOL_MOTION. @return TASK_NONE: it has ended */
enum task_stage tool_change_poll(struct machine *machine);

#endif
