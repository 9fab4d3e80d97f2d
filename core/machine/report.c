/* SPDX-License-Identifier: MIT */
#include "machine/machine.h"

void report_message(struct machine *machine, const char *text) {
    text_string(&machine->out, "[MSG:");
    text_string(&machine->out, text);
    text_string(&machine->out, "]\r\n");
}

void report_banner(struct machine *machine) {
    text_string(&machine->out, "\r\nGrbl 1.1h ['$' for help]\r\n");
    if (machine->state == MACHINE_ALARM)
        report_message(machine, "'$H'|'$X' to unlock");
}

void report_status(struct machine *machine) {
    static const char *const names[] = {
        [MACHINE_IDLE] = "Idle", [MACHINE_RUN] = "Run", [MACHINE_HOLD] = "Hold:0", [MACHINE_ALARM] = "Alarm"};
    const struct text_out *out = &machine->out;
    int32_t steps[AXIS_COUNT];
    machine_position(machine, steps);
    text_string(out, "<");
    text_string(out, names[machine->state]);
    for (unsigned ax = 0; ax < machine->board.axis_count; ax++) {
        text_string(out, ax == 0 ? "|MPos:" : ",");
        text_fixed(out, (double)steps[ax] / (double)machine->settings.steps_per_mm[ax], 3);
    }
    text_string(out, "|FS:");
    text_fixed(out, 60.0 * (double)emit_speed_mm_s(&machine->motion.emit), 0);
    text_string(out, ",");
    text_fixed(out, (double)machine->gcode.modal.spindle_rpm, 0);
    text_string(out, ">\r\n");
}
