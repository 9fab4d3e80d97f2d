/* SPDX-License-Identifier: MIT
 * The configuration words, DEVCFG3 .. DEVCFG0 (Registers 34-3 to 34-6), from what is wanted. Reserved bits
 * are 1 where the data sheet says r-1. They are only in the HEX for a programmer; a bootloader keeps its own.
 */
#ifndef WIFICNC_PIC32MZ_CONFIG_WORDS_H
#define WIFICNC_PIC32MZ_CONFIG_WORDS_H

#include "chip/clock.h"

/* DEVCFG3, Register 34-6 */
#define DEVCFG3_RESERVED 0x84FF0000u
#define DEVCFG3_FUSBIDIO (1u << 30) /* USBID belongs to the USB module */
#define DEVCFG3_FETHIO   (1u << 25) /* default Ethernet pins */
#define DEVCFG3_USERID   0xFFFFu
#define DEVCFG3_WORD     (DEVCFG3_RESERVED | DEVCFG3_FUSBIDIO | DEVCFG3_FETHIO | DEVCFG3_USERID)

/* DEVCFG2, Register 34-5: the PLL */
#define DEVCFG2_RESERVED    0xBFF88008u
#define DEVCFG2_UPLLFSEL_24 (1u << 30)
#define DEVCFG2_FPLLODIV(n) ((n) == 2u ? 1u << 16 : 2u << 16) /* 2 or 4 */
#define DEVCFG2_FPLLMULT(n) (((n) - 1u) << 8)
#define DEVCFG2_FPLLICLK    0u        /* the primary oscillator feeds the PLL */
#define DEVCFG2_FPLLRNG     (1u << 4) /* 5 .. 10 MHz behind the divider */
#define DEVCFG2_FPLLIDIV(n) ((n) - 1u)
#define DEVCFG2_WORD                                                                                         \
    (DEVCFG2_RESERVED | DEVCFG2_UPLLFSEL_24 | DEVCFG2_FPLLODIV(CLOCK_PLL_OUT) |                              \
     DEVCFG2_FPLLMULT(CLOCK_PLL_MULTIPLY) | DEVCFG2_FPLLICLK | DEVCFG2_FPLLRNG |                             \
     DEVCFG2_FPLLIDIV(CLOCK_PLL_DIVIDER))
_Static_assert(CLOCK_INPUT_HZ / CLOCK_PLL_DIVIDER >= 5000000u &&
                   CLOCK_INPUT_HZ / CLOCK_PLL_DIVIDER <= 10000000u,
               "FPLLRNG");

/* DEVCFG1, Register 34-4: oscillator and timers that watch */
#define DEVCFG1_RESERVED  0x00003800u
#define DEVCFG1_DMTCNT    (0x17u << 26) /* deadman timer: off (FDMTEN = 0), longest */
#define DEVCFG1_FWDTWINSZ (3u << 24)
#define DEVCFG1_WINDIS    (1u << 22) /* the watchdog has no window */
#define DEVCFG1_WDTSPGM   (1u << 21) /* ... and stops while flash is programmed */
#define DEVCFG1_WDTPS_2048                                                                                   \
    (11u << 16) /* ... and bites after 2.048 s of the 32 kHz clock; firmware starts it */
#define DEVCFG1_FCKSM      (2u << 14) /* no clock switching, but the clock is monitored */
#define DEVCFG1_OSCIOFNC   (1u << 10) /* no clock on OSC2 */
#define DEVCFG1_POSCMOD_EC (0u << 8)  /* an oscillator, not a crystal */
#define DEVCFG1_DMTINTV    (7u << 3)
#define DEVCFG1_FNOSC_SPLL 1u
#define DEVCFG1_WORD                                                                                         \
    (DEVCFG1_RESERVED | DEVCFG1_DMTCNT | DEVCFG1_FWDTWINSZ | DEVCFG1_WINDIS | DEVCFG1_WDTSPGM |              \
     DEVCFG1_WDTPS_2048 | DEVCFG1_FCKSM | DEVCFG1_OSCIOFNC | DEVCFG1_POSCMOD_EC | DEVCFG1_DMTINTV |          \
     DEVCFG1_FNOSC_SPLL)

/* DEVCFG0, Register 34-3 */
#define DEVCFG0_RESERVED 0xBFC00880u
#define DEVCFG0_EJTAGBEN (1u << 30)
#define DEVCFG0_POSC     (7u << 19) /* gain and boost of the primary oscillator: a crystal's business */
#define DEVCFG0_SOSC     (7u << 16) /* the same of the secondary one */
#define DEVCFG0_SMCLR    (1u << 15) /* MCLR is a system reset */
#define DEVCFG0_DBGPER   (7u << 12)
#define DEVCFG0_FSLEEP   (1u << 10)
#define DEVCFG0_FECCCON_OFF                                                                                  \
    (3u << 8)                        /* no ECC: a word of flash cut off half written is read, not trapped    \
                                      */
#define DEVCFG0_BOOTISA    (1u << 6) /* exceptions in MIPS32, not microMIPS */
#define DEVCFG0_ICESEL_2   (2u << 3) /* debugger at PGEC2, PGED2 */
#define DEVCFG0_JTAGEN_OFF 0u
#define DEVCFG0_DEBUG_OFF  3u
#define DEVCFG0_WORD                                                                                         \
    (DEVCFG0_RESERVED | DEVCFG0_EJTAGBEN | DEVCFG0_POSC | DEVCFG0_SOSC | DEVCFG0_SMCLR | DEVCFG0_DBGPER |    \
     DEVCFG0_FSLEEP | DEVCFG0_FECCCON_OFF | DEVCFG0_BOOTISA | DEVCFG0_ICESEL_2 | DEVCFG0_JTAGEN_OFF |        \
     DEVCFG0_DEBUG_OFF)

/* DEVCP0 and DEVSIGN0 (Registers 34-1, 34-2): no code protection; bit 31 of the signature is 0 */
#define DEVCP0_WORD   0xFFFFFFFFu
#define DEVSIGN0_WORD 0x7FFFFFFFu

#endif
