/* SPDX-License-Identifier: MIT */
#include "app/board.h"

#include "pin_config.h"

#include <stddef.h>

_Static_assert((unsigned)GPIO_NONE == (unsigned)PIN_NONE, "no pin is the same number in both");

/* A row of BOARD_INPUTS or BOARD_OUTPUTS. */
struct row {
    uint8_t gpio;
    bool active_high;
    uint8_t pull;
};

#define INPUT_ROW(pin, signal, level, pull) {pin, level, pull},
#define OUTPUT_ROW(pin, signal, level)      {pin, level, PIN_PULL_NONE},
static const struct row rows[] = {BOARD_INPUTS(INPUT_ROW) BOARD_OUTPUTS(OUTPUT_ROW)};

const struct step_engine_board board_step_engine = {
    .step_gpio = BOARD_STEP_PINS,
    .dir_gpio = BOARD_DIR_PINS,
    .probe_gpio = PIN_PROBE,
    .timer_hz = BOARD_TIMER_HZ,
    .step_pulse_ns = BOARD_STEP_PULSE_NS,
    .dir_setup_ns = BOARD_DIR_SETUP_NS,
};

static struct row row_of(uint8_t gpio) {
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
        if (rows[i].gpio == gpio && gpio != GPIO_NONE)
            return rows[i];
    return (struct row){.gpio = GPIO_NONE};
}

static struct input_wire input(uint8_t gpio) {
    struct row row = row_of(gpio);
    return (struct input_wire){.gpio = row.gpio, .active_high = row.active_high, .pull = row.pull};
}

void board_inputs(struct input_wire wire[INPUT_COUNT]) {
    static const uint8_t one[] = BOARD_LIMIT_PINS, least[] = BOARD_LIMIT_MIN_PINS,
                         most[] = BOARD_LIMIT_MAX_PINS;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) { /* one line for both ends, or one for each */
        wire[INPUT_LIMIT_MIN + ax] = input(least[ax] != GPIO_NONE ? least[ax] : one[ax]);
        wire[INPUT_LIMIT_MAX + ax] = input(most[ax] != GPIO_NONE ? most[ax] : one[ax]);
    }
    wire[INPUT_PROBE] = input(PIN_PROBE);
    wire[INPUT_ESTOP] = input(PIN_ESTOP);
}

void board_outputs(struct output_wire wire[SWITCH_COUNT]) {
    static const uint8_t gpio[SWITCH_COUNT] = {
        [SWITCH_ENABLE] = PIN_ENABLE,           [SWITCH_SPINDLE_ENABLE] = PIN_SPINDLE_ENABLE,
        [SWITCH_SPINDLE_DIR] = PIN_SPINDLE_DIR, [SWITCH_SPINDLE_PWM] = PIN_SPINDLE_PWM,
        [SWITCH_FLOOD] = PIN_COOLANT_FLOOD,     [SWITCH_MIST] = PIN_COOLANT_MIST,
        [SWITCH_CHARGE_PUMP] = PIN_CHARGE_PUMP, [SWITCH_DIGITAL] = PIN_MISC_OUT_0,
        [SWITCH_DIGITAL + 1] = PIN_MISC_OUT_1,  [SWITCH_DIGITAL + 2] = PIN_MISC_OUT_2,
        [SWITCH_DIGITAL + 3] = PIN_MISC_OUT_3,  [SWITCH_LAST_DIGITAL] = PIN_MISC_OUT_4,
    };
    for (unsigned output = 0; output < SWITCH_COUNT; output++) {
        struct row row = row_of(gpio[output]);
        wire[output] = (struct output_wire){.gpio = row.gpio, .active_high = row.active_high};
    }
}

struct machine_board board_machine(void) {
    return (struct machine_board){
        .timer_hz = BOARD_TIMER_HZ,
        .step_pulse_ns = BOARD_STEP_PULSE_NS,
        .dir_setup_ns = BOARD_DIR_SETUP_NS,
        .max_step_rate_hz = BOARD_MAX_STEP_RATE_HZ,
        .axis_count = BOARD_AXIS_COUNT,
    };
}
