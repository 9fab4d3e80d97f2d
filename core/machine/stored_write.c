/* SPDX-License-Identifier: MIT
 * Writes to the store, one at a time. All values of a write are one transaction: a power cut leaves all of
 * them old or all of them new.
 *
 *   stored_save() --> copy of damaged data --> batch --> "Not stored", if so --> what follows --> ok
 *
 * The store of a chip may take 50 ms and writes while the program runs: stored_poll() looks how far it is. As
 * long as it is busy no further line begins; real-time bytes, switches and motion are served as ever. */
#include "machine/stored_write.h"

#include "machine/answer.h"
#include "machine/configure.h"
#include "machine/parts.h"
#include "machine/pump.h"
#include "machine/report.h"
#include "machine/stored.h"
#include "machine/tool_notes.h"

#include <string.h>

bool stored_is_busy(const struct machine *machine) {
    return machine->stored.step != STORED_RESTS;
}

/* ---- the batch ---- */

static bool is_meant(const struct machine *machine, enum stored_key key) {
    return (machine->stored.keys & STORED_BIT(key)) != 0;
}

enum {
    OFFSETS_SIZE = sizeof(struct kept_offsets),
    WCS_MORE_SIZE = sizeof(double[KEPT_WCS_MORE][AXIS_COUNT]),
    TOOLS_SIZE = sizeof((struct gcode_offsets *)0)->tool_mm,
    STARTUP_SIZE = sizeof((struct machine_lines *)0)->startup_text,
    INFO_SIZE = sizeof((struct machine_lines *)0)->info,
    OTHERS_COUNT = STORED_KEYS - STORED_OFFSETS,
    OTHERS_SUM = OFFSETS_SIZE + WCS_MORE_SIZE + TOOLS_SIZE + STARTUP_SIZE + INFO_SIZE
};
_Static_assert((int)OFFSETS_SIZE <= (int)STORE_OTHERS_SIZE && (int)WCS_MORE_SIZE <= (int)STORE_OTHERS_SIZE &&
                   (int)TOOLS_SIZE <= (int)STORE_OTHERS_SIZE && (int)STARTUP_SIZE <= (int)STORE_OTHERS_SIZE &&
                   (int)INFO_SIZE <= (int)STORE_OTHERS_SIZE,
               "each value can be stored: STORE_OTHERS_SIZE");
/* Notes are stored with the settings and the lines when all of them are cleared, and are heads then. */
_Static_assert((int)OTHERS_COUNT + 1 == (int)STORE_BATCH_VALUES, "the settings and the others");
_Static_assert((int)OTHERS_SUM + OTHERS_COUNT * (int)STORE_HEAD_SIZE <= (int)STORE_OTHERS_ROOM,
               "a batch has room for each value once: STORE_OTHERS_ROOM");
_Static_assert((int)TOOLS_SIZE + (int)sizeof(struct tool_notes) + 2 * (int)STORE_HEAD_SIZE <=
                   (int)STORE_BATCH_SIZE,
               "a batch has room for a tool's length and note");

static void add(struct machine *machine, enum stored_key key, const void *bytes, size_t size) {
    struct store store = stored_records(machine);
    if (is_meant(machine, key))
        store_add(&machine->stored.batch, &store, (uint8_t)key, STORE_VERSION, bytes, size);
}

static void add_offsets(struct machine *machine) {
    const struct gcode_offsets *offsets = &machine->interp.gcode.offsets;
    struct kept_offsets kept;
    memcpy(kept.row_mm, offsets->wcs_mm, KEPT_WCS * sizeof offsets->wcs_mm[0]);
    memcpy(kept.row_mm[KEPT_WCS], offsets->g28_mm, sizeof offsets->g28_mm);
    memcpy(kept.row_mm[KEPT_WCS + 1], offsets->g30_mm, sizeof offsets->g30_mm);
    add(machine, STORED_OFFSETS, &kept, OFFSETS_SIZE);
    add(machine, STORED_WCS_MORE, offsets->wcs_mm[KEPT_WCS], WCS_MORE_SIZE);
}

static void fill_batch(struct machine *machine) {
    struct store_batch *batch = &machine->stored.batch;
    struct store store = stored_records(machine);
    batch->count = batch->used = 0;
    if (is_meant(machine, STORED_SETTINGS))
        store_add_settings(batch, &store, &machine->settings);
    add_offsets(machine);
    add(machine, STORED_TOOLS, machine->interp.gcode.offsets.tool_mm, TOOLS_SIZE);
    for (unsigned key = 0; key < STORED_NOTE_KEYS; key++)
        if (is_meant(machine, (enum stored_key)(STORED_NOTES + key)))
            tool_notes_add(batch, &store, key, machine->stored.edit);
    add(machine, STORED_STARTUP, machine->lines.startup_text, STARTUP_SIZE);
    add(machine, STORED_INFO, machine->lines.info, INFO_SIZE);
}

