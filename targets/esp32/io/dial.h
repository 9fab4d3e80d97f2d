/* SPDX-License-Identifier: MIT
 * The dial: a unit of the pulse counter (PCNT) decodes A and B behind its glitch filter; its switches are
 * read. */
#ifndef WIFICNC_ESP32_DIAL_H
#define WIFICNC_ESP32_DIAL_H

#include "dial_wires.h"

struct machine_dial;

/** [start, after encoder_init()] @return what the machine gets; NULL: the pulse counter did not start */
const struct hal_dial *dial_init(const struct dial_wire wire[DIAL_LINES]);

/** The machine's part; NULL: there is no dial. */
struct machine_dial *dial_state(void);

#endif
