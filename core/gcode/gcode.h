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

#include <math.h> // fabs
#include <stdbool.h>
#include <stdint.h>

enum { WCS_COUNT = 9 };           /* G54..G59, G59.1..G59.3 */
enum { TOOL_COUNT = 96 };         /* tools with a length in the tool table: T1..T96 */
enum { OUTPUT_COUNT = 5 };        /* digital outputs P0..P4 of M62..M65 */
enum { DIGITAL_INPUT_COUNT = 8 }; /* digital inputs P0..P7 of M66, at most */
enum { ANALOG_COUNT = 4 };        /* analog inputs E0..E3 of M66 and outputs E0..E3 of M67 and M68, at most */

/** Every target and every stored offset lies within +-this, in mm; error:33 otherwise. Positions in steps
 * then fit int32_t up to 21 474 steps per mm. */
#define GCODE_COORDINATE_MAX 1e5

/** The same in degrees: 10 million turns. How many of them there are in int32_t steps depends on steps per
 * degree, and is checked where these are known (kinematics_in_range()). */
#define GCODE_DEGREES_MAX 3.6e9

static inline bool gcode_in_range(unsigned axis, double coordinate) {
    const double size = fabs(coordinate);
    return size <= GCODE_COORDINATE_MAX || (axis >= AXIS_A && size <= GCODE_DEGREES_MAX);
}

/** Largest radius of an arc; error:33 above. 100 mm of such an arc are straight within 0.2 um. */
#define GCODE_RADIUS_MAX_MM 1e7

enum gcode_motion {
    MOTION_RAPID,     /* G0 */
    MOTION_LINEAR,    /* G1 */
    MOTION_ARC_CW,    /* G2 */
    MOTION_ARC_CCW,   /* G3 */
    MOTION_PROBE,     /* G38.2 .. G38.5, see gcode_modal.probe */
    MOTION_NONE,      /* G80 */
    MOTION_CYCLE,     /* G73 G81 .. G89, see gcode_modal.cycle */
    MOTION_CUBIC,     /* G5 */
    MOTION_QUADRATIC, /* G5.1 */
    MOTION_THREAD,    /* G33 G33.1 G76, see gcode_modal.cycle */
};
enum gcode_plane { PLANE_XY, PLANE_ZX, PLANE_YZ };                       /* G17 G18 G19 */
enum gcode_path { PATH_BLEND, PATH_EXACT, PATH_EXACT_STOP };             /* G64 G61 G61.1 */
enum gcode_feed_mode { FEED_PER_MIN, FEED_INVERSE_TIME, FEED_PER_REV };  /* G94 G93 G95 */
enum gcode_spindle { SPINDLE_OFF, SPINDLE_CW, SPINDLE_CCW };             /* M5 M3 M4 */
enum gcode_flow { FLOW_RUN, FLOW_PAUSE, FLOW_OPTIONAL_PAUSE, FLOW_END }; /* -, M0, M1, M2 and M30 */
enum { COOLANT_MIST = 1, COOLANT_FLOOD = 2 };                            /* M7 M8; bits, M9 clears both */

/** Canned cycles: what happens at the bottom and on the way out; gcode/cycle.h. */
enum gcode_cycle {
    CYCLE_CHIP,       /* G73 pecks, lifts a little after each */
    CYCLE_DRILL,      /* G81 */
    CYCLE_DWELL,      /* G82 */
    CYCLE_PECK,       /* G83 pecks, leaves the hole after each */
    CYCLE_BORE,       /* G85 out at feed */
    CYCLE_BORE_STOP,  /* G86 dwell, spindle stops, out as a rapid */
    CYCLE_BORE_DWELL, /* G89 dwell, out at feed */
};

/** Motion that follows the spindle. */
enum gcode_thread_kind {
    THREAD_LINE,  /* G33 */
    THREAD_TAP,   /* G33.1 there and back */
    THREAD_CYCLE, /* G76 many passes */
};

/** What M62 .. M68 switch, set or look at. */
enum gcode_port { PORT_DIGITAL_OUT, PORT_ANALOG_OUT, PORT_DIGITAL_IN, PORT_ANALOG_IN };
/** L of M66: an event that must come, or a level. */
enum gcode_wait { WAIT_NOT, WAIT_RISE, WAIT_FALL, WAIT_HIGH, WAIT_LOW };

/** M70 .. M73, done before anything else in the line. M73 is M70 to a controller; who runs a program with
 * subroutines says M72 when the present one returns (program_note()). */
enum gcode_modes { MODES_KEEP, MODES_SAVE, MODES_FORGET, MODES_RESTORE, MODES_SAVE_FOR_SUB };

