/* SPDX-License-Identifier: MIT
 * Bytes of an instruction to struct op. Xtensa ISA Reference Manual, chapter Instruction Formats and Opcodes;
 * the tables have its order. What is not in them is UNKNOWN, and stops the chip when it is executed. */
#include "instruction.h"

static const uint8_t registers_of[KINDS] = {
#define OP(name, registers, ...) [OP_##name] = (registers),
#include "instructions.def"
#undef OP
};

unsigned decode_registers(unsigned kind) {
    return registers_of[kind];
}

static int32_t extended(uint32_t value, unsigned bits) {
    return (int32_t)(value << (32 - bits)) >> (32 - bits);
}

/* A kind of one of the tables; 0 there: UNKNOWN. */
static uint8_t known(unsigned kind) {
    return (uint8_t)(kind == OP_NONE ? OP_UNKNOWN : kind);
}

/* ---- QRST: op0 = 0 ---- */

static void decode_jump(struct op *op, uint32_t word) { /* SNM0 */
    const unsigned m = FIELD_T >> 2, n = FIELD_T & 3;
    static const uint8_t jumps[4] = {OP_RET, OP_RETW, OP_JX, OP_UNKNOWN};
    if (m == 0)
        op->kind = n == 0 && FIELD_S == 0 ? OP_ILLEGAL : OP_UNKNOWN;
    else if (m == 2)
        op->kind = jumps[n];
    else if (m == 3) {
        op->kind = n == 0 ? OP_CALLX0 : OP_CALLX;
        op->other = (uint16_t)n;
    } else
        op->kind = OP_UNKNOWN;
}

static void decode_return(struct op *op, uint32_t word) { /* RFEI */
    static const uint8_t returns[16] = {[0] = OP_RFE, [2] = OP_RFDE, [4] = OP_RFWO, [5] = OP_RFWU};
    if (FIELD_T == 0)
        op->kind = known(returns[FIELD_S]);
    else
        op->kind = FIELD_T == 1 && FIELD_S >= 2 && FIELD_S < LEVELS ? OP_RFI : OP_UNKNOWN;
}

static void decode_st0(struct op *op, uint32_t word) {
    static const uint8_t syncs[16] = {[0] = OP_NOP, [1] = OP_NOP,   [2] = OP_NOP,   [3] = OP_NOP,
                                      [8] = OP_NOP, [12] = OP_MEMW, [13] = OP_MEMW, [15] = OP_NOP};
    static const uint8_t kinds[16] = {[1] = OP_MOVSP, [4] = OP_BREAK, [6] = OP_RSIL,  [7] = OP_WAITI,
                                      [8] = OP_ANY4,  [9] = OP_ALL4,  [10] = OP_ANY8, [11] = OP_ALL8};
    if (FIELD_R == 0)
        decode_jump(op, word);
    else if (FIELD_R == 2)
        op->kind = known(syncs[FIELD_T]);
    else if (FIELD_R == 3)
        decode_return(op, word);
    else if (FIELD_R == 5)
        op->kind = FIELD_S == 0 ? OP_SYSCALL : OP_UNKNOWN;
    else
        op->kind = known(kinds[FIELD_R]);
}

static void decode_st1(struct op *op, uint32_t word) {
    static const uint8_t kinds[16] = {[0] = OP_SSR,  [1] = OP_SSL,  [2] = OP_SSA8L, [3] = OP_SSA8B,
                                      [4] = OP_SSAI, [6] = OP_RER,  [7] = OP_WER,   [8] = OP_ROTW,
                                      [14] = OP_NSA, [15] = OP_NSAU};
    op->kind = known(kinds[FIELD_R]);
    if (op->kind == OP_SSAI)
        op->imm = (int32_t)(FIELD_S | (FIELD_T & 1) << 4);
    if (op->kind == OP_ROTW)
        op->imm = extended(FIELD_T, 4);
}

