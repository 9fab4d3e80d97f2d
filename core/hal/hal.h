/* SPDX-License-Identifier: MIT
 * Cold tier of the HAL: what a target supplies to the task side. A missing function fails the link.
 * The hot tier is hal/hal_step.h, found by include path in targets/<target>/. Table: core/hal/README.md. */
#ifndef WIFICNC_HAL_HAL_H
#define WIFICNC_HAL_HAL_H

#include "base/axis.h"
#include "base/duty.h" // struct duty_register

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** A target's own context: outputs and clock of one machine. */
struct hal;

/** [task] Time since power-on, us; wraps at 2^32. On the host: virtual time. */
uint32_t hal_time_us(const struct hal *hal);

/** What the spindle is to do. A PWM output uses duty, a relay direction, a bus drive rpm. */
struct hal_spindle {
    int direction;   /* -1 counter-clockwise, 0 off, 1 clockwise */
    float rpm;       /* >= 0, overrides and $30 $31 applied; 0 when off */
    uint16_t duty;   /* as the PWM's register has it */
    bool keeps_duty; /* a laser: duty is hal_step_duty()'s */
};

/** [task] Nothing moves and the spindle is off: the PWM has this frequency from now on, and changes to it
 * without a pulse. After a change it is dark until the next duty. @param hz  $33
 * @return what its register shows now for no pulse, the shortest and the longest: no pulse is the same at
 * every frequency; all 0: there is no PWM */
struct duty_register hal_spindle_pwm(struct hal *hal, uint32_t hz);

/** [task] Takes effect immediately. */
void hal_spindle_set(struct hal *hal, const struct hal_spindle *spindle);

/** [task] Coolant outputs: COOLANT_ bits of gcode/gcode.h. Takes effect immediately. */
void hal_coolant_set(struct hal *hal, uint8_t bits);

/** [task] Digital outputs of M62 .. M65: bit n = Pn. All off at power-on. Takes effect immediately. */
void hal_digital_set(struct hal *hal, uint8_t bits);

/** [motion side] Power of all motors, $1; immediately. @param invert  $4: the enable line has the other level
 */
void hal_motors_set(struct hal *hal, bool on, bool invert);

/** [isr] E-stop: drivers and spindle are off when this returns, and no task was needed; coolant and the rest
 * follow by a task.
 * @param invert  $4, as of hal_motors_set() @param dark  the PWM's register without a pulse */
void hal_estop(struct hal *hal, bool invert, uint16_t dark);

/** Limit and home switches: level of the line, 1 = high ($5 says what it means; a home line that the board
 * file calls active high comes the other way round, so that $5 fits both kinds). */
struct hal_switches {
    axis_mask_t limit_min, limit_max;   /* a board with one line an axis reports it in both */
    axis_mask_t second_min, second_max; /* of the second motors; only hal_ganged.axes are looked at */
    axis_mask_t home, second_home;      /* only axes of machine_board.home_axes are looked at */
};

/** Why the target itself keeps the machine stopped, as a pressed e-stop does. */
enum hal_lock {
    HAL_LOCK_NONE,
    HAL_LOCK_UPDATE,    /* a firmware is being received */
    HAL_LOCK_SAFE_MODE, /* after crashes in a row */
    HAL_LOCK_STEPS_LOST /* step pulses have not left the pins */
};

/** Inputs, debounced: a switch is closed from its first edge until it has been open for some ms. probe: level
 * of the line, 1 = high ($6), toolsetter: the same ($72). The others: 1 = asks for its action; the board file
 * knows their polarity. */
struct hal_inputs {
    struct hal_switches switches;
    struct hal_switches pins; /* the same at this moment, not debounced */
    bool probe, toolsetter;
    bool door, hold, start, reset, estop;
    uint8_t lock;    /* enum hal_lock; estop is on with it */
    uint8_t digital; /* of M66: bit n = Pn, 1 = high */
};

/** [task or isr] Levels now. The target calls machine_edge_isr() at every edge of a limit, home or
 * e-stop line. */
void hal_inputs_read(const struct hal *hal, struct hal_inputs *inputs);

/** [isr, or where its interrupts are held off] Once, so many us from now or little later, the target calls
 * machine_switch_timer_isr(). Not while one is under way. @param us  1 .. 1000 */
void hal_switch_timer_start(struct hal *hal, uint32_t us);

/** Inputs that stop a G38: the probe, and on boards that have one a tool setter. */
enum hal_probe { HAL_PROBE, HAL_TOOLSETTER };

