/* SPDX-License-Identifier: MIT
 * Overrides of feed, rapids and spindle, in percent. [task] */
#ifndef WIFICNC_MACHINE_OVERRIDES_H
#define WIFICNC_MACHINE_OVERRIDES_H

#include "machine/machine.h"

/** Overrides as the operator has set them; overrides_feed_pct() is in force. */
struct machine_overrides {
    uint8_t feed_pct;
    uint8_t rapid_pct;
    uint8_t spindle_pct;
    bool optional_stop; /* M1 pauses; a switch, which a reset leaves as it is */
};

/** All of them 100 %; in force from overrides_apply() on. */
static inline void overrides_begin(struct machine_overrides *overrides) {
    overrides->feed_pct = overrides->rapid_pct = overrides->spindle_pct = 100;
}

/** A byte from 0x90 on, or 0x88. @return false: it is none of these overrides */
bool overrides_take(struct machine_overrides *overrides, int byte);

/** Feed override in force for what is done now; jogs, probing and homing have none. */
void overrides_apply(struct machine *machine);

/** Feed override of the program, percent: 100 while M49 or M50 P0 have switched it off. */
uint8_t overrides_feed_pct(const struct machine *machine);

/** All of them to 100 %. */
void overrides_reset(struct machine *machine);

#endif
