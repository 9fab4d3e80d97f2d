/* SPDX-License-Identifier: MIT
 * A restart that was not requested: its alarm, and its cause in words. */
#include "machine/restart.h"

#include "machine/parts.h"
#include "machine/report.h"

static const char *const causes[] = {
    [HAL_RESTART_NONE] = "",
#define RESTART(name, text) [HAL_RESTART_##name] = text,
#include "hal/restarts.def"
#undef RESTART
};

void restart_describe(const struct machine *machine, const struct text_out *out) {
    const struct hal_restart *restart = machine->board.restart;
    if (restart == NULL)
        return;
    text_string(out, causes[restart->cause]);
    for (unsigned n = 0; n < restart->address_count; n++) {
        text_string(out, n == 0 ? " at 0x" : " 0x");
        text_hex(out, restart->address[n]);
    }
    if (restart->detail == NULL)
        return;
    text_string(out, " (");
    text_string(out, restart->detail);
    text_string(out, ")");
}

void restart_report(struct machine *machine) {
    if (!machine->life.restarted)
        return;
    state_show_alarm(&machine->life, ALARM_RESTARTED);
    report_alarm(machine, ALARM_RESTARTED);
    text_string(&machine->out, "[MSG:Restarted by ");
    restart_describe(machine, &machine->out);
    text_string(&machine->out, "]\r\n");
}
