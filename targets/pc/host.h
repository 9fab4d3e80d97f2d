/* SPDX-License-Identifier: MIT
 * The whole controller on a PC, in virtual time: the core, a step timer and pins, and a byte stream to talk
 * to it.
 *
 * Time stops while the core computes (an infinitely fast processor) and jumps from step event to step
 * event. Same input, same output, always. Not thread-safe: one thread per host object; many objects may live
 * in one process. */
#ifndef WIFICNC_PC_HOST_H
#define WIFICNC_PC_HOST_H

#include "base/axis.h"
#include "device/device.h"
#include "machine/motors.h"
#include "machine/pendant.h"
#include "trace.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct hal_store;

/** In whose time the controller works (targets/chip/task_periods.h). */
enum host_tasks_of {
    HOST_TASKS_FREE, /* everything is looked at all the time */
    HOST_TASKS_ESP32,
    HOST_TASKS_PIC32MZ,
};

/** Added to the counts a detent of a dial: it has an axis switch. */
enum { HOST_DIAL_SELECTS = 8 };

/** What a board fixes. */
struct host_board {
    uint32_t timer_hz;         /* step timer, 1 MHz .. 100 MHz */
    uint32_t step_pulse_ns;    /* step high time, and at least the same low */
    uint32_t dir_setup_ns;     /* direction stable before a step */
    uint32_t max_step_rate_hz; /* of one axis; rates above are clamped and reported */
    uint8_t axis_count;        /* 1 .. AXIS_COUNT, in the order XYZABC */
    axis_mask_t ganged;        /* axes with a second motor */
    uint8_t missing_outputs;   /* BOARD_OUTPUT_ bits of machine/machine.h that it lacks */
    uint8_t digital_inputs;    /* of M66, 0 .. DIGITAL_INPUT_COUNT */
    uint8_t analog;            /* 1: analog inputs and outputs (M66 .. M68), four of each */
    uint16_t motors_wake_us;   /* from powered to the first step */
    uint8_t digital_outputs;   /* of M62 .. M65, 0 .. OUTPUT_COUNT */
    uint8_t encoder;           /* 1: of the spindle, with index */
    axis_mask_t home_axes;     /* axes with home switches of their own */
    uint8_t tasks;             /* enum host_tasks_of */
    uint8_t default_pulse_us;  /* what $0 starts at; 0: step_pulse_ns */
    uint32_t step_spread_ns;   /* from step to step, beyond the pulse and a pause as long */
    uint32_t step_grid_ns;     /* pulses and pauses are whole ones of it; 0: any */
    uint16_t look_ahead;       /* pieces of path, 32 or more; 0: PLAN_SIZE */
    uint16_t laser_marks;      /* changes of S in it; 0: POWER_MARKS */
    uint8_t toolsetter;        /* 1: a second probe input */
    uint16_t switchless; /* motors without a limit (of home_axes: a home switch): bit n = the first one of
                          * axis n, bit AXIS_COUNT + n = its second one */
    uint8_t spindle_bus; /* 1: RS-485 for a spindle drive */
    const struct device_board *device;                      /* is copied; NULL: no pins */
    uint16_t pump_hz;                                       /* what $73 starts at; 0: no charge pump */
    uint32_t pump_clock_hz, pump_ticks_min, pump_ticks_max; /* of its timer */
    uint32_t driver[MOTOR_COUNT * AXIS_COUNT]; /* with registers: host_drivers_init(); 0: a plain one */
    uint8_t dial;                              /* counts a detent, and HOST_DIAL_SELECTS; 0: no dial */
    uint8_t restart;          /* enum hal_restart_cause: it starts after this; 0: it is switched on */
    uint32_t restart_address; /* where the program was; 0: not known */
};

/** Pieces of path. */
enum { HOST_LOOK_AHEAD_MIN = 32 };

struct host;

