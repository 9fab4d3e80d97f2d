/* SPDX-License-Identifier: MIT
 * What a program has set by the time it reaches some line, without moving anything: the core's own reader and
 * parser over the lines before it. A sender that resumes in the middle of a job needs it.
 *
 * What the controller alone knows (offsets, where the machine stood) is given beforehand. Called from one
 * thread; Python drives it through ctypes. */
#ifndef WIFICNC_SIM_REBUILD_H
#define WIFICNC_SIM_REBUILD_H

#include "base/axis.h"

#include <stddef.h>
#include <stdint.h>

struct rebuild;

/** Modal state in the numbers of G-code; mm, degrees and minutes. */
struct rebuild_state {
    double work_mm[AXIS_COUNT];    /* position in the work coordinates now in force */
    double machine_mm[AXIS_COUNT]; /* the same in machine coordinates */
    double g92_mm[AXIS_COUNT];     /* G92 offset */
    double top_z_mm;       /* highest Z that a move ended at, machine coordinates; NaN = none moved Z */
    double tool_length_mm; /* on Z */
    double feed_mm_min, spindle_rpm; /* F (in G95 mm a revolution), S; 0 = none yet */
    double path_tolerance_mm;        /* G64 P */
    int32_t tool;                    /* T */
    int16_t motion_g10, path_g10; /* ten times the G code: 0 10 20 30 50 51 382.. 730 .. 890; 610 611 640 */
    int16_t wcs_g10;              /* 540 .. 593 */
    uint8_t plane_g, units_g;     /* 17 18 19; 20 21 */
    uint8_t distance_g, feed_mode_g; /* 90 91; 93 94 95 */
    uint8_t spindle_m, coolant;      /* 3 4 5; bit 0 = M7, bit 1 = M8 */
    uint8_t arc_absolute;            /* 1 = G90.1 */
    axis_mask_t moved;               /* axes that some move took elsewhere */
    uint8_t stored; /* 1 = G10, G28.1, G30.1 or G92.2 stored something, or G43 read the tool table */
};

/** Power-on state at position 0, no offsets. @return NULL when memory is short or the axes are out of range
 */
struct rebuild *rebuild_create(uint8_t axis_count);
void rebuild_destroy(struct rebuild *rebuild);

/** Where the machine is, machine coordinates. */
void rebuild_set_position(struct rebuild *rebuild, const double machine_mm[AXIS_COUNT]);

/** A row of `$#`: 0.. = G54.., -28 = G28, -30 = G30, -92 = G92, -43 = tool length (Z only). @return 0, or -1:
 * there is no such row
 */
int rebuild_set_offset(struct rebuild *rebuild, int row, const double mm[AXIS_COUNT]);

/** Take one line, without its end. An erroneous line changes nothing.
 *  @return 0 or the number of the error */
int rebuild_line(struct rebuild *rebuild, const char *line, size_t size);

/** The state now. */
void rebuild_state(const struct rebuild *rebuild, struct rebuild_state *out);

#endif
