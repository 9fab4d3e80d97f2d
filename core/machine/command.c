/* SPDX-License-Identifier: MIT
 * $ lines: a table of what they begin with, the action that each is, and who carries it out. Order of the
 * checks as in Grbl. */
#include "machine/command.h"

#include "machine/actions.h"
#include "machine/answer.h"
#include "machine/auto_report.h"
#include "machine/compute.h"
#include "machine/driver_list.h"
#include "machine/jog.h"
#include "machine/list.h"
#include "machine/notice.h"
#include "machine/outputs.h"
#include "machine/parts.h"
#include "machine/report.h"
#include "machine/state.h"
#include "machine/stored.h"
#include "machine/stored_write.h"
#include "machine/task.h"
#include "machine/tool_change.h"

#include "gcode/number.h"

#include <string.h>

/* ---- questions ---- */

static enum status help(struct machine *machine, const char *rest) {
    (void)rest;
    text_string(&machine->out,
                "[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H $RST=$ ~ ! ? ctrl-x]\r\n");
    return STATUS_OK;
}

static enum status show_settings(struct machine *machine, const char *rest) {
    (void)rest;
    list_settings(machine);
    stored_report(machine);
    return STATUS_OK;
}

static enum status show_modes(struct machine *machine, const char *rest) {
    (void)rest;
    list_modes(machine);
    return STATUS_OK;
}

static enum status show_offsets(struct machine *machine, const char *rest) {
    (void)rest;
    list_offsets(machine);
    return STATUS_OK;
}

static enum status show_startup(struct machine *machine, const char *rest) {
    (void)rest;
    list_startup(machine);
    return STATUS_OK;
}

static enum status show_build(struct machine *machine, const char *rest) {
    (void)rest;
    list_build(machine);
    notice_report(machine);
    return STATUS_OK;
}

static enum status show_spindles(struct machine *machine, const char *rest) {
    (void)rest;
    list_spindles(machine);
    return STATUS_OK;
}

/* cppcheck-suppress constParameterCallback ; the type of commands is fixed */
static enum status show_drivers(struct machine *machine, const char *rest) {
    (void)rest;
    driver_list(machine);
    return STATUS_OK;
}

static enum status show_codes(struct machine *machine, const char *rest) {
    (void)rest;
    list_build(machine);
    list_codes(machine);
    notice_report(machine);
    return STATUS_OK;
}

/* ---- locks ---- */

static enum status unlock(struct machine *machine, const char *rest) {
    (void)rest;
    return refusal_status(action_unlock(machine));
}

static enum status check(struct machine *machine, const char *rest) {
    (void)rest;
    if (machine->life.state == MACHINE_CHECK) {
        /* As in Grbl, check mode ends with a reset: what the checked program has set is gone with it. */
        report_message(machine, "Disabled");
        state_ask_reset(&machine->life, true);
        return STATUS_OK;
    }
    const enum refusal refusal = action_may(machine, ACTION_CHECK, ACTOR_TEXT);
    if (refusal != REFUSAL_NONE)
        return refusal_status(refusal);
    state_go(machine, EVENT_CHECK);
    report_message(machine, "Enabled");
    return STATUS_OK;
}

/* Answered before its message, as in Grbl. */
static enum status sleep(struct machine *machine, const char *rest) {
    (void)rest;
    answer_line(machine, STATUS_OK);
    state_go(machine, EVENT_SLEEP);
    outputs_off(machine);
    report_message(machine, "Sleeping");
    return STATUS_OK;
}

/* ---- what is stored ---- */

static enum status acknowledge(struct machine *machine, const char *rest) {
    (void)rest;
    if (stored_is_damaged(machine))
        stored_acknowledge(machine);
    return STATUS_OK;
}

