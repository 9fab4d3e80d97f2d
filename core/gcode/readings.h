/* SPDX-License-Identifier: MIT
 * Parameters that are only read: what the interpreter and the machine know, under LinuxCNC's numbers (#5061..
 * #5428) and names (#<_x>, readings.def). [task] Pure. */
#ifndef WIFICNC_GCODE_READINGS_H
#define WIFICNC_GCODE_READINGS_H

#include "gcode/gcode.h"
#include "gcode/params.h"

/** Where values come from. */
struct param_context {
    const struct gcode_state *gcode;
    const struct params *params;
    uint32_t line; /* #<_line> */
};

/** Value of any parameter.
 *  @return STATUS_PARAMETER_NUMBER, STATUS_PARAMETER_UNSET */
enum status readings_get(const struct param_context *context, const struct param_ref *ref, double *value);

/** May a program set it? @return STATUS_PARAMETER_NUMBER, STATUS_PARAMETER_READ_ONLY */
enum status readings_check_set(const struct param_ref *ref);

#endif
