/* SPDX-License-Identifier: MIT
 * MIPS32 release 2: one instruction after the other. The tables are main.def, special.def and regimm.def.
 *
 * Flash is decoded once: `ops` has for each of its words which case of the loop it is and which registers.
 * The loop keeps place and time in variables of its own, and a place is a distance in `ops`, so that an
 * addition costs no fetch. What is not an addition or a load from RAM sees them in struct cpu and struct
 * chip, and may change them there (SLOW). Code elsewhere is decoded each time and run alone. The loop is
 * loop.def: each instruction jumps to the next one's by itself, so that a processor which foresees jumps by
 * where they are learns what usually follows what. */
#include "instruction.h"

#include <string.h>

enum { OP_SPECIAL = 64, OP_REGIMM = 128 };

/* Code with one decoded instruction for each of its words, and a last one that says OP_LEAVE. */
struct code {
    struct op *ops;
    uint32_t base; /* address of the first word */
    uint32_t size; /* bytes */
};

/* Instructions are 4 bytes, decoded ones OP_SIZE. */
enum { OP_SIZE = sizeof(struct op), PLACES = OP_SIZE / 4 };
_Static_assert(OP_SIZE == 8, "a place is found by a shift");

static const bool is_known[256] = {
#define OP(code, ...) [code] = true,
#include "main.def"
#undef OP
#define OP(code, ...) [OP_SPECIAL + code] = true,
#include "special.def"
#undef OP
#define OP(code, ...) [OP_REGIMM + code] = true,
#include "regimm.def"
#undef OP
};

static void decode(struct op *op, uint32_t word) {
    unsigned kind = word >> 26;
    if (kind == 0)
        kind = OP_SPECIAL + (word & 63);
    else if (kind == 1)
        kind = OP_REGIMM + FIELD_RT;
    *op = (struct op){.word = word,
                      .kind = is_known[kind] ? (uint8_t)kind : OP_RESERVED,
                      .rs = (uint8_t)FIELD_RS,
                      .rt = (uint8_t)FIELD_RT,
                      .rd = (uint8_t)FIELD_RD};
}

/* ---- arithmetic ---- */

/* By zero is undefined on the chip: compilers put a trap next to it. */
INLINE void divide_unsigned(struct cpu *cpu, uint32_t n, uint32_t d) {
    cpu->lo = d == 0 ? 0xFFFFFFFFu : n / d;
    cpu->hi = d == 0 ? n : n % d;
}

INLINE void divide_signed(struct cpu *cpu, int32_t n, int32_t d) {
    if (d == 0 || (n == INT32_MIN && d == -1)) {
        cpu->lo = d == 0 ? (n < 0 ? 1u : 0xFFFFFFFFu) : (uint32_t)n;
        cpu->hi = d == 0 ? (uint32_t)n : 0;
        return;
    }
    cpu->lo = (uint32_t)(n / d);
    cpu->hi = (uint32_t)(n % d);
}

INLINE uint32_t rotated(uint32_t value, unsigned count) {
    return count == 0 ? value : value >> count | value << (32 - count);
}

INLINE bool condition(const struct cpu *cpu, unsigned number) {
    return cpu->fcsr >> (number == 0 ? 23 : 24 + number) & 1;
}

/* ---- the words of the tables ---- */

#define RS      r[op->rs]
#define RT      r[op->rt]
#define RD      r[op->rd]
#define SHIFT   (word >> 6 & 31)
#define SIMM    sign_extended(word)
#define UIMM    (word & 0xFFFFu)
#define ADDRESS (RS + SIMM)
#define TARGET  (((PC + 4) & 0xF0000000u) | (word & 0x3FFFFFFu) << 2)
#define LINK    (PC + 8)

/* Address <-> place; a place may lie anywhere, but only those in `code` are gone to. */
#define AT_OF(place)      (code->base + (uint32_t)((place) / PLACES))
#define PLACE_OF(address) ((int64_t)(int32_t)((address) - code->base) * PLACES)
#define IS_INSIDE(place)  ((uint64_t)(place) < (uint64_t)code->size * PLACES && (place) % OP_SIZE == 0)
#define PC                AT_OF(here)

#define PUT_BACK()                                                                                           \
    (cpu->at = PC, cpu->in_slot = in_slot, cpu->pc = AT_OF(now), cpu->next_pc = AT_OF(next),                 \
     cpu->slot = slot, chip->cycles = cycles)
#define TAKE()                                                                                               \
    do {                                                                                                     \
        now = PLACE_OF(cpu->pc);                                                                             \
        next = PLACE_OF(cpu->next_pc);                                                                       \
        slot = cpu->slot;                                                                                    \
        r = cpu->r;                                                                                          \
        if (timed)                                                                                           \
            cycles = chip->cycles;                                                                           \
        cpu->broken = false;                                                                                 \
        limit = chip->limit < most ? chip->limit : most;                                                     \
        if (!IS_INSIDE(now))                                                                                 \
            limit = cycles;                                                                                  \
        else if (!IS_INSIDE(next) && limit > cycles + 1)                                                     \
            limit = cycles + 1;                                                                              \
    } while (0)
#define SLOW(...)                                                                                            \
    do {                                                                                                     \
        PUT_BACK();                                                                                          \
        __VA_ARGS__;                                                                                         \
        TAKE();                                                                                              \
    } while (0)
#define EXCEPTION(code) SLOW(cpu_exception(chip, code, 0x180))
#define TRAP(met)                                                                                            \
    if (met)                                                                                                 \
    EXCEPTION(EXCEPTION_TRAP)

