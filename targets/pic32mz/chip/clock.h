/* SPDX-License-Identifier: MIT
 * What clocks this board runs on. The configuration words, the UART's divider and the step timer follow from
 * it.
 */
#ifndef WIFICNC_PIC32MZ_CLOCK_H
#define WIFICNC_PIC32MZ_CLOCK_H

/* A 24 MHz oscillator on OSC1, through the PLL. */
#define CLOCK_INPUT_HZ     24000000u
#define CLOCK_PLL_DIVIDER  3u  /* FPLLIDIV; the PLL's input must be 5 .. 64 MHz */
#define CLOCK_PLL_MULTIPLY 50u /* FPLLMULT; the VCO must be 350 .. 700 MHz */
#define CLOCK_PLL_OUT      2u  /* FPLLODIV */
#define CLOCK_CPU_HZ       (CLOCK_INPUT_HZ / CLOCK_PLL_DIVIDER * CLOCK_PLL_MULTIPLY / CLOCK_PLL_OUT)

/* PBCLK2 (UARTs) and PBCLK3 (timers, output compare). */
#define CLOCK_BUS_DIVIDER 4u
#define CLOCK_BUS_HZ      (CLOCK_CPU_HZ / CLOCK_BUS_DIVIDER)

/* What the clock monitor goes over to when the oscillator has failed (BFRC); within 5 %. */
#define CLOCK_BACKUP_HZ 8000000u

/* CP0 Count advances every second cycle of the CPU. */
#define CLOCK_COUNT_HZ     (CLOCK_CPU_HZ / 2u)
#define CLOCK_COUNTS_IN_US (CLOCK_COUNT_HZ / 1000000u)

_Static_assert(CLOCK_CPU_HZ == 200000000u, "the fastest this part runs");
_Static_assert(CLOCK_INPUT_HZ / CLOCK_PLL_DIVIDER * CLOCK_PLL_MULTIPLY <= 700000000u, "VCO");

#endif
