/* SPDX-License-Identifier: MIT */
#include "app/board.h"

#include "pin_config.h"

#include <stddef.h>

/* A row of BOARD_INPUTS or BOARD_OUTPUTS. */
struct row {
    uint8_t pin;
    bool active_high;
    uint8_t pull;
};

#define INPUT_ROW(pin, signal, level, pull) {pin, level, pull},
#define OUTPUT_ROW(pin, signal, level)      {pin, level, PIN_PULL_NONE},
static const struct row rows[] = {BOARD_INPUTS(INPUT_ROW) BOARD_OUTPUTS(OUTPUT_ROW)};

/* Pins of a kind: of the axes' first motors, or of their second ones. */
struct motor_pins {
    uint8_t step[AXIS_COUNT], dir[AXIS_COUNT], enable[AXIS_COUNT];
    uint8_t limit[AXIS_COUNT], limit_min[AXIS_COUNT], limit_max[AXIS_COUNT], home[AXIS_COUNT];
};

static const struct motor_pins first_motors = {.step = BOARD_STEP_PINS,
                                               .dir = BOARD_DIR_PINS,
                                               .enable = BOARD_ENABLE_PINS,
                                               .limit = BOARD_LIMIT_PINS,
                                               .limit_min = BOARD_LIMIT_MIN_PINS,
                                               .limit_max = BOARD_LIMIT_MAX_PINS,
                                               .home = BOARD_HOME_PINS};
static const struct motor_pins second_motors = {.step = BOARD_STEP_SECOND_PINS,
                                                .dir = BOARD_DIR_SECOND_PINS,
                                                .enable = BOARD_ENABLE_SECOND_PINS,
                                                .limit = BOARD_LIMIT_SECOND_PINS,
                                                .limit_min = BOARD_LIMIT_SECOND_MIN_PINS,
                                                .limit_max = BOARD_LIMIT_SECOND_MAX_PINS,
                                                .home = BOARD_HOME_SECOND_PINS};

struct gang board_gang(void) {
    return gang_of(BOARD_AXIS_COUNT, BOARD_GANGED_AXES);
}

/* Where a motor's pins are. */
struct motor_place {
    const struct motor_pins *pins;
    unsigned index;
};

static struct motor_place place_of(unsigned motor) {
    const uint8_t axis = board_gang().axis[motor];
    const bool is_second = motor >= BOARD_AXIS_COUNT && axis != NO_AXIS;
    return (struct motor_place){.pins = is_second ? &second_motors : &first_motors,
                                .index = is_second ? axis : motor};
}

/* The board file has a row for each wired pin; a signal is found in it by its pin. */
static struct row row_of(uint8_t pin) {
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
        if (rows[i].pin == pin && pin != NO_PIN)
            return rows[i];
    return (struct row){.pin = NO_PIN};
}

struct step_engine_board board_step_engine(void) {
    struct step_engine_board board = {
        .gang = board_gang(),
        .step_pulse_ns = BOARD_STEP_PULSE_NS,
        .dir_setup_ns = BOARD_DIR_SETUP_NS,
    };
    for (unsigned motor = 0; motor < AXIS_COUNT; motor++) {
        const struct motor_place at = place_of(motor);
        board.step_pin[motor] = at.pins->step[at.index];
        board.dir_pin[motor] = at.pins->dir[at.index];
        const unsigned bit = 1u << motor;
        board.step_low = (uint8_t)(board.step_low | (row_of(board.step_pin[motor]).active_high ? 0u : bit));
        board.dir_low = (uint8_t)(board.dir_low | (row_of(board.dir_pin[motor]).active_high ? 0u : bit));
    }
    return board;
}

static struct input_wire input(uint8_t pin) {
    struct row row = row_of(pin);
    return (struct input_wire){.pin = row.pin, .active_high = row.active_high, .pull = row.pull};
}

