/* SPDX-License-Identifier: MIT */
#include "io/dial.h"

#include "base/quadrature.h"
#include "chip/interrupts.h"
#include "io/pin.h"
#include "machine/dial.h"

static const struct dial_wire wires[DIAL_LINES] = {BOARD_DIAL_WIRES(DIAL_WIRE)};
static struct quadrature wheel;
static struct machine_dial state;

static unsigned is_on(unsigned line) {
    const struct dial_wire *wire = &wires[line];
    if (wire->pin == NO_PIN)
        return 0;
    const bool high = (SFR(PORT_ADDRESS(pin_port(wire->pin))) & pin_bit(wire->pin)) != 0;
    return high == wire->active_high ? 1u : 0u;
}

void dial_edge(void) {
    quadrature_take(&wheel, is_on(DIAL_A), is_on(DIAL_B));
}

/* Each is one word, which the interrupt writes. */
static void read_dial(struct hal *hal, struct hal_dial_state *out) {
    unsigned on = 0;
    (void)hal;
    for (unsigned line = DIAL_X10; line < DIAL_LINES; line++)
        on |= is_on(line) << line;
    *out = (struct hal_dial_state){.counts = __atomic_load_n(&wheel.counts, __ATOMIC_RELAXED),
                                   .slips = __atomic_load_n(&wheel.slips, __ATOMIC_RELAXED)};
    dial_switches(on, out);
}

const struct hal_dial *dial_init(void) {
    static const struct hal_dial ops = {.counts_per_detent = BOARD_DIAL_COUNTS,
                                        .selects_axis = BOARD_DIAL_SELECTS_AXIS != 0,
                                        .read = read_dial};
    for (unsigned line = 0; line < DIAL_LINES; line++)
        if (wires[line].pin != NO_PIN)
            pin_make_input(wires[line].pin, wires[line].pull);
    wheel.phase = quadrature_phase(is_on(DIAL_A), is_on(DIAL_B));
    return &ops;
}

struct machine_dial *dial_state(void) {
    return &state;
}

void dial_attach(void) {
    for (unsigned line = DIAL_A; line <= DIAL_B; line++) {
        const uint8_t pin = wires[line].pin;
        SFR(CNCON_ADDRESS(pin_port(pin))) = CNCON_ON | CNCON_EDGE_DETECT;
        SFR_SET(CNEN_ADDRESS(pin_port(pin))) = pin_bit(pin);
        SFR_SET(CNNE_ADDRESS(pin_port(pin))) = pin_bit(pin);
        interrupt_clear(IRQ_CHANGE_A + pin_port(pin));
        interrupt_enable(IRQ_CHANGE_A + pin_port(pin));
    }
    dial_edge(); /* what has changed before */
}
