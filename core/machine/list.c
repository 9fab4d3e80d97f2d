/* SPDX-License-Identifier: MIT
 * Answers of several lines: $$ $# $G $I $N. */
#include "machine/list.h"

#include "machine/parts.h"
#include "machine/report.h"
#include "machine/restart.h"
#include "machine/tool_notes.h"

#include "spindle/vfd_models.h"

void list_settings(struct machine *machine) {
    uint16_t number = SETTINGS_BEGIN;
    while (settings_next(&number, machine->board.axis_count)) {
        double value;
        uint8_t decimals;
        if (!settings_get(&machine->settings, number, machine->board.axis_count, &value, &decimals))
            continue;
        text_string(&machine->out, "$");
        text_int(&machine->out, number);
        text_string(&machine->out, "=");
        text_fixed(&machine->out, value, decimals);
        text_string(&machine->out, "\r\n");
    }
}

static void list_row(struct machine *machine, const char *name, const double mm[AXIS_COUNT]) {
    text_string(&machine->out, "[");
    text_string(&machine->out, name);
    text_string(&machine->out, ":");
    report_axes(machine, mm);
    text_string(&machine->out, "]\r\n");
}

void list_probe(struct machine *machine) {
    text_string(&machine->out, "[PRB:");
    report_axes_steps(machine, machine->probe.steps);
    text_string(&machine->out, machine->probe.ok ? ":1]\r\n" : ":0]\r\n");
}

/* What Grbl does not have is listed only where it was set: a sender that reads just Grbl's rows sees those.
 */
static void list_more_rows(struct machine *machine) {
    char name[] = "G59.1";
    for (unsigned row = 6; row < WCS_COUNT; row++, name[4]++) {
        bool is_set = machine->interp.gcode.modal.wcs == row;
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
            is_set |= machine->interp.gcode.offsets.wcs_mm[row][ax] != 0.0;
        if (is_set)
            list_row(machine, name, machine->interp.gcode.offsets.wcs_mm[row]);
    }
}

/* As grblHAL lists a tool: number, offsets of the axes, radius; and a text, if it has one. */
static void list_tool(struct machine *machine, unsigned tool, const struct tool_note *note) {
    double mm[AXIS_COUNT] = {[AXIS_Z] = (double)machine->interp.gcode.offsets.tool_mm[tool]};
    if (mm[AXIS_Z] == 0.0 && note->diameter_mm == 0.0f && note->text[0] == '\0')
        return;
    text_string(&machine->out, "[T:");
    text_int(&machine->out, (int32_t)tool + 1);
    text_string(&machine->out, "|");
    report_axes(machine, mm);
    text_string(&machine->out, "|");
    report_length(machine, (double)note->diameter_mm / 2.0);
    text_string(&machine->out, note->text[0] == '\0' ? "" : "|");
    text_string(&machine->out, note->text);
    text_string(&machine->out, "]\r\n");
}

static void list_tools(struct machine *machine) {
    const struct store store = stored_records(machine);
    for (unsigned key = 0; key < STORED_NOTE_KEYS; key++) {
        struct tool_notes notes;
        (void)tool_notes_load(&store, key, &notes);
        for (unsigned i = 0; i < NOTES_PER_KEY; i++)
            list_tool(machine, key * NOTES_PER_KEY + i, &notes.of[i]);
    }
}

void list_offsets(struct machine *machine) {
    const struct gcode_offsets *offsets = &machine->interp.gcode.offsets;
    char name[] = "G54";
    for (unsigned row = 0; row < 6; row++, name[2]++)
        list_row(machine, name, offsets->wcs_mm[row]);
    list_more_rows(machine);
    list_row(machine, "G28", offsets->g28_mm);
    list_row(machine, "G30", offsets->g30_mm);
    list_row(machine, "G92", offsets->g92_mm);
    text_string(&machine->out, "[TLO:");
    report_length(machine, offsets->tool_length_mm);
    text_string(&machine->out, "]\r\n");
    list_tools(machine);
    list_probe(machine);
}

