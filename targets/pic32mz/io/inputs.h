/* SPDX-License-Identifier: MIT
 * Limits, home switches, probes and e-stop: edge interrupts, and a sample every ms that ends their bouncing;
 * the inputs of M66: the sample.
 *
 * A switch that stops the machine is on at its first edge, whatever noise follows, and off when all of them
 * have been quiet for 5 ms. The probe's level is only looked at between moves: the step interrupt reads the
 * pin itself.
 *
 * A switch or a probe that is active high is seen inverted, so that $5 and $6 mean the same for every line of
 * a board that mixes both kinds. */
#ifndef WIFICNC_PIC32MZ_INPUTS_H
#define WIFICNC_PIC32MZ_INPUTS_H

#include "wires.h"

#include <stdbool.h>
#include <stdint.h>

struct machine;

struct inputs {
    struct input_wire wire[INPUT_COUNT];
    const struct gang *gang; /* whose switches they are */
    uint32_t wired;          /* bit n = input n */
    uint32_t active_low;     /* inputs that are on while their pin is low */
    uint32_t inverted;       /* of those, by $5 and $6 */
    uint32_t raw, stable;    /* inputs that are on: at the last sample, without bouncing */
    uint32_t since_count;    /* CP0 Count when raw changed last */
    uint8_t misc_raw, misc;  /* levels of M66's inputs, bit n = Pn: at the last sample, without bouncing */
    uint32_t misc_since_count;
    struct machine *machine; /* gets the edges of limits, home and e-stop; NULL: no one */
};

/** [start] Pins become inputs with their pulls. No interrupt yet. @param wire  is copied; gang lives as long
 */
void inputs_init(struct inputs *inputs, const struct input_wire wire[INPUT_COUNT], const struct gang *gang);

/** [task] At which level limits, home switches, probe, tool setter and e-stop are on: as the board calls
 * them, or the other way round. */
void inputs_set_levels(struct inputs *inputs, struct input_senses senses);

/** [start, interrupts off] From now on edges interrupt, and `machine` gets them. */
void inputs_attach(struct inputs *inputs, struct machine *machine);

/** [task, every ms] Take in what has stopped bouncing. */
void inputs_sample(struct inputs *inputs);

/** [task, isr] Levels as core/hal/hal.h wants them. */
void inputs_read(const struct inputs *inputs, struct hal_inputs *out);

/** From startup.S. [isr] */
void on_edge(void);
void on_switch_timer(void);

#endif
