/* SPDX-License-Identifier: MIT */
#include "machine/wiring.h"

#include "machine/interp.h"
#include "machine/motor_drivers.h"
#include "machine/parts.h"
#include "machine/pump.h"
#include "machine/report.h"
#include "machine/vfd_spindle.h"

#include <math.h>
#include <stddef.h>

/* Settings that need a pin. Stored ones may come from another board (wiring_fit()). */
static const uint16_t needs_wiring[] = {SETTING_LASER_MODE,     SETTING_TORQUE_MASK,    SETTING_SERVO_AXIS,
                                        SETTING_ENCODER_COUNTS, SETTING_CHARGE_PUMP_HZ, SETTING_SPINDLE_TYPE};

static bool has(const struct machine *machine, enum board_output output) {
    return (machine->board.outputs & output) != 0;
}

static uint8_t missing_coolant(const struct machine *machine) {
    return (uint8_t)((has(machine, BOARD_OUTPUT_FLOOD) ? 0 : COOLANT_FLOOD) |
                     (has(machine, BOARD_OUTPUT_MIST) ? 0 : COOLANT_MIST));
}

void wiring_apply(struct machine *machine) {
    const struct settings *settings = &machine->settings;
    struct gcode_ports *ports = &machine->interp.gcode.ports;
    const bool bus = vfd_spindle_is_chosen(machine); /* a drive does both */
    ports->no_spindle = !has(machine, BOARD_OUTPUT_SPINDLE) && !bus;
    ports->no_reverse =
        !has(machine, BOARD_OUTPUT_REVERSE) && !settings->laser_mode && !bus; /* M4 is a kind of power */
    ports->no_coolant = missing_coolant(machine);
    ports->coolant_passes = settings->coolant_passes;
}

/* @param from  the axis whose driver it is @param others  of so many axes no other one may have it */
static enum status check_second(const struct machine *machine, unsigned axis, double from, unsigned others) {
    const struct hal_ganged *ganged = machine->board.ganged;
    if (ganged == NULL || from >= (double)AXIS_COUNT || (ganged->spare >> (unsigned)from & 1) == 0)
        return STATUS_NO_SECOND_MOTOR;
    if ((ganged->fixed >> axis & 1) != 0)
        return STATUS_HAS_SECOND_MOTOR;
    if ((unsigned)from <= axis)
        return STATUS_SECOND_MOTOR_ORDER;
    for (unsigned ax = 0; ax < others; ax++)
        if (ax != axis && machine->settings.second_motor[ax] == (unsigned)from + 1)
            return STATUS_SECOND_MOTOR_TAKEN;
    return STATUS_OK;
}

static bool is_second_motor(uint16_t number) {
    return number >= SETTING_SECOND_MOTOR && number < (uint16_t)SETTING_SECOND_MOTOR + (uint16_t)AXIS_COUNT;
}

static bool is_current(uint16_t number) {
    return number >= SETTING_DRIVER_CURRENT_MA &&
           number < (uint16_t)SETTING_DRIVER_CURRENT_MA + (uint16_t)AXIS_COUNT;
}

static enum status check_spindle(const struct machine *machine, double number) {
    if (machine->board.vfd == NULL)
        return STATUS_NO_SPINDLE_BUS;
    return number < (double)VFD_MODEL_COUNT + 1.0 ? STATUS_OK : STATUS_UNKNOWN_VFD;
}

static enum status check_pump(const struct hal_pump *pump, double hz) {
    if (pump == NULL)
        return STATUS_NO_OUTPUT;
    return pump_ticks(pump, floor(hz)) != 0 ? STATUS_OK : STATUS_PUMP_FREQUENCY;
}

