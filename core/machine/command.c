/* SPDX-License-Identifier: MIT
 * $ lines: what each needs, and in which states it is possible. Order of the checks as in Grbl. */
#include "machine/command.h"

#include "machine/answer.h"
#include "machine/compute.h"
#include "machine/configure.h"
#include "machine/homing.h"
#include "machine/inputs.h"
#include "machine/jog.h"
#include "machine/keep.h"
#include "machine/keep_write.h"
#include "machine/list.h"
#include "machine/notice.h"
#include "machine/outputs.h"
#include "machine/parts.h"
#include "machine/report.h"
#include "machine/state.h"
#include "machine/task.h"
#include "machine/wiring.h"

#include "gcode/number.h"

#include <string.h>

static enum status help(struct machine *machine) {
    text_string(&machine->out,
                "[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H $RST=$ ~ ! ? ctrl-x]\r\n");
    return STATUS_OK;
}

static enum status show_settings(struct machine *machine) {
    if (machine->life.state == MACHINE_RUN || machine->life.state == MACHINE_HOLD)
        return STATUS_NOT_IDLE;
    list_settings(machine);
    keep_report(machine);
    return STATUS_OK;
}

/* With settings that are not the machine's it would move wrongly, and what is stored would be overwritten. */
static enum status refuse_damaged(struct machine *machine) {
    keep_report(machine);
    return STATUS_STORE_DAMAGED;
}

static enum status unlock(struct machine *machine) {
    if (machine->life.state != MACHINE_ALARM)
        return STATUS_OK;
    if (keep_is_damaged(machine))
        return refuse_damaged(machine);
    if (inputs_door_is_open(machine))
        return STATUS_DOOR_OPEN;
    report_message(machine, "Caution: Unlocked");
    report_not_homed(machine);
    state_go(machine, MACHINE_UNLOCKS);
    return STATUS_OK;
}

static enum status check(struct machine *machine) {
    if (machine->life.state == MACHINE_CHECK) {
        report_message(machine, "Disabled");
        state_ask_reset(&machine->life, true);
        return STATUS_OK;
    }
    if (!machine_is_at_rest(machine) || !state_go(machine, MACHINE_CHECKS))
        return STATUS_NOT_IDLE;
    report_message(machine, "Enabled");
    return STATUS_OK;
}

/* Single letters, alone on their line. */
static enum status single(struct machine *machine, char letter) {
    switch (letter) {
    case '$':
        return show_settings(machine);
    case 'G':
        list_modes(machine);
        return STATUS_OK;
    case 'C':
        return check(machine);
    default:
        return unlock(machine);
    }
}

static enum status acknowledge(struct machine *machine) {
    if (!keep_is_damaged(machine))
        return STATUS_OK;
    keep_acknowledge(machine);
    return STATUS_OK;
}

static enum status restore(struct machine *machine, const char *what) {
    const unsigned settings = KEEP_BIT(KEEP_SETTINGS);
    const unsigned offsets = KEEP_ALL_OFFSETS | KEEP_BIT(KEEP_TOOLS);
    const unsigned lines = KEEP_BIT(KEEP_STARTUP) | KEEP_BIT(KEEP_INFO);
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
    keep_defaults(machine, keys);
    return STATUS_OK;
}

static enum status build_info(struct machine *machine, const char *text) {
    if (text[0] == '\0' || strcmp(text, "+") == 0) {
        list_build(machine);
        if (text[0] == '+')
            list_codes(machine);
        notice_report(machine);
        return STATUS_OK;
    }
    if (text[0] != '=')
        return STATUS_UNKNOWN_COMMAND;
    if (keep_is_damaged(machine))
        return refuse_damaged(machine);
    memcpy(machine->lines.info, text + 1,
           strlen(text)); /* with its NUL; shorter than LINE_SIZE as the line was */
    (void)keep_save(machine, KEEP_BIT(KEEP_INFO));
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
    return number >= 0.0 && number <= 65534.0 && number == (double)(uint16_t)number ? (int32_t)number
                                                                                    : INT32_MAX;
}

static enum status set(struct machine *machine, const char *text) {
    enum status status;
    double value;
    int32_t number = left_side(&text, &status);
    if (number < 0)
        return status;
    const char *end = number_read(text, &value);
    if (end == NULL)
        return STATUS_BAD_NUMBER;
    if (*end != '\0' || number == INT32_MAX)
        return STATUS_UNKNOWN_COMMAND;
    status =
        keep_is_damaged(machine) ? refuse_damaged(machine) : configure_set(machine, (uint16_t)number, value);
    if (status != STATUS_OK)
        return status;
    report_changed_offset(machine); /* $10 and $13 change how it reads */
    (void)keep_save(machine, KEEP_BIT(KEEP_SETTINGS));
    return STATUS_OK;
}

