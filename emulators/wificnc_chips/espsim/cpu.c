/* SPDX-License-Identifier: MIT
 * One instruction after the other. The table is instructions.def.
 *
 * Code is decoded once, when it is first executed: a page has a struct op for each of its bytes. Where it is
 * (`part`) is looked up when it leaves a page, or a line of the cache. The loop
 * keeps place and time in variables of its own. What is not arithmetic or an access to plain memory sees them
 * in struct cpu and struct esp, and may change them there (SLOW). */
#include "instruction.h"

#include <stdlib.h>
#include <string.h>

#define NO_LOOP 0xFFFFFFFFu
#define NO_PART 0xFFFFFFFFu

static const int32_t constants[16] = {-1, 1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 16, 32, 64, 128, 256};
static const uint32_t unsigned_constants[16] = {32768, 65536, 2,  3,  4,  5,  6,   7,
                                                8,     10,    12, 16, 32, 64, 128, 256};

/* ---- arithmetic ---- */

INLINE uint32_t clamped(uint32_t value, unsigned bits) {
    const int32_t most = (int32_t)((1u << bits) - 1), number = (int32_t)value;
    return (uint32_t)(number > most ? most : number < -most - 1 ? -most - 1 : number);
}

INLINE uint32_t quotient(uint32_t n, uint32_t d) {
    return d == UINT32_MAX ? 0u - n : (uint32_t)((int32_t)n / (int32_t)d);
}

INLINE uint32_t remainder_of(uint32_t n, uint32_t d) {
    return d == UINT32_MAX ? 0 : (uint32_t)((int32_t)n % (int32_t)d);
}

/* ---- instructions that are rare ---- */

static void cpu_unknown(struct esp *esp, const struct op *op) {
    uint32_t word = 0;
    char text[96];
    (void)bus_fetch(esp, esp->cpu->pc, &word);
    chip_fault(esp, "the instruction %06x at %s is not emulated",
               word & (op->size == 2 ? 0xFFFFu : 0xFFFFFFu), chip_place(esp, esp->cpu->pc, text));
}

static void cpu_compare_and_swap(struct esp *esp, const struct op *op) {
    struct cpu *cpu = esp->cpu;
    const uint32_t address = cpu->a[op->s] + (uint32_t)op->imm, with = cpu->a[op->t];
    if ((address & 3) != 0) {
        cpu_exception_at(esp, CAUSE_UNALIGNED, address);
        return;
    }
    const uint32_t before = bus_load(esp, address, 4);
    if (cpu->broken)
        return;
    if (before == cpu->scompare1)
        bus_store(esp, address, with, 4);
    if (!cpu->broken)
        cpu->a[op->t] = before;
}

static void cpu_wait(struct esp *esp, uint32_t level) {
    esp->cpu->ps = (esp->cpu->ps & ~(uint32_t)PS_LEVEL) | level;
    esp->cpu->waits = true;
    chip_look(esp);
}

/* ---- the words of the table ---- */

#define AR                a[op->r]
#define AS                a[op->s]
#define AT                a[op->t]
#define IMM               (op->imm)
#define CONSTANT          ((uint32_t)constants[op->r])
#define UNSIGNED_CONSTANT (unsigned_constants[op->r])
#define BIT(number)       (cpu->br >> (number) & 1u)
#define SET_BIT(number, value)                                                                               \
    (cpu->br = (cpu->br & ~(1u << (number))) | ((uint32_t)(value) & 1u) << (number))

#define LOOP_END() (loop_end = cpu->lcount != 0 && (cpu->ps & PS_EXCM) == 0 ? cpu->lend : NO_LOOP)
#define PUT_BACK()                                                                                           \
    (cpu->pc = pc, cpu->next = pc + size, cpu->broken = false, cpu->spent = op->cycles, esp->cycles = cycles)
#define TAKE()                                                                                               \
    do {                                                                                                     \
        cycles = esp->cycles;                                                                                \
        limit = esp->limit;                                                                                  \
        room = window_room(cpu);                                                                             \
        LOOP_END();                                                                                          \
    } while (0)