void board_inputs(struct input_wire wire[INPUT_COUNT]) {
    static const uint8_t misc[] = BOARD_MISC_IN_PINS;
    for (unsigned motor = 0; motor < AXIS_COUNT; motor++) { /* one line for both ends, or one for each */
        const struct motor_place at = place_of(motor);
        const uint8_t one = at.pins->limit[at.index];
        const uint8_t least = at.pins->limit_min[at.index], most = at.pins->limit_max[at.index];
        wire[INPUT_LIMIT_MIN + motor] = input(least != NO_PIN ? least : one);
        wire[INPUT_LIMIT_MAX + motor] = input(most != NO_PIN ? most : one);
        wire[INPUT_HOME + motor] = input(at.pins->home[at.index]);
    }
    wire[INPUT_PROBE] = input(PIN_PROBE);
    wire[INPUT_TOOLSETTER] = input(PIN_TOOLSETTER);
    wire[INPUT_ESTOP] = input(PIN_ESTOP);
    for (unsigned n = 0; n < DIGITAL_INPUT_COUNT; n++)
        wire[INPUT_MISC + n] = input(misc[n]);
}

static uint8_t pin_of(unsigned output) {
    static const uint8_t digital[] = BOARD_MISC_OUT_PINS;
    if (output >= SWITCH_ENABLE_MOTOR && output < SWITCH_ENABLE_MOTOR + AXIS_COUNT) {
        const struct motor_place at = place_of(output - SWITCH_ENABLE_MOTOR);
        return at.pins->enable[at.index];
    }
    if (output >= SWITCH_DIGITAL)
        return digital[output - SWITCH_DIGITAL];
    switch (output) {
    case SWITCH_ENABLE:
        return PIN_ENABLE;
    case SWITCH_SPINDLE_ENABLE:
        return PIN_SPINDLE_ENABLE;
    case SWITCH_SPINDLE_DIR:
        return PIN_SPINDLE_DIR;
    case SWITCH_SPINDLE_PWM:
        return PIN_SPINDLE_PWM;
    case SWITCH_FLOOD:
        return PIN_COOLANT_FLOOD;
    case SWITCH_MIST:
        return PIN_COOLANT_MIST;
    case SWITCH_CHARGE_PUMP:
        return PIN_CHARGE_PUMP;
    case SWITCH_LED:
        return PIN_LED;
    default:
        return NO_PIN;
    }
}

void board_outputs(struct output_wire wire[SWITCH_COUNT]) {
    for (unsigned output = 0; output < SWITCH_COUNT; output++) {
        struct row row = row_of(pin_of(output));
        wire[output] = (struct output_wire){.pin = row.pin, .active_high = row.active_high};
    }
}

static uint8_t outputs_wired(void) {
    const bool pwm = PIN_SPINDLE_PWM != PIN_NONE;
    return (uint8_t)((pwm || PIN_SPINDLE_ENABLE != PIN_NONE ? BOARD_OUTPUT_SPINDLE : 0) |
                     (pwm ? BOARD_OUTPUT_PWM : 0) | (PIN_SPINDLE_DIR != PIN_NONE ? BOARD_OUTPUT_REVERSE : 0) |
                     (PIN_COOLANT_FLOOD != PIN_NONE ? BOARD_OUTPUT_FLOOD : 0) |
                     (PIN_COOLANT_MIST != PIN_NONE ? BOARD_OUTPUT_MIST : 0));
}

struct machine_board board_machine(void) {
    return (struct machine_board){
        .timer_hz = BOARD_TIMER_HZ,
        .step_pulse_ns = BOARD_STEP_PULSE_NS,
        .default_pulse_us = BOARD_DEFAULT_PULSE_US,
        .dir_setup_ns = BOARD_DIR_SETUP_NS,
        .max_step_rate_hz = BOARD_MAX_STEP_RATE_HZ,
        .axis_count = BOARD_AXIS_COUNT,
        .home_axes = BOARD_HOME_AXES,
        .motors_wake_us = 1000, /* what the slowest of common drivers want */
        .outputs = outputs_wired(),
        .toolsetter = PIN_TOOLSETTER != NO_PIN,
        .digital_inputs = BOARD_MISC_IN_COUNT,
        .digital_outputs = BOARD_MISC_OUT_COUNT,
    };
}
