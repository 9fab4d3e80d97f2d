/* SPDX-License-Identifier: MIT
 * One machine: owns every part, moves bytes to steps by polling, answers every line once. [task]
 *
 *   bytes -> rx -> line reader -> command ($) or G-code -> task (stages) -> motion -> segment ring -> prep ->
 * step ISR
 *
 * Nothing here blocks. A line that must wait (look-ahead full, dwell, M0) stays the current task; each poll
 * carries it on as far as it goes, and the next line is not read before it is answered. This header is for
 * the outside; machine/inner.h is for core/machine alone. */
#ifndef WIFICNC_MACHINE_MACHINE_H
#define WIFICNC_MACHINE_MACHINE_H

#include "gcode/arc.h"
#include "gcode/cycle.h"
#include "gcode/gcode.h"
#include "gcode/params.h"
#include "gcode/spline.h"
#include "gcode/thread.h"
#include "hal/hal.h"
#include "link/line_reader.h"
#include "link/rx.h"
#include "link/text.h"
#include "machine/keep.h"
#include "machine/switches.h"
#include "motion/joints.h"
#include "motion/motion.h"
#include "segment/feed.h"
#include "settings/settings.h"
#include "step/isr.h"
#include "step/prep.h"

/** Outputs that not every board has: bits of machine_board.outputs. */
enum board_output {
    BOARD_OUTPUT_SPINDLE = 1, /* anything that starts it: an enable line or PWM */
    BOARD_OUTPUT_PWM = 2,     /* of the spindle; a laser ($32) needs it */
    BOARD_OUTPUT_REVERSE = 4, /* its direction: M4 without $32 */
    BOARD_OUTPUT_FLOOD = 8,
    BOARD_OUTPUT_MIST = 16,
    BOARD_OUTPUT_SERVO = 32,
    BOARD_OUTPUTS_ALL = 63
};

/** What the board fixes. */
struct machine_board {
    uint32_t timer_hz;
    uint32_t step_pulse_ns; /* used unless $0 asks for another; $0 starts at this, in whole us */
    uint32_t dir_setup_ns;
    uint32_t step_spread_ns;           /* from step to step, beyond the pulse and a pause as long */
    uint32_t max_step_rate_hz;         /* of one axis */
    uint8_t axis_count;                /* 1 .. AXIS_COUNT */
    axis_mask_t home_axes;             /* homing looks at switches of their own, not at the limits */
    uint32_t motors_wake_us;           /* drivers need it from enabled to their first step */
    uint8_t outputs;                   /* BOARD_OUTPUT_ bits of what is wired */
    uint16_t charge_pump_hz;           /* of its square wave; 0: no such output */
    uint8_t digital_inputs;            /* of M66, 0 .. DIGITAL_INPUT_COUNT */
    uint8_t digital_outputs;           /* of M62 .. M65, 0 .. OUTPUT_COUNT */
    const struct hal_analog *analog;   /* NULL: no analog inputs and outputs */
    const struct hal_servo *servo;     /* NULL: no servo output */
    const struct hal_encoder *encoder; /* NULL: none of the spindle */
    const struct hal_ganged *ganged;   /* NULL: every axis has one motor */
    const struct hal_store *store;     /* NULL: nothing is kept */
    const void *store_ctx;
    const struct hal_motion_side *motion_side; /* NULL: the task that calls machine_poll() is it */
    const void *motion_side_ctx;
};

enum machine_state {
    MACHINE_IDLE,
    MACHINE_RUN,
    MACHINE_HOLD, /* ! or M0: waits for ~ */
    MACHINE_JOG,
    MACHINE_ALARM, /* locked until $X, $H or reset; position may be wrong */
    MACHINE_DOOR,  /* safety door: outputs off, waits for a closed door and ~ */
    MACHINE_CHECK, /* $C: lines are read, nothing moves */
    MACHINE_HOME,
    MACHINE_SLEEP, /* $SLP: waits for reset */
    MACHINE_STATE_COUNT
};