#define SLOW(...)                                                                                            \
    do {                                                                                                     \
        PUT_BACK();                                                                                          \
        __VA_ARGS__;                                                                                         \
        TAKE();                                                                                              \
        if (cpu->next != pc + size || cpu->broken)                                                           \
            GO_TO(cpu->next);                                                                                \
    } while (0)
#define GO_TO(place)                                                                                         \
    {                                                                                                        \
        pc = (place);                                                                                        \
        goto next;                                                                                           \
    }
#define BRANCH(condition)                                                                                    \
    if (condition) {                                                                                         \
        cycles += esp->taken;                                                                                \
        GO_TO((uint32_t)IMM)                                                                                 \
    }
#define DIVIDE(value)                                                                                        \
    if (AT == 0)                                                                                             \
        SLOW(cpu_exception(esp, CAUSE_DIVIDE));                                                              \
    else                                                                                                     \
        AR = (value)
#define CALLED(place)                                                                                        \
    {                                                                                                        \
        cpu->ps = (cpu->ps & ~(uint32_t)PS_CALLINC) | (uint32_t)op->other << PS_CALLINC_SHIFT;               \
        a[4 * op->other] = (uint32_t)op->other << 30 | ((pc + size) & 0x3FFFFFFFu);                          \
        GO_TO(place)                                                                                         \
    }
#define BEGIN_LOOP()                                                                                         \
    do {                                                                                                     \
        cpu->lbeg = pc + 3;                                                                                  \
        cpu->lend = (uint32_t)IMM;                                                                           \
        LOOP_END();                                                                                          \
    } while (0)

/* Plain memory: the page has bytes for it, and it does not cross the page's end. */
#define PLAIN(table, address, count)                                                                         \
    ((host = esp->table[(address) >> PAGE_BITS]) != NULL && ((address) & (PAGE - 1)) <= PAGE - (count))
/* Cached flash whose line is there. */
#define CACHED(table, address, count)                                                                        \
    ((host = lines[(address) >> PAGE_BITS]) != NULL && host[((address) & (PAGE - 1)) / GRAIN] &&             \
     PLAIN(table, address, count))
