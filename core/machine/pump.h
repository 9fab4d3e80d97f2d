/* SPDX-License-Identifier: MIT
 * The charge pump, $73: which frequencies its timer can make. [task] */
#ifndef WIFICNC_MACHINE_PUMP_H
#define WIFICNC_MACHINE_PUMP_H

#include "hal/hal.h"

struct machine;

/** The wave that is nearest to this frequency. @return its ticks; 0: none within 1 % of it */
uint32_t pump_ticks(const struct hal_pump *pump, double hz);

/** What $73 starts at. */
uint16_t pump_default_hz(const struct machine *machine);

/** $73 has changed, or the machine starts. */
void pump_apply(struct machine *machine);

#endif
