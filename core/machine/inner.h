/* SPDX-License-Identifier: MIT
 * What the files of core/machine say to each other. [task] unless noted. */
#ifndef WIFICNC_MACHINE_INNER_H
#define WIFICNC_MACHINE_INNER_H

#include "machine/machine.h"

/** What can happen to the state. */
enum machine_event {
    MACHINE_STARTS,  /* motion begins */
    MACHINE_RESTS,   /* everything is done */
    MACHINE_HOLDS,   /* ! or M0 */
    MACHINE_RESUMES, /* ~ */
    MACHINE_JOGS,
    MACHINE_OPENS, /* the door */
    MACHINE_ALARMS,
    MACHINE_UNLOCKS, /* $X */
    MACHINE_CHECKS,  /* $C */
    MACHINE_HOMES,   /* $H */
    MACHINE_SLEEPS,  /* $SLP */
    MACHINE_RESETS,
    MACHINE_EVENT_COUNT
};

/** Grbl's pause before a job goes on behind a closed door. */
#define SPINDLE_RUN_UP_US 4000000u

/* state.c */
/** Go on to the next state. @return false: the event means nothing in this state, and nothing changed. */
bool machine_transition(struct machine *machine, enum machine_event event);
/** $# $I $N ... are possible. */
bool machine_is_idle_or_alarm(const struct machine *machine);
/** Lines are read in this state. */
bool machine_reads(const struct machine *machine);
/** Tasks go on in this state. */
bool machine_works(const struct machine *machine);
/** Grbl's longer report intervals. */
bool machine_is_busy(const struct machine *machine);

/* machine.c */
void machine_apply_settings(struct machine *machine);
void machine_answer(struct machine *machine, enum status status);
/** Nothing moves and nothing will before a resume: at rest, or held. */
bool machine_is_stopped(const struct machine *machine);
/** Have work(arg) done where the step ISR is started and stopped. */
void machine_on_motion_side(struct machine *machine, void (*work)(void *arg), void *arg);
/** Stop at once, forget all that was planned and stand where the pins have brought us. */
void machine_halt(struct machine *machine);
/** The counters are right and motion stands: forget all that was planned and go on from `position`. */
void machine_stand_at(struct machine *machine, const int32_t position[AXIS_COUNT]);
/** Forget what was planned and stand where the pins have brought us. */
void machine_drop_motion(struct machine *machine);
/** Feed override in force for what is done now; jogs, probing and homing have none. */
void machine_apply_override(struct machine *machine);
/** $0 as the board brings it: its step pulse in whole us, rounded up. */
uint16_t machine_board_pulse_us(const struct machine *machine);
/** Feed override of the program, percent: 100 while M49 or M50 P0 have switched it off. */
uint8_t machine_feed_pct(const struct machine *machine);
void machine_timer_start(const struct machine *machine, struct machine_timer *timer, uint32_t us);
bool machine_timer_runs(const struct machine *machine, const struct machine_timer *timer);

/** Machine position of the tool, mm. */
void machine_tool_mm(const struct machine *machine, const int32_t steps[AXIS_COUNT], double mm[AXIS_COUNT]);
/** Where the axes stand that have switches, steps: the tool's where the joints are coupled. [any] */
void machine_axis_steps(const struct machine *machine, int32_t steps[AXIS_COUNT]);

/* reach.c */
/** The tool can go there, and every joint's counter with it: STATUS_OK, STATUS_BAD_TARGET or
 * STATUS_UNREACHABLE. From where the newest move ends. */
enum status reach_move(const struct machine *machine, const struct gcode_move *move);

/* compute.c */
/** A line that gcode_line() refused may have expressions: compute it into machine->command, and take its
 * assignments if it is accepted.
 *  @param refused  what gcode_line() said, and what is said of a line without expressions */
enum status compute_line(struct machine *machine, const char *line, enum status refused);

