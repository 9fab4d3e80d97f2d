/* SPDX-License-Identifier: MIT
 * Notes on motion lines under way. More lines cannot be under way than there are blocks and segments with a
 * line of their own, and those are fewer than LINE_NOTES. */
#include "machine/inner.h"

#include <stddef.h>

void notes_add(struct line_notes *notes, const struct line_note *note) {
    notes->slots[notes->count++ % LINE_NOTES] = *note;
}

const struct line_note *notes_find(const struct line_notes *notes, uint32_t line) {
    for (uint32_t back = 1; back <= LINE_NOTES && back <= notes->count; back++) {
        const struct line_note *note = &notes->slots[(notes->count - back) % LINE_NOTES];
        if (note->line == line)
            return note;
    }
    return NULL;
}

uint32_t notes_line_now(const struct machine *machine) {
    const struct step *step = &machine->step;
    return step->active ? step->ring.slots[step->ring.index.tail & (SPAN_RING_SIZE - 1)].line : 0;
}