/** Alarm numbers: Grbl 1.1h's, and from 50 on our own. */
enum alarm {
    ALARM_NONE = 0,
    ALARM_HARD_LIMIT = 1,
    ALARM_SOFT_LIMIT = 2,
    ALARM_RESET_IN_MOTION = 3,
    ALARM_PROBE_CLOSED = 4, /* in contact before it moved */
    ALARM_PROBE_MISSED = 5, /* no contact */
    ALARM_HOMING_RESET = 6,
    ALARM_HOMING_DOOR = 7,
    ALARM_HOMING_PULL_OFF = 8, /* the switch did not open */
    ALARM_HOMING_MISSED = 9,   /* the switch was not found */
    ALARM_SQUARING = 10,       /* the second motor's switch was not found near the first one's */
    ALARM_ESTOP = 50,
    ALARM_SPINDLE = 51, /* it did not come to a steady speed, or stood still, while motion follows it */
    ALARM_THREAD = 52,  /* the axes could not keep up with it */
    ALARM_STORE = 55,   /* stored data is damaged; locked until $ACK. No line ALARM:53 */
};

/** Where the current line stands; each stage ends before the next begins. */
enum task_stage {
    TASK_NONE,
    TASK_TOOL,      /* M6: wait for rest */
    TASK_TOOL_WAIT, /* M6: wait for ~ */
    TASK_OUTPUTS,   /* spindle, coolant and what else waits for rest */
    TASK_INPUT,     /* M66: wait for rest */
    TASK_DWELL,
    TASK_DWELLING, /* and M66 while it waits for its input */
    TASK_STORE,
    TASK_VIA, /* first leg of G28, G30 */
    TASK_MOVE,
    TASK_ARC, /* and splines */
    TASK_CYCLE,
    TASK_THREAD, /* motion that follows the spindle */
    TASK_FLOW,   /* M0, M2, M30: wait for rest */
    TASK_PAUSED, /* M0: wait for ~ */
    TASK_JOG,    /* $J=: wait for room */
    TASK_PROBE,  /* wait for rest, then look at the probe */
    TASK_PROBING,
    TASK_PROBED,     /* say where; after an alarm when its quiet time is over */
    TASK_ALARMED,    /* answer when the quiet time is over */
    TASK_SOFT_LIMIT, /* wait for the stop, then alarm 2 */
    TASK_HOMING,
    TASK_LOCKED, /* a critical alarm has ended the line; answered when its quiet time is over */
};

/** Whose line the current one is. */
enum line_source { LINE_STREAM, LINE_STARTUP, LINE_STORED };

/** A span of time to be waited for. */
struct machine_timer {
    bool on;
    uint32_t from_us, us;
};

/** Spindle and coolant: what the program wants and what is kept from it. */
struct machine_outputs {
    enum gcode_spindle spindle;
    float rpm;  /* S */
    bool laser; /* switched on as a laser ($32) */
    uint8_t coolant;
    bool spindle_stopped;     /* 0x9E in a hold */
    bool suspended;           /* the door is open: everything is off */
    bool coolant_waits;       /* the door was closed: the spindle runs up first */
    float shown_rpm;          /* on the pins: with override, limits and the laser's power */
    struct machine_timer aim; /* the aiming beam of a laser at rest; laser.c */
};

/** Where a pass that follows the spindle is; machine/thread.c. */
enum thread_step {
    THREAD_NEXT,     /* find the next thing to do */
    THREAD_PASSING,  /* a pass is under way */
    THREAD_OUT,      /* a tap: the spindle was told to turn back */
    THREAD_TURNING,  /* it has come back and was told to turn as before */
    THREAD_STANDING, /* its axes come to rest */
    THREAD_BACK,     /* it returns to where it began */
};

/** Motion that follows the spindle, and feed per revolution. */
struct machine_thread {
    enum thread_step step;
    struct thread cycle;         /* G76 */
    struct thread_action action; /* of it, waits while action_pending */
    bool action_pending;
    bool cutting;     /* the tool is in the work: holds and the door wait */
    bool door_waits;  /* 0x84 came meanwhile */
    bool again;       /* a hold came before the pass had begun */
    enum alarm fault; /* to be told when all stands */
    struct machine_timer patience;
    float per_rev_nominal; /* G95: revolutions/s that feeds were planned with; 0: G93, G94 */
    float per_rev_factor;  /* real speed / that */
};

