/* SPDX-License-Identifier: MIT
 * The MAC16 option: halves of two registers are multiplied into, added to or taken from an accumulator of 40
 * bits, and a register m may be loaded at the same time. Registers m0 and m1 are first operands, m2 and m3
 * second ones. */
#include "instruction.h"

enum { UMUL = 0, MUL = 1, MULA = 2, MULS = 3 };

static uint64_t accumulator(const struct cpu *cpu) {
    return (uint64_t)(cpu->acchi & 0xFF) << 32 | cpu->acclo;
}

static void accumulate(struct cpu *cpu, uint64_t value) {
    cpu->acclo = (uint32_t)value;
    cpu->acchi = (uint32_t)(int8_t)(value >> 32 & 0xFF);
}

static int64_t half(uint32_t value, bool high, bool is_unsigned) {
    const uint32_t bits = high ? value >> 16 : value & 0xFFFF;
    return is_unsigned ? (int64_t)bits : (int64_t)(int16_t)bits;
}

/* LDINC, LDDEC: s moves by 4, and m[w] becomes what is there. @return false: it met an exception */
static bool load(struct esp *esp, const struct op *op, bool backwards) {
    struct cpu *cpu = esp->cpu;
    const uint32_t address = cpu->a[op->s] + (backwards ? -4u : 4u), value = bus_load(esp, address, 4);
    if (cpu->broken)
        return false;
    cpu->a[op->s] = address;
    cpu->m[op->r & 3] = value;
    return true;
}

void mac_execute(struct esp *esp, const struct op *op) {
    struct cpu *cpu = esp->cpu;
    const unsigned op2 = op->other >> 4, op1 = op->other & 15, what = op1 >> 2;
    const bool loads = op2 == 0 || op2 == 1 || op2 == 4 || op2 == 5 || op2 >= 8;
    const bool first_is_m = op2 != 3 && op2 != 7, second_is_m = op2 < 4;
    const uint32_t x = first_is_m ? cpu->m[op->r >> 2 & 1] : cpu->a[op->s];
    const uint32_t y = second_is_m ? cpu->m[2 + (op->t >> 2 & 1)] : cpu->a[op->t];
    const int64_t product = half(x, (op1 & 1) != 0, what == UMUL) * half(y, (op1 & 2) != 0, what == UMUL);
    if (loads && !load(esp, op, (op2 & 1) != 0))
        return;
    if (op2 >= 8)
        return;
    if (what == UMUL || what == MUL)
        accumulate(cpu, (uint64_t)product);
    else
        accumulate(cpu, accumulator(cpu) + (uint64_t)(what == MULA ? product : -product));
}
