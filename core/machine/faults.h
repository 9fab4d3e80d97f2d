/* SPDX-License-Identifier: MIT
 * Fault outputs of motor drivers and servos, at digital inputs: $744, $745. [task]
 *
 * They are looked at, not waited for: an axis that has a fault has lost its position already, so the
 * interrupt of the e-stop would save nothing. */
#ifndef WIFICNC_MACHINE_FAULTS_H
#define WIFICNC_MACHINE_FAULTS_H

#include "machine/machine.h"
#include "machine/timer.h"

struct machine_faults {
    uint8_t seen;                /* lines that were faulty at each look since `filter` was started */
    uint8_t active;              /* lines that are faulty, and not for a moment only; bit n = Pn of M66 */
    struct machine_timer filter; /* when `seen` is old enough to be `active` */
};

/** What is faulty at power-on counts immediately. After inputs_begin(). */
void faults_begin(struct machine *machine);

/** Stop with alarm 54 when a fault is new. @return true when that was done */
bool faults_poll(struct machine *machine);

/** A driver has a fault now, at an input or in its registers. */
bool faults_any(const struct machine *machine);

/** [MSG:Check motor drivers: ..], if a driver has a fault. */
void faults_report(struct machine *machine);

/** Look again after this many us; UINT32_MAX: no need. */
uint32_t faults_wait_us(const struct machine *machine);

#endif
