/* SPDX-License-Identifier: MIT */
#include "app/board.h"

#include "app/wired.h"

#include "pin_config.h"

#include <stddef.h>
#include <string.h>

enum { NAME_SIZE = 16 };

static const char *const misc_inputs[DIGITAL_INPUT_COUNT] = {
    "misc_in_0", "misc_in_1", "misc_in_2", "misc_in_3", "misc_in_4", "misc_in_5", "misc_in_6", "misc_in_7"};

/* "limit_" with axis 2 and "_min": "limit_z_min". */
static const struct pin_wire *axis_wire(const struct pin_map *map, const char *kind, unsigned axis,
                                        const char *end) {
    char name[NAME_SIZE];
    size_t length = strlen(kind);
    memcpy(name, kind, length);
    name[length++] = "xyzabc"[axis];
    strcpy(name + length, end);
    return pin_map_find(map, name);
}

struct step_engine_board board_step_engine(const struct pin_map *map) {
    struct step_engine_board board = {
        .probe_gpio = pin_map_find(map, "probe")->gpio,
        .timer_hz = BOARD_TIMER_HZ,
        .step_pulse_ns = BOARD_STEP_PULSE_NS,
        .dir_setup_ns = BOARD_DIR_SETUP_NS,
    };
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        board.step_gpio[ax] = axis_wire(map, "step_", ax, "")->gpio;
        board.dir_gpio[ax] = axis_wire(map, "dir_", ax, "")->gpio;
    }
    return board;
}

static struct input_wire input(const struct pin_wire *wire) {
    return (struct input_wire){.gpio = wire->gpio, .active_high = wire->active_high, .pull = wire->pull};
}

/* One line for both ends of an axis, or one for each. */
static struct input_wire limit(const struct pin_map *map, unsigned axis, const char *end) {
    const struct pin_wire *own = axis_wire(map, "limit_", axis, end);
    return input(own->gpio != GPIO_NONE ? own : axis_wire(map, "limit_", axis, ""));
}

void board_inputs(const struct pin_map *map, struct input_wire wire[INPUT_COUNT]) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        wire[INPUT_LIMIT_MIN + ax] = limit(map, ax, "_min");
        wire[INPUT_LIMIT_MAX + ax] = limit(map, ax, "_max");
        wire[INPUT_HOME + ax] = input(axis_wire(map, "home_", ax, ""));
    }
    wire[INPUT_PROBE] = input(pin_map_find(map, "probe"));
    wire[INPUT_ESTOP] = input(pin_map_find(map, "estop"));
    for (unsigned misc = 0; misc < DIGITAL_INPUT_COUNT; misc++)
        wire[INPUT_MISC + misc] = input(pin_map_find(map, misc_inputs[misc]));
}

void board_outputs(const struct pin_map *map, struct output_wire wire[SWITCH_COUNT]) {
    static const char *const signal[SWITCH_COUNT] = {
        [SWITCH_ENABLE] = "enable",           [SWITCH_SPINDLE_ENABLE] = "spindle_enable",
        [SWITCH_SPINDLE_DIR] = "spindle_dir", [SWITCH_SPINDLE_PWM] = "spindle_pwm",
        [SWITCH_FLOOD] = "coolant_flood",     [SWITCH_MIST] = "coolant_mist",
        [SWITCH_CHARGE_PUMP] = "charge_pump", [SWITCH_SERVO] = "servo",
        [SWITCH_DIGITAL] = "misc_out_0",      [SWITCH_DIGITAL + 1] = "misc_out_1",
        [SWITCH_DIGITAL + 2] = "misc_out_2",  [SWITCH_DIGITAL + 3] = "misc_out_3",
        [SWITCH_LAST_DIGITAL] = "misc_out_4",
    };
    for (unsigned output = 0; output < SWITCH_COUNT; output++) {
        const struct pin_wire *found = pin_map_find(map, signal[output]);
        wire[output] = (struct output_wire){.gpio = found->gpio, .active_high = found->active_high};
    }
}

void board_encoder(const struct pin_map *map, struct encoder_wire wire[ENCODER_LINES]) {
    static const char *const signal[ENCODER_LINES] = {
        [ENCODER_A] = "encoder_a", [ENCODER_B] = "encoder_b", [ENCODER_INDEX] = "encoder_index"};
    for (unsigned n = 0; n < ENCODER_LINES; n++) {
        const struct pin_wire *found = pin_map_find(map, signal[n]);
        wire[n] = (struct encoder_wire){
            .gpio = found->gpio, .active_high = found->active_high, .pull = found->pull};
    }
}

struct machine_board board_machine(const struct pin_map *map) {
    const uint8_t inputs =
        BOARD_MISC_IN_COUNT < DIGITAL_INPUT_COUNT ? BOARD_MISC_IN_COUNT : DIGITAL_INPUT_COUNT;
    return (struct machine_board){
        .charge_pump_hz = pin_map_find(map, "charge_pump")->gpio != GPIO_NONE ? PUMP_HZ : 0,
        .outputs = wired_outputs(map),
        .digital_inputs = inputs,
        .digital_outputs = BOARD_MISC_OUT_COUNT,
        .motors_wake_us = 1000, /* what the slowest of common drivers want */
        .timer_hz = BOARD_TIMER_HZ,
        .step_pulse_ns = BOARD_STEP_PULSE_NS,
        .default_pulse_us = BOARD_DEFAULT_PULSE_US,
        .dir_setup_ns = BOARD_DIR_SETUP_NS,
        .step_spread_ns = BOARD_STEP_SPREAD_NS,
        .max_step_rate_hz = BOARD_MAX_STEP_RATE_HZ,
        .axis_count = BOARD_AXIS_COUNT,
        .home_axes = BOARD_HOME_AXES,
    };
}
