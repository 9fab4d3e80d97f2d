/* SPDX-License-Identifier: MIT
 * What survives a power cut: settings, offsets, startup lines and the text of $I, read at power-on. What
 * could not be read is reported until the user acknowledges it. Writing: stored_write.c. */
#include "machine/stored.h"

#include "machine/list.h"
#include "machine/parts.h"
#include "machine/tool_notes.h"

#include "settings/store.h"

#include <string.h>

/* What the user calls the values, by key. */
static const char *const names[] = {[STORED_SETTINGS] = "settings",
                                    [STORED_OFFSETS] = "work offsets",
                                    [STORED_STARTUP] = "startup lines",
                                    [STORED_INFO] = "$I text",
                                    [STORED_WCS_MORE] = "G59.1 to G59.3",
                                    [STORED_TOOLS] = "tool table",
                                    [STORED_NOTES] = "notes of T1 to T16",
                                    [STORED_NOTES + 1] = "notes of T17 to T32",
                                    [STORED_NOTES + 2] = "notes of T33 to T48",
                                    [STORED_NOTES + 3] = "notes of T49 to T64",
                                    [STORED_NOTES + 4] = "notes of T65 to T80",
                                    [STORED_NOTES + 5] = "notes of T81 to T96"};

static enum store_result load(const struct machine *machine, enum stored_key key, void *bytes, size_t size) {
    struct store store = stored_records(machine);
    return store_load(&store, (uint8_t)key, STORE_VERSION, bytes, size);
}

static bool are_coordinates(const double *mm, unsigned count) {
    for (unsigned i = 0; i < count; i++)
        if (!gcode_in_range(i % AXIS_COUNT, mm[i]))
            return false;
    return true;
}

static bool load_offsets(struct machine *machine) {
    struct gcode_offsets *offsets = &machine->interp.gcode.offsets;
    struct kept_offsets kept;
    enum store_result result = load(machine, STORED_OFFSETS, &kept, sizeof kept);
    if (result != STORE_FOUND)
        return result == STORE_EMPTY;
    /* A sound CRC is not enough: another firmware may have stored values that this one would refuse when
     * typed. */
    if (!are_coordinates(kept.row_mm[0], (KEPT_WCS + 2) * AXIS_COUNT))
        return false;
    memcpy(offsets->wcs_mm, kept.row_mm, KEPT_WCS * sizeof offsets->wcs_mm[0]);
    memcpy(offsets->g28_mm, kept.row_mm[KEPT_WCS], sizeof offsets->g28_mm);
    memcpy(offsets->g30_mm, kept.row_mm[KEPT_WCS + 1], sizeof offsets->g30_mm);
    return true;
}

static bool load_more_offsets(struct machine *machine) {
    struct gcode_offsets *offsets = &machine->interp.gcode.offsets;
    double row_mm[KEPT_WCS_MORE][AXIS_COUNT];
    enum store_result result = load(machine, STORED_WCS_MORE, row_mm, sizeof row_mm);
    if (result != STORE_FOUND)
        return result == STORE_EMPTY;
    if (!are_coordinates(row_mm[0], KEPT_WCS_MORE * AXIS_COUNT))
        return false;
    memcpy(offsets->wcs_mm[KEPT_WCS], row_mm, sizeof row_mm);
    return true;
}

static bool load_tools(struct machine *machine) {
    float tool_mm[TOOL_COUNT];
    enum store_result result = load(machine, STORED_TOOLS, tool_mm, sizeof tool_mm);
    if (result != STORE_FOUND)
        return result == STORE_EMPTY;
    for (unsigned tool = 0; tool < TOOL_COUNT; tool++)
        if (!gcode_in_range(AXIS_Z, (double)tool_mm[tool]))
            return false;
    memcpy(machine->interp.gcode.offsets.tool_mm, tool_mm, sizeof tool_mm);
    return true;
}

/* They are not kept in memory. */
static bool are_notes_sound(const struct machine *machine, unsigned key) {
    struct store store = stored_records(machine);
    struct tool_notes notes;
    return tool_notes_load(&store, key, &notes) != STORE_DAMAGED;
}

static bool load_lines(const struct machine *machine, enum stored_key key, char (*lines)[GRBL_LINE_SIZE],
                       unsigned count) {
    enum store_result result = load(machine, key, lines, count * GRBL_LINE_SIZE);
    bool good = result == STORE_FOUND;
    for (unsigned line = 0; line < count; line++)
        /* A line without its end would be read beyond the array. */
        if (!good || memchr(lines[line], '\0', GRBL_LINE_SIZE) == NULL)
            lines[line][0] = '\0';
    return result != STORE_DAMAGED;
}

static bool load_settings(struct machine *machine) {
    struct store store = stored_records(machine);
    return store_load_settings(&store, &machine->settings, machine->board.axis_count,
                               &machine->stored.lost) != STORE_DAMAGED;
}

void stored_load(struct machine *machine) {
    bool good[STORED_KEYS] = {true};
    good[STORED_SETTINGS] = load_settings(machine);
    good[STORED_OFFSETS] = load_offsets(machine);
    good[STORED_WCS_MORE] = load_more_offsets(machine);
    good[STORED_TOOLS] = load_tools(machine);
    good[STORED_STARTUP] =
        load_lines(machine, STORED_STARTUP, machine->lines.startup_text, STARTUP_LINE_COUNT);
    good[STORED_INFO] = load_lines(machine, STORED_INFO, &machine->lines.info, 1);
    for (unsigned key = 0; key < STORED_NOTE_KEYS; key++)
        good[STORED_NOTES + key] = are_notes_sound(machine, key);
    for (unsigned key = 0; key < STORED_KEYS; key++)
        if (!good[key])
            machine->stored.damaged |= (uint16_t)(1u << key);
    if (!stored_is_damaged(machine))
        return;
    /* As Grbl at power-on with a damaged EEPROM: error:7, then all settings. */
    text_string(&machine->out, "error:7\r\n");
    list_settings(machine);
}

/* ---- damage ---- */

bool stored_is_damaged(const struct machine *machine) {
    return machine->stored.damaged != 0;
}

static void list_lost(const struct store_lost *lost, const struct text_out *out) {
    for (unsigned i = 0; i < lost->count && i < STORE_LOST_MAX; i++) {
        text_string(out, " $");
        text_int(out, lost->number[i]);
    }
    if (lost->count > STORE_LOST_MAX)
        text_string(out, " and more");
}

void stored_describe(const struct machine *machine, const struct text_out *out) {
    if (!stored_is_damaged(machine))
        return;
    const char *before = "Stored data is damaged: ";
    for (unsigned key = 0; key < STORED_KEYS; key++) {
        if ((machine->stored.damaged >> key & 1) == 0)
            continue;
        text_string(out, before);
        text_string(out, names[key]);
        if (key == STORED_SETTINGS)
            list_lost(&machine->stored.lost, out);
        before = ", ";
    }
    text_string(out, ". Check $$ $# $N, then $ACK");
}

void stored_report(struct machine *machine) {
    if (!stored_is_damaged(machine))
        return;
    text_string(&machine->out, "[MSG:");
    stored_describe(machine, &machine->out);
    text_string(&machine->out, "]\r\n");
}

struct store stored_records(const struct machine *machine) {
    return (struct store){.ops = machine->board.store, .ctx = machine->board.store_ctx};
}