/** [task] From now on hal_step_probe() is true while this line has this level. Not while the step ISR looks
 * at it. */
void hal_probe_watch(struct hal *hal, enum hal_probe probe, bool high);

/** Analog inputs and outputs, E0 .. of M66 .. M68; percent of full scale. A machine without them has none of
 * this. All outputs are 0 at power-on. */
struct hal_analog {
    uint8_t inputs, outputs; /* 0 .. ANALOG_COUNT each */
    /** [task] 0 .. 100, takes effect immediately. */
    void (*set)(struct hal *hal, unsigned output, float percent);
    /** [task] @return 0 .. 100, now */
    float (*read)(const struct hal *hal, unsigned input);
};

/** An output for an RC servo. A machine without it has none of this. */
struct hal_servo {
    /** [task] From now on a pulse of this length every 20 ms; 0: none (power-on). */
    void (*set)(struct hal *hal, uint16_t pulse_us);
};

/** How characters of 8 bits look on a bus. */
enum hal_bus_parity { HAL_BUS_NONE, HAL_BUS_EVEN, HAL_BUS_ODD };

struct hal_bus_format {
    uint32_t baud;
    enum hal_bus_parity parity; /* one stop bit */
};

/** An RS-485 bus with one master, for a spindle drive. A machine without it has none of this.
 *
 * While bytes are sent, the driver of the bus is enabled (DE), from before the first start bit until the last
 * stop bit has left; what is received meanwhile is dropped, because it is what was sent. */
struct hal_bus {
    /** [task] Nothing is being sent. @return false: the hardware does not have this format */
    bool (*configure)(struct hal *hal, const struct hal_bus_format *format);
    /** [task] Begin to send; the bytes are copied. At most 16, and not while others are being sent. */
    void (*send)(struct hal *hal, const uint8_t *bytes, size_t count);
    /** [task] @return bytes that have come since, at most size, without waiting */
    size_t (*receive)(struct hal *hal, uint8_t *bytes, size_t size);
};

/** The UART or SPI of motor drivers with registers, all of them on this one bus. A machine without it has
 * none of this.
 *
 * On a UART there is one wire: what is sent may come back before the answer. By SPI (mode 3, high byte first)
 * as many bytes come back as are sent, when all of them are there, and the select line is low meanwhile. */
struct hal_driver_bus {
    /** [task] What was received before is dropped; begin to send. The bytes are copied; at most 30, and not
     * while others are being sent. @param select  which driver or chain, of those with lines of their own */
    void (*send)(struct hal *hal, uint8_t select, const uint8_t *bytes, size_t count);
    /** [task] @return bytes that have come since, at most size, without waiting */
    size_t (*receive)(struct hal *hal, uint8_t *bytes, size_t size);
};

/** A square wave that keeps a safety relay closed. It ends some 20 ms after the motion side was polled for
 * the last time, so that a program that hangs opens the relay. A machine without it has none of this. */
struct hal_pump {
    uint16_t default_hz;           /* the board's: $73 starts at it */
    uint32_t clock_hz;             /* of its timer */
    uint32_t ticks_min, ticks_max; /* of the clock, of a wave */
    /** [task] From now on waves of so many ticks; 0: none (power-on). */
    void (*set)(struct hal *hal, uint32_t ticks);
};

/** What a spindle's encoder says, all of one moment. Counts go up while the spindle turns clockwise (M3). */
struct hal_encoder_state {
    int32_t counts;   /* edges counted since power-on, signed; wraps */
    uint32_t edge_us; /* hal_time_us() of the newest of them: a count begins there. Where the hardware stamps
                       * no edges, of the read that has seen it first */
    int32_t index_counts; /* counts at the newest index pulse; filled in when index_seen */
    bool index_seen;      /* there was one since power-on */
};

/** The spindle's encoder. A machine without it has none of this. */
struct hal_encoder {
    bool has_index; /* a line that pulses once a revolution; without one the place at power-on serves */
    /** [task] At every machine_poll(); 10 us at most. The target counts and stamps the edges in hardware or
     * in an interrupt of its own, which may come while this reads: it reads until it has seen one moment. */
    void (*read)(struct hal *hal, struct hal_encoder_state *out);
};

/** What a dial (hand wheel) says, all of one moment. */
struct hal_dial_state {
    int32_t counts;   /* edges of its lines A and B since power-on, signed: up while A is before B; wraps */
    uint32_t slips;   /* signals that no wheel makes, as far as the hardware can tell; wraps */
    axis_mask_t axes; /* of its axis switch: lines that are on */
    bool x10, x100;   /* of its step switch */
};

