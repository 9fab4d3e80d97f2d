/* SPDX-License-Identifier: MIT
 * Timer 1 of group 0, once: how long a switch must stay closed to count (hal_switch_timer_start()). The step
 * timer is timer 0 of this group, and step_engine_init() starts the group. */
#ifndef WIFICNC_ESP32_SWITCH_TIMER_H
#define WIFICNC_ESP32_SWITCH_TIMER_H

#include <stdbool.h>
#include <stdint.h>

/** [task on core 1] From now on handler(arg) comes when the time is over. @return false: no interrupt is free
 */
bool switch_timer_init(void (*handler)(void *arg), void *arg);

/** [isr, or in a critical section on core 1] @param us  1 .. 1000 */
void switch_timer_start(uint32_t us);

/** [isr] Its time is over. */
void switch_timer_stop(void);

#endif