/* $RST=$, # or *. The defaults are in force immediately; a reset follows when they are stored. */
static enum status restore(struct machine *machine, const char *what) {
    const unsigned settings = STORED_BIT(STORED_SETTINGS);
    const unsigned offsets = STORED_ALL_OFFSETS | STORED_BIT(STORED_TOOLS) | STORED_ALL_NOTES;
    const unsigned lines = STORED_BIT(STORED_STARTUP) | STORED_BIT(STORED_INFO);
    unsigned keys = 0;
    if (strcmp(what, "*") == 0)
        keys = settings | offsets | lines;
    else if (strcmp(what, "$") == 0)
        keys = settings;
    else if (strcmp(what, "#") == 0)
        keys = offsets;
    if (keys == 0)
        return STATUS_UNKNOWN_COMMAND;
    if ((keys & settings) != 0)
        trust_lose(&machine->trust, machine->trust.axes); /* steps of another size */
    stored_defaults(machine, keys);
    return STATUS_OK;
}

static enum status store_info(struct machine *machine, const char *text) {
    if (strlen(text) >= GRBL_LINE_SIZE)
        return STATUS_STORED_LINE_TOO_LONG;
    memcpy(machine->lines.info, text, strlen(text) + 1);
    (void)stored_save(machine, STORED_BIT(STORED_INFO));
    return STATUS_OK;
}

/* $0=1.5x and so on: number, =, value. @return the number, or -1 and *status */
static int32_t left_side(const char **text, enum status *status) {
    double number;
    const char *end = number_read(*text, &number);
    *status = end == NULL ? STATUS_BAD_NUMBER : STATUS_UNKNOWN_COMMAND;
    if (end == NULL || *end != '=')
        return -1;
    *text = end + 1;
    /* What cannot be a setting's number is INT32_MAX, not an error yet: Grbl reports a value that is no
     * number first. 65535 is SETTINGS_BEGIN. */
    return number >= 0.0 && number <= 65534.0 && number == (double)(uint16_t)number ? (int32_t)number
                                                                                    : INT32_MAX;
}

static enum status set(struct machine *machine, const char *text) {
    enum status status;
    double value;
    const int32_t number = left_side(&text, &status);
    if (number < 0)
        return status;
    const char *end = number_read(text, &value);
    if (end == NULL)
        return STATUS_BAD_NUMBER;
    if (*end != '\0' || number == INT32_MAX)
        return STATUS_UNKNOWN_COMMAND;
    status = action_set(machine, ACTOR_TEXT, (uint16_t)number, value);
    if (status != STATUS_OK)
        return status;
    report_changed_offset(machine); /* $10 and $13 change how it reads */
    (void)stored_save(machine, STORED_BIT(STORED_SETTINGS));
    return STATUS_OK;
}

static bool frees_estop(const struct machine *machine, const char *text) {
    enum status status;
    return action_frees_estop(machine, left_side(&text, &status));
}

/* The line is executed first, and stored if that went well (answer_line()). */
static enum status startup_line(struct machine *machine, const char *text) {
    enum status status;
    const int32_t index = left_side(&text, &status);
    if (index < 0)
        return status;
    if (index >= STARTUP_LINE_COUNT)
        return STATUS_UNKNOWN_COMMAND;
    if (strlen(text) >= GRBL_LINE_SIZE)
        return STATUS_STORED_LINE_TOO_LONG;
    status = gcode_line(&machine->interp.gcode, text, &machine->task.command);
    if (status != STATUS_OK)
        status = compute_line(machine, text, status);
    if (status == STATUS_OK)
        status = lines_begin_gcode(machine);
    if (status == STATUS_OK)
        lines_store_as(&machine->lines, (unsigned)index);
    return status;
}

/* ---- motion ---- */

static enum status home(struct machine *machine, const char *letters) {
    unsigned axes = 0;
    for (; *letters != '\0'; letters++) {
        const char *letter = strchr(AXIS_LETTERS, *letters);
        if (letter == NULL)
            return STATUS_UNKNOWN_COMMAND;
        axes |= 1u << (letter - AXIS_LETTERS);
    }
    return refusal_status(action_home(machine, ACTOR_TEXT, (axis_mask_t)axes));
}