/* ---- one step after the other ---- */

static void finish(struct machine *machine) {
    struct machine_stored *stored = &machine->stored;
    enum stored_follow follow = stored->follow;
    bool answers = stored->answers;
    stored->step = STORED_RESTS;
    stored->follow = STORED_FOLLOW_NOTHING;
    stored->answers = false;
    if (follow == STORED_FOLLOW_UNLOCK)
        report_message(machine, "'$H'|'$X' to unlock");
    if (follow == STORED_FOLLOW_RESET) {
        report_message(machine, "Restoring defaults");
        /* A reset that came while the store was busy does it already. */
        state_ask_reset(&machine->life, !machine->life.restart);
    }
    if (answers)
        answer_line(machine, STATUS_OK);
}

/* @return false: not stored */
static bool take_written(struct machine *machine, enum hal_store_state state) {
    if (state == HAL_STORE_BUSY)
        return true;
    if (state == HAL_STORE_FAILED)
        report_message(machine, "Not stored");
    finish(machine);
    return state == HAL_STORE_DONE;
}

static bool begin_write(struct machine *machine) {
    struct store store = stored_records(machine);
    fill_batch(machine);
    machine->stored.step = STORED_WRITES;
    return take_written(machine, store_write(&store, &machine->stored.batch));
}

static void take_copied(struct machine *machine, enum hal_store_state state) {
    if (state == HAL_STORE_BUSY)
        return;
    report_message(machine, state == HAL_STORE_DONE ? "Saved a copy of the damaged data"
                                                    : "Cannot save a copy of the damaged data");
    (void)begin_write(machine);
}

/* The damaged data is the only copy of itself: it is copied before anything is written. */
static void begin_copy(struct machine *machine) {
    struct store store = stored_records(machine);
    /* Also what was not asked for: values that could not be read are written again as they are in force
     * now. */
    machine->stored.keys |= machine->stored.damaged;
    /* Before the copy is done: a failure of the copy must not keep the machine locked. */
    machine->stored.damaged = 0;
    machine->stored.step = STORED_COPIES;
    state_show_alarm(&machine->life, machine->life.restarted ? ALARM_RESTARTED : ALARM_NONE);
    take_copied(machine, store.ops->set_aside(store.ctx));
}

bool stored_poll(struct machine *machine) {
    struct store store = stored_records(machine);
    if (!stored_is_busy(machine))
        return false;
    enum hal_store_state state = store_state(&store);
    if (machine->stored.step == STORED_COPIES)
        take_copied(machine, state);
    else
        (void)take_written(machine, state);
    return state != HAL_STORE_BUSY;
}

/* ---- what is stored ---- */

bool stored_save(struct machine *machine, unsigned keys) {
    if (stored_is_damaged(machine)) {
        report_message(machine, "Not stored");
        return false;
    }
    machine->stored.keys = (uint16_t)keys;
    return begin_write(machine);
}

void stored_save_note(struct machine *machine, unsigned keys, const struct tool_note_edit *edit) {
    if (stored_records(machine).ops == NULL)
        report_message(machine, "Not stored"); /* and nothing else keeps it */
    machine->stored.edit = edit;
    (void)stored_save(machine, keys);
    machine->stored.edit = NULL;
}

void stored_startup(struct machine *machine) {
    const char *text = strchr(machine->lines.reader.text, '=');
    char *line = machine->lines.startup_text[machine->lines.store_as];
    if (text != NULL)
        memcpy(line, text + 1, strlen(text));
    (void)stored_save(machine, STORED_BIT(STORED_STARTUP));
}

void stored_acknowledge(struct machine *machine) {
    machine->stored.keys = 0;
    machine->stored.follow = STORED_FOLLOW_UNLOCK;
    begin_copy(machine);
}

static void set_defaults(struct machine *machine, unsigned keys) {
    if ((keys & STORED_BIT(STORED_SETTINGS)) != 0) {
        settings_defaults(&machine->settings);
        configure_board_defaults(machine);
        configure_apply(machine);
        configure_pwm(machine);
        pump_apply(machine);
    }
    if ((keys & STORED_ALL_OFFSETS) != 0)
        memset(&machine->interp.gcode.offsets, 0, sizeof machine->interp.gcode.offsets);
    if ((keys & STORED_BIT(STORED_STARTUP)) != 0)
        memset(machine->lines.startup_text, 0, sizeof machine->lines.startup_text);
    if ((keys & STORED_BIT(STORED_INFO)) != 0)
        memset(machine->lines.info, 0, sizeof machine->lines.info);
}

void stored_defaults(struct machine *machine, unsigned keys) {
    set_defaults(machine, keys);
    machine->stored.keys = (uint16_t)keys;
    machine->stored.follow = STORED_FOLLOW_RESET;
    if (stored_is_damaged(machine))
        begin_copy(machine);
    else
        (void)begin_write(machine);
}
