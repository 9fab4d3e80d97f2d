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
    struct gcode_offsets offsets_unchecked; /* in check mode: those that come back after it */
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

/** Check mode begins, or ends: offsets are then as they were before it. */
void interp_check(struct machine_interp *interp, bool begins);

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
