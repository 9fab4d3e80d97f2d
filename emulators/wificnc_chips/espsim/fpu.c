/* SPDX-License-Identifier: MIT
 * Single-precision floating point: IEEE 754, to nearest, as this computer does it; multiply-add rounds once.
 * A result that is no number is the chip's own quiet one, or an operand's (quiet). The FSR's flags are not
 * kept. */
#include "instruction.h"

#include <math.h>
#include <string.h>

_Static_assert(sizeof(float) == 4, "IEEE 754 single");

#define QUIET     0x00400000u
#define NO_NUMBER 0x7FC00000u

enum { ADD = 0, SUB = 1, MUL = 2, MADD = 4, MSUB = 5, MADDN = 6, DIVN = 7 };
enum { ROUND = 8, TRUNC = 9, FLOOR = 10, CEIL = 11, FLOAT = 12, UFLOAT = 13, UTRUNC = 14 };
/* 16 + t of FP1OP */
enum {
    ABS = 17,
    CONST = 19,
    NEG = 22,
    DIV0 = 23,
    RECIP0 = 24,
    SQRT0 = 25,
    RSQRT0 = 26,
    NEXP01 = 27,
    MKSADJ = 28,
    MKDADJ = 29,
    ADDEXP = 30,
    ADDEXPM = 31,
};

static float number(uint32_t bits) {
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static uint32_t bits_of(float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static bool is_no_number(uint32_t bits) {
    return (bits & 0x7FFFFFFFu) > 0x7F800000u;
}

/* Of a result that is no number: the first of these operands that is none. r: 0 where it is no operand. */
static uint32_t result(float value, uint32_t r, uint32_t t, uint32_t s) {
    if (!isnan(value))
        return bits_of(value);
    return is_no_number(r)   ? r | QUIET
           : is_no_number(t) ? t | QUIET
           : is_no_number(s) ? s | QUIET
                             : NO_NUMBER;
}

static void unknown(struct esp *esp, unsigned which) {
    char text[96];
    chip_fault(esp, "the floating-point instruction %u at %s is not emulated", which,
               chip_place(esp, esp->cpu->pc, text));
}

void fpu_arithmetic(struct esp *esp, const struct op *op) {
    uint32_t *f = esp->cpu->f;
    const uint32_t s = f[op->s], t = f[op->t], r = f[op->r];
    switch (op->other) {
    case ADD:
        f[op->r] = result(number(s) + number(t), 0, t, s);
        break;
    case SUB:
        f[op->r] = result(number(s) - number(t), 0, t, s);
        break;
    case MUL:
        f[op->r] = result(number(s) * number(t), 0, t, s);
        break;
    case DIVN:
        break; /* ADDEXPM.S has put the result there */
    case MADD:
    case MADDN:
        f[op->r] = result(fmaf(number(s), number(t), number(r)), r, t, s);
        break;
    case MSUB:
        f[op->r] = result(fmaf(-number(s), number(t), number(r)), r, t, s);
        break;
    default:
        unknown(esp, op->other);
    }
}

/* ---- numbers to integers: what does not fit becomes the nearest that does, and no number the greatest ----
 */

static uint32_t to_signed(double value) {
    if (value < -2147483648.0)
        return 0x80000000u;
    return value < 2147483648.0 ? (uint32_t)(int32_t)value : 0x7FFFFFFFu;
}

/* UTRUNC: a negative one as a signed integer */
static uint32_t to_unsigned(double value) {
    if (value < 0)
        return to_signed(value);
    return value < 4294967296.0 ? (uint32_t)value : UINT32_MAX;
}

static uint32_t to_integer(unsigned how, uint32_t bits, unsigned scale) {
    const double value = ldexp((double)number(bits), (int)scale);
    switch (how) {
    case ROUND:
        return to_signed(nearbyint(value));
    case TRUNC:
        return to_signed(trunc(value));
    case FLOOR:
        return to_signed(floor(value));
    case CEIL:
        return to_signed(ceil(value));
    default:
        return to_unsigned(trunc(value));
    }
}

/* Integer to number, then exactly smaller by 2^scale. */
static uint32_t from_integer(unsigned how, uint32_t value, unsigned scale) {
    const float whole = how == FLOAT ? (float)(int32_t)value : (float)value;
    return bits_of(ldexpf(whole, -(int)scale));
}

void fpu_unary(struct esp *esp, const struct op *op) {
    struct cpu *cpu = esp->cpu;
    uint32_t *f = cpu->f;
    static const uint32_t constants[16] = {0, 0x3F800000u, 0x40000000u, 0x3F000000u};
    switch (op->other) {
    case ROUND:
    case TRUNC:
    case FLOOR:
    case CEIL:
    case UTRUNC:
        cpu->a[op->r] = to_integer(op->other, f[op->s], op->t);
        break;
    case FLOAT:
    case UFLOAT:
        f[op->r] = from_integer(op->other, cpu->a[op->s], op->t);
        break;
    case ABS:
        f[op->r] = f[op->s] & 0x7FFFFFFFu;
        break;
    case NEG:
        f[op->r] = f[op->s] ^ 0x80000000u;
        break;
    case DIV0:
    case SQRT0:
    case NEXP01:
    case ADDEXPM:
        f[op->r] = f[op->s];
        break;
    case ADDEXP:
        break;
    case MKDADJ:
        f[op->r] = result(number(f[op->s]) / number(f[op->r]), f[op->r], 0, f[op->s]);
        break;
    case MKSADJ:
        f[op->r] = result(sqrtf(number(f[op->s])), f[op->s], 0, 0);
        break;
    case CONST:
        if (op->s < 4)
            f[op->r] = constants[op->s];
        else
            unknown(esp, op->other);
        break;
    default:
        unknown(esp, op->other);
    }
}

void fpu_compare(struct esp *esp, const struct op *op) {
    struct cpu *cpu = esp->cpu;
    const uint32_t a = cpu->f[op->s], b = cpu->f[op->t];
    const bool unordered = is_no_number(a) || is_no_number(b);
    const float x = number(a), y = number(b);
    const bool truths[8] = {[1] = unordered,          [2] = x == y, [3] = unordered || x == y, [4] = x < y,
                            [5] = unordered || x < y, [6] = x <= y, [7] = unordered || x <= y};
    cpu->br = (cpu->br & ~(1u << op->r)) | (uint32_t)truths[op->other] << op->r;
}
