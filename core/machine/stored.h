/* SPDX-License-Identifier: MIT
 * What the machine stores: which of it could not be read at power-on, until the user has acknowledged that,
 * and the write that is under way. */
#ifndef WIFICNC_MACHINE_STORED_H
#define WIFICNC_MACHINE_STORED_H

#include "settings/store.h"

/** Keys of the values. */
enum stored_key {
    STORED_SETTINGS = STORE_KEY_SETTINGS,
    STORED_OFFSETS = 2,
    STORED_STARTUP = 3,
    STORED_INFO = 4,
    STORED_WCS_MORE = 5,
    STORED_TOOLS = 6,
    STORED_NOTES = 7, /* diameter and text of the tools: tool_notes.h */
    STORED_KEYS = 13
};
enum { STORED_NOTE_KEYS = STORED_KEYS - STORED_NOTES };

/** A set of them. */
#define STORED_BIT(key) (1u << (key))
enum {
    STORED_ALL_OFFSETS = STORED_BIT(STORED_OFFSETS) | STORED_BIT(STORED_WCS_MORE),
    STORED_ALL_NOTES = STORED_BIT(STORED_KEYS) - STORED_BIT(STORED_NOTES)
};

enum stored_step {
    STORED_RESTS,
    STORED_COPIES, /* what is damaged is copied first */
    STORED_WRITES,
};

/** What follows a write, before the line that asked for it is answered. */
enum stored_follow { STORED_FOLLOW_NOTHING, STORED_FOLLOW_UNLOCK, STORED_FOLLOW_RESET };

/** While a value of the store is damaged the machine is locked and nothing is stored: its copy in the store
 * is the only one. */
struct machine_stored {
    uint16_t damaged;       /* STORED_BIT()s */
    struct store_lost lost; /* of the settings */

    enum stored_step step;
    enum stored_follow follow;
    uint16_t keys; /* STORED_BIT()s of what is being written */
    const struct tool_note_edit
        *edit;    /* of the tool whose note is stored; NULL: notes of `keys` are cleared */
    bool answers; /* the line that asked for it is not answered before it is done */
    struct store_batch batch;
};

struct machine;
struct text_out;

#include "gcode/gcode.h"

/** G54 .. G59, G28, G30 as they are stored; G59.1 .. G59.3 have their own key. */
enum { KEPT_WCS = 6, KEPT_WCS_MORE = WCS_COUNT - KEPT_WCS };
struct kept_offsets {
    double row_mm[KEPT_WCS + 2][AXIS_COUNT];
};

/** Power-on: read all that is stored, and keep in mind what could not be read. */
void stored_load(struct machine *machine);

/** Something stored could not be read, and the user has not acknowledged that: nothing moves. */
bool stored_is_damaged(const struct machine *machine);

/** Print what is damaged, and what to do, if something is. */
void stored_report(struct machine *machine);

/** The same without `[MSG:`. */
void stored_describe(const struct machine *machine, const struct text_out *out);

/** The board's store. */
struct store stored_records(const struct machine *machine);

#endif
