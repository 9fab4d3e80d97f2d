/* SPDX-License-Identifier: MIT
 * The one answer that each line gets. */
#include "machine/answer.h"

#include "machine/parts.h"
#include "machine/stored_write.h"

#include "base/debug.h"

static void print_answer(const struct machine *machine, enum status status) {
    if (status == STATUS_OK) {
        text_string(&machine->out, "ok\r\n");
        return;
    }
    text_string(&machine->out, "error:");
    text_int(&machine->out, (int32_t)status);
    text_string(&machine->out, "\r\n");
}

void answer_line(struct machine *machine, enum status status) {
    DEBUG(DEBUG_MACHINE, "answer: line, status", machine->lines.count, status);
    if (machine->lines.source == LINE_STARTUP) {
        text_string(&machine->out, ">");
        text_string(&machine->out, machine->lines.startup_text[machine->lines.startup - 1]);
        text_string(&machine->out, ":");
    } else if (machine->lines.source == LINE_STORED && status == STATUS_OK) {
        machine->lines.source = LINE_STREAM;
        stored_startup(machine);
    }
    if (stored_is_busy(machine)) { /* ok comes when it is stored */
        machine->stored.answers = true;
        return;
    }
    machine->lines.open = false;
    print_answer(machine, status);
}
