/* SPDX-License-Identifier: MIT
 * Coprocessor 1: IEEE 754 single and double with 32 registers of 64 bits (Status.FR = 1), rounding to
 * nearest. With FCSR.FS set, as the firmware has it, denormal operands and results are 0. */
#include "chip.h"

#include <math.h>
#include <string.h>

#define FT (word >> 16 & 31)
#define FS (word >> 11 & 31)
#define FD (word >> 6 & 31)

enum { FORMAT_S = 16, FORMAT_D = 17, FORMAT_W = 20, FORMAT_L = 21 };

#define FCSR_FLUSH 0x01000000u

bool cpu_fpu_usable(struct chip *chip) {
    if ((chip->cpu.status & STATUS_CU1) != 0)
        return true;
    chip->cpu.cause = (chip->cpu.cause & ~0x30000000u) | 0x10000000u;
    cpu_exception(chip, EXCEPTION_COPROCESSOR, 0x180);
    return false;
}

static void reserved(struct chip *chip, uint32_t word) {
    chip_fault(chip, "instruction %08x at %08x is not known here", word, chip->cpu.at);
}

static bool flushes(const struct cpu *cpu) {
    return (cpu->fcsr & FCSR_FLUSH) != 0;
}

static float single(const struct cpu *cpu, unsigned n) {
    float value;
    memcpy(&value, &cpu->f[n], sizeof value);
    return flushes(cpu) && fpclassify(value) == FP_SUBNORMAL ? copysignf(0.0f, value) : value;
}

static void set_single(struct cpu *cpu, unsigned n, float value) {
    if (flushes(cpu) && fpclassify(value) == FP_SUBNORMAL)
        value = copysignf(0.0f, value);
    memcpy(&cpu->f[n], &value, sizeof value);
}

static double twice(const struct cpu *cpu, unsigned n) {
    double value;
    memcpy(&value, &cpu->f[n], sizeof value);
    return flushes(cpu) && fpclassify(value) == FP_SUBNORMAL ? copysign(0.0, value) : value;
}

static void set_twice(struct cpu *cpu, unsigned n, double value) {
    if (flushes(cpu) && fpclassify(value) == FP_SUBNORMAL)
        value = copysign(0.0, value);
    memcpy(&cpu->f[n], &value, sizeof value);
}

static bool condition(const struct cpu *cpu, unsigned number) {
    return cpu->fcsr >> (number == 0 ? 23 : 24 + number) & 1;
}

static void set_condition(struct cpu *cpu, unsigned number, bool value) {
    uint32_t bit = 1u << (number == 0 ? 23 : 24 + number);
    cpu->fcsr = value ? cpu->fcsr | bit : cpu->fcsr & ~bit;
}

/* ---- to integers: 0 round, 1 trunc, 2 ceil, 3 floor ---- */

static double rounded(double value, unsigned how) {
    switch (how) {
    case 1:
        return trunc(value);
    case 2:
        return ceil(value);
    case 3:
        return floor(value);
    default:
        return nearbyint(value);
    }
}

static uint32_t to_word(double value, unsigned how) {
    double whole = rounded(value, how);
    return whole >= -2147483648.0 && whole <= 2147483647.0 ? (uint32_t)(int32_t)whole : 0x7FFFFFFFu;
}

static uint64_t to_long(double value, unsigned how) {
    double whole = rounded(value, how);
    return whole >= -0x1p63 && whole < 0x1p63 ? (uint64_t)(int64_t)whole : (uint64_t)INT64_MAX;
}

static void set_word(struct cpu *cpu, unsigned n, uint32_t value) {
    cpu->f[n] = (cpu->f[n] & ~(uint64_t)0xFFFFFFFFu) | value;
}

/* ---- conversions: to S, D, W, L ---- */

static bool convert(struct cpu *cpu, uint32_t word) {
    unsigned from = word >> 21 & 31, code = word & 63;
    double value = from == FORMAT_S   ? (double)single(cpu, FS)
                   : from == FORMAT_D ? twice(cpu, FS)
                   : from == FORMAT_W ? (double)(int32_t)cpu->f[FS]
                                      : (double)(int64_t)cpu->f[FS];
    switch (code) {
    case 0x20:
        set_single(cpu, FD, from == FORMAT_L ? (float)(int64_t)cpu->f[FS] : (float)value);
        return true;
    case 0x21:
        set_twice(cpu, FD, value);
        return true;
    case 0x24:
        set_word(cpu, FD, to_word(value, 0));
        return true;
    case 0x25:
        cpu->f[FD] = to_long(value, 0);
        return true;
    default:
        break;
    }
    if (code >= 0x08 && code <= 0x0B) {
        cpu->f[FD] = to_long(value, code & 3);
        return true;
    }
    if (code >= 0x0C && code <= 0x0F) {
        set_word(cpu, FD, to_word(value, code & 3));
        return true;
    }
    return false;
}

/* ---- comparisons: bit 0 unordered, 1 equal, 2 less ---- */

static void compare(struct cpu *cpu, uint32_t word, double a, double b) {
    unsigned code = word & 15;
    bool unordered = isnan(a) || isnan(b);
    bool met = (unordered && (code & 1) != 0) || (!unordered && a == b && (code & 2) != 0) ||
               (!unordered && a < b && (code & 4) != 0);
    set_condition(cpu, word >> 8 & 7, met);
}

