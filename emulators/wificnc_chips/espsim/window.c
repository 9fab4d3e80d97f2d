/* SPDX-License-Identifier: MIT
 * Register windows. Xtensa ISA Reference Manual, chapter Windowed Register Option. 64 physical registers in
 * fours; bit n of WINDOWSTART: a window begins at the four n. */
#include "esp.h"

#include <string.h>

enum { FOURS = PHYSICAL / 4 };

static unsigned four(unsigned number) {
    return number % FOURS;
}

static bool begins(const struct cpu *cpu, unsigned number) {
    return (cpu->window_start >> four(number) & 1) != 0;
}

unsigned window_room(const struct cpu *cpu) {
    if ((cpu->ps & (PS_WOE | PS_EXCM)) != PS_WOE)
        return 3;
    const uint32_t twice = cpu->window_start | cpu->window_start << FOURS;
    const uint32_t next = twice >> (cpu->window_base + 1) & 7;
    return next == 0 ? 3 : (unsigned)__builtin_ctz(next);
}

static void copy(struct cpu *cpu, bool to_window) {
    const unsigned first = 4 * cpu->window_base;
    const unsigned before_end = PHYSICAL - first < 16 ? PHYSICAL - first : 16;
    uint32_t *a = cpu->a, *from = &cpu->physical[first];
    if (to_window) {
        memcpy(a, from, before_end * sizeof *a);
        memcpy(a + before_end, cpu->physical, (16 - before_end) * sizeof *a);
    } else {
        memcpy(from, a, before_end * sizeof *a);
        memcpy(cpu->physical, a + before_end, (16 - before_end) * sizeof *a);
    }
}

void window_rotate(struct cpu *cpu, int by) {
    copy(cpu, false);
    cpu->window_base = four(cpu->window_base + (unsigned)by);
    copy(cpu, true);
}

static void enter(struct esp *esp, int by, uint32_t vector) {
    struct cpu *cpu = esp->cpu;
    cpu->ps = (cpu->ps & ~(uint32_t)PS_OWB) | cpu->window_base << PS_OWB_SHIFT | PS_EXCM;
    cpu->epc[1] = cpu->pc;
    window_rotate(cpu, by);
    cpu_vector(esp, vector);
}

/* Fours 1 .. top are used, and a window of a caller begins in one of them: it goes to the stack. */
void window_overflow(struct esp *esp, unsigned top) {
    struct cpu *cpu = esp->cpu;
    unsigned by = 1;
    while (by < top && !begins(cpu, cpu->window_base + by))
        by++;
    const unsigned first = cpu->window_base + by;
    const uint32_t vector = begins(cpu, first + 1) ? 0x00 : begins(cpu, first + 2) ? 0x80 : 0x100;
    enter(esp, (int)by, vector);
}

void window_entry(struct esp *esp, const struct op *op) {
    struct cpu *cpu = esp->cpu;
    const unsigned by = (cpu->ps & PS_CALLINC) >> PS_CALLINC_SHIFT;
    if (op->s > 3 || (cpu->ps & (PS_WOE | PS_EXCM)) != PS_WOE) {
        cpu_exception(esp, CAUSE_ILLEGAL);
        return;
    }
    if (by > window_room(cpu)) {
        window_overflow(esp, by);
        return;
    }
    const uint32_t stack = cpu->a[op->s] - (uint32_t)op->imm;
    window_rotate(cpu, (int)by);
    cpu->a[op->s] = stack;
    cpu->window_start |= 1u << cpu->window_base;
}

void window_return(struct esp *esp) {
    struct cpu *cpu = esp->cpu;
    const unsigned by = cpu->a[0] >> 30;
    unsigned nearest = 1;
    while (nearest <= 3 && !begins(cpu, cpu->window_base - nearest))
        nearest++;
    if (by == 0 || (nearest <= 3 && nearest != by) || (cpu->ps & (PS_WOE | PS_EXCM)) != PS_WOE) {
        cpu_exception(esp, CAUSE_ILLEGAL);
        return;
    }
    if (nearest > 3) { /* the caller's window is on the stack */
        static const uint32_t vectors[4] = {0, 0x40, 0xC0, 0x140};
        enter(esp, -(int)by, vectors[by]);
        return;
    }
    cpu->next = (cpu->pc & 0xC0000000u) | (cpu->a[0] & 0x3FFFFFFFu);
    cpu->window_start &= ~(1u << cpu->window_base);
    window_rotate(cpu, -(int)by);
}

void window_movsp(struct esp *esp, const struct op *op) {
    struct cpu *cpu = esp->cpu;
    bool caller_is_here = false;
    for (unsigned by = 1; by <= 3; by++)
        caller_is_here |= begins(cpu, cpu->window_base - by);
    if (caller_is_here)
        cpu->a[op->t] = cpu->a[op->s];
    else
        cpu_exception(esp, CAUSE_ALLOCA);
}

/* RFWO, RFWU */
void window_handled(struct esp *esp, bool underflow) {
    struct cpu *cpu = esp->cpu;
    const unsigned owner = (cpu->ps & PS_OWB) >> PS_OWB_SHIFT;
    if (underflow)
        cpu->window_start |= 1u << cpu->window_base;
    else
        cpu->window_start &= ~(1u << cpu->window_base);
    window_rotate(cpu, (int)owner - (int)cpu->window_base);
    cpu->ps &= ~(uint32_t)PS_EXCM;
    cpu->next = cpu->epc[1];
    cpu_check(esp);
}