/** Power of the motors; of the motion side. */
struct machine_motors {
    bool on, inverted;           /* as put out: $4 */
    bool awake;                  /* since they were switched on */
    uint32_t moved_us, woken_us; /* when something moved last; when they were switched on */
};

/** Current of the motors, $83. */
struct machine_torque {
    axis_mask_t full;                /* axes with full current */
    uint32_t seen;                   /* segments of the ring looked at */
    uint32_t until_us[OUTPUT_COUNT]; /* full until then */
};

/** What is asked about motion lines while they are under way: one note for a row of source lines. Moves of
 * different notes never share a piece of path, so more notes than pieces and segments are never needed. */
enum { LINE_NOTES = PLAN_SIZE + 32 };
struct line_note {
    uint32_t line;        /* first of the row */
    uint32_t number;      /* its N word; 0: none has one */
    int32_t stride;       /* from N word to N word, per line; NOTE_SINGLE: a row of one line */
    float rpm, feed_mm_s; /* laser: S and F of the lines */
};
#define NOTE_SINGLE INT32_MIN
struct line_notes {
    uint32_t count;
    struct line_note slots[LINE_NOTES];
};

/** Motors of an axis. */
enum { FIRST_MOTOR, SECOND_MOTOR, MOTOR_COUNT };

/** How far homing is; machine/homing.c. From `found` on: machine/square.c. */
struct homing {
    uint8_t step, next;                     /* within the cycle; the next cycle */
    bool all;                               /* $H without letters */
    bool locked;                            /* it began in an alarm */
    axis_mask_t asked, done;                /* of $H; of the cycles so far */
    axis_mask_t axes, left;                 /* of this cycle; of these still looking for their switch */
    axis_mask_t found[MOTOR_COUNT];         /* motors whose switch is found */
    axis_mask_t held[MOTOR_COUNT];          /* motors that wait for the other one */
    int32_t motor[MOTOR_COUNT][AXIS_COUNT]; /* where each stands: steps it has made */
    int32_t from[AXIS_COUNT];               /* counters when the present motion began */
};

/** Written by machine_edge_isr() too. */
struct machine_edges {
    struct switches switches;
    axis_mask_t known;              /* limits active at the last edge */
    axis_mask_t latch[MOTOR_COUNT]; /* homing: remember where the switches of these motors come on */
    volatile axis_mask_t latched[MOTOR_COUNT];
    int32_t mark[MOTOR_COUNT][AXIS_COUNT]; /* steps, where the line closed that waits */
    int32_t at[MOTOR_COUNT][AXIS_COUNT];   /* steps, where latched */
    volatile bool hard_limit, estop;       /* seen, motion is halted */
};

/** A jog of a network host: it goes on until it is stopped, so its end moves on before it. */
struct host_jog {
    bool on, waits; /* waits: for the one before to stand */
    uint8_t axis;
    int8_t direction;
    float speed_mm_s;
    double target_mm; /* planned so far */
};

/** A job of the text side that a network host has interrupted; machine/preempt.c. */
enum host_job {
    HOST_JOB_NONE,
    HOST_JOB_BRAKES,   /* it slows down along its path; the host's segments lie ready */
    HOST_JOB_WAITS,    /* it stands with all that was planned, until the host has let go and ~ comes */
    HOST_JOB_RESTORES, /* spindle and outputs are again as the job had them */
    HOST_JOB_RETURNS,  /* the axes go back to where it was left */
};
struct host_suspended {
    enum host_job step;
    bool hold_asked; /* ! came while it slowed down: the host's motion begins held */
    bool by_release; /* the hold is that of the host's letting go, nobody else has asked for it */
    int32_t left_steps[AXIS_COUNT];
    enum gcode_spindle spindle, modal_spindle; /* as they were put out, and as the program had set them */
    float rpm, modal_rpm;
    uint8_t coolant, modal_coolant, digital;
};

