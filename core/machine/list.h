/* SPDX-License-Identifier: MIT
 * Answers of several lines: $$ $# $G $I $N. [task] */
#ifndef WIFICNC_MACHINE_LIST_H
#define WIFICNC_MACHINE_LIST_H

#include "machine/machine.h"

/** $n: the setting of this number. @return false: there is none */
bool list_setting(struct machine *machine, uint16_t number);

/** $$ */
void list_settings(struct machine *machine);

/** $# */
void list_offsets(struct machine *machine);

/** [PRB:] of the last G38 */
void list_probe(struct machine *machine);

/** $G */
void list_modes(struct machine *machine);

/** $I */
void list_build(struct machine *machine);

/** [CAPS:], of $I+ */
void list_codes(struct machine *machine);

/** $SPINDLES: those that $395 can name on this board */
void list_spindles(struct machine *machine);

/** $N */
void list_startup(struct machine *machine);

#endif
