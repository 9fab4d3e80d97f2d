/* SPDX-License-Identifier: MIT
 * The board this firmware is built for, as the parts want to know it: pin_config.h, generated from boards/,
 * turned into their structs. */
#ifndef WIFICNC_PIC32MZ_BOARD_H
#define WIFICNC_PIC32MZ_BOARD_H

#include "hal/step_engine.h"
#include "io/inputs.h"
#include "io/outputs.h"
#include "machine/machine.h"

/** Which axes have a second motor. */
struct gang board_gang(void);

struct step_engine_board board_step_engine(void);

void board_inputs(struct input_wire wire[INPUT_COUNT]);
void board_outputs(struct output_wire wire[SWITCH_COUNT]);

/** Without store and second motors. */
struct machine_board board_machine(void);

#endif
