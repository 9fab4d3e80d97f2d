/* SPDX-License-Identifier: MIT
 * What is for the chip in tests/xtensa/vector: registers in memory, with a look at each access.
 * Everything is inline, as the interrupt's code and the program's have different ABIs. */
#pragma once

#include <stdint.h>

enum { EMULATED_AXES = 6, FIRST_STEP_GPIO = 0, FIRST_DIR_GPIO = 8 };

struct emulated {
    uint32_t random;
    uint32_t least_cycles, spread_mask; /* an interrupt comes this long after the last access to the timer */
    volatile int32_t steps[EMULATED_AXES]; /* that have left the pins */
    uint32_t negative;
    uint32_t looks;              /* of the interrupt at the timer, some in each */
    uint32_t looks_from_windows; /* those in an interrupt of a window handler */
};

extern struct emulated emulated;

static inline uint32_t emulated_random(void) {
    uint32_t value = emulated.random;
    value ^= value << 13;
    value ^= value >> 17;
    value ^= value << 5;
    return emulated.random = value;
}

static inline uint32_t emulated_cycles(void) {
    uint32_t cycles;
    __asm__ volatile("rsr %0, ccount" : "=r"(cycles));
    return cycles;
}

/* By the interrupt: what has it interrupted? */
static inline void emulated_note_origin(void) {
    uint32_t ps, pc;
    __asm__ volatile("rsr %0, ps\n\trsr %1, epc5" : "=r"(ps), "=r"(pc));
    if ((ps & 0xF) != 5)
        return;
    emulated.looks++;
    __asm__ volatile("wsr %0, sar\n\twsr %0, scompare1" ::"r"(emulated.looks & 31)); /* as a compiler may */
    if (pc >= 0x2000 && pc < 0x2180)
        emulated.looks_from_windows++;
}
