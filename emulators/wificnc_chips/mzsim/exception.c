/* SPDX-License-Identifier: MIT
 * Exceptions, interrupts, reset: how the CPU leaves its way. */
#include "chip.h"

#include <string.h>

static void enter(struct cpu *cpu, uint32_t return_to, bool in_slot) {
    if ((cpu->status & STATUS_EXL) == 0) {
        cpu->epc = in_slot ? return_to - 4 : return_to;
        cpu->cause = (cpu->cause & 0x7FFFFFFFu) | (in_slot ? 0x80000000u : 0);
    }
    cpu->status |= STATUS_EXL;
}

static void go_to(struct cpu *cpu, uint32_t address) {
    cpu->pc = address;
    cpu->next_pc = address + 4;
    cpu->slot = false;
}

static void use_set(struct cpu *cpu, unsigned set) {
    cpu->srsctl = (cpu->srsctl & ~0x3CFu) | (cpu->srsctl & 15u) << 6 | set; /* PSS = CSS, CSS */
    cpu->r = cpu->set[set];
}

void cpu_exception(struct chip *chip, enum exception_code code, uint32_t vector) {
    struct cpu *cpu = &chip->cpu;
    uint32_t base = (cpu->status & STATUS_BEV) != 0 ? 0xBFC00200u : cpu->ebase & 0xFFFFF000u;
    if ((cpu->status & STATUS_BEV) != 0)
        chip_fault(chip, "exception %u at %08x before there are vectors", (unsigned)code, cpu->at);
    const bool nested = (cpu->status & STATUS_EXL) != 0;
    enter(cpu, cpu->at, cpu->in_slot);
    cpu->cause = (cpu->cause & ~0x7Cu) | (uint32_t)code << 2;
    if (!nested)
        use_set(cpu, cpu->srsctl >> 12 & 15); /* ESS */
    go_to(cpu, base + vector);
    cpu->broken = true;
}

/* The vector of the interrupt that evic.c has found. */
void cpu_interrupt(struct chip *chip) {
    struct cpu *cpu = &chip->cpu;
    timing_interrupt(chip);
    enter(cpu, cpu->pc, false);
    cpu->cause = (cpu->cause & ~0x0003FC7Cu) | chip->level << 10;
    use_set(cpu, chip->priss->value >> 4 * chip->level & 15u);
    go_to(cpu, (cpu->ebase & 0xFFFFF000u) + chip->off[chip->irq]);
    cpu->waits = false;
    chip->running[chip->depth % REGISTER_SETS] = chip->irq;
    chip->began[chip->depth % REGISTER_SETS] = chip->cycles - chip->asleep;
    chip->depth++;
}

/* The register set, RAM and all peripherals stay as they are. */
void cpu_nmi(struct chip *chip) {
    struct cpu *cpu = &chip->cpu;
    cpu->error_epc = cpu->slot ? cpu->pc - 4 : cpu->pc;
    cpu->status |= STATUS_BEV | STATUS_ERL | STATUS_NMI;
    cpu->waits = false;
    go_to(cpu, 0xBFC00000u);
    chip_look(chip);
}

void cpu_reset(struct chip *chip) {
    struct cpu *cpu = &chip->cpu;
    memset(cpu, 0, sizeof *cpu);
    cpu->r = cpu->set[0];
    cpu->status = STATUS_BEV | STATUS_ERL;
    cpu->srsctl = 7u << 26; /* HSS: seven shadow sets */
    cpu->ebase = 0x80000000u;
    cpu->config = 2; /* K0: not cached */
    go_to(cpu, 0xBFC00000u);
    chip->depth = 0;
}
