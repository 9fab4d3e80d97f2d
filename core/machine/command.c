/* SPDX-License-Identifier: MIT
 * $ lines. */
#include "machine/machine.h"

#include "gcode/number.h"

static void print_settings(struct machine *machine) {
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

static enum status unlock(struct machine *machine) {
    if (machine->state == MACHINE_ALARM) {
        machine->state = MACHINE_IDLE;
        report_message(machine, "Caution: Unlocked");
    }
    return STATUS_OK;
}

/* $N=value; text stands behind the $. */
static enum status set(struct machine *machine, const char *text) {
    double number, value;
    text = number_read(text, &number);
    if (text == NULL || *text != '=')
        return STATUS_UNKNOWN_COMMAND;
    const char *end = number_read(text + 1, &value);
    if (end == NULL)
        return STATUS_BAD_NUMBER;
    if (*end != '\0' || !(number >= 0.0 && number <= 65534.0) || number != (double)(uint16_t)number)
        return STATUS_UNKNOWN_COMMAND;
    if (!machine_is_at_rest(machine))
        return STATUS_NOT_IDLE;
    enum status status = settings_set(&machine->settings, (uint16_t)number, value, machine->board.axis_count);
    if (status == STATUS_OK)
        machine_apply_settings(machine);
    return status;
}

static enum status dollar(struct machine *machine, const char *text) {
    if (text[0] == '\0') {
        text_string(&machine->out, "[HLP:$$ $x=val $X ~ ! ? ctrl-x]\r\n");
        return STATUS_OK;
    }
    if (text[1] == '\0' && text[0] == '$') {
        if (!machine_is_at_rest(machine))
            return STATUS_NOT_IDLE;
        print_settings(machine);
        return STATUS_OK;
    }
    if (text[1] == '\0' && text[0] == 'X')
        return unlock(machine);
    if (text[0] >= '0' && text[0] <= '9')
        return set(machine, text);
    return STATUS_UNKNOWN_COMMAND;
}

void machine_dollar(struct machine *machine, const char *line) {
    machine_answer(machine, dollar(machine, line + 1));
}