/** What M48 .. M53 enable; bits. */
enum { OVERRIDE_FEED = 1, OVERRIDE_SPINDLE = 2, OVERRIDE_HOLD = 4, OVERRIDE_ALL = 7 };

/** Words of a canned cycle that later lines of the same cycle need not repeat. As written, so that G91 and
 * offsets mean what they mean in the line that uses them; forgotten when plane or distance mode change. */
struct gcode_sticky {
    double r_mm, z_mm;   /* R and the word of the axis normal to the plane */
    double q_mm;         /* Q > 0 */
    double initial_mm;   /* level before the first of a row of cycles (G98), machine coordinates */
    float p_s;           /* P >= 0 */
    uint8_t known;       /* WORD_ bits of resolve_cycle.c */
    double spline_mm[2]; /* P Q of the last G5, for a next one without I J */
    enum gcode_plane plane;
    bool incremental;
};

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
    bool diameter;           /* G7: X words count twice what X moves; positions and offsets are radii */
    uint8_t coolant;         /* COOLANT_ bits */
    uint8_t wcs;             /* 0 = G54 */
    uint8_t probe;           /* 2..5 for G38.2 .. G38.5 while motion is MOTION_PROBE */
    uint8_t cycle;           /* enum gcode_cycle while motion is MOTION_CYCLE, gcode_thread_kind: _THREAD */
    bool retract_to_r;       /* G99 */
    bool toolsetter;         /* G65 P5 Q1: G38 looks at the tool setter */
    uint8_t overrides;       /* OVERRIDE_ bits */
    int32_t tool;            /* T */
    int32_t tool_in_spindle; /* T at the last M6; 0 = none since the reset */
    float feed_mm_s;         /* F in mm/s (G94) or mm per revolution (G95); 0 = none yet. Inverse time is
                              * never modal: G93 clears it. */
    float spindle_rpm;       /* S */
    float path_tolerance_mm; /* G64 P; 0 = $11 alone */
};

/** Offsets. Persistent: wcs_mm, g28_mm, g30_mm, tool_mm. Volatile: the others. All in machine mm. */
struct gcode_offsets {
    double wcs_mm[WCS_COUNT][AXIS_COUNT];
    double g28_mm[AXIS_COUNT];
    double g30_mm[AXIS_COUNT];
    double g92_mm[AXIS_COUNT];
    double g92_kept_mm[AXIS_COUNT]; /* what G92.3 brings back after G92.2 */
    double tool_length_mm;          /* on Z, in force */
    float tool_mm[TOOL_COUNT];      /* tool table: length of T1.., on Z; exact to 0.01 um up to 100 mm */
};

/** How many of them this machine has, from number 0 on. */
struct gcode_ports {
    uint8_t digital_out;           /* 0 .. OUTPUT_COUNT */
    uint8_t digital_in;            /* 0 .. DIGITAL_INPUT_COUNT */
    uint8_t analog_in, analog_out; /* 0 .. ANALOG_COUNT */
    bool encoder;                  /* of the spindle: G33, G33.1, G76 and G95 are possible */
    bool no_spindle, no_reverse;   /* no output for it, or none for its direction: M3 and M4, or M4 */
    uint8_t no_coolant;            /* COOLANT_ bits without an output: M7, M8 */
    bool coolant_passes;           /* $91: they are taken all the same, and stay off */
    bool toolsetter;               /* a second probe input: G65 P5 Q1 */
    bool no_tool_change;           /* $341=4: M6 only notes the tool */
};

/** The spindle can turn so: M3, M4, M5. */
static inline bool gcode_can_turn(const struct gcode_ports *ports, enum gcode_spindle spindle) {
    return spindle == SPINDLE_OFF || (!ports->no_spindle && !(ports->no_reverse && spindle == SPINDLE_CCW));
}

/** Some of this coolant has no output, and $91 does not let it pass. @param coolant  COOLANT_ bits */
static inline bool gcode_lacks_coolant(const struct gcode_ports *ports, unsigned coolant) {
    return !ports->coolant_passes && (coolant & ports->no_coolant) != 0;
}

/** All that can be: for who reads a program without its machine. */
#define GCODE_PORTS_ALL                                                                                      \
    ((struct gcode_ports){.digital_out = OUTPUT_COUNT,                                                       \
                          .digital_in = DIGITAL_INPUT_COUNT,                                                 \
                          .analog_in = ANALOG_COUNT,                                                         \
                          .analog_out = ANALOG_COUNT,                                                        \
                          .encoder = true,                                                                   \
                          .toolsetter = true})

