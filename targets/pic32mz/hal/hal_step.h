/* SPDX-License-Identifier: MIT
 * Hot tier of the PIC32MZ: timer 4 and output compare 1, the virtual dominant axis. Contract:
 * core/hal/README.md.
 *
 *   timer 4   0 ......... OC1RS ............ PR4 | 0 ......... OC1RS ...       ticks of 20 ns
 *             ^ match of before: the step ISR    ^ the next one
 *             '- pulse -'^ OC1: the pulse ends
 *
 * The timer's match is the step event: the step ISR puts the step bits out and writes the length of the new
 * period, PR4. OC1 makes continuous pulses on the same timer; its falling edge, always step_pulse after the
 * match, interrupts to end the pulse, and to set a new direction behind it. So no interrupt waits for a
 * pulse, nothing fires while nothing moves, and OC1's own output, on a board that routes it to a pin, is the
 * step signal of an axis that steps at every event. Both interrupts are of one level; of two that wait, the
 * step goes first.
 *
 * Step and direction lines are inverted (LATxINV): one write a port whatever the polarity ($2, $3). */
#ifndef WIFICNC_HAL_STEP_H
#define WIFICNC_HAL_STEP_H

#include "base/axis.h"
#include "chip/interrupts.h"
#include "chip/sfr.h"
#include "chip/system.h"
#include "hal/compiler.h"
#include "hal/spindle_pwm.h"
#include "pin_config.h"
#include "step_pins.h"

#include <stdbool.h>
#include <stdint.h>

#define HAL_ISR /* code runs from the flash, through the cache */

struct step_engine_board;

/** Step timer and pins. Filled by step_engine_init(). */
struct hal_step {
    struct step_pins pins;
    const struct step_engine_board *board;
    /* CP0 Counts (10 ns). The lengths are changed at rest only */
    uint32_t pulse_counts;     /* to wait for in a step pulse, and in the pause behind it */
    uint32_t dir_setup_counts; /* from a change of direction to the next pulse */
    uint32_t dir_quiet_counts; /* the longer of both */
    uint32_t pulse_ticks;      /* of timer 4, from its match to OC1's edge */
    uint32_t set_at;           /* when the present pulse began */
    uint32_t quiet_at, quiet;  /* no pulse begins within `quiet` of this moment */
    axis_mask_t pulsing;       /* axes whose step line is active */
    axis_mask_t negative;      /* axes that are to move in negative direction */
    axis_mask_t negative_pins; /* axes whose direction line says so; follows when the pulse has ended */
    bool running;
    const volatile uint32_t *probe_in; /* PORTx of the probe */
    uint32_t probe_mask;               /* the probe's bit; 0 = no probe */
    uint32_t probe_level;              /* (*probe_in & probe_mask) while it touches */
    uint32_t late;                     /* events whose time had passed when the timer was to be set */
};

/* What a board has no line at costs nothing: these masks are constants. */
#define STEP_PORT_INVERT(kind, port_number, bits)                                                            \
    do {                                                                                                     \
        if (BOARD_##kind##_MASK_##port_number != 0)                                                          \
            SFR_INV(LAT_ADDRESS(port_number)) = (bits)->bank[port_number];                                   \
    } while (0)

static HAL_INLINE void step_lines_invert(const struct pin_bits *bits) {
    STEP_PORT_INVERT(STEP, 0, bits);
    STEP_PORT_INVERT(STEP, 1, bits);
    STEP_PORT_INVERT(STEP, 2, bits);
    STEP_PORT_INVERT(STEP, 3, bits);
    STEP_PORT_INVERT(STEP, 4, bits);
    STEP_PORT_INVERT(STEP, 5, bits);
    STEP_PORT_INVERT(STEP, 6, bits);
}

static HAL_INLINE void dir_lines_invert(const struct pin_bits *bits) {
    STEP_PORT_INVERT(DIR, 0, bits);
    STEP_PORT_INVERT(DIR, 1, bits);
    STEP_PORT_INVERT(DIR, 2, bits);
    STEP_PORT_INVERT(DIR, 3, bits);
    STEP_PORT_INVERT(DIR, 4, bits);
    STEP_PORT_INVERT(DIR, 5, bits);
    STEP_PORT_INVERT(DIR, 6, bits);
}

static HAL_INLINE void step_turn(struct hal_step *hal) {
    dir_lines_invert(&hal->pins.dir[hal->negative ^ hal->negative_pins]);
    hal->negative_pins = hal->negative;
    hal->quiet_at = system_count();
    hal->quiet = hal->dir_quiet_counts;
}

/* [isr] The present pulse ends; the wait is for an interrupt that came late after one in time. */
static HAL_INLINE void step_pulse_end(struct hal_step *hal) {
    while (system_count() - hal->set_at < hal->pulse_counts) {
    }
    step_lines_invert(&hal->pins.step[hal->pulsing]);
    hal->pulsing = 0;
    hal->quiet_at = system_count();
    hal->quiet = hal->pulse_counts;
    if (__builtin_expect(hal->negative != hal->negative_pins, 0))
        step_turn(hal);
}

static HAL_INLINE void hal_step_set(struct hal_step *hal, axis_mask_t axes) {
    if (axes == 0)
        return;
    if (__builtin_expect(hal->pulsing != 0, 0)) /* the event before has come very late */
        step_pulse_end(hal);
    while (system_count() - hal->quiet_at < hal->quiet) {
    }
    step_lines_invert(&hal->pins.step[axes]);
    hal->set_at = system_count();
    hal->pulsing = axes;
}

/* OC1's interrupt does it. */
static HAL_INLINE void hal_step_clear(struct hal_step *hal) {
    (void)hal;
}

/* While a pulse is high its direction stays: its end brings the new one. */
static HAL_INLINE void hal_step_direction(struct hal_step *hal, axis_mask_t negative) {
    hal->negative = negative;
    if (hal->pulsing == 0 && negative != hal->negative_pins)
        step_turn(hal);
}

static HAL_INLINE void hal_step_duty(struct hal_step *hal, uint32_t value) {
    (void)hal;
    spindle_pwm_set(value);
}

static HAL_INLINE bool hal_step_probe(const struct hal_step *hal) {
    return (*hal->probe_in & hal->probe_mask) == hal->probe_level;
}

/* The timer began the period at the present event. Where that is over already, after another interrupt of
 * this level, the next event comes immediately; hal_step_set() keeps the pulses apart. */
static HAL_INLINE void hal_step_timer_next(struct hal_step *hal, uint32_t ticks) {
    PR4 = ticks - 1;
    if (__builtin_expect(TMR4 < ticks - 1, 1))
        return;
    TMR4 = ticks - 2;
    hal->late++;
}

static HAL_INLINE void hal_step_timer_start(struct hal_step *hal, uint32_t ticks) {
    SFR_CLR(T4CON_ADDRESS) = TCON_ON;
    TMR4 = 0;
    PR4 = ticks - 1;
    OC1RS = hal->pulse_ticks;
    interrupt_clear(IRQ_T4);
    hal->running = true;
    interrupt_enable(IRQ_T4);
    SFR_SET(T4CON_ADDRESS) = TCON_ON;
}

/* The timer continues until OC1 has ended the present pulse. */
static HAL_INLINE void hal_step_timer_stop(struct hal_step *hal) {
    interrupt_disable(IRQ_T4);
    interrupt_clear(IRQ_T4);
    hal->running = false;
}

static HAL_INLINE void hal_step_span(struct hal_step *hal, uint16_t flags, uint32_t line) {
    (void)hal;
    (void)flags;
    (void)line;
}

#endif
