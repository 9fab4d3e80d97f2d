/* SPDX-License-Identifier: MIT
 * Timer 8, once: how long a switch must stay closed to count (hal_switch_timer_start()). */
#ifndef WIFICNC_PIC32MZ_SWITCH_TIMER_H
#define WIFICNC_PIC32MZ_SWITCH_TIMER_H

#include <stdint.h>

struct machine;

/** [start, interrupts off] From now on `machine` is told when the time is over. */
void switch_timer_attach(struct machine *machine);

/** [isr, or interrupts held off] @param us  1 .. 1000 */
void switch_timer_start(uint32_t us);

/** From startup.S. [isr] */
void on_switch_timer(void);

#endif