/** Everything gcode_resolve() reads. */
struct gcode_state {
    struct gcode_modal modal;
    struct gcode_sticky sticky; /* means something while the modal motion is MOTION_CYCLE or _CUBIC */
    struct gcode_modal saved;   /* by M70; one of them, as at LinuxCNC's program level */
    double saved_tool_length_mm;
    bool is_saved;
    struct gcode_offsets offsets;
    double position_mm[AXIS_COUNT]; /* programmed end of the last accepted move, machine coordinates */
    axis_mask_t axes;               /* axes this machine has; a word of another axis is error:20 */
    struct gcode_ports ports;
    float arc_radius_tolerance_mm; /* $41: so far the radii of an arc may differ, beyond Grbl's rule */
};

/** A canned cycle: the same hole `repeats` times. Levels are machine coordinates of the axis normal to the
 * plane: bottom <= r <= clear. The last hole lies at target_mm, in front of it each step_mm. */
struct gcode_drill {
    enum gcode_cycle cycle;
    double r_mm, bottom_mm, clear_mm;
    double step_mm[2]; /* from hole to hole, plane axes in the order of arc_plane_axes */
    uint32_t repeats;  /* L, 1 .. DRILL_REPEATS_MAX */
    double peck_mm;    /* Q of G73, G83 */
    uint32_t pecks;    /* >= 1 */
    float dwell_s;     /* P of G82, G86, G89 */
};
enum { DRILL_REPEATS_MAX = 65535, DRILL_PECKS_MAX = 1000000 };
enum { ARC_PASSES_MAX = 1000 }; /* P of an arc */

/** A thread: motion as a function of the spindle's angle. All but the first two are G76's: passes from the
 * drive line, which lies where the tool stood before and is parallel to Z. Depths count from the thread's
 * peak, away from the drive line. */
struct gcode_thread {
    enum gcode_thread_kind kind;
    float pitch_mm;     /* K; P of G76. > 0, along the way, per revolution */
    float return_speed; /* I of G33.1, > 0: times the speed in */
    float peak_mm;      /* I: where X of the thread's peak lies from the drive line; not 0 */
    float first_mm;     /* J: depth of the first pass, > 0, less than the full one */
    float depth_mm;     /* K: full depth, > 0 */
    float degression;   /* R >= 1: pass n is first * n^(1/R) deep */
    float slide;        /* tangent of Q, >= 0: passes lie so much further ahead, per depth */
    float taper_mm;     /* E: length of a taper from full depth to the peak */
    uint16_t springs;   /* H: passes more at full depth */
    bool entry, exit;   /* L: tapers there */
};
enum { THREAD_PASSES_MAX = 1000 };

/** What one motion does. Targets are machine coordinates. For MOTION_NONE nothing else is filled in. */
struct gcode_move {
    enum gcode_motion motion; /* MOTION_NONE: this line moves nothing */
    double target_mm[AXIS_COUNT];
    float feed_mm_s;      /* along XYZ; degrees/s when none of XYZ moves; 0 for MOTION_RAPID and G93; in G95
                           * at the speed that S asks for */
    float inverse_time_s; /* > 0: the move lasts this long (G93) */
    /* arcs only: all three are ready for arc_begin() */
    enum gcode_plane plane;
    double center_mm[2];       /* centre in the plane, machine coordinates, first and second plane axis */
    int32_t turns;             /* full turns in addition to the part turn, 0 .. ARC_PASSES_MAX - 1 */
    double control_mm[2][2];   /* MOTION_CUBIC, _QUADRATIC: control points of a cubic in XY */
    bool via;                  /* G28, G30 with axis words: go through via_mm first, as a rapid */
    double via_mm[AXIS_COUNT]; /* filled in when via, and for MOTION_CYCLE and _THREAD */
    uint8_t probe;             /* 2..5 for G38.2 .. G38.5, else 0 */
    struct gcode_drill drill; /* filled in for MOTION_CYCLE; plane and via_mm (bottom of the last hole) too */
    struct gcode_thread thread; /* filled in for MOTION_THREAD; and via_mm, the end of the way that follows
                                 * the spindle: target_mm is where the tool is at last */
};

/** Which row of gcode_offsets a line replaces. */
enum gcode_store {
    STORE_NOTHING,
    STORE_WCS,
    STORE_G28,
    STORE_G30,
    STORE_G92,       /* G92, G92.1: what G92.3 brings back, too */
    STORE_G92_ALONE, /* G92.2, G92.3 */
    STORE_TOOL,      /* no row, but one length of the tool table */
};

/** A line ready to execute. The machine performs its parts in this order, each after the one before:
 *  tool change (motion has finished, spindle and coolant are off), spindle/coolant/override switches
 *  (synchronised with motion when sync is set), output, input, dwell, store, move, flow. */
