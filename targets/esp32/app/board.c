/* SPDX-License-Identifier: MIT */
#include "app/board.h"

#include "app/wired.h"
#include "machine/motors.h"

#include "pin_config.h"

_Static_assert((int)SIGNAL_STEP_C == (int)SIGNAL_STEP_X + AXIS_COUNT - 1,
               "a signal of each kind for each axis");
_Static_assert((int)SIGNAL_STEP_C2 == (int)SIGNAL_STEP_X2 + AXIS_COUNT - 1, "and of each second motor");
_Static_assert((int)SIGNAL_MISC_IN_7 == (int)SIGNAL_MISC_IN_0 + DIGITAL_INPUT_COUNT - 1,
               "M66 reads them all");

struct gang board_gang(void) {
    return gang_of(BOARD_AXIS_COUNT, BOARD_GANGED_AXES);
}

/* A motor's wire. @param first, second  signals of a kind, of axis X */
static const struct pin_wire *motor_wire(const struct pin_map *map, unsigned motor, enum board_signal first,
                                         enum board_signal second) {
    const uint8_t axis = board_gang().axis[motor];
    const bool is_second = motor >= BOARD_AXIS_COUNT && axis != NO_AXIS;
    return &map->wire[is_second ? second + axis : first + motor];
}

struct step_engine_board board_step_engine(const struct pin_map *map) {
    struct step_engine_board board = {
        .gang = board_gang(),
        .timer_hz = BOARD_TIMER_HZ,
        .step_pulse_ns = BOARD_STEP_PULSE_NS,
        .dir_setup_ns = BOARD_DIR_SETUP_NS,
    };
    for (unsigned motor = 0; motor < AXIS_COUNT; motor++) {
        const struct pin_wire *step = motor_wire(map, motor, SIGNAL_STEP_X, SIGNAL_STEP_X2);
        const struct pin_wire *dir = motor_wire(map, motor, SIGNAL_DIR_X, SIGNAL_DIR_X2);
        board.step_gpio[motor] = step->gpio;
        board.dir_gpio[motor] = dir->gpio;
        board.step_low = (uint8_t)(board.step_low | (step->active_high ? 0u : 1u << motor));
        board.dir_low = (uint8_t)(board.dir_low | (dir->active_high ? 0u : 1u << motor));
    }
    return board;
}

static struct input_wire input(const struct pin_wire *wire) {
    return (struct input_wire){.pin = wire->gpio, .active_high = wire->active_high, .pull = wire->pull};
}

/* One line for both ends of an axis, or one for each. */
static struct input_wire limit(const struct pin_wire *both, const struct pin_wire *end) {
    return input(end->gpio != NO_PIN ? end : both);
}

void board_inputs(const struct pin_map *map, struct input_wire wire[INPUT_COUNT]) {
    for (unsigned motor = 0; motor < AXIS_COUNT; motor++) {
        const struct pin_wire *both = motor_wire(map, motor, SIGNAL_LIMIT_X, SIGNAL_LIMIT_X2);
        wire[INPUT_LIMIT_MIN + motor] =
            limit(both, motor_wire(map, motor, SIGNAL_LIMIT_X_MIN, SIGNAL_LIMIT_X2_MIN));
        wire[INPUT_LIMIT_MAX + motor] =
            limit(both, motor_wire(map, motor, SIGNAL_LIMIT_X_MAX, SIGNAL_LIMIT_X2_MAX));
        wire[INPUT_HOME + motor] = input(motor_wire(map, motor, SIGNAL_HOME_X, SIGNAL_HOME_X2));
    }
    wire[INPUT_PROBE] = input(&map->wire[SIGNAL_PROBE]);
    wire[INPUT_TOOLSETTER] = input(&map->wire[SIGNAL_TOOLSETTER]);
    wire[INPUT_ESTOP] = input(&map->wire[SIGNAL_ESTOP]);
    for (unsigned misc = 0; misc < DIGITAL_INPUT_COUNT; misc++)
        wire[INPUT_MISC + misc] = input(&map->wire[SIGNAL_MISC_IN_0 + misc]);
}

void board_outputs(const struct pin_map *map, struct output_wire wire[SWITCH_COUNT]) {
    static const uint8_t signal[SWITCH_COUNT] = {
        [SWITCH_ENABLE] = SIGNAL_ENABLE,           [SWITCH_SPINDLE_ENABLE] = SIGNAL_SPINDLE_ENABLE,
        [SWITCH_SPINDLE_DIR] = SIGNAL_SPINDLE_DIR, [SWITCH_SPINDLE_PWM] = SIGNAL_SPINDLE_PWM,
        [SWITCH_FLOOD] = SIGNAL_COOLANT_FLOOD,     [SWITCH_MIST] = SIGNAL_COOLANT_MIST,
        [SWITCH_CHARGE_PUMP] = SIGNAL_CHARGE_PUMP, [SWITCH_SERVO] = SIGNAL_SERVO,
        [SWITCH_DIGITAL] = SIGNAL_MISC_OUT_0,      [SWITCH_DIGITAL + 1] = SIGNAL_MISC_OUT_1,
        [SWITCH_DIGITAL + 2] = SIGNAL_MISC_OUT_2,  [SWITCH_DIGITAL + 3] = SIGNAL_MISC_OUT_3,
        [SWITCH_LAST_DIGITAL] = SIGNAL_MISC_OUT_4,
    };
    for (unsigned output = 0; output < SWITCH_COUNT; output++) {
        const struct pin_wire *found = &map->wire[signal[output]];
        if (output >= SWITCH_ENABLE_X && output <= SWITCH_ENABLE_LAST)
            found = motor_wire(map, output - SWITCH_ENABLE_X, SIGNAL_ENABLE_X, SIGNAL_ENABLE_X2);
        wire[output] = (struct output_wire){.pin = found->gpio, .active_high = found->active_high};
    }
}

