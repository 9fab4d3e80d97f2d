/* SPDX-License-Identifier: MIT */
#include "channels/channels.h"

#include <string.h>

enum { US_PER_MS = 1000 };

void channels_init(struct channels *channels, const struct channels_ops *ops, void *ctx) {
    memset(channels, 0, sizeof *channels);
    channels->ops = ops;
    channels->ctx = ctx;
    for (unsigned index = 0; index < CHANNELS_VALUES; index++)
        channels->config.value[index] = channels_rows[index].fallback;
    memset(channels->wiring.pin, CHANNELS_NO_PIN, sizeof channels->wiring.pin);
}

bool channels_set_value(struct channels *channels, unsigned index, uint32_t value) {
    const struct channels_row *row = &channels_rows[index];
    if (value < row->min || value > row->max)
        return false;
    channels->config.value[index] = (uint16_t)value;
    return true;
}

unsigned channels_find(uint16_t wire) {
    unsigned index = 0;
    while (index < CHANNELS_VALUES && channels_rows[index].wire != wire)
        index++;
    return index;
}

bool channels_are_chosen(const struct channels *channels) {
    return channels->config.value[CHANNELS_DEVICE_MODE] == CHANNELS_MODE_MODULE;
}

/* ---- wiring ---- */

static bool is_taken(const uint16_t *pins, unsigned channel) {
    for (unsigned other = 0; other < channel; other++)
        if (pins[other] == pins[channel])
            return true;
    return false;
}

uint16_t channels_faults(const struct channels *channels) {
    const uint16_t *value = channels->config.value, *pins = &value[CHANNELS_IO_PIN_0];
    unsigned faults = 0;
    for (unsigned n = 0; n < value[CHANNELS_IO_COUNT]; n++) {
        bool output = (value[CHANNELS_IO_DIRECTION] >> n & 1) != 0;
        if (pins[n] == CHANNELS_NO_PIN)
            continue;
        if (is_taken(pins, n) || !channels->ops->can(channels->ctx, (uint8_t)pins[n], output))
            faults |= 1u << n;
    }
    return (uint16_t)faults;
}

/* Channels of the configuration that have a line. */
static uint16_t used(const struct channels *channels) {
    const uint16_t *value = channels->config.value;
    unsigned mask = 0;
    for (unsigned n = 0; n < value[CHANNELS_IO_COUNT]; n++)
        mask |= value[CHANNELS_IO_PIN_0 + n] != CHANNELS_NO_PIN ? 1u << n : 0;
    return (uint16_t)(mask & ~(unsigned)channels->faults);
}

/* Outputs of both wirings, at the same pin. */
static uint16_t same_outputs(const struct channels_wiring *one, const struct channels_wiring *other) {
    unsigned mask = one->outputs & other->outputs;
    for (unsigned n = 0; n < CHANNELS_MAX; n++)
        mask &= one->pin[n] == other->pin[n] ? ~0u : ~(1u << n);
    return (uint16_t)mask;
}

static uint16_t levels(const struct channels *channels) {
    return (uint16_t)((channels->outputs ^ channels->invert) & channels->wiring.outputs);
}

static uint16_t read_on(const struct channels *channels) {
    return (uint16_t)((channels->ops->read(channels->ctx) ^ channels->invert) & channels->inputs);
}

void channels_apply(struct channels *channels) {
    const uint16_t *value = channels->config.value;
    const uint16_t debounce_us = (uint16_t)(value[CHANNELS_IO_DEBOUNCE] * US_PER_MS);
    struct channels_wiring wiring = {.outputs = 0};
    channels->faults = channels_faults(channels);
    uint16_t mask = used(channels);
    for (unsigned n = 0; n < CHANNELS_MAX; n++)
        wiring.pin[n] =
            (uint8_t)((mask >> n & 1) != 0 ? value[CHANNELS_IO_PIN_0 + n] : (unsigned)CHANNELS_NO_PIN);
    wiring.outputs = value[CHANNELS_IO_DIRECTION] & mask;
    channels->inputs = (uint16_t)(mask & ~wiring.outputs);
    wiring.pull_up = value[CHANNELS_IO_PULL_UP] & channels->inputs;
    /* An output that keeps its pin keeps its state when the configuration is stored; a new one begins in
     * its safe state. */
    uint16_t stay = same_outputs(&wiring, &channels->wiring);
    channels->outputs =
        (uint16_t)((channels->outputs & stay) | (value[CHANNELS_IO_SAFE] & wiring.outputs & ~stay));
    channels->invert = value[CHANNELS_IO_INVERT];
    channels->wiring = wiring;
    /* With the levels, so that no output shows another one in between. */
    channels->ops->wire(channels->ctx, &wiring, levels(channels));
    for (unsigned n = 0; n < CHANNELS_MAX; n++)
        channels->debounce.time[n] = (struct debounce_time){.on_us = debounce_us, .off_us = debounce_us};
    /* After the pins are set up, with the inputs as they are now. */
    debounce_start(&channels->debounce, read_on(channels));
}

/* ---- at work ---- */

void channels_poll(struct channels *channels, uint32_t now_us) {
    (void)debounce_sample(&channels->debounce, read_on(channels), now_us);
}

bool channels_are_quiet(const struct channels *channels) {
    return channels->debounce.raw == channels->debounce.stable;
}

uint16_t channels_inputs(const struct channels *channels) {
    return (uint16_t)channels->debounce.stable;
}

static void drive(struct channels *channels, unsigned outputs) {
    channels->outputs = (uint16_t)(outputs & channels->wiring.outputs);
    channels->ops->write(channels->ctx, levels(channels));
}

void channels_set(struct channels *channels, uint16_t mask, uint16_t on) {
    if (!channels->locked)
        drive(channels, (unsigned)((channels->outputs & ~mask) | (on & mask)));
}

/* Also while locked, unlike channels_set(): the safe state may always be taken. */
void channels_safe(struct channels *channels) {
    drive(channels, channels->config.value[CHANNELS_IO_SAFE]);
}
