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

const struct step_engine_board board_step_engine = {
    .step_pin = BOARD_STEP_PINS,
    .dir_pin = BOARD_DIR_PINS,
    .probe_pin = PIN_PROBE,
    .step_pulse_ns = BOARD_STEP_PULSE_NS,
    .dir_setup_ns = BOARD_DIR_SETUP_NS,
};

/* The board file has a row for each wired pin; a signal is found in it by its pin. */
static struct row row_of(uint8_t pin) {
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
        if (rows[i].pin == pin && pin != NO_PIN)
            return rows[i];
    return (struct row){.pin = NO_PIN};
}

static struct input_wire input(uint8_t pin) {
    struct row row = row_of(pin);
    return (struct input_wire){.pin = row.pin, .active_high = row.active_high, .pull = row.pull};
}

void board_inputs(struct input_wire wire[INPUT_COUNT]) {
    static const uint8_t one[] = BOARD_LIMIT_PINS, least[] = BOARD_LIMIT_MIN_PINS,
                         most[] = BOARD_LIMIT_MAX_PINS, home[] = BOARD_HOME_PINS, misc[] = BOARD_MISC_IN_PINS;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) { /* one line for both ends, or one for each */
        wire[INPUT_LIMIT_MIN + ax] = input(least[ax] != NO_PIN ? least[ax] : one[ax]);
        wire[INPUT_LIMIT_MAX + ax] = input(most[ax] != NO_PIN ? most[ax] : one[ax]);
        wire[INPUT_HOME + ax] = input(home[ax]);
    }
    wire[INPUT_PROBE] = input(PIN_PROBE);
    wire[INPUT_ESTOP] = input(PIN_ESTOP);
    for (unsigned n = 0; n < DIGITAL_INPUT_COUNT; n++)
        wire[INPUT_MISC + n] = input(misc[n]);
}

static uint8_t pin_of(unsigned output) {
    static const uint8_t enable[] = BOARD_ENABLE_PINS, digital[] = BOARD_MISC_OUT_PINS;
    if (output >= SWITCH_ENABLE_AXIS && output < SWITCH_ENABLE_AXIS + AXIS_COUNT)
        return enable[output - SWITCH_ENABLE_AXIS];
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
        .digital_inputs = BOARD_MISC_IN_COUNT,
        .digital_outputs = BOARD_MISC_OUT_COUNT,
    };
}