#define LOAD(table, where, count, type, to)                                                                  \
    do {                                                                                                     \
        const uint32_t address = (where);                                                                    \
        const uint8_t *host;                                                                                 \
        if (__builtin_expect(PLAIN(plain_##table, address, count), 1) || CACHED(table, address, count)) {    \
            type value;                                                                                      \
            memcpy(&value, host + (address & (PAGE - 1)), sizeof value);                                     \
            (to) = (uint32_t)value;                                                                          \
        } else                                                                                               \
            SLOW(const uint32_t value = bus_load(esp, address, count);                                       \
                 if (!cpu->broken)(to) = (uint32_t)(type)value);                                             \
    } while (0)
#define STORE(where, count, from)                                                                            \
    do {                                                                                                     \
        const uint32_t address = (where), value = (from);                                                    \
        uint8_t *host;                                                                                       \
        if (__builtin_expect(PLAIN(write, address, count), 1))                                               \
            memcpy(host + (address & (PAGE - 1)), &value, count);                                            \
        else                                                                                                 \
            SLOW(bus_store(esp, address, value, count));                                                     \
    } while (0)
/* Only reached when the access before met no exception. */
#define UPDATE(to, by) ((to) += (by))
#define FPU(...)                                                                                             \
    if (__builtin_expect((cpu->cpenable & 1) == 0, 0))                                                       \
        SLOW(cpu_exception(esp, CAUSE_NO_FPU));                                                              \
    else {                                                                                                   \
        __VA_ARGS__;                                                                                         \
    }

/* ---- code ---- */

static struct op *decoded_page(struct esp *esp, uint32_t page) {
    if (esp->code[page] == NULL) {
        esp->code[page] = calloc(PAGE, sizeof(struct op));
        if (esp->code[page] == NULL)
            abort();
        esp->write[page] = NULL; /* stores are looked at from now on: bus_store() */
    }
    return esp->code[page];
}

void cpu_forget(struct esp *esp, uint32_t address, size_t count) {
    for (uint64_t at = address < 2 ? 0 : address - 2u; at < (uint64_t)address + count; at++) {
        const uint32_t page = (uint32_t)(at >> PAGE_BITS) & (PAGES - 1);
        if (esp->code[page] != NULL)
            esp->code[page][at & (PAGE - 1)] = (struct op){.kind = OP_NONE};
    }
}

void cpu_forget_all(struct esp *esp) {
    for (uint32_t page = 0; page < PAGES; page++)
        if (esp->code[page] != NULL)
            memset(esp->code[page], 0, PAGE * sizeof **esp->code);
}

/* An op that is not decoded, or that leaves the loop. @return false: it leaves */
static bool prepare(struct esp *esp, struct op *op, uint32_t pc) {
    uint32_t word;
    if (esp->stops && pc == esp->stop_at && !esp->passes) {
        *op = (struct op){.kind = OP_PLACE};
        esp->stop = ES_PLACE;
        esp->limit = 0;
        return false;
    }
    if (rom_has(esp, pc)) {
        *op = (struct op){.kind = OP_ROM};
        rom_call(esp);
        return false;
    }
    if (!bus_fetch(esp, pc, &word)) {
        char from[96];
        chip_fault(esp, "the program runs to %08x, %s; a0 is %s", pc,
                   bus_missing(esp, pc, "where there is no code"),
                   chip_place(esp, (esp->cpu->a[0] & 0x3FFFFFFFu) | 0x40000000u, from));
        return false;
    }
    decode(op, word, pc);
    op->cycles = (uint8_t)pipeline_cycles(esp, op, pc);
    return true;
}

/* @return false: the line of the cache was not there. It is now, or the other core comes first: limit */
static bool is_there(struct esp *esp, uint32_t pc, uint8_t *const *lines) {
    const uint8_t *there = lines[pc >> PAGE_BITS];
    if (there == NULL || there[(pc & (PAGE - 1)) / GRAIN])
        return true;
    if (!cores_wait(esp))
        cache_miss(esp, pc);
    return false;
}

void cpu_run(struct esp *esp) {
    struct cpu *cpu = esp->cpu;
    uint32_t *const a = cpu->a;
    uint8_t *const *const lines = esp->lines[cpu->number];
    uint64_t cycles, limit, count = 0;
    uint32_t pc = cpu->pc, loop_end, part = NO_PART;
    unsigned room, part_bits = PAGE_BITS;
    struct op *ops = NULL;
    TAKE();
    while (cycles < limit) {
        if (__builtin_expect(pc >> part_bits != part, 0)) {
            esp->cycles = cycles;
            const bool is_here = is_there(esp, pc, lines);
            TAKE();
            if (!is_here)
                continue;
            part_bits = lines[pc >> PAGE_BITS] != NULL ? esp->cache[CACHE_CODE].line_bits : PAGE_BITS;
            part = pc >> part_bits;
            ops = decoded_page(esp, pc >> PAGE_BITS);
        }
        struct op *op = &ops[pc & (PAGE - 1)];
    again:;
        const uint32_t size = op->size;
        cycles += op->cycles;
        count++;
        if (__builtin_expect(op->top > room, 0))
            SLOW(window_overflow(esp, op->top));
        switch (op->kind) {
        case OP_NONE:
        case OP_PLACE:
        case OP_ROM:
            count--;
            PUT_BACK();
            if (!prepare(esp, op, pc)) {
                pc = cpu->next;
                TAKE();
                continue;
            }
            goto again;
#define OP(name, registers, ...)                                                                             \
    case OP_##name: {                                                                                        \
        __VA_ARGS__;                                                                                         \
    } break;
#include "instructions.def"
#undef OP
        default:
            __builtin_unreachable();
        }
        pc += size;
        if (__builtin_expect(pc == loop_end, 0)) {
            pc = cpu->lbeg;
            cpu->lcount--;
            LOOP_END();
        }
    next:;
    }
    cpu->pc = pc;
    cpu->instructions += count;
    esp->cycles = cycles;
}
