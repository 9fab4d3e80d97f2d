/* SPDX-License-Identifier: MIT
 * What the controller says of its own accord, and the status report. */
#include "machine/inner.h"

#define MM_PER_INCH 25.4

/* Reports from one field to the next, Grbl's. */
enum { WCO_IDLE = 10, WCO_BUSY = 30, OV_IDLE = 10, OV_BUSY = 20 };

void report_message(struct machine *machine, const char *text) {
    text_string(&machine->out, "[MSG:");
    text_string(&machine->out, text);
    text_string(&machine->out, "]\r\n");
}

void report_not_homed(struct machine *machine) {
    axis_mask_t axes = machine->settings.homing ? homing_unknown(machine) : 0;
    char letters[AXIS_COUNT + 1], *at = letters;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        if ((axes >> ax & 1) != 0)
            *at++ = AXIS_LETTERS[ax];
    *at = '\0';
    if (axes == 0)
        return;
    text_string(&machine->out, "[MSG:Not homed: ");
    text_string(&machine->out, letters);
    text_string(&machine->out, "]\r\n");
}

void report_underruns(struct machine *machine) {
    text_string(&machine->out, "[MSG:Motion slowed down because the controller was busy: ");
    text_int(&machine->out, (int32_t)machine->motion.ahead.late);
    text_string(&machine->out, machine->motion.ahead.late == 1 ? " time]\r\n" : " times]\r\n");
}

void report_gaps(struct machine *machine) {
    uint32_t gaps = rx_gaps(&machine->rx);
    text_string(&machine->out, "[MSG:The serial port lost bytes: ");
    text_int(&machine->out, (int32_t)gaps);
    text_string(&machine->out, gaps == 1 ? " time]\r\n" : " times]\r\n");
}

void report_tool_change(struct machine *machine) {
    text_string(&machine->out, "[MSG:Tool change: T");
    text_int(&machine->out, machine->command.next.tool);
    text_string(&machine->out, "]\r\n");
}

void report_alarm(struct machine *machine, enum alarm alarm) {
    text_string(&machine->out, "ALARM:");
    text_int(&machine->out, (int32_t)alarm);
    text_string(&machine->out, "\r\n");
}

void report_banner(struct machine *machine) {
    text_string(&machine->out, "\r\nGrbl 1.1h ['$' for help]\r\n");
}

void report_changed_offset(struct machine *machine) {
    machine->wco_wait = 0;
}

void report_changed_override(struct machine *machine) {
    machine->ov_wait = 0;
}

void report_length(const struct machine *machine, double mm) {
    bool inches = machine->settings.report_inches;
    text_fixed(&machine->out, inches ? mm / MM_PER_INCH : mm, inches ? 4 : 3);
}

void report_rate(const struct machine *machine, double mm_s) {
    bool inches = machine->settings.report_inches;
    text_fixed(&machine->out, 60.0 * mm_s / (inches ? MM_PER_INCH : 1.0), inches ? 1 : 0);
}

void report_axes(const struct machine *machine, const double mm[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < machine->board.axis_count; ax++) {
        text_string(&machine->out, ax == 0 ? "" : ",");
        if (ax < AXIS_A)
            report_length(machine, mm[ax]);
        else
            text_fixed(&machine->out, mm[ax], 3); /* degrees have no inches */
    }
}

void report_axes_steps(const struct machine *machine, const int32_t steps[AXIS_COUNT]) {
    double mm[AXIS_COUNT];
    machine_tool_mm(machine, steps, mm);
    report_axes(machine, mm);
}

static void report_position(const struct machine *machine, const double offset_mm[AXIS_COUNT]) {
    int32_t steps[AXIS_COUNT];
    double mm[AXIS_COUNT];
    bool work = (machine->settings.report_mask & 1) == 0;
    machine_position(machine, steps);
    machine_tool_mm(machine, steps, mm);
    for (unsigned ax = 0; work && ax < AXIS_COUNT; ax++)
        mm[ax] -= offset_mm[ax];
    text_string(&machine->out, work ? "|WPos:" : "|MPos:");
    report_axes(machine, mm);
}

