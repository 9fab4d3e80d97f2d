/* SPDX-License-Identifier: MIT
 * Shift registers outside of the chip: 32 outputs of 74HC595 in a chain. They shift with each rising edge of
 * the clock and show with each rising edge of the latch. Edges come from pins that GPIO registers drive, or
 * whole words from the I2S peripheral (i2s.c), whose edges are not made one by one. */
#include "esp.h"

static bool is_high(const struct esp *esp, unsigned pin) {
    return (esp->gpio.level[pin / 32] >> pin % 32 & 1) != 0;
}

void shift_bits(struct esp *esp, uint32_t bits, unsigned count) {
    struct shift *shift = &esp->shift;
    shift->chain = count >= 32 ? bits : shift->chain << count | bits;
}

void shift_show(struct esp *esp, uint64_t cycle) {
    struct shift *shift = &esp->shift;
    const uint32_t changed = shift->chain ^ shift->shown;
    shift->shown = shift->chain;
    for (uint32_t left = changed; left != 0; left &= left - 1) {
        const unsigned output = (unsigned)__builtin_ctz(left);
        gpio_record(esp, cycle, ES_SHIFT_FIRST + output, (shift->shown >> output & 1) != 0);
    }
}

static bool rises(const struct esp *esp, unsigned pin, unsigned bank, uint32_t changed) {
    return pin / 32 == bank && (changed >> pin % 32 & 1) != 0 && is_high(esp, pin);
}

void shift_pins(struct esp *esp, uint64_t cycle, unsigned bank, uint32_t changed) {
    const struct shift *shift = &esp->shift;
    if (!shift->is_wired)
        return;
    if (rises(esp, shift->clock, bank, changed))
        shift_bits(esp, is_high(esp, shift->data), 1);
    if (rises(esp, shift->latch, bank, changed))
        shift_show(esp, cycle);
}

void shift_sync(struct esp *esp) {
    i2s_sync(esp);
}

void es_shift_registers(struct esp *esp, unsigned clock, unsigned data, unsigned latch) {
    shift_sync(esp);
    esp->shift = (struct shift){.is_wired = true,
                                .clock = clock % ES_PINS,
                                .data = data % ES_PINS,
                                .latch = latch % ES_PINS,
                                .chain = UINT32_MAX,
                                .shown = UINT32_MAX};
    gpio_listen(esp, esp->shift.clock);
    gpio_listen(esp, esp->shift.latch);
    chip_look(esp);
}

uint32_t es_shift_outputs(struct esp *esp) {
    shift_sync(esp);
    return esp->shift.shown;
}