/* Moves that look at no value: MOV, MOVF/T, MOVZ, MOVN. */
static bool move(struct cpu *cpu, uint32_t word) {
    unsigned code = word & 63;
    bool moves = code == 0x06 || (code == 0x11 && condition(cpu, word >> 18 & 7) == (word >> 16 & 1)) ||
                 (code == 0x12 && cpu->r[FT] == 0) || (code == 0x13 && cpu->r[FT] != 0);
    if (code != 0x06 && code != 0x11 && code != 0x12 && code != 0x13)
        return false;
    if (moves && (word >> 21 & 31) == FORMAT_S)
        set_word(cpu, FD, (uint32_t)cpu->f[FS]);
    else if (moves)
        cpu->f[FD] = cpu->f[FS];
    return true;
}

/* ABS and NEG change the sign bit alone, also of no number. */
static bool sign(struct cpu *cpu, uint32_t word) {
    unsigned code = word & 63;
    bool is_single = (word >> 21 & 31) == FORMAT_S;
    uint64_t bit = is_single ? 0x80000000u : (uint64_t)1 << 63;
    if (code != 0x05 && code != 0x07)
        return false;
    uint64_t value = code == 0x05 ? cpu->f[FS] & ~bit : cpu->f[FS] ^ bit;
    if (is_single)
        set_word(cpu, FD, (uint32_t)value);
    else
        cpu->f[FD] = value;
    return true;
}

static bool arithmetic_single(struct cpu *cpu, uint32_t word) {
    float a = single(cpu, FS), b = single(cpu, FT);
    switch (word & 63) {
    case 0x00:
        set_single(cpu, FD, a + b);
        return true;
    case 0x01:
        set_single(cpu, FD, a - b);
        return true;
    case 0x02:
        set_single(cpu, FD, a * b);
        return true;
    case 0x03:
        set_single(cpu, FD, a / b);
        return true;
    case 0x04:
        set_single(cpu, FD, sqrtf(a));
        return true;
    default:
        return false;
    }
}

static bool arithmetic_double(struct cpu *cpu, uint32_t word) {
    double a = twice(cpu, FS), b = twice(cpu, FT);
    switch (word & 63) {
    case 0x00:
        set_twice(cpu, FD, a + b);
        return true;
    case 0x01:
        set_twice(cpu, FD, a - b);
        return true;
    case 0x02:
        set_twice(cpu, FD, a * b);
        return true;
    case 0x03:
        set_twice(cpu, FD, a / b);
        return true;
    case 0x04:
        set_twice(cpu, FD, sqrt(a));
        return true;
    default:
        return false;
    }
}

static void operate(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    unsigned format = word >> 21 & 31;
    bool known;
    if (format == FORMAT_W || format == FORMAT_L) {
        known = ((word & 63) == 0x20 || (word & 63) == 0x21) && convert(cpu, word);
    } else if ((word & 0x30) == 0x30) {
        if (format == FORMAT_S)
            compare(cpu, word, (double)single(cpu, FS), (double)single(cpu, FT));
        else
            compare(cpu, word, twice(cpu, FS), twice(cpu, FT));
        known = true;
    } else {
        known = (format == FORMAT_S ? arithmetic_single(cpu, word) : arithmetic_double(cpu, word)) ||
                move(cpu, word) || sign(cpu, word) || convert(cpu, word);
    }
    if (!known)
        reserved(chip, word);
}

static void branch_on(struct cpu *cpu, uint32_t word) {
    bool taken = condition(cpu, word >> 18 & 7) == (word >> 16 & 1);
    bool likely = (word >> 17 & 1) != 0;
    if (taken)
        cpu->next_pc = cpu->at + 4 + ((uint32_t)(int32_t)(int16_t)word << 2);
    if (taken || !likely) {
        cpu->slot = true;
        return;
    }
    cpu->pc = cpu->next_pc;
    cpu->next_pc += 4;
}

void cpu_cop1(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    if (!cpu_fpu_usable(chip))
        return;
    switch (word >> 21 & 31) {
    case 0x00: /* mfc1 */
        cpu->r[FT] = (uint32_t)cpu->f[FS];
        break;
    case 0x02: /* cfc1 */
        cpu->r[FT] = FS == 31 ? cpu->fcsr : 0x00F30000u;
        break;
    case 0x03: /* mfhc1 */
        cpu->r[FT] = (uint32_t)(cpu->f[FS] >> 32);
        break;
    case 0x04: /* mtc1 */
        set_word(cpu, FS, cpu->r[FT]);
        break;
    case 0x06: /* ctc1 */
        cpu->fcsr = cpu->r[FT];
        if (FS != 31 || (cpu->fcsr & 3) != 0)
            chip_fault(chip, "FCSR = %08x at %08x: only rounding to nearest is known here", cpu->fcsr,
                       cpu->at);
        break;
    case 0x07: /* mthc1 */
        cpu->f[FS] = (uint64_t)cpu->r[FT] << 32 | (uint32_t)cpu->f[FS];
        break;
    case 0x08:
        branch_on(cpu, word);
        break;
    case FORMAT_S:
    case FORMAT_D:
    case FORMAT_W:
    case FORMAT_L:
        operate(chip, word);
        break;
    default:
        reserved(chip, word);
    }
}
