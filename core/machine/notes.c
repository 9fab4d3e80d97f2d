/* SPDX-License-Identifier: MIT
 * Notes on motion lines under way. */
#include "machine/notes.h"

#include "machine/parts.h"

#include <stddef.h>

static struct line_note *newest(struct line_notes *notes) {
    return &notes->slots[(notes->count - 1) % LINE_NOTES];
}

/* Does the line continue as the row does? The second line of a row says how much N words grow by. */
static bool continues(struct line_note *row, const struct line_note *note) {
    if ((row->number == 0) != (note->number == 0))
        return false;
    int32_t grown = (int32_t)(note->number - row->number), lines = (int32_t)(note->line - row->line);
    if (lines == 0)
        return grown == 0;
    if (row->stride == NOTE_SINGLE && grown % lines == 0)
        row->stride = grown / lines;
    return row->stride != NOTE_SINGLE && grown == row->stride * lines;
}

void notes_add(struct line_notes *notes, const struct line_note *note) {
    if (notes->count > 0 && continues(newest(notes), note))
        return;
    notes->slots[notes->count++ % LINE_NOTES] = *note;
    newest(notes)->stride = NOTE_SINGLE;
}

/* @return NULL: nothing was noted of this line */
static const struct line_note *find(const struct line_notes *notes, uint32_t line) {
    const uint32_t oldest = notes->count < LINE_NOTES ? notes->count : LINE_NOTES;
    uint32_t newer = 0, back = oldest + 1; /* notes `newer` back are of later lines, `back` back are not */
    while (back - newer > 1) {
        const uint32_t middle = (newer + back) / 2;
        if ((int32_t)(line - notes->slots[(notes->count - middle) % LINE_NOTES].line) >= 0)
            back = middle;
        else
            newer = middle;
    }
    return back > oldest ? NULL : &notes->slots[(notes->count - back) % LINE_NOTES];
}

uint32_t notes_number(const struct line_notes *notes, uint32_t line) {
    const struct line_note *note = find(notes, line);
    if (note == NULL)
        return 0;
    return note->stride == NOTE_SINGLE ? note->number
                                       : note->number + (uint32_t)note->stride * (line - note->line);
}

uint32_t notes_line_now(const struct machine *machine) {
    struct step_now now;
    if (!machine->drive.step.active ||
        machine->drive.motion.ahead.owner == AHEAD_HOST) /* a line may be half done */
        return emit_line(&machine->drive.motion.emit);
    step_look(&machine->drive.step, &now);
    return now.line;
}
