/* SPDX-License-Identifier: MIT */
#include "machine/pump.h"

#include "machine/parts.h"

#include <stddef.h>

uint32_t pump_ticks(const struct hal_pump *pump, double hz) {
    const double wanted = (double)pump->clock_hz / hz;
    /* Before the cast, which has no meaning for larger numbers. */
    if (!(wanted >= (double)pump->ticks_min - 0.5 && wanted < (double)pump->ticks_max + 0.5))
        return 0;
    const uint32_t ticks = (uint32_t)(wanted + 0.5);
    const double off = (double)ticks - wanted;
    return off <= 0.01 * wanted && -off <= 0.01 * wanted ? ticks : 0;
}

uint16_t pump_default_hz(const struct machine *machine) {
    return machine->board.pump != NULL ? machine->board.pump->default_hz : 0;
}

void pump_apply(struct machine *machine) {
    const struct hal_pump *pump = machine->board.pump;
    const uint16_t hz = machine->settings.charge_pump_hz;
    if (pump != NULL)
        pump->set(machine->hal, hz > 0 ? pump_ticks(pump, hz) : 0);
}