static void decode_rst0(struct op *op, uint32_t word) {
    static const uint8_t kinds[16] = {[1] = OP_AND,    [2] = OP_OR,     [3] = OP_XOR,    [8] = OP_ADD,
                                      [9] = OP_ADDX2,  [10] = OP_ADDX4, [11] = OP_ADDX8, [12] = OP_SUB,
                                      [13] = OP_SUBX2, [14] = OP_SUBX4, [15] = OP_SUBX8};
    if (FIELD_OP2 == 0)
        decode_st0(op, word);
    else if (FIELD_OP2 == 4)
        decode_st1(op, word);
    else if (FIELD_OP2 == 5) /* RITLB1 .. WDTLB: attributes of memory, which is there as it is */
        op->kind = FIELD_R == 6 || FIELD_R == 14 ? OP_NOP : OP_UNKNOWN;
    else if (FIELD_OP2 == 6)
        op->kind = FIELD_S == 0 ? OP_NEG : FIELD_S == 1 ? OP_ABS : OP_UNKNOWN;
    else
        op->kind = known(kinds[FIELD_OP2]);
    if (op->kind == OP_OR && op->s == op->t)
        op->kind = OP_MOV;
}

static void decode_rst1(struct op *op, uint32_t word) {
    static const uint8_t kinds[16] = {[0] = OP_SLLI, [1] = OP_SLLI, [2] = OP_SRAI,    [3] = OP_SRAI,
                                      [4] = OP_SRLI, [6] = OP_XSR,  [8] = OP_SRC,     [9] = OP_SRL,
                                      [10] = OP_SLL, [11] = OP_SRA, [12] = OP_MUL16U, [13] = OP_MUL16S};
    op->kind = known(kinds[FIELD_OP2]);
    if (op->kind == OP_SLLI)
        op->imm = (int32_t)(32 - (FIELD_T | (FIELD_OP2 & 1) << 4));
    if (op->kind == OP_SRAI)
        op->imm = (int32_t)(FIELD_S | (FIELD_OP2 & 1) << 4);
    op->other = (uint16_t)(word >> 8 & 255); /* of XSR: the special register */
}

static void decode_rst2(struct op *op, uint32_t word) {
    static const uint8_t kinds[16] = {OP_ANDB, OP_ANDBC, OP_ORB,  OP_ORBC, OP_XORB,  OP_NONE,
                                      OP_NONE, OP_NONE,  OP_MULL, OP_NONE, OP_MULUH, OP_MULSH,
                                      OP_QUOU, OP_QUOS,  OP_REMU, OP_REMS};
    op->kind = known(kinds[FIELD_OP2]);
}

static void decode_rst3(struct op *op, uint32_t word) {
    static const uint8_t kinds[16] = {OP_RSR,  OP_WSR,  OP_SEXT,   OP_CLAMPS, OP_MIN,    OP_MAX,
                                      OP_MINU, OP_MAXU, OP_MOVEQZ, OP_MOVNEZ, OP_MOVLTZ, OP_MOVGEZ,
                                      OP_MOVF, OP_MOVT, OP_RUR,    OP_WUR};
    op->kind = kinds[FIELD_OP2];
    op->other = (uint16_t)(word >> 8 & 255);
    if (op->kind == OP_RUR) /* the number lies in s and t, the register in r */
        op->other = (uint16_t)(FIELD_S << 4 | FIELD_T);
    if (op->kind == OP_RSR && op->other == 234)
        op->kind = OP_CCOUNT;
}

/* ---- floating point ---- */

static void decode_indexed(struct op *op, uint32_t word) { /* LSCX */
    static const uint8_t kinds[16] = {[0] = OP_LSX, [1] = OP_LSXU, [4] = OP_SSX, [5] = OP_SSXU};
    op->kind = known(kinds[FIELD_OP2]);
}

static void decode_window_memory(struct op *op, uint32_t word) { /* LSC4 */
    op->kind = FIELD_OP2 == 0 ? OP_L32E : FIELD_OP2 == 4 ? OP_S32E : OP_UNKNOWN;
    op->imm = (int32_t)(FIELD_R << 2) - 64;
}