/** Why host_run() came back. */
enum host_wait {
    HOST_IDLE,   /* nothing to do: all input is answered and nothing moves (or only input can bring it on) */
    HOST_ROOM,   /* the receive buffer has room again and motion continues */
    HOST_BUDGET, /* max_events step events were run */
    HOST_TIME,   /* the time asked for has come (host_run_until) */
};

/** @return NULL when memory is short or the board is out of range. Settings start at their defaults. */
struct host *host_create(const struct host_board *board);

/** As host_create(), but settings, offsets and startup lines are kept in this file. It is made when something
 * is stored; a damaged one gives defaults, and the controller says so. @param store_path  NULL: nothing is
 * kept */
struct host *host_open(const struct host_board *board, const char *store_path);

/** The same with any store. @param store_ctx  outlives the controller */
struct host *host_open_stored(const struct host_board *board, const struct hal_store *store,
                              const void *store_ctx);
void host_destroy(struct host *host);

/** [tests] Put bytes on the controller's stream as a UART does: it cannot wait, and what finds no room is
 * lost and reported. */
void host_write_or_lose(struct host *host, const char *bytes, size_t count);

/** Put bytes on the controller's stream. @return bytes taken: 0 .. free receive buffer; the rest must come
 * again. */
size_t host_write(struct host *host, const char *bytes, size_t count);

/** Take what the controller said. @return bytes copied, 0 = nothing more. */
size_t host_read(struct host *host, char *bytes, size_t size);

/** Let the controller work: parse, plan and step. @param max_events > 0, step-timer events before coming
 * back. */
enum host_wait host_run(struct host *host, uint64_t max_events);

/** As host_run(), but not beyond this virtual time: HOST_TIME then. HOST_IDLE may come before it. */
enum host_wait host_run_before(struct host *host, uint64_t max_events, uint64_t t_ticks);

/** Let the controller work until this virtual time, also when it has nothing to do: for a clock outside that
 * leads. With host_input_follows(host, 0) it comes back with HOST_TIME and then it is t_ticks, or later if it
 * was so before. */
enum host_wait host_run_until(struct host *host, uint64_t t_ticks);

/** Real time, for senders: as host_run_until(), but the controller is left alone with its input. No
 * look-ahead is waited for, none is cut short.
 * @return HOST_TIME, or HOST_BUDGET: max_events step-timer events were run and it is not t_ticks yet */
enum host_wait host_run_paced(struct host *host, uint64_t t_ticks, uint64_t max_events);

/** Take input in: no time passes, no step is made. */
void host_act(struct host *host);

/** Parts of a firmware that can be kept from working while step interrupts and edges of inputs continue. */
enum host_side {
    HOST_CONTROLLER, /* the task of machine_poll(): lines, planning, states */
    HOST_MOTION,     /* the task that feeds the step interrupt; with one loop (PIC32MZ) the same as above */
    HOST_READER,     /* bytes that arrive wait outside of the controller */
    HOST_SIDES
};

/** [tests] Keep a side from working from a virtual time on (the past means now) for this long.
 * @return false: there is no such side, or too many stalls wait */
bool host_stall(struct host *host, enum host_side side, uint64_t from_ticks, uint64_t ticks);

/** Stalls at random times, one at a time, the same ones for the same seed. */
struct host_random_stalls {
    uint64_t seed;
    uint32_t sides;      /* bit = enum host_side; 0: no further stall */
    uint32_t gap_ms;     /* between two of them on average */
    uint32_t longest_ms; /* > 0 */
};
void host_stall_randomly(struct host *host, const struct host_random_stalls *stalls);

/** [tests] From now on the controller looks only so often. @param period_us  > 0 */
void host_look_each(struct host *host, uint32_t period_us);

/** When it will continue by itself, now at the earliest; UINT64_MAX: never without input. */
uint64_t host_next_ticks(struct host *host);

/** The sender's connection has ended: machine_sender_lost(). */
void host_sender_lost(struct host *host, bool lines_wait);

/** machine_notice(). */
bool host_notice(const struct host *host, unsigned number, char *text, size_t size);

