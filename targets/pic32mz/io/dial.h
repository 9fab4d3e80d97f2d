/* SPDX-License-Identifier: MIT
 * The dial: its two lines interrupt at each edge, as limit switches do (io/inputs.h), and are decoded there;
 * its switches are read. No filter but the debouncing that quadrature is. */
#ifndef WIFICNC_PIC32MZ_DIAL_H
#define WIFICNC_PIC32MZ_DIAL_H

#include "dial_wires.h"

struct machine_dial;

/** [start] Pins become inputs with their pulls. @return what the machine gets */
const struct hal_dial *dial_init(void);

/** The machine's part. */
struct machine_dial *dial_state(void);

/** [start, interrupts off] From now on edges interrupt. After inputs_attach(). */
void dial_attach(void);

/** [isr] Some input has changed. */
void dial_edge(void);

#endif
