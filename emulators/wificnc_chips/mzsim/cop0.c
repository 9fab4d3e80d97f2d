/* SPDX-License-Identifier: MIT
 * Coprocessor 0: status, exceptions, the core timer, shadow register sets. */
#include "chip.h"

/* The registers by 8 * number + select. */
static uint32_t *plain_register(struct cpu *cpu, unsigned number) {
    switch (number) {
    case 8 * 0:
        return &cpu->tlb_index;
    case 8 * 2:
        return &cpu->tlb_low[0];
    case 8 * 3:
        return &cpu->tlb_low[1];
    case 8 * 5:
        return &cpu->tlb_mask;
    case 8 * 10:
        return &cpu->tlb_high;
    case 8 * 8:
        return &cpu->bad_address;
    case 8 * 11:
        return &cpu->compare;
    case 8 * 12:
        return &cpu->status;
    case 8 * 12 + 1:
        return &cpu->intctl;
    case 8 * 12 + 2:
        return &cpu->srsctl;
    case 8 * 13:
        return &cpu->cause;
    case 8 * 14:
        return &cpu->epc;
    case 8 * 15 + 1:
        return &cpu->ebase;
    case 8 * 16:
        return &cpu->config;
    case 8 * 30:
        return &cpu->error_epc;
    default:
        return NULL;
    }
}

static void move_from(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    unsigned number = (word >> 11 & 31) * 8 + (word & 7);
    const uint32_t *from = plain_register(cpu, number);
    uint32_t *to = &cpu->r[word >> 16 & 31];
    if (number == 8 * 9)
        *to = system_count(chip);
    else if (from != NULL)
        *to = *from;
    else
        chip_fault(chip, "CP0 register %u, select %u is not known here", number / 8, number % 8);
}

static void move_to(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    unsigned number = (word >> 11 & 31) * 8 + (word & 7);
    uint32_t *to = plain_register(cpu, number);
    uint32_t value = cpu->r[word >> 16 & 31];
    if (number / 8 == 28)
        return; /* TagLo: there is no cache */
    if (to == NULL || number == 8 * 8) {
        chip_fault(chip, "CP0 register %u, select %u is not written here", number / 8, number % 8);
        return;
    }
    if (number == 8 * 11)
        system_set_compare(chip, value);
    else if (number == 8 * 12 + 2)
        *to = (*to & 0x3C3C000Fu) | (value & 0x0000F3C0u); /* HSS, EICSS and CSS are the chip's */
    else if (number == 8 * 13)
        *to = (*to & ~0x08C00300u) | (value & 0x08C00300u);
    else
        *to = value;
    chip_look(chip);
}

/* Entries that map something are not known here, and two for one page are a machine check. */
static void write_tlb(struct chip *chip) {
    struct cpu *cpu = &chip->cpu;
    unsigned index = cpu->tlb_index % TLB_ENTRIES;
    if (((cpu->tlb_low[0] | cpu->tlb_low[1]) & 2u) != 0)
        chip_fault(chip, "a valid entry of the TLB, written at %08x, is not known here", cpu->at);
    for (unsigned i = 0; i < TLB_ENTRIES; i++)
        if (i != index && (cpu->tlb_written >> i & 1u) != 0 && cpu->tlb[i] == cpu->tlb_high >> 13)
            chip_fault(chip, "two entries of the TLB for one page, written at %08x", cpu->at);
    cpu->tlb[index] = cpu->tlb_high >> 13;
    cpu->tlb_written |= 1u << index;
}

static void return_from_exception(struct chip *chip) {
    struct cpu *cpu = &chip->cpu;
    if ((cpu->status & STATUS_ERL) != 0) {
        chip_fault(chip, "eret at %08x while Status.ERL is set", cpu->at);
        return;
    }
    cpu->status &= ~(uint32_t)STATUS_EXL;
    cpu->srsctl = (cpu->srsctl & ~15u) | (cpu->srsctl >> 6 & 15u); /* CSS = PSS */
    cpu->r = cpu->set[cpu->srsctl & 7u];
    cpu->pc = cpu->epc;
    cpu->next_pc = cpu->epc + 4;
    cpu->linked = false;
    if (chip->depth > 0) {
        chip->depth--;
        struct mz_vector *vector = &chip->vectors[chip->running[chip->depth % REGISTER_SETS]];
        uint64_t took = chip->cycles - chip->asleep - chip->began[chip->depth % REGISTER_SETS];
        vector->count++;
        vector->instructions += took;
        vector->most = took > vector->most ? took : vector->most;
    }
    chip_look(chip);
}

static void switch_interrupts(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    uint32_t before = cpu->status;
    cpu->status = (word & 0x20) != 0 ? before | STATUS_IE : before & ~(uint32_t)STATUS_IE;
    cpu->r[word >> 16 & 31] = before;
    chip_look(chip);
}

static void wait_for_interrupt(struct chip *chip) {
    chip->cpu.waits = true;
    chip_look(chip);
}

void cpu_cop0(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    unsigned previous = cpu->srsctl >> 6 & 7u;
    unsigned from = word >> 16 & 31, to = word >> 11 & 31;
    if (word == 0x42000018u)
        return_from_exception(chip);
    else if (word == 0x42000002u)
        write_tlb(chip);
    else if ((word & 0xFE00003Fu) == 0x42000020u)
        wait_for_interrupt(chip);
    else if (word >> 21 == 0x200)
        move_from(chip, word);
    else if (word >> 21 == 0x204)
        move_to(chip, word);
    else if ((word & 0xFFE0FFDFu) == 0x41606000u)
        switch_interrupts(chip, word);
    else if (word >> 21 == 0x20A)
        cpu->r[to] = cpu->set[previous][from]; /* rdpgpr */
    else if (word >> 21 == 0x20E)
        cpu->set[previous][to] = cpu->r[from]; /* wrpgpr */
    else
        chip_fault(chip, "instruction %08x at %08x is not known here", word, cpu->at);
}