void board_encoder(const struct pin_map *map, struct encoder_wire wire[ENCODER_LINES]) {
    static const uint8_t signal[ENCODER_LINES] = {[ENCODER_A] = SIGNAL_ENCODER_A,
                                                  [ENCODER_B] = SIGNAL_ENCODER_B,
                                                  [ENCODER_INDEX] = SIGNAL_ENCODER_INDEX};
    for (unsigned n = 0; n < ENCODER_LINES; n++) {
        const struct pin_wire *found = &map->wire[signal[n]];
        wire[n] = (struct encoder_wire){
            .gpio = found->gpio, .active_high = found->active_high, .pull = found->pull};
    }
}

bool board_spindle_bus(struct spindle_bus_wire *wire) {
    *wire = (struct spindle_bus_wire){
        .uart = BOARD_SPINDLE_UART, .tx = PIN_BUS_TX, .rx = PIN_BUS_RX, .de = PIN_BUS_DE};
    return BOARD_HAS_SPINDLE_BUS != 0;
}

bool board_pendant(struct serial_pendant *wire) {
    *wire = (struct serial_pendant){.baud = BOARD_PENDANT_BAUD,
                                    .uart = BOARD_PENDANT_UART,
                                    .tx = PIN_PENDANT_TX,
                                    .rx = PIN_PENDANT_RX,
                                    .kind = BOARD_PENDANT_MPG ? NET_PENDANT_MPG : NET_PENDANT_TERMINAL};
    return BOARD_HAS_PENDANT != 0;
}

static const struct driver_wire driver_wires[] = {
#define WIRE(kind_, axis_, motor_, address_, select_, chain_, mohm_, diag_)                                  \
    {.kind = kind_,                                                                                          \
     .axis = axis_,                                                                                          \
     .motor = motor_,                                                                                        \
     .address = address_,                                                                                    \
     .select = select_,                                                                                      \
     .chain = chain_,                                                                                        \
     .sense_mohm = mohm_,                                                                                    \
     .diag = (diag_) != 0},
    BOARD_DRIVER_ROWS(WIRE)
#undef WIRE
        {.kind = TMC_NONE}, /* an array is never empty */
};

const struct driver_wire *board_drivers(struct driver_bus_wire *bus, uint8_t *count) {
    static const uint8_t own_select[MOTOR_COUNT][AXIS_COUNT] = {
        {PIN_DRIVER_CS_X, PIN_DRIVER_CS_Y, PIN_DRIVER_CS_Z, PIN_DRIVER_CS_A, PIN_DRIVER_CS_B,
         PIN_DRIVER_CS_C},
        {PIN_DRIVER_CS_X2, PIN_DRIVER_CS_Y2, PIN_DRIVER_CS_Z2, PIN_DRIVER_CS_A2, PIN_DRIVER_CS_B2,
         PIN_DRIVER_CS_C2}};
    *count = BOARD_DRIVER_COUNT;
    *bus = (struct driver_bus_wire){.number = BOARD_DRIVER_BUS,
                                    .uart = BOARD_DRIVER_IS_UART != 0,
                                    .tx = PIN_DRIVER_TX,
                                    .rx = PIN_DRIVER_RX,
                                    .mosi = PIN_DRIVER_MOSI,
                                    .miso = PIN_DRIVER_MISO,
                                    .sclk = PIN_DRIVER_SCLK,
                                    .select_count = 1};
    bus->select[0] = PIN_DRIVER_CS; /* of a chain */
    for (unsigned n = 0; n < *count && PIN_DRIVER_CS == NO_PIN; n++) {
        bus->select[driver_wires[n].select] = own_select[driver_wires[n].motor][driver_wires[n].axis];
        bus->select_count = (uint8_t)(n + 1u);
    }
    return driver_wires;
}

struct machine_board board_machine(const struct pin_map *map) {
    const uint8_t inputs =
        BOARD_MISC_IN_COUNT < DIGITAL_INPUT_COUNT ? BOARD_MISC_IN_COUNT : DIGITAL_INPUT_COUNT;
    return (struct machine_board){
        .outputs = wired_outputs(map),
        .toolsetter = map->wire[SIGNAL_TOOLSETTER].gpio != NO_PIN,
        .digital_inputs = inputs,
        .digital_outputs = wired_digital_outputs(map),
        .motors_wake_us = 1000, /* what the slowest of common drivers want */
        .timer_hz = BOARD_TIMER_HZ,
        .step_pulse_ns = BOARD_STEP_PULSE_NS,
        .default_pulse_us = BOARD_DEFAULT_PULSE_US,
        .dir_setup_ns = BOARD_DIR_SETUP_NS,
        .step_spread_ns = BOARD_STEP_SPREAD_NS,
        .step_grid_ns = BOARD_STEP_GRID_NS,
        .max_step_rate_hz = BOARD_MAX_STEP_RATE_HZ,
        .axis_count = BOARD_AXIS_COUNT,
        .home_axes = BOARD_HOME_AXES,
    };
}
