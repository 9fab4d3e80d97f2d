/* SPDX-License-Identifier: MIT
 * The interrupts of this firmware: who interrupts whom. The vectors are in startup.S. */
#ifndef WIFICNC_PIC32MZ_INTERRUPTS_H
#define WIFICNC_PIC32MZ_INTERRUPTS_H

#include "chip/sfr.h"

#include <stdint.h>

/** Numbers of Table 7-2. */
enum {
    IRQ_CORE_TIMER = 0,
    IRQ_OC1 = 7,
    IRQ_T4 = 19,
    IRQ_T8 = 36,
    IRQ_T9 = 40,
    IRQ_CHANGE_A = 118, /* .. IRQ_CHANGE_A + 6: ports A to G */
    IRQ_U2_RX = 146,
    IRQ_U2_TX = 147,
    IRQ_U3_RX = 158,
    IRQ_U3_TX = 159,
    IRQ_WORDS = 7, /* IEC0 .. IEC6 */
};

/* Level, and order within it. Steps and switches are one level, so that none of them comes between another's
 * instructions: switches must see a whole step. Among those that wait, the step goes before the end of its
 * pulse (hal_step.h relies on that). A level's shadow register set has its number. */
enum { LEVEL_TICK = 1, LEVEL_PUMP = 2, LEVEL_UART = 3, LEVEL_STEP = 6 };
enum { ORDER_PULSE_END = 1, ORDER_EDGE = 2, ORDER_STEP = 3 };

/** [start] Disable every source: a bootloader that ran before may have left its own on. */
void interrupts_stop_all(void);

/** [start] Vectors, levels, shadow sets. All sources stay disabled; interrupts are on when this returns. */
void interrupts_init(void);

static inline void interrupt_enable(unsigned irq) {
    SFR_SET(IEC_ADDRESS(irq / 32)) = 1u << irq % 32;
}

/** Also waits until it has arrived: not one more interrupt comes from this source. */
static inline void interrupt_disable(unsigned irq) {
    SFR_CLR(IEC_ADDRESS(irq / 32)) = 1u << irq % 32;
    (void)SFR(IEC_ADDRESS(irq / 32));
}

static inline void interrupt_clear(unsigned irq) {
    SFR_CLR(IFS_ADDRESS(irq / 32)) = 1u << irq % 32;
}

/** [task] Hold all interrupts off. @return what interrupts_restore() wants */
static inline uint32_t interrupts_hold(void) {
    uint32_t status;
    __asm__ volatile("di %0\n\tehb" : "=r"(status) : : "memory");
    return status;
}

static inline void interrupts_restore(uint32_t status) {
    if ((status & 1u) != 0)
        __asm__ volatile("ei\n\tehb" : : : "memory");
}

#endif
