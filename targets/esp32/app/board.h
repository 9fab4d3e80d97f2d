/* SPDX-License-Identifier: MIT
 * The board this firmware is built for, as the parts want to know it: pin_config.h, generated from boards/,
 * and the pin map turned into their structs. */
#ifndef WIFICNC_ESP32_BOARD_H
#define WIFICNC_ESP32_BOARD_H

#include "hal/step_engine.h"
#include "io/driver_bus.h"
#include "io/encoder.h"
#include "io/inputs.h"
#include "io/outputs.h"
#include "io/pin_map.h"
#include "io/spindle_bus.h"
#include "link/serial_stream.h"
#include "machine/machine.h"

/** Which axes have a second motor. */
struct gang board_gang(void);

struct step_engine_board board_step_engine(const struct pin_map *map);

void board_inputs(const struct pin_map *map, struct input_wire wire[INPUT_COUNT]);
void board_outputs(const struct pin_map *map, struct output_wire wire[SWITCH_COUNT]);

/** Lines of the spindle's encoder. */
void board_encoder(const struct pin_map *map, struct encoder_wire wire[ENCODER_LINES]);

/** RS-485 for a spindle drive. @return false: the board has none */
bool board_spindle_bus(struct spindle_bus_wire *wire);

/** UART of a pendant. @return false: the board has none */
bool board_pendant(struct serial_pendant *wire);

/** Motor drivers with registers. @param bus  of how they are reached
 * @return their places, *count of them; 0: the board has none */
const struct driver_wire *board_drivers(struct driver_bus_wire *bus, uint8_t *count);

/** Without store, encoder, second motors and motion side. */
struct machine_board board_machine(const struct pin_map *map);

#endif
