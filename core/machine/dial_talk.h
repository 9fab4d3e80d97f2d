/* SPDX-License-Identifier: MIT
 * Messages of the dial: what was dropped of its counts, and why. Behind machine/dial.h. [task] */
#ifndef WIFICNC_MACHINE_DIAL_TALK_H
#define WIFICNC_MACHINE_DIAL_TALK_H

#include "machine/machine.h"

/** Something is to be reported: after a moment, with what else comes in it, and not often. */
void dial_talk_soon(struct machine *machine);

void dial_talk_poll(struct machine *machine);

#endif
