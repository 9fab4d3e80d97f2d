/* SPDX-License-Identifier: MIT
 * Pulse counters: eight units of the ESP32, four of the S3 (technical reference manuals, chapter Pulse Count
 * Controller). A unit has two channels; an edge of a channel's one input counts up, down or not at all, which
 * the level of its other input may turn round or hold. The filter passes a level that has lasted for as many
 * cycles of the APB clock. At a limit the counter is zero again. */
#include "esp.h"

#include <string.h>

enum { UNIT_SIZE = 12, S3_UNITS = 4, CYCLES_APB = 3 };
enum {
    FILTER = 0x3FF,
    FILTER_ON = 1 << 10,
    ZERO_ON = 11,
    HIGH_ON = 12,
    LOW_ON = 13,
    FIRST_ON = 14,
    SECOND_ON = 15
};
enum { UP = 1, DOWN = 2, INVERT = 1, HOLD = 2 };
enum { AT_SECOND = 1 << 2, AT_FIRST = 1 << 3, AT_LOW = 1 << 4, AT_HIGH = 1 << 5, AT_ZERO = 1 << 6 };

static unsigned units_of(const struct esp *esp) {
    return esp->chip == ES_ESP32 ? PCNT_UNITS : S3_UNITS;
}

/* Inputs: edges of channels 0 and 1, levels of channels 0 and 1. The ESP32's units 5 to 7 have others. */
static unsigned signal_of(const struct esp *esp, unsigned unit, unsigned input) {
    static const unsigned order[PCNT_INPUTS] = {0, 2, 1, 3};
    const unsigned first = esp->chip == ES_ESP32S3 ? 33 + 4 * unit
                           : unit < 5              ? 39 + 4 * unit
                                                   : 71 + 4 * (unit - 5);
    return first + order[input];
}

/* ---- counting ---- */

static void raise(struct esp *esp, unsigned number, uint32_t events) {
    struct pcnt_unit *unit = &esp->pcnt.unit[number];
    if (events == 0)
        return;
    unit->status = events;
    esp->pcnt.raw |= 1u << number;
}

static int16_t low_half(uint32_t word) {
    return (int16_t)(word & 0xFFFF);
}

static int16_t high_half(uint32_t word) {
    return (int16_t)(word >> 16);
}

static void add(struct esp *esp, unsigned number, int by) {
    struct pcnt_unit *unit = &esp->pcnt.unit[number];
    const uint32_t on = unit->conf[0];
    uint32_t events = 0;
    unit->count = (int16_t)(unit->count + by);
    if ((on >> FIRST_ON & 1) != 0 && unit->count == low_half(unit->conf[1]))
        events |= AT_FIRST;
    if ((on >> SECOND_ON & 1) != 0 && unit->count == high_half(unit->conf[1]))
        events |= AT_SECOND;
    const bool at_high = unit->count == low_half(unit->conf[2]) && unit->count > 0;
    const bool at_low = unit->count == high_half(unit->conf[2]) && unit->count < 0;
    if (at_high || at_low)
        unit->count = 0;
    if (at_high && (on >> HIGH_ON & 1) != 0)
        events |= AT_HIGH;
    if (at_low && (on >> LOW_ON & 1) != 0)
        events |= AT_LOW;
    if ((on >> ZERO_ON & 1) != 0 && unit->count == 0)
        events |= AT_ZERO;
    raise(esp, number, events);
}

/* An edge of a channel's input. */
static void count(struct esp *esp, unsigned number, unsigned channel, bool rising) {
    const struct pcnt_unit *unit = &esp->pcnt.unit[number];
    const uint32_t conf = unit->conf[0] >> (16 + 8 * channel); /* falling, rising, at high, at low */
    const uint32_t edge = conf >> (rising ? 2 : 0) & 3;
    const uint32_t control = conf >> (unit->input[2 * channel + 1].level ? 4 : 6) & 3;
    const uint32_t state = esp->pcnt.control >> 2 * number & 3; /* reset, pause */
    if (edge == 0 || edge > DOWN || control >= HOLD || state != 0)
        return;
    add(esp, number, (edge == UP) != (control == INVERT) ? 1 : -1);
}

/* ---- inputs ---- */

static uint64_t passes_at(const struct pcnt_unit *unit, const struct pcnt_input *input) {
    const uint32_t conf = unit->conf[0];
    return input->since + ((conf & FILTER_ON) != 0 ? (uint64_t)CYCLES_APB * (conf & FILTER) : 0);
}

static void pass(struct esp *esp, unsigned number, unsigned input) {
    struct pcnt_input *in = &esp->pcnt.unit[number].input[input];
    in->level = in->seen;
    if (input % 2 == 0)
        count(esp, number, input / 2, in->level);
}

/* What has lasted long enough by then. */
static void settle(struct esp *esp, uint64_t cycle) {
    for (unsigned number = 0; number < units_of(esp); number++)
        for (unsigned i = 0; i < PCNT_INPUTS; i++) {
            const struct pcnt_unit *unit = &esp->pcnt.unit[number];
            if (unit->input[i].seen != unit->input[i].level && passes_at(unit, &unit->input[i]) <= cycle)
                pass(esp, number, i);
        }
}