/** A line or motion is under way. */
bool host_is_busy(const struct host *host);

/** For a pendant next to the sender: machine/pendant.h. */
enum machine_reads host_reads(const struct host *host);
void host_pendant_lost(struct host *host);
uint32_t host_drop_unread(struct host *host);
void host_set_mpg(struct host *host, bool on);

/** machine_stopped_by_other() */
void host_stopped_by_other(struct host *host);

/** board.start_id (machine/board.h), which a host does not have by itself: virtual time has no chance. */
void host_set_start(struct host *host, uint32_t start_id);

/** Virtual time, ticks of the board's timer from power-on. */
uint64_t host_time_ticks(const struct host *host);

/** State as the status report shows it: "Idle", "Hold:0", ... */
const char *host_state(const struct host *host);

/** The program waits for ~, at M0 or M6. */
bool host_is_paused(const struct host *host);

/** The program waits for a tool at M6. @param tool  its number */
bool host_awaits_tool(const struct host *host, int32_t *tool);

/** When the last alarm came; 0: none has. After it the controller is quiet for a while. */
uint64_t host_alarm_ticks(const struct host *host);

/** Spans of dwells begun so far, mod 256, as trace events count them. */
uint8_t host_dwells(const struct host *host);

/** The line that is being moved, counted from power-on (struct machine, lines); any older one before the
 * first motion. */
uint32_t host_line_now(const struct host *host);

/** Step counters: exactly the pulses that left the pins, signed, and host_shift_steps(). */
void host_position_steps(const struct host *host, int32_t steps[AXIS_COUNT]);

/** Steps by which homing has moved the counters against the pulses, since power-on. */
void host_shift_steps(const struct host *host, int32_t steps[AXIS_COUNT]);

/** Tell the controller whether more input will come immediately (a file, default 1) or not (0 at the end of
 * the file). */
void host_input_follows(struct host *host, int follows);

/** The event trace; add consumers to it before running. */
struct trace *host_trace(struct host *host);

/** A segment, or a part of it with one S of a laser, and where that begins and ends: machine position of
 * every motor, with its fraction of a step. The segment's steps are those of all its parts. */
struct segment;
struct host_segment {
    const struct segment *segment;
    double from_steps[AXIS_COUNT], to_steps[AXIS_COUNT];
};

/** From now on this one gets every segment of the planner, in order, before its steps are made. One watcher
 * at a time. */
typedef void host_segment_watcher(void *ctx, const struct host_segment *moved);
void host_watch_segments(struct host *host, host_segment_watcher *watch, void *ctx);

/** The controller itself, for looking at what has no function here. Nothing of it is changed from outside. */
struct machine;
const struct machine *host_machine(const struct host *host);

/** The move of the line answered last. @return false: it had none, or it was taken before */
struct gcode_move;
bool host_take_move(struct host *host, struct gcode_move *out);

/** Work counters since host_create(). */
struct host_counters {
    uint64_t step_events;       /* step-timer interrupts that stepped at least one axis */
    uint64_t timer_events;      /* all step-timer interrupts (with oversampling and waits) */
    uint64_t segments;          /* segments run */
    uint64_t spans;             /* spans run */
    uint64_t blocks;            /* planner blocks */
    uint64_t lines;             /* lines answered */
    uint64_t lookahead_starved; /* motion had to stop for want of look-ahead although more moves came */
    uint64_t underruns;         /* motion had to slow down because a side of the controller was late */
    uint64_t plan_unmet;        /* struct timing, unmet: a fault of the planner if not 0 */
};
void host_counters(const struct host *host, struct host_counters *out);

/** Steps per mm now in force, per axis ($100..). */
void host_steps_per_mm(const struct host *host, float out[AXIS_COUNT]);

/** What is stored could not be read, and no one has acknowledged it yet. */
bool host_store_is_damaged(const struct host *host);

/** Static RAM of one controller in bytes: struct machine with all its buffers. */
size_t host_core_ram_bytes(void);

#endif