/* $N and $Nx=line: the line is executed first, and stored if that went well (answer_line()).
 * @return false: it became a task */
static bool startup_line(struct machine *machine, const char *text, enum status *status) {
    *status = STATUS_OK;
    if (text[0] == '\0') {
        list_startup(machine);
        return true;
    }
    *status = STATUS_NOT_IDLE;
    if (machine->life.state != MACHINE_IDLE)
        return true;
    int32_t index = left_side(&text, status);
    if (index >= STARTUP_LINE_COUNT)
        *status = STATUS_UNKNOWN_COMMAND;
    if (index < 0 || index >= STARTUP_LINE_COUNT)
        return true;
    *status = gcode_line(&machine->interp.gcode, text, &machine->task.command);
    if (*status != STATUS_OK)
        *status = compute_line(machine, text, *status);
    if (*status != STATUS_OK)
        return true;
    lines_store_as(&machine->lines, (unsigned)index);
    task_begin(machine);
    return false;
}

static enum status home(struct machine *machine, const char *axes) {
    if (keep_is_damaged(machine))
        return refuse_damaged(machine);
    if (!machine->settings.homing)
        return STATUS_HOMING_DISABLED;
    if (inputs_door_is_open(machine))
        return STATUS_DOOR_OPEN;
    return homing_begin(machine, axes);
}

static void sleep(struct machine *machine) {
    answer_line(machine, STATUS_OK);
    state_go(machine, MACHINE_SLEEPS);
    outputs_off(machine);
    report_message(machine, "Sleeping");
}

/* Commands that need Idle or Alarm. @return false: answered already, or a task */
static bool at_rest(struct machine *machine, const char *text, enum status *status) {
    *status = STATUS_NOT_IDLE;
    if (!state_is_idle_or_alarm(machine) || !machine_is_at_rest(machine))
        return true;
    *status = STATUS_UNKNOWN_COMMAND;
    if (strcmp(text, "#") == 0) {
        list_offsets(machine);
        *status = STATUS_OK;
    } else if (text[0] == 'H') {
        *status = home(machine, text + 1);
        return *status != STATUS_OK;
    } else if (strcmp(text, "ACK") == 0) {
        *status = acknowledge(machine);
    } else if (strcmp(text, "SLP") == 0) {
        sleep(machine);
        return false;
    } else if (text[0] == 'I') {
        *status = build_info(machine, text + 1);
    } else if (strncmp(text, "RST=", 4) == 0) {
        *status = restore(machine, text + 4);
    } else if (text[0] == 'N') {
        return startup_line(machine, text + 1, status);
    } else if (strchr("#SR", text[0]) == NULL) {
        *status = set(machine, text);
    }
    return true;
}

static enum status jog(struct machine *machine, const char *text) {
    bool may_begin = machine->life.state == MACHINE_IDLE && machine_is_at_rest(machine);
    if (!may_begin && machine->life.state != MACHINE_JOG) /* in Jog all that is queued are jogs */
        return STATUS_NOT_IDLE;
    if (text[0] != '=')
        return STATUS_UNKNOWN_COMMAND;
    return jog_begin(machine, text + 1);
}

/* What a critical alarm leaves: only questions. */
static bool is_question(const char *text) {
    static const char *const questions[] = {"", "$", "#", "G", "I", "I+", "N"};
    for (unsigned i = 0; i < sizeof questions / sizeof questions[0]; i++)
        if (strcmp(text, questions[i]) == 0)
            return true;
    return false;
}

void command_line(struct machine *machine, const char *line) {
    const char *text = line + 1;
    enum status status;
    if (machine->life.critical && !is_question(text)) {
        status = STATUS_LOCKED;
    } else if (text[0] == '\0') {
        status = help(machine);
    } else if (text[0] == 'J') {
        status = jog(machine, text + 1);
        if (status == STATUS_OK)
            return; /* answered when there is room for it */
    } else if (strchr("$GCX", text[0]) != NULL) {
        status = text[1] != '\0' ? STATUS_UNKNOWN_COMMAND : single(machine, text[0]);
    } else if (!at_rest(machine, text, &status)) {
        return;
    }
    answer_line(machine, status);
}
