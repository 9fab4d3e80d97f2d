/* SPDX-License-Identifier: MIT
 * Whose motion is: the text side's, or a network host's. [task] */
#ifndef WIFICNC_MACHINE_OWNER_H
#define WIFICNC_MACHINE_OWNER_H

#include "machine/actions.h"

/** Nothing of anyone is under way, and no pendant is in control (MPG). Between two polls the state says
 * whether something moves; asking the motion side would also find it busy when it only looks around. */
bool owner_is_free(const struct machine *machine);

/** A host homes, jogs or discards its queue: segments are refused until that is over. */
bool owner_host_is_busy(const struct machine *machine);

/** Whether motion can be a host's: its own is under way, or nothing moves. */
enum refusal owner_may_be_host(const struct machine *machine);

/** Motion is the host's from now on. */
void owner_take_over(struct machine *machine);

#endif
