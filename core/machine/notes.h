/* SPDX-License-Identifier: MIT
 * Notes on motion lines under way. [task] */
#ifndef WIFICNC_MACHINE_NOTES_H
#define WIFICNC_MACHINE_NOTES_H

#include "machine/machine.h"
#include "motion/planner.h"

/** What is asked about motion lines while they are under way: one note for a row of source lines. Moves of
 * different notes never share a piece of path, so more notes than pieces and segments are never needed. */
enum { LINE_NOTES = PLAN_SIZE + 32 };
struct line_note {
    uint32_t line;   /* first of the row */
    uint32_t number; /* its N word; 0: none has one */
    int32_t stride;  /* from N word to N word, per line; NOTE_SINGLE: a row of one line */
};
#define NOTE_SINGLE INT32_MIN
struct line_notes {
    uint32_t count;
    struct line_note slots[LINE_NOTES];
};

/** Nothing of what comes is a line of the text side. */
static inline void notes_forget(struct line_notes *notes) {
    notes->count = 0;
}

/** Lines are motion to come: of note->line, with number. Ever growing lines. */
void notes_add(struct line_notes *notes, const struct line_note *note);

/** @return the N word of a source line; 0: none, or not known any more */
uint32_t notes_number(const struct line_notes *notes, uint32_t line);

/** Source line of the motion on the pins, or of the motion that a hold interrupts; 0 = none. */
uint32_t notes_line_now(const struct machine *machine);

#endif
