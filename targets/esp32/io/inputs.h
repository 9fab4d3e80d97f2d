/* SPDX-License-Identifier: MIT
 * Limits, home switches, probe, e-stop and the misc inputs: edge interrupts on core 1, and a sample every ms
 * that ends their bouncing. Everything here runs on core 1, except inputs_read(), which any core may call. */
#ifndef WIFICNC_ESP32_INPUTS_H
#define WIFICNC_ESP32_INPUTS_H

#include "base/debounce.h"
#include "io/encoder.h"
#include "wires.h"

#include <stdbool.h>
#include <stdint.h>

_Static_assert((int)INPUT_COUNT <= (int)DEBOUNCE_INPUTS, "an input is a bit of its word");

struct machine;

/** Which misc inputs are these, as M66 numbers them; INPUT_NONE: none. */
enum { INPUT_NONE = 0xFF };
struct input_roles {
    uint8_t door, hold, start;
};

struct inputs {
    struct input_wire wire[INPUT_COUNT];
    const struct gang *gang; /* whose switches they are */
    struct input_roles roles;
    struct debounce debounce;
    volatile uint8_t lock;   /* enum hal_lock: as if the e-stop were pressed */
    uint32_t active_low;     /* inputs that are on while their line is low */
    uint32_t switch_high;    /* limit and home lines that the board calls active high */
    struct encoder *encoder; /* of the index line; NULL: none is wired */
    uint8_t index_gpio;
    struct machine *machine; /* gets the edges of limits, home and e-stop; NULL: no one */
};

/** [task] Pins become inputs with their pulls. No interrupt yet. @param wire, roles  are copied; gang lives
 * as long */
void inputs_init(struct inputs *inputs, const struct input_wire wire[INPUT_COUNT], const struct gang *gang,
                 const struct input_roles *roles);

/** [motion side, or before inputs_attach()] At which level limits, home switches and e-stop (as the board
 * calls them, or the other way round), probe and tool setter are on. */
void inputs_set_levels(struct inputs *inputs, struct input_senses senses);

/** [start] The index line of the spindle's encoder: inputs_attach() has it interrupt, too. */
void inputs_add_index(struct inputs *inputs, struct encoder *encoder, const struct encoder_wire *wire);

/** [task on core 1] From now on edges interrupt, and `machine` gets them. @return false: no interrupt is free
 */
bool inputs_attach(struct inputs *inputs, struct machine *machine);

/** [task on core 1, every ms] Take in what has stopped bouncing. */
void inputs_sample(struct inputs *inputs);

/** [any task, isr] Levels as core/hal/hal.h wants them. */
void inputs_read(const struct inputs *inputs, struct hal_inputs *out);

#endif