static void list_word(struct machine *machine, const char *letter, int32_t number) {
    text_string(&machine->out, letter);
    text_int(&machine->out, number);
}

/* The order of the groups is Grbl's; senders parse the line by the codes, and a mode that Grbl does not
 * have is listed only while it is in force. */
static void list_motion(struct machine *machine) {
    const struct gcode_modal *modal = &machine->interp.gcode.modal;
    static const char *const names[] = {
        [MOTION_RAPID] = "G0",  [MOTION_LINEAR] = "G1", [MOTION_ARC_CW] = "G2", [MOTION_ARC_CCW] = "G3",
        [MOTION_PROBE] = "G38", [MOTION_NONE] = "G80",  [MOTION_CUBIC] = "G5",  [MOTION_QUADRATIC] = "G5.1"};
    static const char *const cycles[] = {
        [CYCLE_CHIP] = "G73", [CYCLE_DRILL] = "G81",     [CYCLE_DWELL] = "G82",     [CYCLE_PECK] = "G83",
        [CYCLE_BORE] = "G85", [CYCLE_BORE_STOP] = "G86", [CYCLE_BORE_DWELL] = "G89"};
    static const char *const threads[] = {
        [THREAD_LINE] = "G33", [THREAD_TAP] = "G33.1", [THREAD_CYCLE] = "G76"};
    const char *name = modal->motion == MOTION_CYCLE    ? cycles[modal->cycle]
                       : modal->motion == MOTION_THREAD ? threads[modal->cycle]
                                                        : names[modal->motion];
    text_string(&machine->out, name);
    if (modal->motion == MOTION_PROBE)
        list_word(machine, ".", modal->probe);
}

static void list_wcs(struct machine *machine) {
    int32_t wcs = machine->interp.gcode.modal.wcs;
    list_word(machine, " G", wcs < 6 ? 54 + wcs : 59);
    if (wcs >= 6)
        list_word(machine, ".", wcs - 5);
}

static void list_outputs(struct machine *machine) {
    const struct gcode_modal *modal = &machine->interp.gcode.modal;
    static const char *const spindle[] = {[SPINDLE_OFF] = " M5", [SPINDLE_CW] = " M3", [SPINDLE_CCW] = " M4"};
    text_string(&machine->out, spindle[modal->spindle]);
    if ((modal->coolant & COOLANT_MIST) != 0)
        text_string(&machine->out, " M7");
    if ((modal->coolant & COOLANT_FLOOD) != 0)
        text_string(&machine->out, " M8");
    if (modal->coolant == 0)
        text_string(&machine->out, " M9");
}

void list_modes(struct machine *machine) {
    static const char *const feed_modes[] = {
        [FEED_PER_MIN] = " G94", [FEED_INVERSE_TIME] = " G93", [FEED_PER_REV] = " G95"};
    const struct gcode_modal *modal = &machine->interp.gcode.modal;
    text_string(&machine->out, "[GC:");
    list_motion(machine);
    list_wcs(machine);
    list_word(machine, " G", 17 + (int32_t)modal->plane);
    text_string(&machine->out, modal->inches ? " G20" : " G21");
    text_string(&machine->out, modal->incremental ? " G91" : " G90");
    text_string(&machine->out, feed_modes[modal->feed_mode]);
    if (modal->retract_to_r)
        text_string(&machine->out, " G99");
    if (modal->diameter)
        text_string(&machine->out, " G7");
    list_outputs(machine);
    list_word(machine, " T", modal->tool);
    text_string(&machine->out, " F");
    if (modal->feed_mode == FEED_PER_REV)
        report_length(machine, (double)modal->feed_mm_s);
    else
        report_rate(machine, (double)modal->feed_mm_s);
    text_string(&machine->out, " S");
    text_fixed(&machine->out, (double)modal->spindle_rpm, 0);
    text_string(&machine->out, "]\r\n");
}

