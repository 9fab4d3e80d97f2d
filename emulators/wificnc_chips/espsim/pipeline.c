/* SPDX-License-Identifier: MIT
 * Cycles of an instruction, when it is decoded: one, and those for which the next ones wait for its result.
 * The numbers are those of GCC's machine description of Xtensa (gcc/config/xtensa, xtensa.md, xtensa.h,
 * xtensa.cc): a pipeline of five stages; results after 2 cycles (loads, special registers, products,
 * conversions) or 4 (float sums and products); 3 for a branch that is taken; 32 for a quotient. */
#include "instruction.h"

enum { SLOWEST = 4, DIVISION = 32 };

static bool is_divider(unsigned kind) {
    return kind >= OP_QUOU && kind <= OP_REMS;
}

static bool is_float_load(unsigned kind) {
    return kind == OP_LSI || kind == OP_LSIU || kind == OP_LSX || kind == OP_LSXU;
}

/* Cycles until an instruction that uses its result may follow. */
static unsigned latency(const struct op *op) {
    switch (op->kind) {
    case OP_L8UI:
    case OP_L16UI:
    case OP_L16SI:
    case OP_L32I:
    case OP_L32R:
    case OP_L32E:
    case OP_LSI:
    case OP_LSIU:
    case OP_LSX:
    case OP_LSXU:
    case OP_RSR:
    case OP_RUR:
    case OP_CCOUNT:
    case OP_MULL:
    case OP_MULUH:
    case OP_MULSH:
    case OP_MUL16U:
    case OP_MUL16S:
    case OP_FLOAT_FROM:
    case OP_FLOAT_TO:
        return 2;
    case OP_FLOAT_RRR:
        return 4;
    default:
        return 1;
    }
}

/* Its result is a floating-point register. */
static bool makes_float(unsigned kind) {
    return kind == OP_FLOAT_RRR || kind == OP_FLOAT_FROM || is_float_load(kind);
}

static unsigned result(const struct op *op) {
    switch (op->kind) {
    case OP_LSX:
    case OP_LSXU:
    case OP_RUR:
    case OP_MULL:
    case OP_MULUH:
    case OP_MULSH:
    case OP_MUL16U:
    case OP_MUL16S:
    case OP_FLOAT_RRR:
    case OP_FLOAT_FROM:
    case OP_FLOAT_TO:
        return op->r;
    default:
        return op->t;
    }
}

/* Whether an instruction names this address register. One that only writes it counts, too. */
static bool names(const struct op *op, unsigned number) {
    const unsigned fields = decode_registers(op->kind);
    if (op->kind == OP_RET || op->kind == OP_RETW)
        return number == 0;
    return ((fields & IR) != 0 && op->r == number) || ((fields & IS) != 0 && op->s == number) ||
           ((fields & IT) != 0 && op->t == number);
}

static bool names_float(const struct op *op, unsigned number) {
    switch (op->kind) {
    case OP_FLOAT_RRR:
        return op->r == number || op->s == number || op->t == number;
    case OP_FLOAT_COMPARE:
        return op->s == number || op->t == number;
    case OP_SSI:
    case OP_SSIU:
        return op->t == number;
    case OP_SSX:
    case OP_SSXU:
        return op->r == number;
    case OP_RFR:
    case OP_MOV_S:
    case OP_MOVEQZ_S:
    case OP_MOVNEZ_S:
    case OP_MOVLTZ_S:
    case OP_MOVGEZ_S:
    case OP_MOVF_S:
    case OP_MOVT_S:
    case OP_FLOAT_TO:
    case OP_FLOAT_UNARY:
        return op->s == number;
    default:
        return false;
    }
}

/* It goes to another place, whatever happens. */
static bool always_jumps(unsigned kind) {
    switch (kind) {
    case OP_J:
    case OP_JX:
    case OP_CALL0:
    case OP_CALL:
    case OP_CALLX0:
    case OP_CALLX:
    case OP_RET:
    case OP_RETW:
    case OP_RFWO:
    case OP_RFWU:
    case OP_RFE:
    case OP_RFDE:
    case OP_RFI:
        return true;
    default:
        return false;
    }
}

/* Cycles for which those that follow wait. */
static unsigned waits(struct esp *esp, const struct op *op, uint32_t pc) {
    const unsigned wanted = latency(op);
    uint32_t place = pc + op->size, word;
    for (unsigned after = 1; after < wanted && bus_fetch(esp, place, &word); after++) {
        struct op next;
        decode(&next, word, place);
        if (makes_float(op->kind) ? names_float(&next, result(op)) : names(&next, result(op)))
            return wanted - after;
        place += next.size;
    }
    return 0;
}

unsigned pipeline_cycles(struct esp *esp, const struct op *op, uint32_t pc) {
    if (!esp->timed)
        return 1;
    if (is_divider(op->kind))
        return DIVISION;
    return 1 + (always_jumps(op->kind) ? TAKEN : waits(esp, op, pc));
}
