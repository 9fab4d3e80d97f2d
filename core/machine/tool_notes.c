/* SPDX-License-Identifier: MIT */
#include "machine/tool_notes.h"

#include <string.h>

_Static_assert(NOTES_PER_KEY *STORED_NOTE_KEYS == TOOL_COUNT, "each tool has a note");
_Static_assert(sizeof(struct tool_notes) <= STORE_SIZE_MAX, "the notes of a key can be stored");
_Static_assert(sizeof(struct tool_note) == sizeof(float) + TOOL_TEXT_SIZE, "no padding");

static bool is_empty(const struct tool_note *note) {
    return note->diameter_mm == 0.0f && note->text[0] == '\0';
}

static bool is_sound(const struct tool_note *note) {
    return note->diameter_mm >= 0.0f && (double)note->diameter_mm <= 2.0 * GCODE_COORDINATE_MAX &&
           memchr(note->text, '\0', sizeof note->text) != NULL;
}

enum store_result tool_notes_load(const struct store *store, unsigned key, struct tool_notes *notes) {
    size_t count;
    enum store_result result =
        store_load_up_to(store, (uint8_t)(STORED_NOTES + key), STORE_VERSION, notes, sizeof *notes, &count);
    const size_t known = count / sizeof notes->of[0];
    if (result == STORE_FOUND && count % sizeof notes->of[0] != 0)
        result = STORE_DAMAGED;
    for (size_t i = 0; result == STORE_FOUND && i < known; i++)
        if (!is_sound(&notes->of[i]))
            result = STORE_DAMAGED;
    for (size_t i = result == STORE_FOUND ? known : 0; i < NOTES_PER_KEY; i++)
        notes->of[i] = (struct tool_note){.diameter_mm = 0.0f};
    return result;
}

static void apply(struct tool_note *note, const struct tool_note_edit *edit) {
    if (edit->diameter_mm >= 0.0f)
        note->diameter_mm = edit->diameter_mm;
    if (edit->text == NULL)
        return;
    memset(note->text, 0, sizeof note->text);
    for (size_t i = 0; i + 1 < sizeof note->text && edit->text[i] != '\0'; i++)
        note->text[i] = edit->text[i];
}

void tool_notes_add(struct store_batch *batch, const struct store *store, unsigned key,
                    const struct tool_note_edit *edit) {
    struct tool_notes notes;
    const bool was_stored = tool_notes_load(store, key, &notes) != STORE_EMPTY;
    size_t count = 0;
    if (edit != NULL) {
        apply(&notes.of[edit->tool % NOTES_PER_KEY], edit);
        count = NOTES_PER_KEY;
    }
    while (count > 0 && is_empty(&notes.of[count - 1]))
        count--;
    if (count > 0 || was_stored)
        store_add(batch, store, (uint8_t)(STORED_NOTES + key), STORE_VERSION, &notes,
                  count * sizeof notes.of[0]);
}