/* reset.c */
/** ALARM:n, then quiet for half a second. The caller has stopped the motion. */
void machine_alarm(struct machine *machine, enum alarm alarm);
/** An alarm after which only a reset helps. */
void machine_alarm_critical(struct machine *machine, enum alarm alarm);
/** Stop at once, forget, and have the banner printed. @param alarm  ALARM_NONE: alarm 3 if that stopped
 * motion */
void machine_reset(struct machine *machine, enum alarm alarm);
/** Print the banner and what belongs to it. */
void machine_restart(struct machine *machine);

/* realtime.c */
bool realtime_poll(struct machine *machine);
/** Hold, door and jog cancel on their way. */
bool suspend_poll(struct machine *machine);
void suspend_open_door(struct machine *machine);
/** A hold that waits comes now, unless it must wait on. */
void realtime_release(struct machine *machine);
/** M48 .. M53: OVERRIDE_ bits in force from now on; a hold that waited for M53 comes now. */
void realtime_enable(struct machine *machine, uint8_t overrides);

/** As `!`. */
void realtime_hold(struct machine *machine);

/* sender.c */
bool sender_lost_poll(struct machine *machine);
/** Nobody sees the axes move any more: alarm 6, and the banner says why. */
void sender_stop_homing(struct machine *machine);
/** What a client that connects must know, without [MSG: ]; NULL: nothing. */
const char *sender_notice(const struct machine *machine);

/* inputs.c */
bool inputs_poll(struct machine *machine);
/** Take the switches as they are now, as if an edge had come. */
void inputs_look(struct machine *machine);
/** Limit switches that are hit. */
axis_mask_t inputs_limits(const struct machine *machine);
/** Switches that homing looks for, when they are hit: the home lines, or of axes without one the limits at
 * the ends to which they home ($23). @param motor  FIRST_MOTOR or SECOND_MOTOR */
axis_mask_t inputs_homing(const struct machine *machine, unsigned motor);
/** The switches are taken as they are, without an edge; at power-on. */
void inputs_begin(struct machine *machine);
/** Axes with a second motor. */
axis_mask_t inputs_ganged(const struct machine *machine);
/** The probe touches, by $6. */
bool inputs_probe(const struct machine *machine, const struct hal_inputs *inputs);
bool inputs_door_is_open(const struct machine *machine);

/* outputs.c */
void outputs_set(struct machine *machine, enum gcode_spindle spindle, float rpm, uint8_t coolant);
void outputs_apply(struct machine *machine);
void outputs_off(struct machine *machine);
/** Spindle speed that is put out now, rpm; 0 = off. */
float outputs_rpm(const struct machine *machine);
/** Coolant that is put out now, COOLANT_ bits. */
uint8_t outputs_coolant_bits(const struct machine *machine);
/** The laser's power follows the motion; and a change of $32 switches the spindle off. */
void outputs_poll(struct machine *machine);

/* motors.c */
/** Power-on: off. [task] */
void motors_init(struct machine *machine);
/** [motion side] @return false: they wake up, no steps yet */
bool motors_poll(struct machine *machine);
/** Until they are awake; 0: they are, or off. */
uint32_t motors_wait_us(const struct machine *machine);

/* torque.c */
void torque_poll(struct machine *machine);
/** Digital outputs that are torque lines. */
axis_mask_t torque_mask(const struct machine *machine);
/** All digital outputs, torque lines among them. */
void torque_put_out(struct machine *machine);

/* servo.c */
void servo_poll(struct machine *machine);

/* task.c */
/** Start the stages of machine->command. */
void task_begin(struct machine *machine);
/** Carry the current line on. @return true when it came further. */
bool task_poll(struct machine *machine);
/** The pause of M0 or M6 is over. */
void task_resume(struct machine *machine);
void task_set_position(struct machine *machine, const double target_mm[AXIS_COUNT]);
/** The target lies within the travel, or soft limits are off. */
bool task_in_travel(const struct machine *machine, const double target_mm[AXIS_COUNT]);
bool task_rest_reached(struct machine *machine);
/** The target lies outside the travel, and so everything comes to a controlled stop. */
bool task_leaves_travel(struct machine *machine, const double target_mm[AXIS_COUNT]);
/** One straight move of the current line. @return false: no room now */
bool task_push_line(struct machine *machine, const double target_mm[AXIS_COUNT], bool rapid, float feed_mm_s,
                    float duration_s);