/** Motion of a network host; machine/host.h. */
struct machine_host {
    struct feed feed;
    struct host_suspended job;
    bool owns;                     /* motion is a host's: lines of the text side wait */
    bool end_known;                /* end_steps is right */
    int64_t end_steps[AXIS_COUNT]; /* where the segments taken so far end */
    uint32_t dropped;              /* times that queued motion was given up: e-stop, reset, contact; wraps */
    uint32_t done_at_drop;         /* segments executed to their end before that */
    uint32_t late_refusals;        /* segments that waited for a job to stand and then left the travel */
    uint32_t late_refused;         /* number of the first of them, as machine_host_taken() counts */
    struct host_jog jog;
    bool homing, homed_ok;       /* it homes; the last time went well */
    bool discards;               /* its motion slows down; then what is queued is discarded */
    bool probing, probe_contact; /* segments with SEGMENT_PROBE are queued; how the last of them ended */
    uint32_t probes_done;        /* wraps */
    int32_t probe_steps[AXIS_COUNT];
};

/** The sender that commands the text side; machine/sender.c. */
enum machine_sender {
    SENDER_THERE, /* as far as anybody can know */
    SENDER_LOST,
    SENDER_LOST_WITH_LINES, /* and lines of it have not come here yet */
    SENDER_HELD,            /* its program waits for `~`, with spindle and coolant off */
};

struct machine {
    struct machine_board board;
    struct hal *hal;
    struct text_out out;
    struct settings settings;
    struct gcode_state gcode;
    struct gcode_offsets offsets_unchecked; /* in check mode: those that come back after it */
    struct params params;
    struct param_numbered params_numbered[PARAMS_NUMBERED];
    struct param_named params_named[PARAMS_NAMED];
    struct rx rx;
    struct line_reader reader;
    struct joints joints;
    struct motion motion;
    struct prep prep;
    struct step step;
    uint32_t late_told;              /* underruns that were reported */
    struct machine_timer late_quiet; /* ... and none are until this is over */
    struct machine_motors motors;
    struct machine_torque torque;
    uint16_t servo_us;          /* pulse put out; 0: none */
    uint32_t motion_started_us; /* of the motion side: when the step timer was started last */
    uint32_t motion_starts;     /* ... and how often; wraps */

    struct machine_host host;

    enum machine_state state;
    enum alarm alarm;        /* the newest; ALARM_NONE after a reset */
    axis_mask_t trusted;     /* axes that were homed, and not stopped without a ramp since */
    uint8_t position_losses; /* times that motion was stopped without a ramp; wraps */
    bool locks_again;        /* the e-stop came while the machine was locked: it is locked after it, too */
    bool critical;           /* after alarm 1, 2 or e-stop: only a reset helps */
    bool critical_untold;    /* ... and that was not said yet */
    bool release_told;       /* ... but that the e-stop must be released first */
    bool restart;            /* the banner is due */
    bool reset_asked;        /* by a $ command */
    bool restoring;          /* the door was closed, spindle and coolant start again */
    bool cancelling;         /* a jog is being cancelled */
    bool line_open;          /* the current line is not answered yet */
    bool overflow_told;      /* that the lines that were just lost are */
    uint32_t flush_until;    /* $J= lines put before this many bytes are dropped, while flushing */
    bool flushing;
    uint32_t line_from;         /* bytes taken before the present line */
    struct machine_timer quiet; /* after an alarm */
    struct machine_timer timer; /* of the activity: debounce, spindle run-up */
    uint8_t feed_pct, rapid_pct, spindle_pct;
    uint8_t wco_wait, ov_wait; /* reports until the field is due */
    struct machine_edges edges;
    struct hal_inputs inputs; /* at the last poll */
    struct machine_outputs outputs;
    uint8_t coolant_told; /* COOLANT_ bits of which wiring_report_coolant() has spoken */
    uint8_t digital;      /* outputs of M62 .. M65: bit n = Pn; a reset leaves them */
    bool hold_waits;      /* ! while M53 P0 is in force */
    enum machine_sender sender;
    bool homing_lost; /* homing was stopped because its sender was lost; not said yet */

