/* SPDX-License-Identifier: MIT
 * What the G-code interpreter knows: modes, offsets, parameters, and where the program is. [task] */
#ifndef WIFICNC_MACHINE_INTERP_H
#define WIFICNC_MACHINE_INTERP_H

#include "gcode/gcode.h"
#include "gcode/params.h"
#include "machine/machine.h"

struct outputs_wish;

/** As far as lines were taken. */
struct machine_interp {
    struct gcode_state gcode;
    struct params params;
    struct param_numbered numbered[PARAMS_NUMBERED];
    struct param_named named[PARAMS_NAMED];
};

/** Power-on: what this board allows, and no parameters. */
void interp_begin(struct machine_interp *interp, const struct machine_board *board);

/** So many axes from X on have words; the others are refused. */
void interp_take_axes(struct machine_interp *interp, uint8_t axis_count);

/** What the operator has switched counts as if the program had: in force, and in the line under way. */
void interp_know_spindle(struct machine *machine, enum gcode_spindle spindle);
void interp_know_coolant(struct machine *machine, uint8_t coolant);

/** What a host has switched; also in the line under way, unless that is of a job that waits for the host. */
void interp_know_wish(struct machine *machine, const struct outputs_wish *to, uint8_t coolant);

/** Reset: what does not outlive one. */
void interp_forget(struct machine_interp *interp);

/** Check mode begins, or ends: offsets are then as they were before it, in `unchecked`. */
void interp_check(struct machine_interp *interp, struct gcode_offsets *unchecked, bool begins);

/** Where the job is and its modes, while lines of the operator come. */
struct interp_aside {
    struct gcode_modal modal;
    double position_mm[AXIS_COUNT];
    double offset_mm[AXIS_COUNT]; /* of its work coordinates */
};

/** The job's modes wait in `aside`; the operator's lines begin with G0 G90 G94. */
void interp_put_aside(struct machine_interp *interp, struct interp_aside *aside);

/** By how much the job's work coordinates have moved since, mm. */
void interp_shift_mm(const struct machine_interp *interp, const struct interp_aside *aside,
                     double shift_mm[AXIS_COUNT]);

/** The job's modes are in force again, and it is at the same place of its shifted work coordinates. */
void interp_take_back(struct machine_interp *interp, const struct interp_aside *aside,
                      const double shift_mm[AXIS_COUNT]);

/** #5061 .., #5070: in the work coordinates of this line. @param probe_mm  machine position */
void interp_take_probe(struct machine_interp *interp, const struct gcode_command *line,
                       const double probe_mm[AXIS_COUNT], bool ok);

/** Spindle and coolant as lines to come find them. */
static inline void interp_set_tools(struct machine_interp *interp, enum gcode_spindle spindle, float rpm,
                                    uint8_t coolant) {
    struct gcode_modal *modal = &interp->gcode.modal;
    modal->spindle = spindle;
    modal->spindle_rpm = rpm;
    modal->coolant = coolant;
}

/** A measured tool length. */
static inline void interp_set_tool_length(struct machine_interp *interp, double mm) {
    interp->gcode.offsets.tool_length_mm = mm;
}

/** M48 .. M53: OVERRIDE_ bits. */
static inline void interp_enable_overrides(struct machine_interp *interp, uint8_t overrides) {
    interp->gcode.modal.overrides = overrides;
}

/** The program is here, mm. */
static inline void interp_stand_at(struct machine_interp *interp, const double target_mm[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        interp->gcode.position_mm[ax] = target_mm[ax];
}

#endif
