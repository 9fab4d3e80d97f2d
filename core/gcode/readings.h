/* SPDX-License-Identifier: MIT
 * Parameters that are only read: what the interpreter and the machine know, under LinuxCNC's numbers (#5061..
 * #5428) and names (#<_x>, readings.def). [task] Pure. */
#ifndef WIFICNC_GCODE_READINGS_H
#define WIFICNC_GCODE_READINGS_H

#include "gcode/gcode.h"
#include "gcode/params.h"

/** What may be unknown while a program runs without its machine (targets/sim/knowledge.h); bits. */
#define NEEDS_NOTHING         0u
#define NEEDS_UNITS           (1u << 0)
#define NEEDS_DISTANCE        (1u << 1)
#define NEEDS_PLANE           (1u << 2)
#define NEEDS_ARC_DISTANCE    (1u << 3)
#define NEEDS_FEED_MODE       (1u << 4)
#define NEEDS_WCS             (1u << 5)
#define NEEDS_MOTION          (1u << 6)
#define NEEDS_SPINDLE         (1u << 7)
#define NEEDS_COOLANT         (1u << 8)
#define NEEDS_RETRACT         (1u << 9)
#define NEEDS_OVERRIDES       (1u << 10)
#define NEEDS_TOOL            (1u << 11)
#define NEEDS_TOOL_IN_SPINDLE (1u << 12)
#define NEEDS_FEED            (1u << 13)
#define NEEDS_RPM             (1u << 14)
#define NEEDS_OFFSETS         (1u << 15)            /* any of them; absolute positions need them too */
#define NEEDS_PROBE           (1u << 16)            /* what only probing and M66 tell */
#define NEEDS_WORK(axis)      (1u << (17 + (axis))) /* position in work coordinates */
#define NEEDS_WORK_ALL        (63u << 17)
#define NEEDS_ALL             ((1u << 23) - 1)

/** Where values come from. */
struct param_context {
    const struct gcode_state *gcode;
    const struct params *params;
    uint32_t line;    /* #<_line> */
    uint32_t unknown; /* NEEDS_ bits: what is not known; reading it is STATUS_MACHINE_ONLY */
};

/** Value of any parameter.
 *  @return STATUS_PARAMETER_NUMBER, STATUS_PARAMETER_UNSET, STATUS_MACHINE_ONLY */
enum status readings_get(const struct param_context *context, const struct param_ref *ref, double *value);

/** May a program set it? @return STATUS_PARAMETER_NUMBER, STATUS_PARAMETER_READ_ONLY */
enum status readings_check_set(const struct param_ref *ref);

#endif
