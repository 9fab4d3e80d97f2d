/* SPDX-License-Identifier: MIT */
#include "io/inputs.h"

#include "chip/clock.h"
#include "chip/interrupts.h"
#include "chip/system.h"
#include "io/dial.h"
#include "io/pin.h"
#include "io/switch_timer.h"
#include "machine/machine.h"

#define OFF_COUNTS (CLOCK_COUNT_HZ / 200u) /* 5 ms */

static struct inputs *attached;

/* Inputs that are on, as the pins are now. */
static uint32_t read_pins(const struct inputs *inputs) {
    uint32_t port[PORT_COUNT], high = 0;
    for (unsigned i = 0; i < PORT_COUNT; i++)
        port[i] = SFR(PORT_ADDRESS(i));
    for (unsigned input = 0; input < INPUT_MISC; input++) {
        uint8_t pin = inputs->wire[input].pin;
        if (pin != NO_PIN)
            high |= (port[pin_port(pin)] >> pin % PORT_WIDTH & 1u) << input;
    }
    return (high ^ inputs->active_low ^ inputs->inverted) & inputs->wired;
}

/* Levels of M66's inputs. */
static uint8_t read_misc(const struct inputs *inputs) {
    unsigned high = 0;
    for (unsigned n = 0; n < DIGITAL_INPUT_COUNT; n++) {
        uint8_t pin = inputs->wire[INPUT_MISC + n].pin;
        if (pin != NO_PIN)
            high |= (SFR(PORT_ADDRESS(pin_port(pin))) >> pin % PORT_WIDTH & 1u) << n;
    }
    return (uint8_t)high;
}

static void sample_misc(struct inputs *inputs) {
    uint8_t raw = read_misc(inputs);
    uint32_t now = system_count();
    if (raw != inputs->misc_raw)
        inputs->misc_since_count = now;
    inputs->misc_raw = raw;
    if (now - inputs->misc_since_count >= OFF_COUNTS)
        inputs->misc = raw;
}

/* Interrupts of this level are held off. @return inputs that have changed, by their pins or for good */
static uint32_t take_levels(struct inputs *inputs) {
    uint32_t raw = read_pins(inputs), now = system_count(), before = inputs->stable;
    uint32_t changed = raw ^ inputs->raw;
    if (raw != inputs->raw)
        inputs->since_count = now;
    inputs->raw = raw;
    /* On at the first edge; off when no pin has changed for OFF_COUNTS. */
    inputs->stable |= raw;
    if (now - inputs->since_count >= OFF_COUNTS)
        inputs->stable = raw;
    return changed | (inputs->stable ^ before);
}

static void take_sample(struct inputs *inputs) {
    if ((take_levels(inputs) & INPUT_STOPPING) != 0 && inputs->machine != NULL)
        machine_edge_isr(inputs->machine);
}

void on_edge(void) {
    for (unsigned port = 0; port < PORT_COUNT; port++) {
        SFR(CNF_ADDRESS(port)) = 0;
        interrupt_clear(IRQ_CHANGE_A + port);
    }
    /* After the flags: an edge that comes after the reading sets them again. */
    take_sample(attached);
    if (BOARD_HAS_DIAL)
        dial_edge();
}

void on_switch_timer(void) {
    switch_timer_stop();
    (void)take_levels(attached);
    machine_switch_timer_isr(attached->machine);
}

void inputs_init(struct inputs *inputs, const struct input_wire wire[INPUT_COUNT], const struct gang *gang) {
    *inputs = (struct inputs){.gang = gang};
    for (unsigned input = 0; input < INPUT_COUNT; input++) {
        inputs->wire[input] = wire[input];
        if (wire[input].pin == NO_PIN)
            continue;
        pin_make_input(wire[input].pin, wire[input].pull);
        if (input >= INPUT_MISC)
            continue;
        inputs->wired |= 1u << input;
        inputs->active_low |= (wire[input].active_high ? 0u : 1u) << input;
    }
    inputs->misc = inputs->misc_raw = read_misc(inputs);
    inputs_set_levels(inputs, (struct input_senses){0});
}

void inputs_set_levels(struct inputs *inputs, struct input_senses senses) {
    uint32_t held = interrupts_hold();
    inputs->inverted = (senses.limit_invert ? INPUT_SWITCHES : 0) |
                       (senses.probe_invert ? 1u : 0u) << INPUT_PROBE |
                       (senses.toolsetter_invert ? 1u : 0u) << INPUT_TOOLSETTER |
                       (senses.estop_normally_open ? 1u : 0u) << INPUT_ESTOP;
    /* From the levels as they are: a changed polarity is not an edge. */
    inputs->raw = inputs->stable = read_pins(inputs);
    inputs->since_count = system_count();
    interrupts_restore(held);
}

void inputs_attach(struct inputs *inputs, struct machine *machine) {
    attached = inputs;
    inputs->machine = machine;
    switch_timer_init();
    for (unsigned input = 0; input < INPUT_MISC; input++) {
        uint8_t pin = inputs->wire[input].pin;
        if (pin == NO_PIN || (INPUT_STOPPING >> input & 1) == 0)
            continue;
        SFR(CNCON_ADDRESS(pin_port(pin))) = CNCON_ON | CNCON_EDGE_DETECT;
        SFR_SET(CNEN_ADDRESS(pin_port(pin))) = pin_bit(pin);
        SFR_SET(CNNE_ADDRESS(pin_port(pin))) = pin_bit(pin);
        interrupt_clear(IRQ_CHANGE_A + pin_port(pin));
        interrupt_enable(IRQ_CHANGE_A + pin_port(pin));
    }
}

/* Interrupts are held off only when there is something to do, for the steps' sake. */
void inputs_sample(struct inputs *inputs) {
    sample_misc(inputs);
    if (read_pins(inputs) == inputs->raw && inputs->stable == inputs->raw)
        return;
    uint32_t held = interrupts_hold();
    take_sample(inputs);
    interrupts_restore(held);
}

/* As the pin is now: a probe that closes between two samples is closed. @return its level as $6 or $72 has it
 */
static bool probe_level(const struct inputs *inputs, unsigned input) {
    const uint8_t pin = inputs->wire[input].pin;
    const uint32_t bit = 1u << input;
    uint32_t high = pin == NO_PIN ? 0 : SFR(PORT_ADDRESS(pin_port(pin))) & pin_bit(pin);
    uint32_t on = (high != 0 ? bit : 0) ^ inputs->active_low ^ inputs->inverted;
    return ((on & inputs->wired & bit) != 0) == ((inputs->inverted & bit) != 0);
}

/* Levels as $5 has them. */
static struct hal_switches levels_of(const struct inputs *inputs, uint32_t on) {
    return switches_of(inputs->gang, on ^ (INPUT_SWITCHES & ~inputs->inverted));
}

void inputs_read(const struct inputs *inputs, struct hal_inputs *out) {
    uint32_t on = __atomic_load_n(&inputs->stable, __ATOMIC_RELAXED);
    *out = (struct hal_inputs){
        .switches = levels_of(inputs, on),
        .pins = levels_of(inputs, inputs->raw),
        .probe = probe_level(inputs, INPUT_PROBE),
        .toolsetter = probe_level(inputs, INPUT_TOOLSETTER),
        .estop = (on >> INPUT_ESTOP & 1) != 0,
        .digital = inputs->misc,
    };
}