static void decode_fp0(struct op *op, uint32_t word) {
    static const uint8_t unary[16] = {OP_MOV_S,       OP_FLOAT_UNARY, OP_NONE,        OP_FLOAT_UNARY,
                                      OP_RFR,         OP_WFR,         OP_FLOAT_UNARY, OP_FLOAT_UNARY,
                                      OP_FLOAT_UNARY, OP_FLOAT_UNARY, OP_FLOAT_UNARY, OP_FLOAT_UNARY,
                                      OP_FLOAT_UNARY, OP_FLOAT_UNARY, OP_FLOAT_UNARY, OP_FLOAT_UNARY};
    static const uint8_t kinds[16] = {OP_FLOAT_RRR,  OP_FLOAT_RRR,  OP_FLOAT_RRR, OP_NONE,
                                      OP_FLOAT_RRR,  OP_FLOAT_RRR,  OP_FLOAT_RRR, OP_FLOAT_RRR,
                                      OP_FLOAT_TO,   OP_FLOAT_TO,   OP_FLOAT_TO,  OP_FLOAT_TO,
                                      OP_FLOAT_FROM, OP_FLOAT_FROM, OP_FLOAT_TO,  OP_NONE};
    op->kind = known(FIELD_OP2 == 15 ? unary[FIELD_T] : kinds[FIELD_OP2]);
    op->other = (uint16_t)(FIELD_OP2 == 15 ? 16 + FIELD_T : FIELD_OP2);
}

static void decode_fp1(struct op *op, uint32_t word) {
    static const uint8_t kinds[16] = {[1] = OP_FLOAT_COMPARE, [2] = OP_FLOAT_COMPARE, [3] = OP_FLOAT_COMPARE,
                                      [4] = OP_FLOAT_COMPARE, [5] = OP_FLOAT_COMPARE, [6] = OP_FLOAT_COMPARE,
                                      [7] = OP_FLOAT_COMPARE, [8] = OP_MOVEQZ_S,      [9] = OP_MOVNEZ_S,
                                      [10] = OP_MOVLTZ_S,     [11] = OP_MOVGEZ_S,     [12] = OP_MOVF_S,
                                      [13] = OP_MOVT_S};
    op->kind = known(kinds[FIELD_OP2]);
    op->other = (uint16_t)FIELD_OP2;
}

static void decode_qrst(struct op *op, uint32_t word) {
    static void (*const decoders[16])(struct op *, uint32_t) = {
        [0] = decode_rst0,    [1] = decode_rst1,          [2] = decode_rst2, [3] = decode_rst3,
        [8] = decode_indexed, [9] = decode_window_memory, [10] = decode_fp0, [11] = decode_fp1};
    if (FIELD_OP1 == 4 || FIELD_OP1 == 5) {
        op->kind = OP_EXTUI;
        op->s = (uint8_t)(FIELD_S | (FIELD_OP1 & 1) << 4);
        op->imm = (int32_t)((2u << FIELD_OP2) - 1);
    } else if (decoders[FIELD_OP1] != NULL)
        decoders[FIELD_OP1](op, word);
    else
        op->kind = OP_UNKNOWN;
}

/* ---- the other formats of 24 bits ---- */

static void decode_l32r(struct op *op, uint32_t word, uint32_t pc) {
    op->kind = OP_L32R;
    op->imm = (int32_t)(((pc + 3) & ~3u) + (0xFFFC0000u | word >> 8 << 2));
}

