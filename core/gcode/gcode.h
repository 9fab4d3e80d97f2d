/* SPDX-License-Identifier: MIT
 * G-code: text line -> block (pure) -> command (pure) -> motion and I/O (done by the machine).
 *
 *   gcode_parse()    text -> words, modal groups         knows no state
 *   gcode_resolve()  block + modal state -> command      changes nothing: an erroneous line has no effect at all
 *   the machine      command -> moves, outputs, offsets  then takes command->next as its modal state
 *
 * Units: text is mm or inch per minute as programmed; from gcode_resolve() on everything is mm, degrees, seconds.
 * [task] everywhere; no function blocks, allocates or keeps a pointer to its arguments. */
#ifndef WIFICNC_GCODE_GCODE_H
#define WIFICNC_GCODE_GCODE_H

#include "base/axis.h"
#include "gcode/status.h"

#include <stdbool.h>
#include <stdint.h>

enum { WCS_COUNT = 6 }; /* G54..G59 */

enum gcode_motion {
    MOTION_RAPID,   /* G0 */
    MOTION_LINEAR,  /* G1 */
    MOTION_ARC_CW,  /* G2 */
    MOTION_ARC_CCW, /* G3 */
    MOTION_PROBE,   /* G38.2 .. G38.5, see gcode_modal.probe */
    MOTION_NONE,    /* G80 */
};
enum gcode_plane { PLANE_XY, PLANE_ZX, PLANE_YZ };                   /* G17 G18 G19 */
enum gcode_path { PATH_BLEND, PATH_EXACT, PATH_EXACT_STOP };         /* G64 G61 G61.1 */
enum gcode_feed_mode { FEED_PER_MIN, FEED_INVERSE_TIME };            /* G94 G93 */
enum gcode_spindle { SPINDLE_OFF, SPINDLE_CW, SPINDLE_CCW };         /* M5 M3 M4 */
enum gcode_flow { FLOW_RUN, FLOW_PAUSE, FLOW_OPTIONAL_PAUSE, FLOW_END }; /* -, M0, M1, M2 and M30 */
enum { COOLANT_MIST = 1, COOLANT_FLOOD = 2 };                        /* M7 M8; bits, M9 clears both */

/** Modal state: what stays from line to line. Volatile: back to gcode_modal_init() at reset. */
struct gcode_modal {
    enum gcode_motion motion;
    enum gcode_plane plane;
    enum gcode_path path;
    enum gcode_feed_mode feed_mode;
    enum gcode_spindle spindle;
    bool inches;          /* G20 */
    bool incremental;     /* G91 */
    bool arc_absolute;    /* G90.1 */
    uint8_t coolant;      /* COOLANT_ bits */
    uint8_t wcs;          /* 0 = G54 */
    uint8_t probe;        /* 2..5 for G38.2 .. G38.5 while motion is MOTION_PROBE */
    int32_t tool;         /* T */
    float feed_mm_s;      /* F in mm/s (G94); 0 = none yet. Inverse time is never modal. */
    float spindle_rpm;    /* S */
    float path_tolerance_mm; /* G64 P; 0 = $11 alone */
};

/** Offsets. Persistent: wcs_mm, g28_mm, g30_mm. Volatile: g92_mm, tool_length_mm. All in machine mm. */
struct gcode_offsets {
    double wcs_mm[WCS_COUNT][AXIS_COUNT];
    double g28_mm[AXIS_COUNT];
    double g30_mm[AXIS_COUNT];
    double g92_mm[AXIS_COUNT];
    double tool_length_mm; /* on Z */
};

/** Everything gcode_resolve() reads. position_mm is the programmed end of the last accepted move (machine coordinates). */
struct gcode_state {
    struct gcode_modal modal;
    struct gcode_offsets offsets;
    double position_mm[AXIS_COUNT];
    axis_mask_t axes; /* axes this machine has; a word of another axis is error:20 */
};

/** One parsed line: words and groups, no meaning yet. Fields are private to gcode/parse.c and gcode/resolve.c. */
struct gcode_block;

/** What one motion does. Targets are machine coordinates. */
struct gcode_move {
    enum gcode_motion motion;   /* MOTION_NONE: this line moves nothing */
    double target_mm[AXIS_COUNT];
    float feed_mm_s;            /* along the path; ignored for MOTION_RAPID */
    float inverse_time_s;       /* > 0: the move lasts this long (G93) and feed_mm_s is 0 */
    /* arcs: all three are ready for arc_begin() */
    enum gcode_plane plane;
    double center_mm[2];        /* centre in the plane, machine coordinates, first and second plane axis */
    int32_t turns;              /* full turns in addition to the part turn; 0 today (P word later) */
    bool via;                   /* G28, G30 with axis words: go through via_mm first, as a rapid */
    double via_mm[AXIS_COUNT];
    uint8_t probe;              /* 2..5 for G38.2 .. G38.5 */
};

/** Stored-data effect of a line. */
enum gcode_store { STORE_NOTHING, STORE_WCS, STORE_G28, STORE_G30, STORE_G92, STORE_TOOL_LENGTH };

/** A line ready to execute. The machine performs its parts in this order, each after the one before:
 *  spindle/coolant (synchronised with motion when sync is set), dwell, store, move, flow. */
struct gcode_command {
    struct gcode_modal next;        /* modal state after the line */
    bool sync;                      /* a spindle or coolant change: let motion finish first */
    float dwell_s;                  /* >= 0; < 0 means no dwell */
    enum gcode_store store;         /* which field of offsets changed */
    struct gcode_offsets offsets;   /* offsets after the line */
    struct gcode_move move;
    enum gcode_flow flow;
    uint32_t line_number;           /* N word, 0 = none */
    axis_mask_t store_wcs;          /* STORE_WCS: bit n = G54+n changed */
};

/** Default modal state: G0 G54 G17 G21 G90 G91.1 G94 G64 M5 M9, T0 F0 S0. */
void gcode_modal_init(struct gcode_modal *modal);

/** Work coordinate offset of the state: WCS + G92 + tool length, per axis, mm. */
void gcode_work_offset_mm(const struct gcode_state *state, double out_mm[AXIS_COUNT]);

/** Parse and resolve one filtered line (no spaces, upper case, NUL-terminated; see link/line_reader.h).
 *  @return STATUS_OK and *command filled, or the error; state is never changed.
 *  The block is a local of this call: about 200 bytes of stack. */
enum status gcode_line(const struct gcode_state *state, const char *line, struct gcode_command *command);

#endif
