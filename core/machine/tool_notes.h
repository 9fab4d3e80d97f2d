/* SPDX-License-Identifier: MIT
 * Diameter and text of the tools of the tool table. [task] Nothing moves by them, so they are in the store
 * alone, and a chip's RAM has no copy: they are read when they are listed.
 *
 *   value of a key = the notes of NOTES_PER_KEY tools, without the empty ones at its end */
#ifndef WIFICNC_MACHINE_TOOL_NOTES_H
#define WIFICNC_MACHINE_TOOL_NOTES_H

#include "machine/stored.h"

#include <stdbool.h>

enum { TOOL_TEXT_SIZE = 24, NOTES_PER_KEY = TOOL_COUNT / STORED_NOTE_KEYS };

struct tool_note {
    float diameter_mm;         /* 0: not known */
    char text[TOOL_TEXT_SIZE]; /* NUL-terminated; "": none */
};
struct tool_notes {
    struct tool_note of[NOTES_PER_KEY];
};

/** What a line of G10 changes. */
struct tool_note_edit {
    uint8_t tool;      /* 0 = T1 */
    float diameter_mm; /* < 0: stays */
    const char *text;  /* NULL: stays */
};

/** The notes of this key, 0 .. STORED_NOTE_KEYS - 1; all empty where nothing sound is stored.
 *  @return STORE_DAMAGED: it cannot be read, or has what no line could have brought */
enum store_result tool_notes_load(const struct store *store, unsigned key, struct tool_notes *notes);

/** Of the values that a write takes: with this edit, or else empty. */
void tool_notes_add(struct store_batch *batch, const struct store *store, unsigned key,
                    const struct tool_note_edit *edit);

/** The key of a tool, 0 = T1. */
static inline unsigned tool_notes_key(unsigned tool) {
    return tool / NOTES_PER_KEY;
}

#endif
