/* SPDX-License-Identifier: MIT
 * What the files of the CPU share: the fields of an instruction, and the instructions that are functions.
 * They find the CPU between two instructions (its `at` being the present one's address) and may leave it at
 * an exception: then cpu.broken is set, and nothing else of the instruction may happen. */
#ifndef WIFICNC_MZSIM_INSTRUCTION_H
#define WIFICNC_MZSIM_INSTRUCTION_H

#include "chip.h"

#define FIELD_RS    (word >> 21 & 31)
#define FIELD_RT    (word >> 16 & 31)
#define FIELD_RD    (word >> 11 & 31)
#define FIELD_SHIFT (word >> 6 & 31)

#define INLINE static inline __attribute__((always_inline))

INLINE uint32_t sign_extended(uint32_t word) {
    int32_t value = (int16_t)(word & 0xFFFFu);
    return (uint32_t)value;
}

INLINE void set_hilo(struct cpu *cpu, uint64_t value) {
    cpu->hi = (uint32_t)(value >> 32);
    cpu->lo = (uint32_t)value;
}

INLINE uint64_t hilo(const struct cpu *cpu) {
    return (uint64_t)cpu->hi << 32 | cpu->lo;
}

/* In RAM, by KSEG0 or KSEG1, which differ in one bit: its offset is below RAM_SIZE. */
INLINE uint32_t ram_offset(uint32_t address) {
    return (address & 0xDFFFFFFFu) - 0x80000000u;
}

/* rare.c: memory at any address, aligned or not */
uint32_t cpu_load(struct chip *chip, uint32_t address, unsigned size);
void cpu_store(struct chip *chip, uint32_t address, uint32_t value, unsigned size);
void cpu_load_float(struct chip *chip, uint32_t address, unsigned to, unsigned size);
void cpu_store_float(struct chip *chip, uint32_t address, unsigned from, unsigned size);
void cpu_load_linked(struct chip *chip, uint32_t word);
void cpu_store_linked(struct chip *chip, uint32_t word);
void cpu_load_left(struct chip *chip, uint32_t word);
void cpu_load_right(struct chip *chip, uint32_t word);
void cpu_store_left(struct chip *chip, uint32_t word);
void cpu_store_right(struct chip *chip, uint32_t word);
void cpu_special2(struct chip *chip, uint32_t word);
void cpu_special3(struct chip *chip, uint32_t word);
void cpu_cop1x(struct chip *chip, uint32_t word);
void cpu_reserved(struct chip *chip, uint32_t word);

#endif
