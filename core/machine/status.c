/* SPDX-License-Identifier: MIT
 * The status report. */
#include "machine/status.h"

#include "machine/axes.h"
#include "machine/faults.h"
#include "machine/inputs.h"
#include "machine/notes.h"
#include "machine/outputs.h"
#include "machine/parts.h"
#include "machine/place.h"
#include "machine/report.h"
#include "machine/run_up.h"
#include "machine/state.h"
#include "machine/vfd_spindle.h"

#include <math.h>

/* Reports from one field to the next, Grbl's. */
enum { WCO_IDLE = 10, WCO_BUSY = 30, OV_IDLE = 10, OV_BUSY = 20 };

static void report_position(const struct machine *machine, const double offset_mm[AXIS_COUNT]) {
    int32_t steps[AXIS_COUNT];
    double mm[AXIS_COUNT];
    bool work = (machine->settings.report_mask & REPORT_MACHINE_POSITION) == 0;
    machine_position(machine, steps);
    place_tool_mm(machine, steps, mm);
    for (unsigned ax = 0; work && ax < AXIS_COUNT; ax++)
        mm[ax] -= offset_mm[ax];
    text_string(&machine->out, work ? "|WPos:" : "|MPos:");
    report_axes(machine, mm);
}

static void report_buffers(const struct machine *machine) {
    if ((machine->settings.report_mask & REPORT_BUFFERS) == 0)
        return;
    text_string(&machine->out, "|Bf:");
    text_int(&machine->out, (int32_t)plan_free(&machine->drive.motion.plan));
    text_string(&machine->out, ",");
    text_int(&machine->out, (int32_t)rx_free(&machine->lines.rx));
}

/* N word of the line on the pins, or by $10 its place in the program. */
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
    char pins[AXIS_COUNT + 8], *at = pins;
    if (inputs_probe(machine, &inputs, HAL_PROBE) ||
        (machine->board.toolsetter && inputs_probe(machine, &inputs, HAL_TOOLSETTER)))
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
    if (faults_any(machine))
        *at++ = 'M';
    if (inputs.start)
        *at++ = 'S';
    if (overrides_pause(&machine->overrides))
        *at++ = 'T';
    *at = '\0';
    if (at == pins)
        return;
    text_string(&machine->out, "|Pn:");
    text_string(&machine->out, pins);
}

/* @param all  also that nothing is on */
static void report_overrides(const struct machine *machine, bool all) {
    const struct text_out *out = &machine->out;
    const struct machine_outputs *outputs = &machine->outputs;
    bool spindle = outputs->spindle != SPINDLE_OFF && !outputs->spindle_stopped && !outputs->suspended;
    uint8_t coolant = outputs_coolant_bits(machine);
    text_string(out, "|Ov:");
    text_int(out, machine->overrides.feed_pct);
    text_string(out, ",");
    text_int(out, machine->overrides.rapid_pct);
    text_string(out, ",");
    text_int(out, machine->overrides.spindle_pct);
    if (!all && !spindle && coolant == 0)
        return;
    text_string(out, "|A:");
    if (spindle)
        text_string(out, outputs->spindle == SPINDLE_CW ? "S" : "C");
    if ((coolant & COOLANT_FLOOD) != 0)
        text_string(out, "F");
    if ((coolant & COOLANT_MIST) != 0)
        text_string(out, "M");
}

/* As grblHAL: the measured speed is the third number. */
static void report_speeds(const struct machine *machine) {
    float rpm;
    text_string(&machine->out, "|FS:");
    report_rate(machine, machine->drive.step.active ? (double)machine_speed_mm_s(machine) : 0.0);
    text_string(&machine->out, ",");
    text_fixed(&machine->out, (double)outputs_rpm(machine), 0);
    if (!run_up_measured_rpm(machine, &rpm))
        return;
    text_string(&machine->out, ",");
    text_fixed(&machine->out, (double)fabsf(rpm), 0);
}

/* Current of a drive's motor. */
static void report_load(const struct machine *machine) {
    float ampere;
    if (!vfd_spindle_ampere(machine, &ampere))
        return;
    text_string(&machine->out, "|Amp:");
    text_fixed(&machine->out, (double)ampere, 1);
}

/* As grblHAL: 1, or 0 and a mask of the axes that are. */
static void report_homed(struct machine *machine) {
    bool all = axes_not_homed(machine) == 0;
    if (!machine->settings.homing)
        return;
    text_string(&machine->out, all ? "|H:1" : "|H:0,");
    if (!all)
        text_int(&machine->out, machine->trust.axes);
}

/* As grblHAL: after a change, and where all is asked for. */
static void report_mpg(struct machine *machine, bool all) {
    struct machine_reports *reports = &machine->reports;
    if (reports->mpg == MPG_NONE || !(reports->mpg_due || all))
        return;
    reports->mpg_due = false;
    text_string(&machine->out, reports->mpg == MPG_IN_CONTROL ? "|MPG:1" : "|MPG:0");
}

/* Work offset and overrides come now and then, and soon after a change; both in one report only when all is
 * asked for. */
static void report_now_and_then(struct machine *machine, const double offset_mm[AXIS_COUNT], bool all) {
    bool busy = state_is_busy(machine);
    if (all || machine->reports.wco_wait == 0) {
        machine->reports.wco_wait = busy ? WCO_BUSY : WCO_IDLE;
        if (machine->reports.ov_wait == 0)
            /* Counted down below: the overrides come with the next report. */
            machine->reports.ov_wait = 1;
        text_string(&machine->out, "|WCO:");
        report_axes(machine, offset_mm);
        report_homed(machine);
        if (all)
            report_overrides(machine, true);
    } else if (machine->reports.ov_wait == 0) {
        machine->reports.ov_wait = busy ? OV_BUSY : OV_IDLE;
        report_overrides(machine, false);
    }
    machine->reports.wco_wait--;
    machine->reports.ov_wait = (uint8_t)(machine->reports.ov_wait > 0 ? machine->reports.ov_wait - 1 : 0);
}

void status_report(struct machine *machine, bool all) {
    const struct text_out *out = &machine->out;
    double offset_mm[AXIS_COUNT];
    gcode_work_offset_mm(&machine->interp.gcode, offset_mm);
    text_string(out, "<");
    text_string(out, machine_state_text(machine));
    report_position(machine, offset_mm);
    report_buffers(machine);
    report_line(machine);
    report_speeds(machine);
    report_load(machine);
    report_pins(machine);
    report_now_and_then(machine, offset_mm, all);
    report_mpg(machine, all);
    if (all || machine->reports.start_due)
        report_start(machine, "|Start:", "");
    machine->reports.start_due = false;
    text_string(out, ">\r\n");
}
