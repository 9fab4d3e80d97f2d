/* SPDX-License-Identifier: MIT
 * The machine behind the host controller: switches, probe, door, buttons, e-stop, spindle.
 *
 *   step edges -> true position -> switches and probe surface -> levels of the input lines
 *   virtual_set(), virtual_at() -------------------------------^
 *
 * The true position is where the machine really is: it counts pulses and knows nothing of what the
 * controller believes. A switch or the probe changes its level exactly at a step, before the next step event,
 * and the controller's edge interrupt follows immediately. Nothing is simulated until virtual_travel(),
 * virtual_surface() or an event asks for it, so a plain simulation costs nothing. Positions are steps, so
 * that tests can be exact; one thread, as the host.
 */
#ifndef WIFICNC_PC_VIRTUAL_H
#define WIFICNC_PC_VIRTUAL_H

#include "base/axis.h"
#include "base/quadrature.h"
#include "gcode/gcode.h"
#include "virtual_spindle.h"

#include <stdbool.h>
#include <stdint.h>

struct host;
struct hal;
struct hal_inputs;

/** The input lines. Limits: VIRTUAL_LIMIT_MIN + axis, VIRTUAL_LIMIT_MAX + axis; home switches: VIRTUAL_HOME +
 * axis; VIRTUAL_SECOND_ of the second motors. */
enum virtual_input {
    VIRTUAL_LIMIT_MIN = 0,
    VIRTUAL_LIMIT_MAX = VIRTUAL_LIMIT_MIN + AXIS_COUNT,
    VIRTUAL_PROBE = VIRTUAL_LIMIT_MAX + AXIS_COUNT,
    VIRTUAL_DOOR,  /* active: open */
    VIRTUAL_ESTOP, /* active: its contact is open */
    VIRTUAL_HOLD,
    VIRTUAL_START,
    VIRTUAL_RESET,
    VIRTUAL_SECOND_MIN,
    VIRTUAL_SECOND_MAX = VIRTUAL_SECOND_MIN + AXIS_COUNT,
    VIRTUAL_DIGITAL = VIRTUAL_SECOND_MAX + AXIS_COUNT, /* P0 .. of M66; active: high */
    VIRTUAL_HOME = VIRTUAL_DIGITAL + DIGITAL_INPUT_COUNT,
    VIRTUAL_SECOND_HOME = VIRTUAL_HOME + AXIS_COUNT,
    VIRTUAL_TOOLSETTER = VIRTUAL_SECOND_HOME + AXIS_COUNT,
    VIRTUAL_DIAL_A, /* the dial's two lines ... */
    VIRTUAL_DIAL_B,
    VIRTUAL_DIAL_AXIS,                                 /* ... and its switches: X .. C ... */
    VIRTUAL_DIAL_X10 = VIRTUAL_DIAL_AXIS + AXIS_COUNT, /* ... and the distance of a detent */
    VIRTUAL_DIAL_X100,
    VIRTUAL_INPUT_COUNT
};

enum { VIRTUAL_EVENTS_MAX = 256 };

struct virtual_event {
    uint64_t t_ticks;
    uint8_t input; /* enum virtual_input */
    bool active;
};

/** What the controller commands. */
struct virtual_outputs {
    int spindle_direction;          /* -1, 0, 1 */
    float spindle_rpm;              /* commanded */
    uint16_t spindle_duty;          /* PWM, 0 .. 65535 */
    uint8_t coolant;                /* COOLANT_ bits */
    bool motors;                    /* powered */
    bool enable_high;               /* level of their enable line: low switches on unless $4 */
    uint8_t digital;                /* M62 .. M65: bit n = Pn */
    float analog_pct[ANALOG_COUNT]; /* M67, M68 */
    uint16_t servo_us;              /* pulse of the RC servo; 0: none */
    uint32_t pump_ticks;            /* wave of the charge pump; 0: off */
};

/** Only virtual.c and host.c look inside. */
struct virtual_machine {
    uint64_t forced;                           /* inputs held active by hand, bit = enum virtual_input */
    uint64_t levels;                           /* inputs active now */
    uint8_t lock;                              /* enum hal_lock */
    int32_t position[AXIS_COUNT];              /* true position, steps */
    int32_t low[AXIS_COUNT], high[AXIS_COUNT]; /* switches: active at or beyond */
    axis_mask_t has_low, has_high;
    int32_t home_low[AXIS_COUNT], home_high[AXIS_COUNT]; /* home switches, likewise */
    axis_mask_t has_home;
    axis_mask_t ganged;                    /* axes with a second motor */
    int32_t second[AXIS_COUNT];            /* true positions of the second motors, steps */
    axis_mask_t first_waits, second_waits; /* motors that make no steps now */
    bool has_surface;
    int32_t surface;
    int32_t setter[AXIS_COUNT]; /* the tool setter: middle, and its top */
    int32_t setter_radius;      /* 0: none is there */
    bool core_xy;               /* X and Y switches are those of X = (A + B) / 2 and Y = (A - B) / 2 */
    axis_mask_t blind[2]; /* axes without switches whose driver does not see their end now: first motors,
                           * second ones */
    bool follows;         /* the true position matters: every step edge is looked at */
    struct virtual_event events[VIRTUAL_EVENTS_MAX]; /* sorted by time, the next one last */
    uint32_t event_count;
    struct virtual_outputs outputs;
    float analog_pct[ANALOG_COUNT]; /* analog inputs */
    struct quadrature dial;         /* as hardware counts its lines: at every edge */
    int32_t dial_left;              /* edges that a hand still turns, signed; at even times: */
    uint64_t dial_ticks, dial_each_ticks;
    struct virtual_spindle spindle;
    bool driven; /* a drive on the bus turns the spindle, not the pins */
    int drive_direction;
    double drive_rpm;
};

