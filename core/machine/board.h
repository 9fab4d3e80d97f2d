/* SPDX-License-Identifier: MIT
 * What a board gives the machine. */
#ifndef WIFICNC_MACHINE_BOARD_H
#define WIFICNC_MACHINE_BOARD_H

#include "config.h"
#include "hal/hal.h"

struct machine_dial;
struct machine_drivers;
struct machine_vfd;

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

/** The longest pulse of a board with a grid, in grids: what its hardware can take at a time. */
enum { STEP_GRID_MAX = 16 };

/** What the board fixes. */
struct machine_board {
    const char *digest; /* of this firmware, for $I; NULL: none */
    uint32_t start_id; /* another number after each power-on and reset of the chip; 0: it has none */
    uint32_t timer_hz;
    uint32_t step_pulse_ns;    /* the shortest; $0 means it when it is this, in whole us */
    uint16_t default_pulse_us; /* what $0 starts at; 0: step_pulse_ns */
    uint32_t dir_setup_ns;
    uint32_t step_spread_ns;         /* from step to step, beyond the pulse and a pause as long */
    uint32_t step_grid_ns;           /* pulses and pauses are 1 .. STEP_GRID_MAX of it; 0: any */
    uint32_t max_step_rate_hz;       /* of one axis */
    uint16_t look_ahead;             /* pieces of path, 32 .. PLAN_SIZE; 0: PLAN_SIZE */
    uint16_t laser_marks;            /* changes of S in it, 256 .. POWER_MARKS; 0: POWER_MARKS */
    uint8_t axis_count;              /* 1 .. AXIS_COUNT */
    axis_mask_t home_axes;           /* homing looks at switches of their own, not at the limits */
    uint32_t motors_wake_us;         /* drivers need it from enabled to their first step */
    uint8_t outputs;                 /* BOARD_OUTPUT_ bits of what is wired */
    bool toolsetter;                 /* a second probe input: hal_inputs.toolsetter */
    uint8_t digital_inputs;          /* of M66, 0 .. DIGITAL_INPUT_COUNT */
    uint8_t digital_outputs;         /* of M62 .. M65, 0 .. OUTPUT_COUNT */
    const struct hal_analog *analog; /* NULL: no analog inputs and outputs */
    const struct hal_servo *servo;   /* NULL: no servo output */
    const struct hal_bus *bus;       /* NULL: none for a spindle drive */
    struct machine_vfd *vfd;         /* of the target, zeroed, where there is a bus: machine/vfd_spindle.h */
    struct machine_drivers *drivers; /* of the target, NULL: none has registers; machine/motor_drivers.h */
    const struct hal_dial *dial;     /* NULL: no hand wheel */
    struct machine_dial *dial_state; /* of the target, zeroed, where there is a dial: machine/dial.h */
    const struct hal_pump *pump;     /* NULL: no charge pump */
    const struct hal_encoder *encoder; /* NULL: none of the spindle */
    const struct hal_ganged *ganged;   /* NULL: every axis has one motor */
    const struct hal_store *store;     /* NULL: nothing is kept */
    const void *store_ctx;
    const struct hal_restart *restart;         /* NULL: this start was requested, or is power-on */
    const struct hal_motion_side *motion_side; /* NULL: the task that calls machine_poll() is it */
    const void *motion_side_ctx;
};

#endif