/** Spindle and coolant, but not in check mode. */
void task_set_outputs(struct machine *machine, enum gcode_spindle spindle, uint8_t coolant);

/* await.c: M66 */
/** It stands: take the input as it is, or begin to wait. @param next  the stage behind it */
enum task_stage await_begin(struct machine *machine, enum task_stage next);
/** The awaited input may have come: then the dwell ends. */
void await_poll(struct machine *machine);

/* drill.c: canned cycles */
void drill_begin(struct machine *machine);
/** @return TASK_NONE when the cycle is done */
enum task_stage drill_poll(struct machine *machine);

/* thread.c: motion that follows the spindle */
/** The spindle can be followed at this speed: STATUS_OK or STATUS_SPINDLE_TOO_FAST. */
enum status thread_check(const struct machine *machine, const struct gcode_command *command);
void thread_start(struct machine *machine);
/** @return TASK_NONE when the move is done */
enum task_stage thread_poll(struct machine *machine);
/** A motion of the current line begins: is its feed per revolution? */
void thread_note_feed(struct machine *machine);
/** $88 has changed. */
void thread_set_encoder(struct machine *machine);
/** G95: by how much feeds differ from the planned ones, else 1. */
float thread_feed_factor(const struct machine *machine);
/** Look at the encoder. */
void thread_watch(struct machine *machine);
/** A hold or an open door comes now: it must wait until the tool is out of the work. */
bool thread_defers(struct machine *machine);
/** What was under way is given up. */
void thread_forget(struct machine *machine);

/* jog.c */
enum status jog_begin(struct machine *machine, const char *text);
enum task_stage jog_poll(struct machine *machine);
void jog_cancel(struct machine *machine);
void jog_end_cancel(struct machine *machine);

/* probe.c */
enum task_stage probe_begin(struct machine *machine);
enum task_stage probe_poll(struct machine *machine);

/* homing.c */
/** @param letters  axes behind $H, "" = all of them */
enum status homing_begin(struct machine *machine, const char *letters);
enum task_stage homing_poll(struct machine *machine);
/** Axes that $H would home and whose position is not trusted. */
axis_mask_t homing_unknown(const struct machine *machine);
/** 1, or -1 where $23 says that the axis homes towards its negative end. */
double homing_direction(const struct machine *machine, unsigned axis);

/* host.c */
/** The step ISR is halted, and nothing has been forgotten yet. */
void host_note_done(struct machine *machine);
/** Motion of a network host goes on. @return true when anything was done */
bool host_poll(struct machine *machine);
/** The motion side is halted: what a host has queued is given up. */
void host_drop(struct machine *machine);
/** The machine's limits have changed. */
void host_set_limits(struct machine *machine, const struct motion_limits *limits);
/** Nothing of a host comes before a resume, or at all. (The ring may still hold motion.) */
bool host_is_quiet(const struct machine *machine);
/** Take all segments that follow without a gap.
 * @return false: the one at the feed's head leaves the travel, and is not taken */
bool host_take_segments(struct machine *machine);

/* preempt.c: a host interrupts a job of the text side, and gives motion back */
/** There is such a job, and a host may have motion: now, or when it has slowed down. */
bool preempt_may(const struct machine *machine);
/** preempt_may(): the job slows down; or motion is the host's again, because the job waits already. */
void preempt_begin(struct machine *machine);
/** The host lets go: the job waits for ~. @return false: something of the host still moves or waits */
bool preempt_release(struct machine *machine);
/** A hold was asked for. @return true: the job slows down already, and then the host's motion is held */
bool preempt_hold(struct machine *machine);
/** A hold or the door is over: the job goes on if it may, and what the planner has. */
void preempt_resume(struct machine *machine);
bool preempt_poll(struct machine *machine);

