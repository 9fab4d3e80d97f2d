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

/* What the user calls the values, by key. */
static const char *const names[] = {[KEY_SETTINGS] = "settings",       [KEY_OFFSETS] = "work offsets",
                                    [KEY_STARTUP] = "startup lines",   [KEY_INFO] = "$I text",
                                    [KEY_WCS_MORE] = "G59.1 to G59.3", [KEY_TOOLS] = "tool table"};
enum { KEY_COUNT = sizeof names / sizeof names[0] };

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

static bool told(struct machine *machine, bool stored) {
    if (!stored)
        report_message(machine, "Not stored");
    return stored;
}

static void save(struct machine *machine, uint8_t key, const void *bytes, size_t size) {
    struct store store = store_of(machine);
    (void)told(machine, !keep_is_damaged(machine) && store_save(&store, key, VERSION, bytes, size));
}

bool keep_settings(struct machine *machine) {
    struct store store = store_of(machine);
    return told(machine, !keep_is_damaged(machine) && store_save_settings(&store, &machine->settings));
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

static void keep_lines(struct machine *machine) {
    save(machine, KEY_STARTUP, machine->startup_lines, sizeof machine->startup_lines);
}

void keep_startup(struct machine *machine) {
    const char *text = strchr(machine->reader.text, '=');
    char *line = machine->startup_lines[machine->store_as];
    if (text != NULL)
        memcpy(line, text + 1, strlen(text));
    keep_lines(machine);
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

static bool load_settings(struct machine *machine) {
    struct store store = store_of(machine);
    return store_load_settings(&store, &machine->settings, machine->board.axis_count, &machine->kept.lost) !=
           STORE_DAMAGED;
}

void keep_load(struct machine *machine) {
    bool good[KEY_COUNT];
    good[0] = true;
    good[KEY_SETTINGS] = load_settings(machine);
    good[KEY_OFFSETS] = load_offsets(machine);
    good[KEY_WCS_MORE] = load_more_offsets(machine);
    good[KEY_TOOLS] = load_tools(machine);
    good[KEY_STARTUP] = load_lines(machine, KEY_STARTUP, machine->startup_lines, STARTUP_LINE_COUNT);
    good[KEY_INFO] = load_lines(machine, KEY_INFO, &machine->info, 1);
    for (unsigned key = 0; key < KEY_COUNT; key++)
        if (!good[key])
            machine->kept.damaged |= (uint16_t)(1u << key);
    if (!keep_is_damaged(machine))
        return;
    text_string(&machine->out, "error:7\r\n");
    list_settings(machine);
}

/* ---- damage ---- */

bool keep_is_damaged(const struct machine *machine) {
    return machine->kept.damaged != 0;
}

static void list_lost(const struct store_lost *lost, const struct text_out *out) {
    for (unsigned i = 0; i < lost->count && i < STORE_LOST_MAX; i++) {
        text_string(out, " $");
        text_int(out, lost->number[i]);
    }
    if (lost->count > STORE_LOST_MAX)
        text_string(out, " and more");
}

/* Without the frame of a message. */
static void describe(const struct machine *machine, const struct text_out *out) {
    const char *before = "Stored data is damaged: ";
    for (unsigned key = 0; key < KEY_COUNT; key++) {
        if ((machine->kept.damaged >> key & 1) == 0)
            continue;
        text_string(out, before);
        text_string(out, names[key]);
        if (key == KEY_SETTINGS)
            list_lost(&machine->kept.lost, out);
        before = ", ";
    }
    text_string(out, ". Check $$ $# $N, then $ACK");
}

void keep_report(struct machine *machine) {
    if (!keep_is_damaged(machine))
        return;
    text_string(&machine->out, "[MSG:");
    describe(machine, &machine->out);
    text_string(&machine->out, "]\r\n");
}

/* A text of limited size. */
struct notice {
    char *text;
    size_t size, count;
};

static void add_to_notice(void *ctx, const char *bytes, size_t count) {
    struct notice *notice = ctx;
    size_t room = notice->size - 1 - notice->count;
    count = count < room ? count : room;
    memcpy(notice->text + notice->count, bytes, count);
    notice->count += count;
    notice->text[notice->count] = '\0';
}

bool machine_notice(const struct machine *machine, unsigned number, char *text, size_t size) {
    struct notice notice = {.text = text, .size = size};
    const struct text_out out = {.write = add_to_notice, .ctx = &notice};
    const char *sender = sender_notice(machine);
    text[0] = '\0';
    if (keep_is_damaged(machine) && number-- == 0)
        describe(machine, &out);
    else if (sender != NULL && number == 0)
        text_string(&out, sender);
    return text[0] != '\0';
}

/* What is stored now is damaged, but it is the only copy: the copy comes first. */
static void set_aside(struct machine *machine) {
    struct store store = store_of(machine);
    if (keep_is_damaged(machine))
        report_message(machine, store.ops->set_aside(store.ctx)
                                    ? "A copy of the damaged data is kept"
                                    : "No copy of the damaged data could be kept");
}

static void acknowledged(struct machine *machine) {
    machine->kept = (struct machine_kept){.damaged = 0};
    machine->alarm = ALARM_NONE;
}

void keep_acknowledge(struct machine *machine) {
    unsigned damaged = machine->kept.damaged;
    set_aside(machine);
    acknowledged(machine);
    if ((damaged >> KEY_SETTINGS & 1) != 0)
        (void)keep_settings(machine);
    if ((damaged & (1u << KEY_OFFSETS | 1u << KEY_WCS_MORE)) != 0)
        keep_offsets(machine);
    if ((damaged >> KEY_TOOLS & 1) != 0)
        keep_tools(machine);
    if ((damaged >> KEY_STARTUP & 1) != 0)
        keep_lines(machine);
    if ((damaged >> KEY_INFO & 1) != 0)
        keep_info(machine);
}

void keep_defaults(struct machine *machine, bool settings, bool offsets, bool lines) {
    keep_acknowledge(machine);
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
        keep_lines(machine);
        keep_info(machine);
    }
}
