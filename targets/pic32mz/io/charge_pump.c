/* SPDX-License-Identifier: MIT */
#include "io/charge_pump.h"

#include "chip/clock.h"
#include "chip/interrupts.h"
#include "io/pin.h"
#include "pin_config.h"

#include <stddef.h>

/* PBCLK3 by 2; a wave is two periods of the timer. */
#define PRESCALER_2 (1u << TCON_PRESCALE)
_Static_assert(CLOCK_BUS_HZ / 2u / 2u == BOARD_PUMP_CLOCK_HZ, "a tick of a wave is two of the timer");
_Static_assert(BOARD_PUMP_TICKS_MAX - 1u <= UINT16_MAX, "the longest half wave fits the timer");

static struct {
    struct output_wire wire;
    bool level;
    volatile uint32_t left; /* half waves until the main loop is taken for dead */
    uint32_t late;          /* of CHARGE_PUMP_LATE_MS */
} pump = {.wire = {.pin = NO_PIN}};

static void show(bool on) {
    pump.level = on;
    pin_write(pump.wire.pin, on == pump.wire.active_high);
}

void charge_pump_init(const struct output_wire *wire) {
    pump.wire = *wire;
    T9CON = 0;
    interrupt_clear(IRQ_T9);
}

static void set(struct hal *hal, uint32_t ticks) {
    (void)hal;
    interrupt_disable(IRQ_T9);
    T9CON = 0;
    show(false);
    if (ticks == 0)
        return;
    pump.late = BOARD_PUMP_CLOCK_HZ / 1000u * CHARGE_PUMP_LATE_MS / ticks * 2u;
    TMR9 = 0;
    PR9 = ticks - 1u;
    interrupt_clear(IRQ_T9);
    interrupt_enable(IRQ_T9);
    T9CON = PRESCALER_2 | TCON_ON;
}

const struct hal_pump *charge_pump_hal(void) {
    static const struct hal_pump hal = {.default_hz = BOARD_PUMP_DEFAULT_HZ,
                                        .clock_hz = BOARD_PUMP_CLOCK_HZ,
                                        .ticks_min = BOARD_PUMP_TICKS_MIN,
                                        .ticks_max = BOARD_PUMP_TICKS_MAX,
                                        .set = set};
    return pump.wire.pin != NO_PIN ? &hal : NULL;
}

void charge_pump_beat(void) {
    pump.left = pump.late;
}

void on_pump_timer(void) {
    interrupt_clear(IRQ_T9);
    const uint32_t left = pump.left;
    if (left > 0)
        pump.left = left - 1u;
    show(left > 0 && !pump.level);
}