    enum task_stage stage;
    enum line_source source;
    uint8_t startup;              /* next startup line to run; STARTUP_LINE_COUNT = none */
    uint8_t store_as;             /* LINE_STORED: which one */
    bool homed_line;              /* $H is answered after the startup lines */
    struct gcode_command command; /* of the current line */
    double dwell_left_s;
    bool input_awaited, input_before; /* a dwell of M66; the level when it was last looked at */
    enum task_stage after_dwell;
    struct arc arc;
    struct spline spline;
    bool arc_pending; /* arc_point_mm waits for room in the look-ahead */
    double arc_point_mm[AXIS_COUNT];
    float arc_feed_mm_s;
    struct cycle cycle;
    struct cycle_action action; /* of the cycle, waits while action_pending */
    bool action_pending;
    struct machine_thread thread;
    struct homing homing;
    int32_t shift_steps[AXIS_COUNT]; /* by which homing has moved the counters against the pulses */
    int32_t probe_steps[AXIS_COUNT];
    bool probe_ok;
    struct line_notes notes;
    uint32_t lines; /* lines taken */
    char startup_lines[STARTUP_LINE_COUNT][LINE_SIZE];
    char info[LINE_SIZE]; /* $I= */
    struct machine_kept kept;
};

/** Power-on: what was kept or defaults, position 0, banner. `out`, `hal` and the store must live as long as
 * the machine. */
void machine_init(struct machine *machine, const struct machine_board *board, struct hal *hal,
                  struct hal_step *hal_step, const struct text_out *out);

/** Settings that came after machine_init() count as stored ones: lock the machine if $22 asks for homing. */
void machine_lock(struct machine *machine);

/** Carry everything on as far as it goes now. @return true when anything was done. */
bool machine_poll(struct machine *machine);

/** [motion side] Where board.motion_side is set: cut segments into spans and start the step timer. Call it
 * every ms. Everything else of the machine belongs to the task of machine_poll(). @return true when anything
 * was done. */
bool machine_poll_motion(struct machine *machine);

/** [isr or task] A limit, home or e-stop line has changed. Halts the step ISR when it must stop at once, and
 * remembers the exact step. On the ISR's core, never nested into it. */
void machine_edge_isr(struct machine *machine);

/** [isr] The time of hal_switch_timer_start() is over. As machine_edge_isr(). */
void machine_switch_timer_isr(struct machine *machine);

/** Poll again after this many us at the latest, even if nothing happens. @return UINT32_MAX: no need */
uint32_t machine_wait_us(const struct machine *machine);

/** The connection of the sender that commands the text side has ended, in whatever way: a jog is cancelled, a
 * program is held, spindle and coolant stop. Lines of others are read as ever after `~` or a reset. To be
 * called by every target that can see the end of a connection.
 *  @param lines_wait  whole lines of it are still on their way to the machine */
void machine_sender_lost(struct machine *machine, bool lines_wait);

/** Nothing more comes for now: planned moves start without waiting for look-ahead. */
void machine_input_pause(struct machine *machine);

/** Speed of the tool, of the motion that is on the pins now. */
float machine_speed_mm_s(const struct machine *machine);

/** No pulse is on its way to the pins; moves may be planned, as in a hold. While a motion side of its own is
 * at work, also false when it only looks around: ask again. */
bool machine_is_standing(const struct machine *machine);

/** No motion planned, queued or being stepped. */
bool machine_is_at_rest(const struct machine *machine);

/** What a client that connects must know, each for a [MSG:]: stored data that is damaged, a job that is held
 * because its sender was lost. @param number  0, 1, .. until it returns false: nothing more, and text is
 * empty */
bool machine_notice(const struct machine *machine, unsigned number, char *text, size_t size);

/** State as reports show it, with its sub-state: "Idle", "Hold:1", "Door:0". */
const char *machine_state_text(const struct machine *machine);

/** Length of a step pulse in force: the board's, or $0. */
uint32_t machine_step_pulse_ns(const struct machine *machine);

/** Steps that have left the pins. */
void machine_position(const struct machine *machine, int32_t steps[AXIS_COUNT]);

#endif
