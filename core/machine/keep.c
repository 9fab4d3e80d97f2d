/* SPDX-License-Identifier: MIT
 * What survives a power cut: settings, offsets, startup lines and the text of $I. */
#include "machine/inner.h"

#include "settings/store.h"

#include <string.h>

/* Keys and layout versions of the values. A value of another version counts as damaged. */
enum {
    KEY_SETTINGS = STORE_KEY_SETTINGS,
    KEY_OFFSETS = 2,
    KEY_STARTUP = 3,
    KEY_INFO = 4,
    KEY_WCS_MORE = 5,
    KEY_TOOLS = 6
};
enum { VERSION = STORE_VERSION };

/* G54 .. G59, G28, G30; and G59.1 .. G59.3 under a key of their own. */
enum { WCS_GRBL = 6, WCS_MORE = WCS_COUNT - WCS_GRBL };
struct kept_offsets {
    double row_mm[WCS_GRBL + 2][AXIS_COUNT];
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

bool keep_settings(struct machine *machine) {
    struct store store = store_of(machine);
    if (store_save_settings(&store, KEY_SETTINGS, VERSION, &machine->settings))
        return true;
    report_message(machine, "Not stored");
    return false;
}

void keep_offsets(struct machine *machine) {
    const struct gcode_offsets *offsets = &machine->gcode.offsets;
    struct kept_offsets kept;
    memcpy(kept.row_mm, offsets->wcs_mm, WCS_GRBL * sizeof offsets->wcs_mm[0]);
    memcpy(kept.row_mm[WCS_GRBL], offsets->g28_mm, sizeof offsets->g28_mm);
    memcpy(kept.row_mm[WCS_GRBL + 1], offsets->g30_mm, sizeof offsets->g30_mm);
    save(machine, KEY_OFFSETS, &kept, sizeof kept);
    save(machine, KEY_WCS_MORE, offsets->wcs_mm[WCS_GRBL], WCS_MORE * sizeof offsets->wcs_mm[0]);
}

void keep_tools(struct machine *machine) {
    save(machine, KEY_TOOLS, machine->gcode.offsets.tool_mm, sizeof machine->gcode.offsets.tool_mm);
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

static bool is_coordinate(double mm) {
    return mm >= -GCODE_COORDINATE_MAX && mm <= GCODE_COORDINATE_MAX;
}

static bool are_coordinates(const double *mm, unsigned count) {
    for (unsigned i = 0; i < count; i++)
        if (!is_coordinate(mm[i]))
            return false;
    return true;
}

static bool load_offsets(struct machine *machine) {
    struct gcode_offsets *offsets = &machine->gcode.offsets;
    struct kept_offsets kept;
    enum store_result result = load(machine, KEY_OFFSETS, &kept, sizeof kept);
    if (result != STORE_FOUND)
        return result == STORE_EMPTY;
    if (!are_coordinates(kept.row_mm[0], (WCS_GRBL + 2) * AXIS_COUNT))
        return false;
    memcpy(offsets->wcs_mm, kept.row_mm, WCS_GRBL * sizeof offsets->wcs_mm[0]);
    memcpy(offsets->g28_mm, kept.row_mm[WCS_GRBL], sizeof offsets->g28_mm);
    memcpy(offsets->g30_mm, kept.row_mm[WCS_GRBL + 1], sizeof offsets->g30_mm);
    return true;
}

static bool load_more_offsets(struct machine *machine) {
    struct gcode_offsets *offsets = &machine->gcode.offsets;
    double row_mm[WCS_MORE][AXIS_COUNT];
    enum store_result result = load(machine, KEY_WCS_MORE, row_mm, sizeof row_mm);
    if (result != STORE_FOUND)
        return result == STORE_EMPTY;
    if (!are_coordinates(row_mm[0], WCS_MORE * AXIS_COUNT))
        return false;
    memcpy(offsets->wcs_mm[WCS_GRBL], row_mm, sizeof row_mm);
    return true;
}

static bool load_tools(struct machine *machine) {
    float tool_mm[TOOL_COUNT];
    enum store_result result = load(machine, KEY_TOOLS, tool_mm, sizeof tool_mm);
    if (result != STORE_FOUND)
        return result == STORE_EMPTY;
    for (unsigned tool = 0; tool < TOOL_COUNT; tool++)
        if (!is_coordinate((double)tool_mm[tool]))
            return false;
    memcpy(machine->gcode.offsets.tool_mm, tool_mm, sizeof tool_mm);
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
    good &= load_more_offsets(machine);
    good &= load_tools(machine);
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
        (void)keep_settings(machine);
    }
    if (offsets) {
        memset(&machine->gcode.offsets, 0, sizeof machine->gcode.offsets);
        keep_offsets(machine);
        keep_tools(machine);
    }
    if (lines) {
        memset(machine->startup_lines, 0, sizeof machine->startup_lines);
        memset(machine->info, 0, sizeof machine->info);
        save(machine, KEY_STARTUP, machine->startup_lines, sizeof machine->startup_lines);
        keep_info(machine);
    }
}