static void decode_memory(struct op *op, uint32_t word) { /* LSAI */
    static const uint8_t kinds[16] = {[0] = OP_L8UI,    [1] = OP_L16UI, [2] = OP_L32I,  [4] = OP_S8I,
                                      [5] = OP_S16I,    [6] = OP_S32I,  [7] = OP_NOP,   [9] = OP_L16SI,
                                      [10] = OP_MOVI,   [11] = OP_L32I, [12] = OP_ADDI, [13] = OP_ADDI,
                                      [14] = OP_S32C1I, [15] = OP_S32I}; /* 7: caches, 11, 15: L32AI, S32RI */
    static const uint8_t shifts[16] = {[1] = 1, [2] = 2,  [5] = 1,  [6] = 2,
                                       [9] = 1, [11] = 2, [14] = 2, [15] = 2};
    const uint32_t imm = word >> 16 & 255;
    op->kind = known(kinds[FIELD_R]);
    op->imm = (int32_t)(imm << shifts[FIELD_R]);
    if (FIELD_R == 10)
        op->imm = extended(imm | FIELD_S << 8, 12);
    if (FIELD_R == 12)
        op->imm = extended(imm, 8);
    if (FIELD_R == 13)
        op->imm = extended(imm, 8) * 256;
}

static void decode_float_memory(struct op *op, uint32_t word) { /* LSCI */
    static const uint8_t kinds[16] = {[0] = OP_LSI, [4] = OP_SSI, [8] = OP_LSIU, [12] = OP_SSIU};
    op->kind = known(kinds[FIELD_R]);
    op->imm = (int32_t)((word >> 16 & 255) << 2);
}

/* MACID, MACCD, MACDD, MACAD, MACIA, MACCA, MACDA, MACAA, MACI, MACC: mac.c */
static void decode_mac(struct op *op, uint32_t word) {
    static const uint8_t kinds[16] = {OP_MAC_SM, OP_MAC_SM, OP_MAC_MM, OP_MAC_SM, OP_MAC_SS,
                                      OP_MAC_SS, OP_MAC_MT, OP_MAC_SS, OP_MAC_SM, OP_MAC_SM};
    op->kind = known(kinds[FIELD_OP2]);
    op->other = (uint16_t)(FIELD_OP2 << 4 | FIELD_OP1);
    if (FIELD_OP2 >= 8 ? FIELD_OP1 != 0 : FIELD_OP1 < 4 && FIELD_OP2 != 7)
        op->kind = OP_UNKNOWN;
}

static void decode_call(struct op *op, uint32_t word, uint32_t pc) { /* CALLN */
    const unsigned n = FIELD_T & 3;
    op->kind = n == 0 ? OP_CALL0 : OP_CALL;
    op->other = (uint16_t)n;
    op->imm = (int32_t)((pc & ~3u) + 4) + extended(word >> 6, 18) * 4;
}

static void decode_b1(struct op *op, uint32_t word, uint32_t pc) {
    static const uint8_t kinds[16] = {
        [0] = OP_BF, [1] = OP_BT, [8] = OP_LOOP, [9] = OP_LOOPNEZ, [10] = OP_LOOPGTZ};
    const uint32_t imm = word >> 16 & 255;
    op->kind = known(kinds[FIELD_R]);
    op->imm = (int32_t)(pc + 4 + (FIELD_R >= 8 ? imm : (uint32_t)extended(imm, 8)));
}

static void decode_si(struct op *op, uint32_t word, uint32_t pc) {
    static const uint8_t zero[4] = {OP_BEQZ, OP_BNEZ, OP_BLTZ, OP_BGEZ};
    static const uint8_t constant[4] = {OP_BEQI, OP_BNEI, OP_BLTI, OP_BGEI};
    const unsigned n = FIELD_T & 3, m = FIELD_T >> 2;
    op->imm = (int32_t)pc + 4 + extended(word >> 16 & 255, 8);
    if (n == 0) {
        op->kind = OP_J;
        op->imm = (int32_t)pc + 4 + extended(word >> 6, 18);
    } else if (n == 1) {
        op->kind = zero[m];
        op->imm = (int32_t)pc + 4 + extended(word >> 12, 12);
    } else if (n == 2)
        op->kind = constant[m];
    else if (m == 0) {
        op->kind = OP_ENTRY;
        op->imm = (int32_t)(word >> 12 << 3);
    } else if (m == 1)
        decode_b1(op, word, pc);
    else
        op->kind = m == 2 ? OP_BLTUI : OP_BGEUI;
}