static void schedule(struct esp *esp) {
    struct pcnt *pcnt = &esp->pcnt;
    pcnt->due = NEVER;
    for (unsigned number = 0; number < units_of(esp); number++)
        for (unsigned i = 0; i < PCNT_INPUTS; i++) {
            const struct pcnt_unit *unit = &pcnt->unit[number];
            if (unit->input[i].seen != unit->input[i].level && passes_at(unit, &unit->input[i]) < pcnt->due)
                pcnt->due = passes_at(unit, &unit->input[i]);
        }
    matrix_set(esp, esp->chip == ES_ESP32 ? 48 : 41, (pcnt->raw & pcnt->enabled) != 0);
}

void pcnt_event(struct esp *esp) {
    settle(esp, esp->cycles);
    schedule(esp);
}

/* Levels before edges: an edge counts by what the other input is now. */
void pcnt_pins(struct esp *esp, uint64_t cycle) {
    settle(esp, cycle);
    for (unsigned number = 0; number < units_of(esp); number++)
        for (unsigned n = 0; n < PCNT_INPUTS; n++) {
            const unsigned i = n < 2 ? 2 * n + 1 : 2 * (n - 2);
            struct pcnt_input *in = &esp->pcnt.unit[number].input[i];
            const bool level = gpio_input(esp, signal_of(esp, number, i));
            if (level == in->seen)
                continue;
            in->seen = level;
            in->since = cycle;
        }
    settle(esp, cycle);
    schedule(esp);
}

/* An input has another pin, whose level is no edge. */
void pcnt_routed(struct esp *esp, unsigned signal) {
    for (unsigned number = 0; number < units_of(esp); number++)
        for (unsigned i = 0; i < PCNT_INPUTS; i++) {
            struct pcnt_input *in = &esp->pcnt.unit[number].input[i];
            if (signal_of(esp, number, i) != signal)
                continue;
            in->seen = in->level = gpio_input(esp, signal);
            gpio_listen(esp, esp->gpio.input[signal] & 0x3F);
        }
}

/* ---- registers ---- */

/* Counters, then RAW, ST, ENA, CLR, then states, then CTRL. */
static uint32_t counters_at(const struct esp *esp) {
    return UNIT_SIZE * units_of(esp);
}

static uint32_t interrupts_at(const struct esp *esp) {
    return counters_at(esp) + 4 * units_of(esp);
}

static uint32_t states_at(const struct esp *esp) {
    return interrupts_at(esp) + 16;
}

static uint32_t control_at(const struct esp *esp) {
    return states_at(esp) + 4 * units_of(esp);
}

static void control(struct esp *esp, uint32_t value) {
    esp->pcnt.control = value;
    for (unsigned number = 0; number < units_of(esp); number++)
        if ((value >> 2 * number & 1) != 0)
            esp->pcnt.unit[number].count = 0;
}

static void store(struct esp *esp, uint32_t offset, uint32_t value) {
    struct pcnt *pcnt = &esp->pcnt;
    settle(esp, esp->cycles);
    if (offset < counters_at(esp))
        pcnt->unit[offset / UNIT_SIZE].conf[offset % UNIT_SIZE / 4] = value;
    else if (offset == interrupts_at(esp) + 8)
        pcnt->enabled = value;
    else if (offset == interrupts_at(esp) + 12)
        pcnt->raw &= ~value;
    else if (offset == control_at(esp))
        control(esp, value);
    schedule(esp);
}

static uint32_t state_of(const struct pcnt_unit *unit) {
    return unit->status | (unit->count > 0 ? 3u : unit->count < 0 ? 2u : 0u);
}

static uint32_t load(struct esp *esp, uint32_t offset) {
    const struct pcnt *pcnt = &esp->pcnt;
    settle(esp, esp->cycles);
    schedule(esp);
    if (offset < counters_at(esp))
        return pcnt->unit[offset / UNIT_SIZE].conf[offset % UNIT_SIZE / 4];
    if (offset < interrupts_at(esp))
        return (uint16_t)pcnt->unit[(offset - counters_at(esp)) / 4].count;
    const uint32_t words[] = {pcnt->raw, pcnt->raw & pcnt->enabled, pcnt->enabled, 0};
    if (offset < states_at(esp))
        return words[(offset - interrupts_at(esp)) / 4];
    if (offset < control_at(esp))
        return state_of(&pcnt->unit[(offset - states_at(esp)) / 4]);
    return offset == control_at(esp) ? pcnt->control : 0;
}

static void reset(struct esp *esp) {
    struct pcnt *pcnt = &esp->pcnt;
    memset(pcnt, 0, sizeof *pcnt);
    pcnt->due = NEVER;
    pcnt->control = 0x5555 & ((1u << 2 * units_of(esp)) - 1);
    for (unsigned number = 0; number < units_of(esp); number++)
        pcnt->unit[number].conf[0] = 0x3C10;
}

void pcnt_create(struct esp *esp) {
    if (!chip_keeps_outputs(esp))
        reset(esp);
    bus_add(esp, &(struct block){"PCNT", esp->chip == ES_ESP32 ? 0x3FF57000 : 0x60017000, 0x100, load, store,
                                 NULL});
}
