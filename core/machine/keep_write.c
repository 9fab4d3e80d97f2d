/* SPDX-License-Identifier: MIT
 * Writes to the store, one at a time. All values of a write are one transaction: a power cut leaves all of
 * them old or all of them new.
 *
 *   keep_save() --> copy of damaged data --> batch --> "Not stored", if so --> what follows --> ok
 *
 * The store of a chip may take 50 ms and writes while the program runs: keep_poll() looks how far it is. As
 * long as it is busy no further line begins; real-time bytes, switches and motion are served as ever. */
#include "machine/inner.h"

#include <string.h>

struct store keep_store(const struct machine *machine) {
    return (struct store){.ops = machine->board.store, .ctx = machine->board.store_ctx};
}

bool keep_is_busy(const struct machine *machine) {
    return machine->kept.step != KEEP_RESTS;
}

/* ---- the batch ---- */

static bool is_meant(const struct machine *machine, enum keep_key key) {
    return (machine->kept.keys & KEEP_BIT(key)) != 0;
}

static void add(struct machine *machine, enum keep_key key, const void *bytes, size_t size) {
    struct store store = keep_store(machine);
    if (is_meant(machine, key))
        store_add(&machine->kept.batch, &store, (uint8_t)key, STORE_VERSION, bytes, size);
}

static void add_offsets(struct machine *machine) {
    const struct gcode_offsets *offsets = &machine->gcode.offsets;
    struct kept_offsets kept;
    memcpy(kept.row_mm, offsets->wcs_mm, KEPT_WCS * sizeof offsets->wcs_mm[0]);
    memcpy(kept.row_mm[KEPT_WCS], offsets->g28_mm, sizeof offsets->g28_mm);
    memcpy(kept.row_mm[KEPT_WCS + 1], offsets->g30_mm, sizeof offsets->g30_mm);
    add(machine, KEEP_OFFSETS, &kept, sizeof kept);
    add(machine, KEEP_WCS_MORE, offsets->wcs_mm[KEPT_WCS], KEPT_WCS_MORE * sizeof offsets->wcs_mm[0]);
}

static void fill_batch(struct machine *machine) {
    struct store_batch *batch = &machine->kept.batch;
    struct store store = keep_store(machine);
    batch->count = batch->used = 0;
    if (is_meant(machine, KEEP_SETTINGS))
        store_add_settings(batch, &store, &machine->settings);
    add_offsets(machine);
    add(machine, KEEP_TOOLS, machine->gcode.offsets.tool_mm, sizeof machine->gcode.offsets.tool_mm);
    add(machine, KEEP_STARTUP, machine->startup_lines, sizeof machine->startup_lines);
    add(machine, KEEP_INFO, machine->info, sizeof machine->info);
}

/* ---- one step after the other ---- */

static void finish(struct machine *machine) {
    struct machine_kept *kept = &machine->kept;
    enum keep_follow follow = kept->follow;
    bool answers = kept->answers;
    kept->step = KEEP_RESTS;
    kept->follow = KEEP_FOLLOW_NOTHING;
    kept->answers = false;
    if (follow == KEEP_FOLLOW_UNLOCK)
        report_message(machine, "'$H'|'$X' to unlock");
    if (follow == KEEP_FOLLOW_RESET) {
        report_message(machine, "Restoring defaults");
        machine->reset_asked = !machine->restart;
    }
    if (answers)
        machine_answer(machine, STATUS_OK);
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
    struct store store = keep_store(machine);
    fill_batch(machine);
    machine->kept.step = KEEP_WRITES;
    return take_written(machine, store_write(&store, &machine->kept.batch));
}

static void take_copied(struct machine *machine, enum hal_store_state state) {
    if (state == HAL_STORE_BUSY)
        return;
    report_message(machine, state == HAL_STORE_DONE ? "A copy of the damaged data is kept"
                                                    : "No copy of the damaged data could be kept");
    (void)begin_write(machine);
}

/* The damaged data is the only copy of itself: it is copied before anything is written. */
static void begin_copy(struct machine *machine) {
    struct store store = keep_store(machine);
    machine->kept.keys |= machine->kept.damaged;
    machine->kept.damaged = 0;
    machine->kept.step = KEEP_COPIES;
    machine->alarm = ALARM_NONE;
    take_copied(machine, store.ops->set_aside(store.ctx));
}

bool keep_poll(struct machine *machine) {
    struct store store = keep_store(machine);
    if (!keep_is_busy(machine))
        return false;
    enum hal_store_state state = store_state(&store);
    if (machine->kept.step == KEEP_COPIES)
        take_copied(machine, state);
    else
        (void)take_written(machine, state);
    return state != HAL_STORE_BUSY;
}

/* ---- what is stored ---- */

bool keep_save(struct machine *machine, unsigned keys) {
    if (keep_is_damaged(machine)) {
        report_message(machine, "Not stored");
        return false;
    }
    machine->kept.keys = (uint16_t)keys;
    return begin_write(machine);
}

void keep_startup(struct machine *machine) {
    const char *text = strchr(machine->reader.text, '=');
    char *line = machine->startup_lines[machine->store_as];
    if (text != NULL)
        memcpy(line, text + 1, strlen(text));
    (void)keep_save(machine, KEEP_BIT(KEEP_STARTUP));
}

void keep_acknowledge(struct machine *machine) {
    machine->kept.keys = 0;
    machine->kept.follow = KEEP_FOLLOW_UNLOCK;
    begin_copy(machine);
}

static void set_defaults(struct machine *machine, unsigned keys) {
    if ((keys & KEEP_BIT(KEEP_SETTINGS)) != 0) {
        settings_defaults(&machine->settings);
        machine->settings.step_pulse_us = machine_board_pulse_us(machine);
        machine_apply_settings(machine);
    }
    if ((keys & KEEP_ALL_OFFSETS) != 0)
        memset(&machine->gcode.offsets, 0, sizeof machine->gcode.offsets);
    if ((keys & KEEP_BIT(KEEP_STARTUP)) != 0)
        memset(machine->startup_lines, 0, sizeof machine->startup_lines);
    if ((keys & KEEP_BIT(KEEP_INFO)) != 0)
        memset(machine->info, 0, sizeof machine->info);
}

void keep_defaults(struct machine *machine, unsigned keys) {
    set_defaults(machine, keys);
    machine->kept.keys = (uint16_t)keys;
    machine->kept.follow = KEEP_FOLLOW_RESET;
    if (keep_is_damaged(machine))
        begin_copy(machine);
    else
        (void)begin_write(machine);
}
