/* SPDX-License-Identifier: MIT
 * G-code: text line -> block (pure) -> command (pure) -> motion and I/O (done by the machine).
 *
 *   gcode_parse()    text -> words, modal groups         knows no state     block.h, parse.c, codes.def
 *   gcode_resolve()  block + modal state -> command      changes nothing    resolve.h, resolve*.c
 *   the machine      command -> moves, outputs, offsets  then takes command->next as its modal state
 *
 * An erroneous line has no effect at all, because nothing but the machine has effects.
 *
 * Units: text is mm or inch per minute as programmed; from gcode_resolve() on everything is mm, degrees,
 * seconds. [task] everywhere; no function blocks, allocates or keeps a pointer to its arguments. */
#ifndef WIFICNC_GCODE_GCODE_H
#define WIFICNC_GCODE_GCODE_H

#include "base/axis.h"
#include "gcode/status.h"

#include <stdbool.h>
#include <stdint.h>

enum { WCS_COUNT = 6 }; /* G54..G59 */

/** Every target and every stored offset lies within +-this, in mm or degrees; error:33 otherwise. Positions
 * in steps then fit int32_t up to 21 474 steps per unit. */
#define GCODE_COORDINATE_MAX 1e5

/** Largest radius of an arc; error:33 above. 100 mm of such an arc are straight within 0.2 um. */
#define GCODE_RADIUS_MAX_MM 1e7

enum gcode_motion {
    MOTION_RAPID,   /* G0 */
    MOTION_LINEAR,  /* G1 */
    MOTION_ARC_CW,  /* G2 */
    MOTION_ARC_CCW, /* G3 */
    MOTION_PROBE,   /* G38.2 .. G38.5, see gcode_modal.probe */
    MOTION_NONE,    /* G80 */
};
enum gcode_plane { PLANE_XY, PLANE_ZX, PLANE_YZ };                       /* G17 G18 G19 */
enum gcode_path { PATH_BLEND, PATH_EXACT, PATH_EXACT_STOP };             /* G64 G61 G61.1 */
enum gcode_feed_mode { FEED_PER_MIN, FEED_INVERSE_TIME };                /* G94 G93 */
enum gcode_spindle { SPINDLE_OFF, SPINDLE_CW, SPINDLE_CCW };             /* M5 M3 M4 */
enum gcode_flow { FLOW_RUN, FLOW_PAUSE, FLOW_OPTIONAL_PAUSE, FLOW_END }; /* -, M0, M1, M2 and M30 */
enum { COOLANT_MIST = 1, COOLANT_FLOOD = 2 };                            /* M7 M8; bits, M9 clears both */

/** Modal state: what stays from line to line. Volatile: back to gcode_modal_init() at reset. */
struct gcode_modal {
    enum gcode_motion motion;
    enum gcode_plane plane;
    enum gcode_path path;
    enum gcode_feed_mode feed_mode;
    enum gcode_spindle spindle;
    bool inches;             /* G20 */
    bool incremental;        /* G91 */
    bool arc_absolute;       /* G90.1 */
    uint8_t coolant;         /* COOLANT_ bits */
    uint8_t wcs;             /* 0 = G54 */
    uint8_t probe;           /* 2..5 for G38.2 .. G38.5 while motion is MOTION_PROBE */
    int32_t tool;            /* T */
    float feed_mm_s;         /* F in mm/s (G94); 0 = none yet. Inverse time is never modal: G93 clears it. */
    float spindle_rpm;       /* S */
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

/** Everything gcode_resolve() reads. */
struct gcode_state {
    struct gcode_modal modal;
    struct gcode_offsets offsets;
    double position_mm[AXIS_COUNT]; /* programmed end of the last accepted move, machine coordinates */
    axis_mask_t axes;               /* axes this machine has; a word of another axis is error:20 */
};

/** What one motion does. Targets are machine coordinates. For MOTION_NONE nothing else is filled in. */
struct gcode_move {
    enum gcode_motion motion; /* MOTION_NONE: this line moves nothing */
    double target_mm[AXIS_COUNT];
    float feed_mm_s;      /* along XYZ; degrees/s when none of XYZ moves; 0 for MOTION_RAPID and G93 */
    float inverse_time_s; /* > 0: the move lasts this long (G93) */
    /* arcs only: all three are ready for arc_begin() */
    enum gcode_plane plane;
    double center_mm[2];       /* centre in the plane, machine coordinates, first and second plane axis */
    int32_t turns;             /* full turns in addition to the part turn; 0 today (P word later) */
    bool via;                  /* G28, G30 with axis words: go through via_mm first, as a rapid */
    double via_mm[AXIS_COUNT]; /* filled in when via */
    uint8_t probe;             /* 2..5 for G38.2 .. G38.5, else 0 */
};

/** Which row of gcode_offsets a line replaces. */
enum gcode_store { STORE_NOTHING, STORE_WCS, STORE_G28, STORE_G30, STORE_G92 };

/** A line ready to execute. The machine performs its parts in this order, each after the one before:
 *  spindle/coolant (synchronised with motion when sync is set), dwell, store, move, flow. */
struct gcode_command {
    struct gcode_modal next;     /* modal state after the line */
    enum gcode_spindle spindle;  /* for this line's dwell and move; next differs from these two */
    uint8_t coolant;             /*   only at FLOW_END, which switches both off after the move */
    bool sync;                   /* a spindle or coolant change: let motion finish first */
    float dwell_s;               /* >= 0; < 0 means no dwell */
    enum gcode_store store;      /* which row store_mm replaces, see gcode_offsets_apply() */
    uint8_t store_wcs;           /* STORE_WCS: 0 = G54 */
    double store_mm[AXIS_COUNT]; /* the whole new row; not filled in for STORE_NOTHING */
    bool store_tool_length;      /* G43.1, G49: may come together with a store above */
    double tool_length_mm;       /* filled in when store_tool_length */
    struct gcode_move move;
    enum gcode_flow flow;
    uint32_t line_number; /* N word, 0 = none */
};

/** Default modal state: G0 G54 G17 G21 G90 G91.1 G94 G64 M5 M9, T0 F0 S0. */
void gcode_modal_init(struct gcode_modal *modal);

/** Work coordinate offset of the state: WCS + G92 + tool length, per axis, mm. */
void gcode_work_offset_mm(const struct gcode_state *state, double out_mm[AXIS_COUNT]);

/** Do the "store" part of a command. */
void gcode_offsets_apply(struct gcode_offsets *offsets, const struct gcode_command *command);

/** Parse and resolve one filtered line (no spaces, upper case, NUL-terminated; see link/line_reader.h).
 *  @return STATUS_OK and *command filled, or the error and *command undefined; state is never changed.
 *  The block is a local of this call: about 250 bytes of stack. */
enum status gcode_line(const struct gcode_state *state, const char *line, struct gcode_command *command);

/** What stands behind $J=, as gcode_line(): a straight move that leaves every mode as it was.
 *  @return also STATUS_JOG_WORD: a word or code that a jog has not; STATUS_NO_FEED without F of its own;
 *          STATUS_NO_AXIS_WORDS: nothing to move (Grbl would go to machine zero). */
enum status gcode_jog(const struct gcode_state *state, const char *line, struct gcode_command *command);

#endif