static enum status jog(struct machine *machine, const char *text) {
    return text[0] == '=' ? jog_begin(machine, text + 1) : STATUS_UNKNOWN_COMMAND;
}

static enum status probe_tool(struct machine *machine, const char *rest) {
    (void)rest;
    return tool_change_probe(machine);
}

static enum status forget_reference(struct machine *machine, const char *rest) {
    (void)rest;
    tool_change_new_reference(&machine->tool_change);
    return STATUS_OK;
}

/* For lines that begin like a command and are none: the table still gives them the state check of their
 * neighbours, so that the error is Grbl's. */
static enum status unknown(struct machine *machine, const char *rest) {
    (void)machine;
    (void)rest;
    return STATUS_UNKNOWN_COMMAND;
}

/* ---- the table ---- */

struct command {
    const char *text;
    bool more; /* of the line follows */
    enum action needs;
    enum status (*run)(struct machine *machine, const char *rest);
};

/* The first row that fits is taken. */
static const struct command commands[] = {
    {"", false, ACTION_ASK, help},
    {"$", false, ACTION_LIST_SETTINGS, show_settings},
    {"G", false, ACTION_ASK, show_modes},
    {"C", false, ACTION_MODE, check},
    {"X", false, ACTION_MODE, unlock},
    {"#", false, ACTION_LIST_STORED, show_offsets},
    {"I", false, ACTION_LIST_STORED, show_build},
    {"I+", false, ACTION_LIST_STORED, show_codes},
    {"N", false, ACTION_LIST_STORED, show_startup},
    {"ACK", false, ACTION_COMMAND, acknowledge},
    {"TPW", false, ACTION_TOOL_PROBE, probe_tool},
    {"TLR", false, ACTION_TOOL_REFERENCE, forget_reference},
    {"RI=", true, ACTION_ASK, auto_report_set},
    {"SLP", false, ACTION_COMMAND, sleep},
    {"SPINDLES", false, ACTION_LIST_STORED, show_spindles},
    {"DRIVERS", false, ACTION_ASK, show_drivers},
    {"RST=", true, ACTION_COMMAND, restore},
    {"I=", true, ACTION_STORE, store_info},
    {"N", true, ACTION_STARTUP_LINE, startup_line},
    {"H", true, ACTION_HOME, home},
    {"J", true, ACTION_JOG, jog},
    {"$", true, ACTION_MODE, unknown},
    {"G", true, ACTION_MODE, unknown},
    {"C", true, ACTION_MODE, unknown},
    {"X", true, ACTION_MODE, unknown},
    {"#", true, ACTION_COMMAND, unknown},
    {"I", true, ACTION_COMMAND, unknown},
    {"R", true, ACTION_COMMAND, unknown},
    {"S", true, ACTION_COMMAND, unknown},
    {"T", true, ACTION_COMMAND, unknown},
    {"", true, ACTION_COMMAND, set},
};

/* @return what follows the command's own characters; NULL: this line is another command */
static const char *rest_of(const struct command *command, const char *text) {
    const size_t length = strlen(command->text);
    if (strncmp(text, command->text, length) != 0 || (!command->more && text[length] != '\0'))
        return NULL;
    return text + length;
}

static enum status run(struct machine *machine, const char *text) {
    const struct command *command = commands;
    while (rest_of(command, text) == NULL)
        command++;
    const char *rest = rest_of(command, text);
    const enum refusal refusal = action_may(machine, command->needs, ACTOR_TEXT);
    if (refusal != REFUSAL_NONE && !(command->run == set && frees_estop(machine, rest)))
        return refusal_status(refusal);
    return command->run(machine, rest);
}

void command_line(struct machine *machine, const char *line) {
    const enum status status = run(machine, line + 1);
    /* A line that became a task ($H, $J=, $Nx=) is answered when that ends; $SLP has answered by itself. */
    const bool later = machine->task.stage != TASK_NONE || !machine->lines.open;
    if (status == STATUS_STORE_DAMAGED)
        stored_report(machine);
    if (status != STATUS_OK || !later)
        answer_line(machine, status);
}