struct gcode_command {
    struct gcode_modal next;    /* modal state after the line, see gcode_modal_apply() */
    struct gcode_sticky sticky; /* filled in for a move that is MOTION_CYCLE, _CUBIC, _QUADRATIC or _THREAD */
    enum gcode_modes modes;     /* what becomes of gcode_state.saved; RESTORE is already in next */
    enum gcode_spindle spindle; /* for this line's dwell and move; next differs from these two */
    uint8_t coolant;            /*   only at FLOW_END, which switches both off after the move */
    uint8_t coolant_passed;     /* COOLANT_ bits of its M7 and M8 that stay off for want of an output */
    bool tool_change;           /* M6: to next.tool */
    bool sync;                  /* a change of spindle, coolant, override switches, to or from G95, or
                                 * port_sync: let motion finish first */
    bool port_sync;             /* the output waits for motion (M62, M63, M67) */
    int8_t port;                /* number of the input or output of M62 .. M68; -1 = none, and then ... */
    enum gcode_port port_kind;  /* ... these five are not filled in */
    bool port_on;               /* PORT_DIGITAL_OUT */
    float port_pct;             /* PORT_ANALOG_OUT: 0 .. 100 */
    enum gcode_wait wait;       /* PORT_DIGITAL_IN; inputs are looked at when motion has finished */
    float wait_s;               /* > 0 unless WAIT_NOT: this long at most */
    float dwell_s;              /* >= 0; < 0 means no dwell */
    enum gcode_store store;     /* which row store_mm replaces, see gcode_offsets_apply() */
    uint8_t store_wcs;          /* STORE_WCS: 0 = G54 */
    double store_mm[AXIS_COUNT]; /* the whole new row; not filled in for STORE_NOTHING */
    uint8_t store_tool;          /* STORE_TOOL: 0 = T1; the length is store_tool_mm */
    float store_tool_mm;
    float store_tool_diameter_mm; /* < 0: stays as it is */
    bool store_tool_noted;        /* G10 L1: the comment of its line is the tool's text */
    bool store_tool_length;       /* G43, G43.1, G49: may come together with a store above */
    bool tool_table_used;         /* ... by G43: the length came from the tool table */
    double tool_length_mm;        /* filled in when store_tool_length */
    struct gcode_move move;
    enum gcode_flow flow;
    uint32_t line_number; /* N word, 0 = none */
};

/** Forget M70, at a reset. */
static inline void gcode_modes_forget(struct gcode_state *state) {
    state->is_saved = false;
}

/** Default modal state: G0 G54 G17 G21 G90 G91.1 G94 G97 G64 G98 G8 M5 M9 M48 M53, T0 F0 S0. */
void gcode_modal_init(struct gcode_modal *modal);

/** Offset of a work coordinate system: WCS + G92 + tool length, per axis, mm. @param wcs  0 = G54 */
void gcode_wcs_offset_mm(const struct gcode_offsets *offsets, uint8_t wcs, double out_mm[AXIS_COUNT]);

/** The same of the state's. */
void gcode_work_offset_mm(const struct gcode_state *state, double out_mm[AXIS_COUNT]);

/** The part of gcode_modal_apply() that few lines have: M70 and M71. Private. */
void gcode_modes_keep(struct gcode_state *state, const struct gcode_command *command);

/** The command is done: its modes are those of the next line. */
static inline void gcode_modal_apply(struct gcode_state *state, const struct gcode_command *command) {
    if (command->modes != MODES_KEEP)
        gcode_modes_keep(state, command);
    state->modal = command->next;
    if (command->move.motion >= MOTION_CYCLE)
        state->sticky = command->sticky;
}

/** Do the "store" part of a command. */
void gcode_offsets_apply(struct gcode_offsets *offsets, const struct gcode_command *command);

/** Parse and resolve one filtered line (no spaces, upper case, NUL-terminated; see input/line_reader.h).
 *  @return STATUS_OK and *command filled, or the error and *command undefined; state is never changed.
 *  The block is a local of this call: about 250 bytes of stack. */
enum status gcode_line(const struct gcode_state *state, const char *line, struct gcode_command *command);

/** gcode_line() for a line as it came, unfiltered and ended by LF or CR, if it is a plain one: words in
 * capitals, one at least, and spaces behind them. It saves a line of a job the way through the line reader.
 *  @return its end, CR or LF; NULL: it is none, or has an error that gcode_line() will tell; *command is
 *          undefined then */
const char *gcode_plain_line(const struct gcode_state *state, const char *line,
                             struct gcode_command *command);

/** What follows $J=, as gcode_line(): a straight move that leaves every mode as it was.
 *  @return also STATUS_JOG_WORD: a word or code that a jog has not; STATUS_NO_FEED without F of its own;
 *          STATUS_NO_AXIS_WORDS: nothing to move (Grbl would go to machine zero). */
enum status gcode_jog(const struct gcode_state *state, const char *line, struct gcode_command *command);

#endif
