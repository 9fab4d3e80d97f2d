/* SPDX-License-Identifier: MIT */
#include "hal/step_engine.h"

#include "chip/clock.h"

#include <stddef.h>

#define TICK_NS  (1000000000u / CLOCK_BUS_HZ)
#define COUNT_NS (1000000000u / CLOCK_COUNT_HZ)
/* By which a step line goes up later behind its interrupt than it goes down. */
#define SET_LATER_TICKS 4u

/* From the last look at CP0 Count in a wait to the write it was for it is 10 instructions, of a cycle or more
 * each: 50 ns, less the 10 ns that Count does not tell. tests/pic32mz measures what comes of it. */
#define AFTER_WAIT_COUNTS 4u
#define NO_PROBE_LEVEL    1u /* what (anything & 0) never is */

_Static_assert(BOARD_TIMER_HZ == CLOCK_BUS_HZ, "timer 4 counts PBCLK3, undivided");
_Static_assert(BOARD_BANK_COUNT == PIN_BANKS && BOARD_BANK_WIDTH == PIN_BANK_WIDTH, "a bank is a port");

static struct step *stepping;

static uint32_t rounded_up(uint32_t ns, uint32_t unit_ns) {
    return (ns + unit_ns - 1u) / unit_ns;
}

void step_engine_watch(struct hal_step *hal, uint8_t pin, bool high) {
    const bool wired = pin != NO_PIN;
    hal->probe_in = &SFR(PORT_ADDRESS(wired ? pin / PORT_WIDTH : 0u));
    hal->probe_mask = wired ? 1u << pin % PORT_WIDTH : 0;
    hal->probe_level = !wired ? NO_PROBE_LEVEL : high ? hal->probe_mask : 0;
}

bool step_engine_init(struct hal_step *hal, const struct step_engine_board *board) {
    if (!step_pins_set(&hal->pins, &board->gang, board->step_pin, board->dir_pin))
        return false;
    hal->board = board;
    hal->dir_setup_counts = rounded_up(board->dir_setup_ns, COUNT_NS);
    step_engine_set_pulse(hal, board->step_pulse_ns);
    step_engine_watch(hal, NO_PIN, false);
    SFR(T4CON_ADDRESS) = 0; /* PBCLK3, prescaler 1:1, 16 bits */
    OC1CON = 0;
    OC1R = 1;
    OC1RS = hal->pulse_ticks;
    OC1CON = OCM_PULSES | OCCON_ON;
    return true;
}

void step_engine_attach(struct step *step) {
    stepping = step;
    interrupt_clear(IRQ_OC1);
    interrupt_enable(IRQ_OC1);
}

void step_engine_set_pulse(struct hal_step *hal, uint32_t step_pulse_ns) {
    hal->pulse_counts = rounded_up(step_pulse_ns, COUNT_NS) - AFTER_WAIT_COUNTS;
    hal->pulse_ticks = rounded_up(step_pulse_ns, TICK_NS) + SET_LATER_TICKS;
    hal->dir_quiet_counts =
        hal->pulse_counts > hal->dir_setup_counts ? hal->pulse_counts : hal->dir_setup_counts;
}

/* The lines are only ever toggled (LATxINV), so their level at rest is set here once, and with it the
 * polarity. */
static void set_levels(const uint8_t pin[AXIS_COUNT], unsigned high_motors) {
    const struct pin_bits lines = step_pins_bits(pin, AXIS_MASKS - 1);
    const struct pin_bits high = step_pins_bits(pin, high_motors);
    for (unsigned port = 0; port < PORT_COUNT; port++) {
        SFR_CLR(LAT_ADDRESS(port)) = lines.bank[port] & ~(uint32_t)high.bank[port];
        SFR_SET(LAT_ADDRESS(port)) = high.bank[port];
    }
}

void step_engine_invert(struct hal_step *hal, axis_mask_t step, axis_mask_t dir, axis_mask_t second) {
    const struct step_engine_board *board = hal->board;
    const axis_mask_t now = dir ^ hal->negative_pins;
    set_levels(board->step_pin, gang_motors(&board->gang, step, step) ^ board->step_low);
    set_levels(board->dir_pin, gang_motors(&board->gang, now, now ^ second) ^ board->dir_low);
}

void step_engine_regroup(struct hal_step *hal) {
    const struct step_engine_board *board = hal->board;
    (void)step_pins_set(&hal->pins, &board->gang, board->step_pin, board->dir_pin);
}

void step_engine_hold(struct hal_step *hal, axis_mask_t first, axis_mask_t second) {
    /* The interrupt that ends a pulse toggles the lines that the table has. */
    while (__atomic_load_n(&hal->pulsing, __ATOMIC_RELAXED) != 0) {
    }
    step_pins_hold(&hal->pins, &hal->board->gang, hal->board->step_pin, first, second);
}

/* A halted timer's last interrupt may still be on its way: it finds the step side not active. */
void on_step_timer(void) {
    struct step *step = stepping;
    interrupt_clear(IRQ_T4);
    if (__builtin_expect(step->active, 1))
        step_isr(step);
    else
        interrupt_disable(IRQ_T4);
}

void on_pulse_end(void) {
    struct hal_step *hal = stepping->hal;
    interrupt_clear(IRQ_OC1);
    if (hal->pulsing != 0)
        step_pulse_end(hal);
    if (__builtin_expect(!hal->running, 0))
        SFR_CLR(T4CON_ADDRESS) = TCON_ON;
}
