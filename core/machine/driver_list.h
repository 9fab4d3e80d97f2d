/* SPDX-License-Identifier: MIT
 * Motor drivers with registers, in words. [task] */
#ifndef WIFICNC_MACHINE_DRIVER_LIST_H
#define WIFICNC_MACHINE_DRIVER_LIST_H

#include "machine/machine.h"

/** $DRIVERS: [DRIVER:name|chip|place|state|current|most current|hold|microsteps|scale|load|resets] each. */
void driver_list(const struct machine *machine);

/** One [MSG:Driver ..] for each problem. @param fresh  problems of each driver */
void driver_list_problems(const struct machine *machine, const uint16_t fresh[]);

/** [MSG:Driver X Y: text]. @param which  bit n: driver n */
void driver_list_message(const struct machine *machine, unsigned which, const char *text);

#endif
