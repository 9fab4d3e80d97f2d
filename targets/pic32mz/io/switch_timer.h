/* SPDX-License-Identifier: MIT
 * Timer 8, once: how long a switch must stay closed to count (hal_switch_timer_start()). */
#ifndef WIFICNC_PIC32MZ_SWITCH_TIMER_H
#define WIFICNC_PIC32MZ_SWITCH_TIMER_H

#include <stdint.h>

/** [start, interrupts off] From now on on_switch_timer() of inputs.h comes when the time is over. */
void switch_timer_init(void);

/** [isr, or interrupts held off] @param us  1 .. 1000 */
void switch_timer_start(uint32_t us);

/** [isr] Its time is over. */
void switch_timer_stop(void);

#endif
