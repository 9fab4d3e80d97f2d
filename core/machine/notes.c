/* SPDX-License-Identifier: MIT
 * Notes on motion lines under way. */
#include "machine/inner.h"

#include <stddef.h>

static struct line_note *newest(struct line_notes *notes) {
    return &notes->slots[(notes->count - 1) % LINE_NOTES];
}

/* Does the line go on as the row does? The second line of a row says how much N words grow by. */
static bool continues(struct line_note *row, const struct line_note *note) {
    if (row->rpm != note->rpm || row->feed_mm_s != note->feed_mm_s ||
        (row->number == 0) != (note->number == 0))
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

const struct line_note *notes_find(const struct line_notes *notes, uint32_t line) {
    for (uint32_t back = 1; back <= LINE_NOTES && back <= notes->count; back++) {
        const struct line_note *note = &notes->slots[(notes->count - back) % LINE_NOTES];
        if ((int32_t)(line - note->line) >= 0)
            return note;
    }
    return NULL;
}

uint32_t notes_number(const struct line_notes *notes, uint32_t line) {
    const struct line_note *note = notes_find(notes, line);
    if (note == NULL)
        return 0;
    return note->stride == NOTE_SINGLE ? note->number
                                       : note->number + (uint32_t)note->stride * (line - note->line);
}

uint32_t notes_line_now(const struct machine *machine) {
    struct step_now now;
    if (!machine->step.active || machine->motion.ahead.owner == AHEAD_HOST) /* a line may be half done */
        return emit_line(&machine->motion.emit);
    step_look(&machine->step, &now);
    return now.line;
}
