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
    bool optional_stop; /* by 0x88 M1 pauses; a switch, which a reset leaves as it is */
    bool switched;      /* by the board's switch, at this look or the one before */
};

/** All of them 100 %; in force from overrides_apply() on. */
static inline void overrides_begin(struct machine_overrides *overrides) {
    overrides->feed_pct = overrides->rapid_pct = overrides->spindle_pct = 100;
}

/** A byte from 0x90 on, or 0x88. @return false: it is none of these overrides */
bool overrides_take(struct machine_overrides *overrides, int byte);

/** Look at the board's switch of M1. A glitch of one look never makes it pass M1.
 *  @param before  levels of digital inputs at the last look */
void overrides_see_switch(struct machine *machine, uint8_t before);

/** M1 pauses: by 0x88, or by the board's switch. */
static inline bool overrides_pause(const struct machine_overrides *overrides) {
    return overrides->optional_stop || overrides->switched;
}

/** Feed override in force for what is done now; jogs, probing and homing have none. */
void overrides_apply(struct machine *machine);

/** Feed override of the program, percent: 100 while M49 or M50 P0 have switched it off. */
uint8_t overrides_feed_pct(const struct machine *machine);

/** All of them to 100 %. */
void overrides_reset(struct machine *machine);

#endif