/* command.c */
/** $number=value, in force at once and not kept. */
enum status command_set(struct machine *machine, uint16_t number, double value);
/** A $ line (without line end). Answers it, unless it became a task. */
void command_line(struct machine *machine, const char *line);

/* keep.c: what survives a power cut. While stored data is damaged nothing is stored. */
/** G54 .. G59, G28, G30 as they are stored; G59.1 .. G59.3 have their own key. */
enum { KEPT_WCS = 6, KEPT_WCS_MORE = WCS_COUNT - KEPT_WCS };
struct kept_offsets {
    double row_mm[KEPT_WCS + 2][AXIS_COUNT];
};
void keep_load(struct machine *machine);
/** Something stored could not be read, and the user has not acknowledged that: nothing moves. */
bool keep_is_damaged(const struct machine *machine);
/** Print what is damaged, and what to do, if something is. */
void keep_report(struct machine *machine);

/* keep_write.c: each of these begins to store, or has stored already when it returns; keep_is_busy() */
struct store keep_store(const struct machine *machine);
/** A write is under way: no further line may begin, and nothing else may be stored. */
bool keep_is_busy(const struct machine *machine);
/** @return true when a write has come further */
bool keep_poll(struct machine *machine);
/** What is in force now. @param keys  KEEP_BIT()s; they are stored together
 * @return false: not stored, and the text side was told */
bool keep_save(struct machine *machine, unsigned keys);
/** The line of $Nx= that was just executed. */
void keep_startup(struct machine *machine);
/** The user has seen what is damaged: what is in force now is stored in place of it. */
void keep_acknowledge(struct machine *machine);
/** Also acknowledges damage; a reset follows. */
void keep_defaults(struct machine *machine, unsigned keys);

/* report.c */
void report_banner(struct machine *machine);
void report_status(struct machine *machine);
void report_message(struct machine *machine, const char *text);
/** Axes that homing could find and has not. Nothing when there is none. */
void report_not_homed(struct machine *machine);
/** `[MSG:` and how often motion slowed down because a task was late. */
void report_underruns(struct machine *machine);
/** `[MSG:` and how often the serial port has lost bytes. */
void report_gaps(struct machine *machine);
void report_tool_change(struct machine *machine);
void report_alarm(struct machine *machine, enum alarm alarm);
void report_changed_offset(struct machine *machine);
void report_changed_override(struct machine *machine);
/** mm in the unit of $13, with its decimals. */
void report_length(const struct machine *machine, double mm);
/** Rate in the unit of $13. */
void report_rate(const struct machine *machine, double mm_s);
void report_axes(const struct machine *machine, const double mm[AXIS_COUNT]);
/** Machine position of steps. */
void report_axes_steps(const struct machine *machine, const int32_t steps[AXIS_COUNT]);

/* list.c: answers of several lines */
void list_settings(struct machine *machine);
void list_offsets(struct machine *machine);
void list_probe(struct machine *machine);
void list_modes(struct machine *machine);
void list_build(struct machine *machine);
void list_codes(struct machine *machine);
void list_startup(struct machine *machine);

/* notes.c */
/** Lines are motion to come: of note->line (with number, rpm and feed). Ever growing lines. */
void notes_add(struct line_notes *notes, const struct line_note *note);
/** @return NULL: nothing was noted of this line */
const struct line_note *notes_find(const struct line_notes *notes, uint32_t line);
/** @return the N word of a source line; 0: none, or not known any more */
uint32_t notes_number(const struct line_notes *notes, uint32_t line);
/** Source line of the motion on the pins, or of the motion that a hold interrupts; 0 = none. */
uint32_t notes_line_now(const struct machine *machine);

#endif
