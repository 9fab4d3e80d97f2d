/* SPDX-License-Identifier: MIT
 * The interrupt matrix of core 0: sources of peripherals to interrupts of the processor. */
#include "esp.h"

enum { ESP32_SOURCES = 69, S3_SOURCES = 99, NOWHERE = INTERRUPT_TIMER2 };

/* A source that is routed to an interrupt inside of the processor goes nowhere. */
static uint32_t lines(const struct esp *esp) {
    uint32_t found = 0;
    for (unsigned source = 0; source < SOURCES; source++)
        if ((esp->source[source / 32] >> source % 32 & 1) != 0)
            found |= 1u << esp->route[source];
    return found & ~INTERRUPTS_INSIDE;
}

void matrix_set(struct esp *esp, unsigned source, bool active) {
    const uint32_t bit = 1u << source % 32;
    uint32_t *word = &esp->source[source / 32];
    *word = active ? *word | bit : *word & ~bit;
    chip_look(esp);
}

void matrix_update(struct esp *esp) {
    struct cpu *cpu = &esp->cpu;
    const uint32_t now = lines(esp);
    cpu->latched |= now & ~cpu->lines & INTERRUPTS_EDGE;
    cpu->lines = now;
}

static uint32_t load(struct esp *esp, uint32_t offset) {
    return esp->route[offset / 4];
}

static void store(struct esp *esp, uint32_t offset, uint32_t value) {
    esp->route[offset / 4] = value & 31;
    chip_look(esp);
}

void matrix_create(struct esp *esp) {
    const bool is_s3 = esp->chip == ES_ESP32S3;
    for (unsigned source = 0; source < SOURCES; source++)
        esp->route[source] = NOWHERE;
    bus_add(esp, &(struct block){"interrupt matrix", is_s3 ? 0x600C2000 : 0x3FF00104,
                                 4 * (is_s3 ? S3_SOURCES : ESP32_SOURCES), load, store});
}
