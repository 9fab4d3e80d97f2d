/* SPDX-License-Identifier: MIT
 * The interrupt matrices of both cores: sources of peripherals to interrupts of the processor. */
#include "esp.h"

#include <string.h>

enum { ESP32_SOURCES = 69, S3_SOURCES = 99, NOWHERE = INTERRUPT_TIMER2 };

/* A source that is routed to an interrupt inside of the processor goes nowhere. */
static uint32_t lines(const struct esp *esp, unsigned core) {
    uint32_t found = 0;
    for (unsigned word = 0; word < SOURCES / 32; word++)
        for (uint32_t left = esp->source[core][word]; left != 0; left &= left - 1)
            found |= 1u << esp->route[core][32 * word + (unsigned)__builtin_ctz(left)];
    return found & ~INTERRUPTS_INSIDE;
}

void matrix_set_core(struct esp *esp, unsigned core, unsigned source, bool active) {
    const uint32_t bit = 1u << source % 32;
    uint32_t *word = &esp->source[core][source / 32];
    *word = active ? *word | bit : *word & ~bit;
    chip_look(esp);
}

void matrix_set(struct esp *esp, unsigned source, bool active) {
    for (unsigned core = 0; core < CORES; core++)
        matrix_set_core(esp, core, source, active);
}

void matrix_update(struct esp *esp) {
    for (unsigned core = 0; core < CORES; core++) {
        struct cpu *cpu = &esp->core[core];
        const uint32_t now = lines(esp, core);
        cpu->latched |= now & ~cpu->lines & INTERRUPTS_EDGE;
        cpu->lines = now;
    }
}

/* ---- registers ---- */

static uint32_t load(struct esp *esp, unsigned core, uint32_t offset) {
    return esp->route[core][offset / 4];
}

static void store(struct esp *esp, unsigned core, uint32_t offset, uint32_t value) {
    esp->route[core][offset / 4] = value & 31;
    chip_look(esp);
}

static uint32_t load0(struct esp *esp, uint32_t offset) {
    return load(esp, 0, offset);
}

static uint32_t load1(struct esp *esp, uint32_t offset) {
    return load(esp, 1, offset);
}

static void store0(struct esp *esp, uint32_t offset, uint32_t value) {
    store(esp, 0, offset, value);
}

static void store1(struct esp *esp, uint32_t offset, uint32_t value) {
    store(esp, 1, offset, value);
}

/* Which sources ask: words of 32 of them. */
static uint32_t asking0(struct esp *esp, uint32_t offset) {
    return esp->source[0][offset / 4];
}

static uint32_t asking1(struct esp *esp, uint32_t offset) {
    return esp->source[1][offset / 4];
}

static void ignore(struct esp *esp, uint32_t offset, uint32_t value) {
    (void)esp;
    (void)offset;
    (void)value;
}

void matrix_create(struct esp *esp) {
    const bool is_s3 = esp->chip == ES_ESP32S3;
    const uint32_t size = 4 * (is_s3 ? S3_SOURCES : ESP32_SOURCES), words = is_s3 ? 16 : 12;
    memset(esp->route, NOWHERE, sizeof esp->route);
    bus_add(esp,
            &(struct block){"interrupt matrix", is_s3 ? 0x600C2000 : 0x3FF00104, size, load0, store0, NULL});
    bus_add(esp,
            &(struct block){"interrupt matrix", is_s3 ? 0x600C2800 : 0x3FF00218, size, load1, store1, NULL});
    bus_add(esp, &(struct block){"interrupt status", is_s3 ? 0x600C218C : 0x3FF000EC, words, asking0, ignore,
                                 NULL});
    bus_add(esp, &(struct block){"interrupt status", is_s3 ? 0x600C298C : 0x3FF000F8, words, asking1, ignore,
                                 NULL});
}
