/* SPDX-License-Identifier: MIT
 * What survives a power cut: settings, offsets, startup lines and the text of $I. */
#include "machine/inner.h"

#include "settings/store.h"

#include <string.h>

/* Keys and layout versions of the values. A value of another version counts as damaged. */
enum { KEY_SETTINGS = 1, KEY_OFFSETS = 2, KEY_STARTUP = 3, KEY_INFO = 4 };
enum { VERSION = 1 };

/* G54 .. G59, G28, G30. */
struct kept_offsets {
    double row_mm[WCS_COUNT + 2][AXIS_COUNT];
};

static struct store store_of(const struct machine *machine) {
    return (struct store){.ops = machine->board.store, .ctx = machine->board.store_ctx};
}

static enum store_result load(const struct machine *machine, uint8_t key, void *bytes, size_t size) {
    struct store store = store_of(machine);
    return store_load(&store, key, VERSION, bytes, size);
}

static void save(struct machine *machine, uint8_t key, const void *bytes, size_t size) {
    struct store store = store_of(machine);
    if (!store_save(&store, key, VERSION, bytes, size))
        report_message(machine, "Not stored");
}

void keep_settings(struct machine *machine) {
    struct store store = store_of(machine);
    if (!store_save_settings(&store, KEY_SETTINGS, VERSION, &machine->settings))
        report_message(machine, "Not stored");
}

void keep_offsets(struct machine *machine) {
    const struct gcode_offsets *offsets = &machine->gcode.offsets;
    struct kept_offsets kept;
    memcpy(kept.row_mm, offsets->wcs_mm, sizeof offsets->wcs_mm);
    memcpy(kept.row_mm[WCS_COUNT], offsets->g28_mm, sizeof offsets->g28_mm);
    memcpy(kept.row_mm[WCS_COUNT + 1], offsets->g30_mm, sizeof offsets->g30_mm);
    save(machine, KEY_OFFSETS, &kept, sizeof kept);
}

void keep_startup(struct machine *machine) {
    const char *text = strchr(machine->reader.text, '=');
    char *line = machine->startup_lines[machine->store_as];
    if (text != NULL)
        memcpy(line, text + 1, strlen(text));
    save(machine, KEY_STARTUP, machine->startup_lines, sizeof machine->startup_lines);
}

void keep_info(struct machine *machine) {
    save(machine, KEY_INFO, machine->info, sizeof machine->info);
}

static bool load_offsets(struct machine *machine) {
    struct gcode_offsets *offsets = &machine->gcode.offsets;
    struct kept_offsets kept;
    enum store_result result = load(machine, KEY_OFFSETS, &kept, sizeof kept);
    if (result != STORE_FOUND)
        return result == STORE_EMPTY;
    for (unsigned row = 0; row < WCS_COUNT + 2; row++)
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
            if (!(kept.row_mm[row][ax] >= -GCODE_COORDINATE_MAX &&
                  kept.row_mm[row][ax] <= GCODE_COORDINATE_MAX))
                return false;
    memcpy(offsets->wcs_mm, kept.row_mm, sizeof offsets->wcs_mm);
    memcpy(offsets->g28_mm, kept.row_mm[WCS_COUNT], sizeof offsets->g28_mm);
    memcpy(offsets->g30_mm, kept.row_mm[WCS_COUNT + 1], sizeof offsets->g30_mm);
    return true;
}

static bool load_lines(const struct machine *machine, uint8_t key, char (*lines)[LINE_SIZE], unsigned count) {
    enum store_result result = load(machine, key, lines, count * LINE_SIZE);
    bool good = result == STORE_FOUND;
    for (unsigned line = 0; line < count; line++)
        if (!good || memchr(lines[line], '\0', LINE_SIZE) == NULL)
            lines[line][0] = '\0';
    return result != STORE_DAMAGED;
}

void keep_load(struct machine *machine) {
    struct store store = store_of(machine);
    enum store_result settings =
        store_load_settings(&store, KEY_SETTINGS, VERSION, &machine->settings, machine->board.axis_count);
    bool good = settings != STORE_DAMAGED;
    good &= load_offsets(machine);
    good &= load_lines(machine, KEY_STARTUP, machine->startup_lines, STARTUP_LINE_COUNT);
    good &= load_lines(machine, KEY_INFO, &machine->info, 1);
    if (good)
        return;
    text_string(&machine->out, "error:7\r\n");
    list_settings(machine);
}

void keep_defaults(struct machine *machine, bool settings, bool offsets, bool lines) {
    if (settings) {
        settings_defaults(&machine->settings);
        machine->settings.step_pulse_us = machine_board_pulse_us(machine);
        machine_apply_settings(machine);
        keep_settings(machine);
    }
    if (offsets) {
        memset(&machine->gcode.offsets, 0, sizeof machine->gcode.offsets);
        keep_offsets(machine);
    }
    if (lines) {
        memset(machine->startup_lines, 0, sizeof machine->startup_lines);
        memset(machine->info, 0, sizeof machine->info);
        save(machine, KEY_STARTUP, machine->startup_lines, sizeof machine->startup_lines);
        keep_info(machine);
    }
}