enum status wiring_check(const struct machine *machine, uint16_t number, double value) {
    const struct machine_board *board = &machine->board;
    /* Off needs nothing; and a number below 1 is 0 in a whole setting. */
    if (value < 1.0)
        return STATUS_OK;
    if (is_current(number))
        return motor_drivers_check_current(machine, number - SETTING_DRIVER_CURRENT_MA, value);
    if (is_second_motor(number))
        return check_second(machine, number - SETTING_SECOND_MOTOR, value - 1.0, machine->board.axis_count);
    switch (number) {
    case SETTING_LASER_MODE:
        return has(machine, BOARD_OUTPUT_PWM) ? STATUS_OK : STATUS_LASER_NEEDS_PWM;
    case SETTING_TORQUE_MASK:
        return value < (double)(1u << board->digital_outputs) ? STATUS_OK : STATUS_NO_OUTPUT;
    case SETTING_FAULT_INPUTS:
    case SETTING_M1_INPUTS:
        return value < (double)(1u << board->digital_inputs) ? STATUS_OK : STATUS_NO_PORT;
    case SETTING_SERVO_AXIS:
        return has(machine, BOARD_OUTPUT_SERVO) ? STATUS_OK : STATUS_NO_OUTPUT;
    case SETTING_ENCODER_COUNTS:
        return board->encoder != NULL ? STATUS_OK : STATUS_NO_ENCODER;
    case SETTING_CHARGE_PUMP_HZ:
        return check_pump(board->pump, value);
    case SETTING_SPINDLE_TYPE:
        return check_spindle(machine, value);
    default:
        return STATUS_OK;
    }
}

static void report_off(const struct machine *machine, uint16_t number) {
    text_string(&machine->out, "[MSG:$");
    text_int(&machine->out, number);
    text_string(&machine->out, "=0: this board has no pin for it]\r\n");
}

/* Stored for another board: off, as wiring_fit() does. */
static bool has_second(struct machine *machine, unsigned axis) {
    uint8_t *setting = &machine->settings.second_motor[axis];
    if (*setting == 0)
        return false;
    if (check_second(machine, axis, *setting - 1.0, axis) == STATUS_OK)
        return true;
    *setting = 0;
    report_off(machine, (uint16_t)(SETTING_SECOND_MOTOR + axis));
    return false;
}

void wiring_take_axes(struct machine *machine) {
    const struct settings *settings = &machine->settings;
    uint8_t axes = machine->board.axis_count;
    if (settings->machine_axes != 0 && settings->machine_axes < axes)
        axes = settings->machine_axes;
    machine->board.axis_count = axes;
    /* A driver is of a later axis, so no axis that has one already is gone by the next. */
    for (unsigned ax = 0; ax < axes; ax++) {
        if (!has_second(machine, ax))
            continue;
        const uint8_t from = (uint8_t)(settings->second_motor[ax] - 1);
        machine->board.ganged->take(machine->hal, ax, from);
        axes = from < axes ? from : axes;
        machine->board.axis_count = axes;
    }
    interp_take_axes(&machine->interp, axes);
}

void wiring_fit(struct machine *machine) {
    const uint8_t axes = machine->board.axis_count;
    for (size_t i = 0; i < sizeof needs_wiring / sizeof needs_wiring[0]; i++) {
        double value;
        uint8_t decimals;
        uint16_t number = needs_wiring[i];
        (void)settings_get(&machine->settings, number, axes, &value, &decimals);
        if (wiring_check(machine, number, value) == STATUS_OK)
            continue;
        /* Not stored here: on a board with the pin the value is back, unless settings were stored in
         * between. */
        (void)settings_set(&machine->settings, number, 0.0, axes);
        report_off(machine, number);
    }
}

void wiring_report_coolant(struct machine *machine) {
    const uint8_t passed = machine->task.command.coolant_passed;
    if ((passed & ~machine->reports.coolant_told) == 0)
        return;
    machine->reports.coolant_told |= passed;
    report_message(machine, (passed & COOLANT_FLOOD) != 0 ? "This board has no flood output"
                                                          : "This board has no mist output");
}
