/* SPDX-License-Identifier: MIT
 * One machine: owns every part, moves bytes to steps by polling, answers every line once. [task]
 *
 *   bytes -> rx -> line reader -> command ($) or G-code -> task (stages) -> motion -> segment ring -> prep ->
 * step ISR
 *
 * Nothing here blocks. A line that must wait (look-ahead full, dwell, M0) stays the current task; each poll
 * carries it on as far as it goes, and the next line is not read before it is answered. */
#ifndef WIFICNC_MACHINE_MACHINE_H
#define WIFICNC_MACHINE_MACHINE_H

#include "gcode/arc.h"
#include "gcode/gcode.h"
#include "hal/hal.h"
#include "link/line_reader.h"
#include "link/rx.h"
#include "link/text.h"
#include "motion/motion.h"
#include "settings/settings.h"
#include "step/isr.h"
#include "step/prep.h"

/** What the board fixes. */
struct machine_board {
    uint32_t timer_hz;
    uint32_t step_pulse_ns; /* used unless $0 asks for another; $0 starts at this, in whole us */
    uint32_t dir_setup_ns;
    uint32_t max_step_rate_hz; /* of one axis */
    uint8_t axis_count;        /* 1 .. AXIS_COUNT */
};

enum machine_state {
    MACHINE_IDLE,
    MACHINE_RUN,
    MACHINE_HOLD,  /* ! or M0: waits for ~ */
    MACHINE_ALARM, /* locked until $X or reset; position may be wrong */
};

/** Alarm numbers: Grbl 1.1h's. */
enum alarm { ALARM_NONE = 0, ALARM_RESET_IN_MOTION = 3 };

/** Where the current line stands; each stage ends before the next begins. */
enum task_stage {
    TASK_NONE,
    TASK_OUTPUTS, /* spindle and coolant, once motion has come to rest */
    TASK_DWELL,
    TASK_DWELLING,
    TASK_STORE,
    TASK_VIA, /* first leg of G28, G30 */
    TASK_MOVE,
    TASK_ARC,
    TASK_FLOW,   /* M0, M2, M30: wait for rest */
    TASK_PAUSED, /* M0: wait for ~ */
};

struct machine {
    struct machine_board board;
    struct hal *hal;
    struct text_out out;
    struct settings settings;
    struct gcode_state gcode;
    struct rx rx;
    struct line_reader reader;
    struct motion motion;
    struct prep prep;
    struct step step;
    enum machine_state state;
    enum task_stage stage;
    struct gcode_command command; /* of the current line */
    struct arc arc;
    bool arc_pending; /* arc_point_mm waits for room in the look-ahead */
    double arc_point_mm[AXIS_COUNT];
    float arc_feed_mm_s;
    uint32_t lines; /* lines taken */
};

/** Power-on: defaults, position 0, banner. `out` and `hal` must live as long as the machine. */
void machine_init(struct machine *machine, const struct machine_board *board, struct hal *hal,
                  struct hal_step *hal_step, const struct text_out *out);

/** Carry everything on as far as it goes now. @return true when anything was done. */
bool machine_poll(struct machine *machine);

/** Nothing more comes for now: planned moves start without waiting for look-ahead. */
void machine_input_pause(struct machine *machine);

/** No pulse is on its way to the pins; moves may be planned, as in a hold. */
bool machine_is_standing(const struct machine *machine);

/** No motion planned, queued or being stepped. */
bool machine_is_at_rest(const struct machine *machine);

/** Steps that have left the pins. */
void machine_position(const struct machine *machine, int32_t steps[AXIS_COUNT]);

/** A $ line (without line end). Answers it. machine/command.c */
void machine_dollar(struct machine *machine, const char *line);

/** Settings changed: limits of the planner and timing of prep anew. Rates above the board's are clamped and
 * reported. */
void machine_apply_settings(struct machine *machine);

/** ok or error:N. */
void machine_answer(struct machine *machine, enum status status);

/** Start the stages of machine->command. machine/task.c */
void task_begin(struct machine *machine);

/** Carry the current line on. @return true when it came further. */
bool task_poll(struct machine *machine);

/** Banner and what belongs to it. machine/report.c */
void report_banner(struct machine *machine);

/** <State|MPos:...|FS:...> */
void report_status(struct machine *machine);

/** [MSG:text] */
void report_message(struct machine *machine, const char *text);

#endif
