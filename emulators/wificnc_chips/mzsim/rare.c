/* SPDX-License-Identifier: MIT
 * Instructions that are rare or long, and those that reach beyond RAM. */
#include "instruction.h"

#include <string.h>

#define RS      cpu->r[FIELD_RS]
#define RT      cpu->r[FIELD_RT]
#define RD      cpu->r[FIELD_RD]
#define ADDRESS (RS + sign_extended(word))
#define GOOD    (!cpu->broken)

static bool check_alignment(struct chip *chip, uint32_t address, unsigned size, enum exception_code code) {
    if ((address & (size - 1)) == 0)
        return true;
    chip->cpu.bad_address = address;
    cpu_exception(chip, code, 0x180);
    return false;
}

uint32_t cpu_load(struct chip *chip, uint32_t address, unsigned size) {
    if (!check_alignment(chip, address, size, EXCEPTION_ADDRESS_LOAD))
        return 0;
    if (ram_offset(address) < RAM_SIZE) {
        uint32_t value = 0;
        memcpy(&value, (const uint8_t *)chip->ram + ram_offset(address), size);
        chip->cycles += timing_data(chip, address, false);
        return value;
    }
    return bus_load(chip, address, size);
}

void cpu_store(struct chip *chip, uint32_t address, uint32_t value, unsigned size) {
    if (!check_alignment(chip, address, size, EXCEPTION_ADDRESS_STORE))
        return;
    if (ram_offset(address) < RAM_SIZE) {
        memcpy((uint8_t *)chip->ram + ram_offset(address), &value, size);
        chip->cycles += timing_data(chip, address, true);
    } else {
        bus_store(chip, address, value, size);
    }
}

/* Little-endian: the left part of a word is its high bytes, up to the one addressed. */
void cpu_load_left(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    uint32_t address = ADDRESS, shift = 8 * (3 - (address & 3));
    uint32_t value = cpu_load(chip, address & ~3u, 4);
    if (GOOD)
        RT = value << shift | (RT & ((1u << shift) - 1));
}

void cpu_load_right(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    uint32_t address = ADDRESS, shift = 8 * (address & 3);
    uint32_t value = cpu_load(chip, address & ~3u, 4);
    if (GOOD)
        RT = shift == 0 ? value : value >> shift | (RT & ~(0xFFFFFFFFu >> shift));
}

void cpu_store_left(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    uint32_t address = ADDRESS, count = (address & 3) + 1;
    for (uint32_t i = 0; i < count; i++)
        cpu_store(chip, (address & ~3u) + i, RT >> 8 * (4 - count + i) & 0xFF, 1);
}

void cpu_store_right(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    uint32_t address = ADDRESS;
    for (uint32_t i = 0; i < 4 - (address & 3); i++)
        cpu_store(chip, address + i, RT >> 8 * i & 0xFF, 1);
}

void cpu_load_float(struct chip *chip, uint32_t address, unsigned to, unsigned size) {
    struct cpu *cpu = &chip->cpu;
    if (!cpu_fpu_usable(chip) || !check_alignment(chip, address, size, EXCEPTION_ADDRESS_LOAD))
        return;
    uint32_t low = cpu_load(chip, address, 4), high = size == 8 ? cpu_load(chip, address + 4, 4) : 0;
    if (GOOD)
        cpu->f[to] = (size == 8 ? (uint64_t)high << 32 : cpu->f[to] & ~(uint64_t)0xFFFFFFFFu) | low;
}

void cpu_store_float(struct chip *chip, uint32_t address, unsigned from, unsigned size) {
    if (!cpu_fpu_usable(chip) || !check_alignment(chip, address, size, EXCEPTION_ADDRESS_STORE))
        return;
    cpu_store(chip, address, (uint32_t)chip->cpu.f[from], 4);
    if (size == 8)
        cpu_store(chip, address + 4, (uint32_t)(chip->cpu.f[from] >> 32), 4);
}

void cpu_load_linked(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    uint32_t value = cpu_load(chip, ADDRESS, 4);
    if (!GOOD)
        return;
    RT = value;
    cpu->linked = true;
}

void cpu_store_linked(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    if (cpu->linked)
        cpu_store(chip, ADDRESS, RT, 4);
    if (GOOD)
        RT = cpu->linked;
}

/* ---- groups ---- */

void cpu_reserved(struct chip *chip, uint32_t word) {
    chip_fault(chip, "instruction %08x at %08x is not known here", word, chip->cpu.at);
}

void cpu_special2(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    int64_t product = (int64_t)(int32_t)RS * (int32_t)RT;
    uint64_t unsigned_product = (uint64_t)RS * RT;
    switch (word & 63) {
    case 0x00: /* madd */
        set_hilo(cpu, hilo(cpu) + (uint64_t)product);
        break;
    case 0x01: /* maddu */
        set_hilo(cpu, hilo(cpu) + unsigned_product);
        break;
    case 0x02: /* mul; HI and LO are then unpredictable, and stay here */
        RD = (uint32_t)product;
        break;
    case 0x04: /* msub */
        set_hilo(cpu, hilo(cpu) - (uint64_t)product);
        break;
    case 0x05: /* msubu */
        set_hilo(cpu, hilo(cpu) - unsigned_product);
        break;
    case 0x20: /* clz */
        RD = RS == 0 ? 32 : (uint32_t)__builtin_clz(RS);
        break;
    case 0x21: /* clo */
        RD = ~RS == 0 ? 32 : (uint32_t)__builtin_clz(~RS);
        break;
    default:
        cpu_reserved(chip, word);
    }
}

static void byte_shuffle(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    uint32_t value = RT;
    switch (word >> 6 & 31) {
    case 0x02: /* wsbh */
        RD = (value & 0x00FF00FFu) << 8 | (value >> 8 & 0x00FF00FFu);
        break;
    case 0x10: /* seb */
        RD = (uint32_t)(int32_t)(int8_t)value;
        break;
    case 0x18: /* seh */
        RD = (uint32_t)(int32_t)(int16_t)value;
        break;
    default:
        cpu_reserved(chip, word);
    }
}

void cpu_special3(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    unsigned low = word >> 6 & 31, high = word >> 11 & 31;
    switch (word & 63) {
    case 0x00: /* ext: high is the size less 1 */
        RT = RS >> low & (0xFFFFFFFFu >> (31 - high));
        break;
    case 0x04: { /* ins: high is the last bit */
        uint32_t mask = (0xFFFFFFFFu >> (31 - (high - low))) << low;
        RT = (RT & ~mask) | (RS << low & mask);
        break;
    }
    case 0x20:
        byte_shuffle(chip, word);
        break;
    default:
        cpu_reserved(chip, word);
    }
}

/* Indexed loads and stores of floating point. */
void cpu_cop1x(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    uint32_t address = RS + RT;
    switch (word & 63) {
    case 0x00:
        cpu_load_float(chip, address, word >> 6 & 31, 4);
        break;
    case 0x01:
        cpu_load_float(chip, address, word >> 6 & 31, 8);
        break;
    case 0x08:
        cpu_store_float(chip, address, word >> 11 & 31, 4);
        break;
    case 0x09:
        cpu_store_float(chip, address, word >> 11 & 31, 8);
        break;
    case 0x0F: /* prefx */
        break;
    default:
        cpu_reserved(chip, word);
    }
}
