/* SPDX-License-Identifier: MIT
 * Exceptions, interrupts, reset. Xtensa ISA Reference Manual, chapters Exception Option and High-Priority
 * Interrupt Option; the vectors' places and the levels are those of core-isa.h of both chips. */
#include "esp.h"

#include <string.h>

enum { VECTOR_KERNEL = 0x300, VECTOR_USER = 0x340, VECTOR_DOUBLE = 0x3C0, LEVEL_DEBUG = 6, LEVEL_NMI = 7 };

static const uint32_t level_vectors[LEVELS] = {0, 0, 0x180, 0x1C0, 0x200, 0x240, 0x280, 0x2C0};

/* Of interrupts 0 .. 31. */
static const uint8_t levels[32] = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 3, 1, 1, 7, 3,
                                   5, 1, 1, 2, 2, 2, 3, 3, 4, 4, 5, 3, 4, 3, 4, 5};

void cpu_vector(struct esp *esp, uint32_t offset) {
    esp->cpu->next = esp->cpu->vecbase + offset;
    esp->cpu->broken = true;
    esp->cpu->waits = false;
    esp->cycles += esp->taken;
}

static void user_or_kernel(struct esp *esp, enum cause cause, uint32_t from) {
    struct cpu *cpu = esp->cpu;
    cpu->exccause = cause;
    if ((cpu->ps & PS_EXCM) != 0) {
        cpu->depc = from;
        cpu_vector(esp, VECTOR_DOUBLE);
        return;
    }
    cpu->epc[1] = from;
    cpu_vector(esp, (cpu->ps & PS_UM) != 0 ? VECTOR_USER : VECTOR_KERNEL);
    cpu->ps |= PS_EXCM;
}

void cpu_exception(struct esp *esp, enum cause cause) {
    user_or_kernel(esp, cause, esp->cpu->pc);
}

void cpu_exception_at(struct esp *esp, enum cause cause, uint32_t address) {
    esp->cpu->excvaddr = address;
    user_or_kernel(esp, cause, esp->cpu->pc);
}

static void enter_level(struct esp *esp, unsigned level, uint32_t from) {
    struct cpu *cpu = esp->cpu;
    cpu->epc[level] = from;
    cpu->eps[level] = cpu->ps;
    cpu->ps = (cpu->ps & ~(uint32_t)PS_LEVEL) | level | PS_EXCM;
    cpu_vector(esp, level_vectors[level]);
}

/* BREAK without a debugger: the debug exception. */
void cpu_debug(struct esp *esp, uint32_t cause) {
    if ((esp->cpu->ps & PS_LEVEL) >= LEVEL_DEBUG)
        return;
    esp->cpu->debugcause = cause;
    enter_level(esp, LEVEL_DEBUG, esp->cpu->pc);
}

void cpu_return(struct esp *esp) {
    esp->cpu->ps &= ~(uint32_t)PS_EXCM;
    esp->cpu->next = esp->cpu->epc[1];
    cpu_check(esp);
}

void cpu_return_double(struct esp *esp) {
    esp->cpu->next = esp->cpu->depc;
}

void cpu_return_from(struct esp *esp, unsigned level) {
    struct es_level *measured = &esp->level[level];
    esp->cpu->ps = esp->cpu->eps[level];
    esp->cpu->next = esp->cpu->epc[level];
    cpu_check(esp);
    if (esp->cpu->began[level] == NEVER)
        return;
    const uint64_t cycles = esp->cycles - esp->cpu->began[level];
    measured->count++;
    measured->cycles += cycles;
    measured->most = cycles > measured->most ? cycles : measured->most;
    esp->cpu->began[level] = NEVER;
}

uint32_t cpu_interrupts(const struct cpu *cpu) {
    return cpu->latched | (cpu->lines & ~(INTERRUPTS_INSIDE | INTERRUPTS_EDGE));
}

/* The highest level that asks. */
static unsigned asking(const struct cpu *cpu) {
    unsigned level = 0;
    for (uint32_t left = cpu_interrupts(cpu) & (cpu->intenable | 1u << 14); left != 0; left &= left - 1) {
        const unsigned number = (unsigned)__builtin_ctz(left);
        level = levels[number] > level ? levels[number] : level;
    }
    return level;
}

/* The level of the interrupt that it takes now; 0: none. */
static unsigned taken_level(const struct cpu *cpu) {
    const unsigned level = asking(cpu);
    unsigned held = cpu->ps & PS_LEVEL;
    if ((cpu->ps & PS_EXCM) != 0 && held < EXCM_LEVEL)
        held = EXCM_LEVEL;
    return level > held || level == LEVEL_NMI ? level : 0;
}

void cpu_check(struct esp *esp) {
    if ((cpu_interrupts(esp->cpu) & (esp->cpu->intenable | 1u << 14)) != 0)
        esp->limit = 0;
}

bool cpu_sleeps(const struct cpu *cpu) {
    return cpu->waits && taken_level(cpu) == 0;
}

bool cpu_interrupt(struct esp *esp) {
    struct cpu *cpu = esp->cpu;
    const unsigned level = taken_level(cpu);
    if (level == 0)
        return false;
    if (level == 1)
        user_or_kernel(esp, CAUSE_LEVEL1, cpu->pc);
    else {
        enter_level(esp, level, cpu->pc);
        cpu->began[level] = esp->cycles;
    }
    cpu->pc = cpu->next;
    return true;
}

void cpu_reset(struct esp *esp, struct cpu *cpu) {
    const struct cpu before = *cpu;
    memset(cpu, 0, sizeof *cpu);
    cpu->number = before.number;
    cpu->runs = before.runs;
    cpu->cycles = before.cycles;
    cpu->idle = before.idle;
    cpu->instructions = before.instructions;
    cpu->misses = before.misses;
    cpu->missing = before.missing;
    cpu->ps = PS_LEVEL | PS_EXCM;
    cpu->window_start = 1;
    cpu->vecbase = 0x40000000u;
    cpu->atomctl = 0x28;
    cpu->ccount_from = (uint32_t)(0 - esp->cycles);
    for (unsigned level = 0; level < LEVELS; level++)
        cpu->began[level] = NEVER;
    for (unsigned timer = 0; timer < TIMERS; timer++)
        cpu->timer_at[timer] = NEVER;
}

/* As if the boot ROM had called its entry by call8. The ROM's caller's stack pointer lies before its own,
 * where a window that overflows looks for it. */
void cpu_start(struct esp *esp, struct cpu *cpu, uint32_t entry, uint32_t stack_end) {
    enum { CALLER = 16, FRAME = 64, CALLERS_POINTER = 12, CALL8 = 2, ROM_RETURN = 0x400 };
    const uint32_t caller = stack_end - CALLER;
    cpu->pc = entry;
    cpu->ps = PS_WOE | PS_UM | CALL8 << PS_CALLINC_SHIFT;
    cpu->a[1] = stack_end - FRAME;
    cpu->a[4 * CALL8] = (uint32_t)CALL8 << 30 | ROM_RETURN;
    (void)es_write(esp, cpu->a[1] - CALLERS_POINTER, (const uint8_t *)&caller, sizeof caller);
}