/** Number of an input by name: "limit-min-x" .. "limit-max-c", "limit-x" (= min), "second-min-x" .., "home-x"
 * .., "second-home-x" .., "probe", "door", "estop", "hold", "start", "reset", "toolsetter", "input-0" ..,
 * "dial-line-a", "dial-line-b", "dial-x" .. "dial-c" (its axis switch), "dial-x10", "dial-x100".
 * @return -1: there is none of that name. */
int virtual_input_number(const char *name);

/** Now, before the controller continues. The level is what is set here or what the position says, whichever
 * is active. The controller notices within host_run(). @param input  enum virtual_input */
void virtual_set(struct host *host, int input, bool active);

/** [tests] As a target that keeps the machine stopped. @param lock  enum hal_lock */
void virtual_lock(struct host *host, uint8_t lock);

/** At a virtual time; the past means now. Events of the same time happen in the order given.
 * @return false: no such input, or VIRTUAL_EVENTS_MAX are waiting. */
bool virtual_at(struct host *host, uint64_t t_ticks, int input, bool active);

/** Limit switches of an axis: active while position <= low and while position >= high, true steps. */
void virtual_travel(struct host *host, unsigned axis, int32_t low_steps, int32_t high_steps);

/** Home switch of an axis: active while position <= low and while position >= high, true steps. */
void virtual_home(struct host *host, unsigned axis, int32_t low_steps, int32_t high_steps);

/** No limit and no home switches on this axis (power-on state). */
void virtual_no_travel(struct host *host, unsigned axis);

/** The probe touches while Z <= z_steps, true steps. */
void virtual_surface(struct host *host, int32_t z_steps);

/** Nothing to probe (power-on state). */
void virtual_no_surface(struct host *host);

/** A tool setter: it is touched while Z <= at_steps[AXIS_Z], and neither X nor Y is farther than this from
 * its middle; true steps. @param radius_steps  0: it is not there (power-on state) */
void virtual_toolsetter(struct host *host, const int32_t at_steps[AXIS_COUNT], int32_t radius_steps);

/** A hand turns the dial by so many detents, its edges at even times; after what is under way.
 * @param detents_s  > 0, also of what is under way */
void virtual_dial(struct host *host, int32_t detents, double detents_s);

/** [tests] Noise: both lines of the dial change in one moment. */
void virtual_dial_slip(struct host *host);

/** Puts the machine here, as if pushed by hand; power-on is 0 everywhere. */
void virtual_place(struct host *host, const int32_t steps[AXIS_COUNT]);

/** The gantry is crooked now: the second motor of this axis is so many steps beyond the first. */
void virtual_skew(struct host *host, unsigned axis, int32_t steps);

/** Where the second motor is; as virtual_position() for axes without one. */
void virtual_second_position(const struct host *host, int32_t steps[AXIS_COUNT]);

/** struct hal_ganged.take and .hold of the virtual machine. */
void virtual_take_motor(struct hal *hal, unsigned axis, unsigned from);
void virtual_hold_motors(struct hal *hal, axis_mask_t first, axis_mask_t second);

/** Where it is (the first motors): pulses since the last virtual_place(), exact. */
void virtual_position(const struct host *host, int32_t steps[AXIS_COUNT]);

/** Level of an analog input, 0 .. 100 percent; 0 at power-on. */
void virtual_analog(struct host *host, unsigned input, float percent);

/** How fast the spindle changes its speed, rpm/s; 0 = immediately (power-on state). */
void virtual_spindle_ramp(struct host *host, float rpm_s);

/** The work brakes the spindle to so much less than is commanded; negative: it turns faster. It changes
 * its speed by the ramp. @param percent  -100 .. 100 */
void virtual_spindle_load(struct host *host, float percent);

/** Counts of its encoder in a revolution; 0: as many as $88 says (power-on). */
void virtual_spindle_encoder(struct host *host, uint32_t counts_per_rev);

/** [tests] Angle of the spindle at a time not before its last change, revolutions since power-on; where the
 * encoder counts from 0. */
double virtual_spindle_angle(const struct host *host, uint64_t t_ticks);

/** Real spindle speed now, rpm, negative = counter-clockwise. */
float virtual_spindle_rpm(const struct host *host);

/** What the controller commands now. */
void virtual_outputs(const struct host *host, struct virtual_outputs *out);

/** Inputs active now, bit = enum virtual_input. */
uint64_t virtual_levels(const struct host *host);

/* --- for host.c
 * ---------------------------------------------------------------------------------------------- */

/** One step edge. @return true when a level changed. Only while machine->follows. */
bool virtual_step(struct virtual_machine *machine, uint8_t step_mask, uint8_t dir_mask);

/** Perform all events due. @return true when a level changed. */
bool virtual_events(struct virtual_machine *machine, uint64_t now_ticks);

/** Time of the next event, or UINT64_MAX. */
uint64_t virtual_next_ticks(const struct virtual_machine *machine);

/** Levels as the controller's pins see them: limits and probe to ground, so low when active. */
void virtual_read(const struct virtual_machine *machine, struct hal_inputs *inputs);

/** The controller sets its outputs. */
void virtual_command(struct virtual_machine *machine, const struct virtual_outputs *outputs,
                     uint64_t now_ticks, uint32_t timer_hz);

/** Levels again from position, surface and forced inputs. @return true when one changed. */
bool virtual_update(struct virtual_machine *machine);

#endif
