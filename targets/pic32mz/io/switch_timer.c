/* SPDX-License-Identifier: MIT */
#include "io/switch_timer.h"

#include "chip/clock.h"
#include "chip/interrupts.h"

/* PBCLK3 by 8: 160 ns. */
#define PRESCALER_8  (3u << 4)
#define TICKS_IN_4US (CLOCK_BUS_HZ / 8u / 250000u)
_Static_assert(TICKS_IN_4US * 250000u * 8u == CLOCK_BUS_HZ, "whole ticks");
_Static_assert(1000u * TICKS_IN_4US / 4u <= UINT16_MAX, "the longest time fits the timer");

void switch_timer_init(void) {
    T8CON = PRESCALER_8;
    interrupt_clear(IRQ_T8);
    interrupt_enable(IRQ_T8);
}

void switch_timer_start(uint32_t us) {
    T8CON = PRESCALER_8;
    TMR8 = 0;
    PR8 = us * TICKS_IN_4US / 4u + 1u;
    interrupt_clear(IRQ_T8);
    T8CON = PRESCALER_8 | TCON_ON;
}

void switch_timer_stop(void) {
    T8CON = PRESCALER_8;
    interrupt_clear(IRQ_T8);
}