/* Whoever leaves the code does it behind the slot. */
#define GO_TO(place)                                                                                         \
    do {                                                                                                     \
        next = (place);                                                                                      \
        if (__builtin_expect(!IS_INSIDE(next), 0) && limit > cycles + 1)                                     \
            limit = cycles + 1;                                                                              \
    } while (0)
#define JUMP(to)                                                                                             \
    do {                                                                                                     \
        GO_TO(PLACE_OF(to));                                                                                 \
        slot = true;                                                                                         \
    } while (0)
#define BRANCH(taken)                                                                                        \
    do {                                                                                                     \
        if (taken)                                                                                           \
            GO_TO(here + OP_SIZE + (int64_t)(int32_t)SIMM * OP_SIZE);                                        \
        slot = true;                                                                                         \
    } while (0)
/* One that is not taken does not execute its slot. */
#define BRANCH_LIKELY(taken)                                                                                 \
    do {                                                                                                     \
        if (taken) {                                                                                         \
            BRANCH(true);                                                                                    \
        } else {                                                                                             \
            now = next;                                                                                      \
            next += OP_SIZE;                                                                                 \
        }                                                                                                    \
    } while (0)

#define IS_FAST(address, size) (ram_offset(address) < RAM_SIZE && ((address) & ((size) - 1)) == 0)
#define LOAD(size, type)                                                                                     \
    uint32_t address = ADDRESS, value = 0;                                                                   \
    if (IS_FAST(address, size)) {                                                                            \
        if (timed)                                                                                           \
            cycles += timing_data(chip, address, false);                                                     \
        memcpy(&value, ram + ram_offset(address), size);                                                     \
        RT = (uint32_t)(type)value;                                                                          \
    } else {                                                                                                 \
        PUT_BACK();                                                                                          \
        value = cpu_load(chip, address, size);                                                               \
        if (!cpu->broken)                                                                                    \
            RT = (uint32_t)(type)value;                                                                      \
        TAKE();                                                                                              \
    }
#define STORE(size)                                                                                          \
    uint32_t address = ADDRESS, value = RT;                                                                  \
    if (IS_FAST(address, size)) {                                                                            \
        memcpy(ram + ram_offset(address), &value, size);                                                     \
        if (timed)                                                                                           \
            cycles += timing_data(chip, address, true);                                                      \
    } else                                                                                                   \
        SLOW(cpu_store(chip, address, value, size))

/* What an instruction takes, and where its line of the cache begins. */
#define LINE_OF(place) ((place) / (4 * OP_SIZE))
#define COUNT_TIME()                                                                                         \
    do {                                                                                                     \
        cycles += chip->timing.cost.instruction;                                                             \
        if (LINE_OF(here) != line)                                                                           \
            cycles += timing_fetch(chip, PC);                                                                \
        line = LINE_OF(here);                                                                                \
    } while (0)

#define NEXT()                                                                                               \
    do {                                                                                                     \
        r[0] = 0;                                                                                            \
        if (cycles >= limit)                                                                                 \
            goto out;                                                                                        \
        here = now;                                                                                          \
        now = next;                                                                                          \
        next += OP_SIZE;                                                                                     \
        in_slot = slot;                                                                                      \
        slot = false;                                                                                        \
        if (timed)                                                                                           \
            COUNT_TIME();                                                                                    \
        else                                                                                                 \
            cycles++;                                                                                        \
        op = (struct op *)((uint8_t *)code->ops + here);                                                     \
        word = op->word;                                                                                     \
        goto *actions[op->kind];                                                                             \
    } while (0)

#pragma GCC diagnostic ignored "-Wpedantic" /* labels as values */

/* GCC would put the jumps together again. */
#ifdef __clang__
#define JUMPS_APART
#else
#define JUMPS_APART __attribute__((optimize("no-gcse", "no-crossjumping")))
#endif

/* From cpu.pc, which lies in the code, until it is left, or until this cycle. */
JUMPS_APART static void run_fast(struct chip *chip, const struct code *code, uint64_t most) {
    enum { timed = false };
#include "loop.def"
}

JUMPS_APART static void run_timed(struct chip *chip, const struct code *code, uint64_t most) {
    enum { timed = true };
#include "loop.def"
}

static void run(struct chip *chip, const struct code *code, uint64_t most) {
    if (chip->timing.on)
        run_timed(chip, code, most);
    else
        run_fast(chip, code, most);
}

/* One instruction, wherever it lies. */
static void run_alone(struct chip *chip) {
    struct op ops[2] = {{.kind = OP_LEAVE}, {.kind = OP_LEAVE}};
    struct code here = {ops, chip->cpu.pc, 4};
    chip->cpu.at = chip->cpu.pc;
    chip->cpu.in_slot = chip->cpu.slot;
    uint32_t word = bus_fetch(chip, chip->cpu.pc);
    if (chip->cpu.broken || chip->stop == MZ_FAULT)
        return;
    decode(&ops[0], word);
    run(chip, &here, chip->cycles + 1);
}

void cpu_run(struct chip *chip) {
    struct code flash = {chip->ops, 0, MZ_FLASH_SIZE};
    while (chip->cycles < chip->limit) {
        uint32_t pc = chip->cpu.pc;
        flash.base = (pc & 0x20000000u) | 0x80000000u | FLASH_BASE; /* KSEG0 or KSEG1 */
        if (pc - flash.base < MZ_FLASH_SIZE && (pc & 3) == 0)
            run(chip, &flash, NEVER);
        else
            run_alone(chip);
    }
}