/* V variable spindle, N line numbers, M mist coolant, H homing of single axes. */
void list_build(struct machine *machine) {
    text_string(&machine->out, "[VER:1.1h.20190830:");
    text_string(&machine->out, machine->lines.info);
    text_string(&machine->out, "]\r\n[OPT:VNMH,");
    text_int(&machine->out, (int32_t)plan_moves(&machine->drive.motion.plan));
    text_string(&machine->out, ",");
    text_int(&machine->out, RX_SIZE);
    text_string(&machine->out, "]\r\n");
    if (machine->board.restart != NULL) {
        text_string(&machine->out, "[RESTART:");
        restart_describe(machine, &machine->out);
        text_string(&machine->out, "]\r\n");
    }
    if (machine->board.digest != NULL) {
        text_string(&machine->out, "[DIGEST:");
        text_string(&machine->out, machine->board.digest);
        text_string(&machine->out, "]\r\n");
    }
    report_start(machine, "[START:", "]\r\n");
    report_underruns(machine);
    report_gaps(machine);
}

/* All codes of the table, as [CAPS:G0,G1,..,G38.2,..]. */
void list_codes(struct machine *machine) {
    static const struct {
        char letter[2];
        int16_t x10;
    } codes[] = {
#define CODE(letter, x10, ...) {#letter, x10},
#include "gcode/codes.def"
#undef CODE
    };
    text_string(&machine->out, "[CAPS:");
    for (unsigned n = 0; n < sizeof codes / sizeof codes[0]; n++) {
        text_string(&machine->out, n > 0 ? "," : "");
        list_word(machine, codes[n].letter, codes[n].x10 / 10);
        if (codes[n].x10 % 10 != 0)
            list_word(machine, ".", codes[n].x10 % 10);
    }
    text_string(&machine->out, "]\r\n");
}

void list_startup(struct machine *machine) {
    for (int32_t line = 0; line < STARTUP_LINE_COUNT; line++) {
        list_word(machine, "$N", line);
        text_string(&machine->out, "=");
        text_string(&machine->out, machine->lines.startup_text[line]);
        text_string(&machine->out, "\r\n");
    }
}

/* grblHAL's types. */
enum { SPINDLE_IS_PWM, SPINDLE_IS_RELAY, SPINDLE_IS_VFD };

/* grblHAL's row of $SPINDLESH: number of $395 | number in the program, - if it is not chosen | type | what it
 * can | name. */
static void list_spindle(struct machine *machine, int32_t number, int32_t type, const char *abilities,
                         const char *name) {
    const bool chosen = machine->settings.spindle_type == (uint8_t)number;
    text_string(&machine->out, "[SPINDLE:");
    text_int(&machine->out, number);
    text_string(&machine->out, chosen ? "|0|" : "|-|");
    text_int(&machine->out, type);
    text_string(&machine->out, chosen ? "|*" : "|");
    text_string(&machine->out, abilities);
    text_string(&machine->out, "|");
    text_string(&machine->out, name);
    text_string(&machine->out, "]\r\n");
}

void list_spindles(struct machine *machine) {
    const uint8_t outputs = machine->board.outputs;
    const bool pwm = (outputs & BOARD_OUTPUT_PWM) != 0, reverses = (outputs & BOARD_OUTPUT_REVERSE) != 0;
    if (pwm)
        list_spindle(machine, 0, SPINDLE_IS_PWM, reverses ? "DLV" : "LV", "PWM");
    else if ((outputs & BOARD_OUTPUT_SPINDLE) != 0)
        list_spindle(machine, 0, SPINDLE_IS_RELAY, reverses ? "D" : "", "Relay");
    for (int32_t model = 1; machine->board.bus != NULL && model <= VFD_MODEL_COUNT; model++) {
        const bool confirms = vfd_models[model - 1].frame[VFD_READ_SPEED].send_count != 0;
        list_spindle(machine, model, SPINDLE_IS_VFD, confirms ? "SDV" : "DV", vfd_models[model - 1].title);
    }
}