/** A dial. A machine without it has none of this. */
struct hal_dial {
    uint8_t counts_per_detent; /* 1, 2 or 4 */
    bool selects_axis;         /* it has an axis switch; without one $400 says which axis */
    /** [task] At every machine_poll(); 10 us at most. The target counts the edges in hardware or in an
     * interrupt. */
    void (*read)(struct hal *hal, struct hal_dial_state *out);
};

/** Axes with two motors, one at each side of a gantry. Both make every step of their axis; the target's step
 * masks see to that, and the step ISR knows nothing of it. Homing lets one of them wait, so that each finds
 * its own switch. A machine without such axes and without a driver to spare has none of this. */
struct hal_ganged {
    axis_mask_t axes;
    axis_mask_t fixed;    /* of them: the second motor is the board file's */
    axis_mask_t switched; /* of them: the second motor has a limit, or of home_axes a home switch */
    axis_mask_t spare;    /* axes whose driver take() can make the second motor of an earlier axis */
    /** [start, nothing moves] The driver of axis `from`, which is no axis any more, is the second motor of
     * `axis`: its pins, and its limit and home switch as second ones. */
    void (*take)(struct hal *hal, unsigned axis, unsigned from);
    /** [task, nothing moves; the last pulse may still be under way, and is not cut short] From now on the
     * first motors of these axes make no steps, nor the second ones of those; 0, 0: all make theirs. */
    void (*hold)(struct hal *hal, axis_mask_t first, axis_mask_t second);
};

/** A motion side of its own: another task, on the core of the step ISR, that calls machine_poll_motion().
 * Chosen at run time; without one machine_poll() does that work, too. */
struct hal_motion_side {
    /** [task] Have the motion side call work(arg) between two of its polls, with the interrupts of step timer
     * and inputs held off, and wait until it is done. Some 10 us of work at most. */
    void (*call)(const void *ctx, void (*work)(void *arg), void *arg);
};

/** Causes of a restart that was not requested: it is not power-on, nor the result of a command or an update.
 */
enum hal_restart_cause {
    HAL_RESTART_NONE, /* for targets: none of these */
#define RESTART(name, text) HAL_RESTART_##name,
#include "hal/restarts.def"
#undef RESTART
};

enum { HAL_RESTART_ADDRESSES = 4 };

/** Such a restart. It must live as long as the machine. */
struct hal_restart {
    enum hal_restart_cause cause;
    uint8_t address_count;                   /* 0 .. HAL_RESTART_ADDRESSES */
    uint32_t address[HAL_RESTART_ADDRESSES]; /* of the program: where it was, then its callers */
    const char *detail;                      /* of a fault, a few words in plain ASCII; NULL: not known */
};

/** A value on its way into the store. */
struct hal_store_value {
    uint8_t key;
    const void *bytes;
    size_t count;
};

/** The state of a write of the store. */
enum hal_store_state {
    HAL_STORE_DONE,
    HAL_STORE_BUSY,
    HAL_STORE_FAILED, /* the old values are still there */
};

/** Keeps values over a power cut. A power cut at any moment leaves all values of a save() as they were, or
 * all as they are to be, never a mix; and a value that was stored and cannot be read any more is never taken
 * for one that was not, nor for an older one. Chosen at run time; a machine without one forgets.
 *
 * Where the hardware can write while the program runs, save() and set_aside() begin and return
 * HAL_STORE_BUSY; nothing of this is called again until state() reports another state. Others wait, and
 * return how it ended. */
struct hal_store {
    /** [task] @return bytes copied, at most size; 0 = the key has no value. A damaged value may be copied as
     * it is (the core checks it); one byte stands for a value that is lost. */
    size_t (*load)(const void *ctx, uint8_t key, void *bytes, size_t size);
    /** [task] Store these values, each key at most once; the bytes are copied before it returns. */
    enum hal_store_state (*save)(const void *ctx, const struct hal_store_value *values, size_t count);
    /** [task] Put a copy of all that is stored, damaged as it is, where no save touches it; it takes the
     * place of an older copy. HAL_STORE_FAILED: there is no such copy now */
    enum hal_store_state (*set_aside)(const void *ctx);
    /** [task] The last save() or set_aside(). NULL: none is ever busy */
    enum hal_store_state (*state)(const void *ctx);
};

#endif