static void decode_branch(struct op *op, uint32_t word, uint32_t pc) {
    static const uint8_t kinds[16] = {OP_BNONE, OP_BEQ, OP_BLT, OP_BLTU, OP_BALL,  OP_BBC, OP_BBCI, OP_BBCI,
                                      OP_BANY,  OP_BNE, OP_BGE, OP_BGEU, OP_BNALL, OP_BBS, OP_BBSI, OP_BBSI};
    op->kind = kinds[FIELD_R];
    op->other = (uint16_t)(FIELD_T | (FIELD_R & 1) << 4);
    op->imm = (int32_t)pc + 4 + extended(word >> 16 & 255, 8);
}

/* ---- 16 bits ---- */

static void decode_st3(struct op *op, uint32_t word) {
    static const uint8_t kinds[16] = {OP_RET, OP_RETW, OP_BREAK_N, OP_NOP, OP_NONE, OP_NONE, OP_ILLEGAL};
    if (FIELD_R == 0) {
        op->kind = OP_MOV;
        op->r = op->t;
    } else
        op->kind = FIELD_R == 15 ? known(kinds[FIELD_T]) : OP_UNKNOWN;
}

static void decode_narrow(struct op *op, uint32_t word, uint32_t pc) {
    static const uint8_t kinds[4] = {OP_L32I, OP_S32I, OP_ADD, OP_ADDI_N};
    op->size = 2;
    if (FIELD_OP0 == 13) {
        decode_st3(op, word);
        return;
    }
    if (FIELD_OP0 < 12) {
        op->kind = kinds[FIELD_OP0 - 8];
        op->imm = (int32_t)(FIELD_OP0 < 10 ? FIELD_R << 2 : FIELD_T == 0 ? UINT32_MAX : FIELD_T);
        return;
    }
    const uint32_t imm = (FIELD_T & 7) << 4 | FIELD_R;
    if (FIELD_T < 8) { /* MOVI.N: -32 .. 95 */
        op->kind = OP_MOVI;
        op->t = op->s;
        op->imm = (int32_t)imm - (imm >= 96 ? 128 : 0);
    } else {
        op->kind = FIELD_T < 12 ? OP_BEQZ : OP_BNEZ;
        op->imm = (int32_t)(pc + 4 + (imm & 63));
    }
}

static uint8_t top_of(const struct op *op) {
    const unsigned fields = registers_of[op->kind];
    unsigned top = op->kind == OP_CALL || op->kind == OP_CALLX ? op->other * 4u : 0;
    if ((fields & IR) != 0 && op->r > top)
        top = op->r;
    if ((fields & IS) != 0 && op->s > top)
        top = op->s;
    if ((fields & IT) != 0 && op->t > top)
        top = op->t;
    return (uint8_t)(top / 4);
}

void decode(struct op *op, uint32_t word, uint32_t pc) {
    *op = (struct op){.size = 3,
                      .cycles = 1,
                      .kind = OP_UNKNOWN,
                      .r = (uint8_t)FIELD_R,
                      .s = (uint8_t)FIELD_S,
                      .t = (uint8_t)FIELD_T};
    word &= FIELD_OP0 >= 8 ? 0xFFFFu : 0xFFFFFFu;
    switch (FIELD_OP0) {
    case 0:
        decode_qrst(op, word);
        break;
    case 1:
        decode_l32r(op, word, pc);
        break;
    case 2:
        decode_memory(op, word);
        break;
    case 3:
        decode_float_memory(op, word);
        break;
    case 4:
        decode_mac(op, word);
        break;
    case 5:
        decode_call(op, word, pc);
        break;
    case 6:
        decode_si(op, word, pc);
        break;
    case 7:
        decode_branch(op, word, pc);
        break;
    case 14: /* wide formats of the S3's vector unit */
    case 15:
        break;
    default:
        decode_narrow(op, word, pc);
    }
    op->top = top_of(op);
}