static void report_buffers(const struct machine *machine) {
    if ((machine->settings.report_mask & 2) == 0)
        return;
    text_string(&machine->out, "|Bf:");
    text_int(&machine->out, (int32_t)plan_free(&machine->motion.plan));
    text_string(&machine->out, ",");
    text_int(&machine->out, (int32_t)rx_free(&machine->rx));
}

/* N word of the line on the pins. */
static void report_line(const struct machine *machine) {
    uint32_t number = notes_number(&machine->notes, notes_line_now(machine));
    if (number == 0)
        return;
    text_string(&machine->out, "|Ln:");
    text_int(&machine->out, (int32_t)number);
}

static void report_pins(const struct machine *machine) {
    struct hal_inputs inputs;
    hal_inputs_read(machine->hal, &inputs);
    axis_mask_t limits = inputs_limits(machine);
    char pins[AXIS_COUNT + 6], *at = pins;
    if (inputs_probe(machine, &inputs))
        *at++ = 'P';
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        if ((limits >> ax & 1) != 0)
            *at++ = AXIS_LETTERS[ax];
    if (inputs.door)
        *at++ = 'D';
    if (inputs.reset)
        *at++ = 'R';
    if (inputs.hold)
        *at++ = 'H';
    if (inputs.start)
        *at++ = 'S';
    *at = '\0';
    if (at == pins)
        return;
    text_string(&machine->out, "|Pn:");
    text_string(&machine->out, pins);
}

static void report_overrides(const struct machine *machine) {
    const struct text_out *out = &machine->out;
    const struct machine_outputs *outputs = &machine->outputs;
    bool spindle = outputs->spindle != SPINDLE_OFF && !outputs->spindle_stopped && !outputs->suspended;
    uint8_t coolant = outputs_coolant_bits(machine);
    text_string(out, "|Ov:");
    text_int(out, machine->feed_pct);
    text_string(out, ",");
    text_int(out, machine->rapid_pct);
    text_string(out, ",");
    text_int(out, machine->spindle_pct);
    if (!spindle && coolant == 0)
        return;
    text_string(out, "|A:");
    if (spindle)
        text_string(out, outputs->spindle == SPINDLE_CW ? "S" : "C");
    if ((coolant & COOLANT_FLOOD) != 0)
        text_string(out, "F");
    if ((coolant & COOLANT_MIST) != 0)
        text_string(out, "M");
}

/* As grblHAL: 1, or 0 and a mask of the axes that are. */
static void report_homed(struct machine *machine) {
    bool all = homing_unknown(machine) == 0;
    if (!machine->settings.homing)
        return;
    text_string(&machine->out, all ? "|H:1" : "|H:0,");
    if (!all)
        text_int(&machine->out, machine->trusted);
}

/* Work offset and overrides come now and then, and soon after a change; never both in one report. */
static void report_now_and_then(struct machine *machine, const double offset_mm[AXIS_COUNT]) {
    bool busy = machine_is_busy(machine);
    if (machine->wco_wait == 0) {
        machine->wco_wait = busy ? WCO_BUSY : WCO_IDLE;
        if (machine->ov_wait == 0)
            machine->ov_wait = 1;
        text_string(&machine->out, "|WCO:");
        report_axes(machine, offset_mm);
        report_homed(machine);
    } else if (machine->ov_wait == 0) {
        machine->ov_wait = busy ? OV_BUSY : OV_IDLE;
        report_overrides(machine);
    }
    machine->wco_wait--;
    machine->ov_wait = (uint8_t)(machine->ov_wait > 0 ? machine->ov_wait - 1 : 0);
}

void report_status(struct machine *machine) {
    const struct text_out *out = &machine->out;
    double offset_mm[AXIS_COUNT];
    gcode_work_offset_mm(&machine->gcode, offset_mm);
    text_string(out, "<");
    text_string(out, machine_state_text(machine));
    report_position(machine, offset_mm);
    report_buffers(machine);
    report_line(machine);
    text_string(out, "|FS:");
    report_rate(machine, machine->step.active ? (double)machine_speed_mm_s(machine) : 0.0);
    text_string(out, ",");
    text_fixed(out, (double)outputs_rpm(machine), 0);
    report_pins(machine);
    report_now_and_then(machine, offset_mm);
    text_string(out, ">\r\n");
}
