/* SPDX-License-Identifier: MIT
 * What the machine stores: which of it could not be read at power-on, until the user has acknowledged that,
 * and the write that is under way. */
#ifndef WIFICNC_MACHINE_KEEP_H
#define WIFICNC_MACHINE_KEEP_H

#include "settings/store.h"

/** Keys of the values. */
enum keep_key {
    KEEP_SETTINGS = STORE_KEY_SETTINGS,
    KEEP_OFFSETS = 2,
    KEEP_STARTUP = 3,
    KEEP_INFO = 4,
    KEEP_WCS_MORE = 5,
    KEEP_TOOLS = 6,
    KEEP_KEYS
};

/** A set of them. */
#define KEEP_BIT(key) (1u << (key))
enum { KEEP_ALL_OFFSETS = KEEP_BIT(KEEP_OFFSETS) | KEEP_BIT(KEEP_WCS_MORE) };

enum keep_step {
    KEEP_RESTS,
    KEEP_COPIES, /* what is damaged is copied first */
    KEEP_WRITES,
};

/** What follows a write, before the line that asked for it is answered. */
enum keep_follow { KEEP_FOLLOW_NOTHING, KEEP_FOLLOW_UNLOCK, KEEP_FOLLOW_RESET };

/** While a value of the store is damaged the machine is locked and nothing is stored: its copy in the store
 * is the only one. */
struct machine_kept {
    uint16_t damaged;       /* KEEP_BIT()s */
    struct store_lost lost; /* of the settings */

    enum keep_step step;
    enum keep_follow follow;
    uint16_t keys; /* KEEP_BIT()s of what is being written */
    bool answers;  /* the line that asked for it is not answered before it is done */
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
void keep_load(struct machine *machine);

/** Something stored could not be read, and the user has not acknowledged that: nothing moves. */
bool keep_is_damaged(const struct machine *machine);

/** Print what is damaged, and what to do, if something is. */
void keep_report(struct machine *machine);

/** The same without `[MSG:`. */
void keep_describe(const struct machine *machine, const struct text_out *out);

/** The board's store. */
struct store keep_store(const struct machine *machine);

#endif
