/* SPDX-License-Identifier: MIT
 * MIPS32 release 2, integer: one instruction after the other. The tables are main.def and special.def. */
#include "chip.h"

#include <string.h>

#define RS           cpu->r[word >> 21 & 31]
#define RT           cpu->r[word >> 16 & 31]
#define RD           cpu->r[word >> 11 & 31]
#define SHAMT        (word >> 6 & 31)
#define SIMM         sign_extended(word)
#define UIMM         (word & 0xFFFFu)
#define ADDRESS      (RS + SIMM)
#define GOOD         (!cpu->broken)
#define ROTATE(x, n) ((n) == 0 ? (x) : (x) >> (n) | (x) << (32 - (n)))

#define INLINE static inline __attribute__((always_inline))

INLINE uint32_t sign_extended(uint32_t word) {
    int32_t value = (int16_t)(word & 0xFFFFu);
    return (uint32_t)value;
}

/* ---- branches ---- */

INLINE void jump(struct cpu *cpu, uint32_t to) {
    cpu->next_pc = to;
    cpu->slot = true;
}

INLINE void branch(struct cpu *cpu, uint32_t word, bool taken) {
    if (taken)
        cpu->next_pc = cpu->at + 4 + (SIMM << 2);
    cpu->slot = true;
}

/* A likely branch that is not taken does not execute its slot. */
INLINE void branch_likely(struct cpu *cpu, uint32_t word, bool taken) {
    if (taken) {
        branch(cpu, word, true);
        return;
    }
    cpu->pc = cpu->next_pc;
    cpu->next_pc += 4;
}

INLINE bool condition(const struct cpu *cpu, unsigned number) {
    return cpu->fcsr >> (number == 0 ? 23 : 24 + number) & 1;
}

/* ---- arithmetic ---- */

INLINE void set_hilo(struct cpu *cpu, uint64_t value) {
    cpu->hi = (uint32_t)(value >> 32);
    cpu->lo = (uint32_t)value;
}

INLINE uint64_t hilo(const struct cpu *cpu) {
    return (uint64_t)cpu->hi << 32 | cpu->lo;
}

/* By zero is undefined on the chip: compilers put a trap beside it. */
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

INLINE void add_trapping(struct chip *chip, unsigned to, uint32_t a, uint32_t b) {
    int32_t sum;
    if (__builtin_add_overflow((int32_t)a, (int32_t)b, &sum))
        cpu_exception(chip, EXCEPTION_OVERFLOW, 0x180);
    else
        chip->cpu.r[to] = (uint32_t)sum;
}

INLINE void subtract_trapping(struct chip *chip, unsigned to, uint32_t a, uint32_t b) {
    int32_t rest;
    if (__builtin_sub_overflow((int32_t)a, (int32_t)b, &rest))
        cpu_exception(chip, EXCEPTION_OVERFLOW, 0x180);
    else
        chip->cpu.r[to] = (uint32_t)rest;
}

INLINE void trap(struct chip *chip, bool met) {
    if (met)
        cpu_exception(chip, EXCEPTION_TRAP, 0x180);
}

/* ---- memory ---- */

INLINE bool is_ram(uint32_t address) {
    return (address >> 30) == 2 && (address & 0x1FFFFFFFu) < RAM_SIZE;
}

INLINE bool check_alignment(struct chip *chip, uint32_t address, unsigned size, enum exception_code code) {
    if ((address & (size - 1)) == 0)
        return true;
    chip->cpu.bad_address = address;
    cpu_exception(chip, code, 0x180);
    return false;
}

INLINE uint32_t load(struct chip *chip, uint32_t address, unsigned size) {
    if (!check_alignment(chip, address, size, EXCEPTION_ADDRESS_LOAD))
        return 0;
    if (is_ram(address)) {
        uint32_t value = 0;
        memcpy(&value, (const uint8_t *)chip->ram + (address & 0x1FFFFFFFu), size);
        return value;
    }
    return bus_load(chip, address, size);
}

INLINE void store(struct chip *chip, uint32_t address, uint32_t value, unsigned size) {
    if (!check_alignment(chip, address, size, EXCEPTION_ADDRESS_STORE))
        return;
    if (is_ram(address))
        memcpy((uint8_t *)chip->ram + (address & 0x1FFFFFFFu), &value, size);
    else
        bus_store(chip, address, value, size);
}

/* Little-endian: the left part of a word is its high bytes, up to the one addressed. */
static void load_left(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    uint32_t address = ADDRESS, shift = 8 * (3 - (address & 3));
    uint32_t value = load(chip, address & ~3u, 4);
    if (GOOD)
        RT = value << shift | (RT & ((1u << shift) - 1));
}

static void load_right(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    uint32_t address = ADDRESS, shift = 8 * (address & 3);
    uint32_t value = load(chip, address & ~3u, 4);
    if (GOOD)
        RT = shift == 0 ? value : value >> shift | (RT & ~(0xFFFFFFFFu >> shift));
}

static void store_left(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    uint32_t address = ADDRESS, count = (address & 3) + 1;
    for (uint32_t i = 0; i < count; i++)
        store(chip, (address & ~3u) + i, RT >> 8 * (4 - count + i) & 0xFF, 1);
}

static void store_right(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    uint32_t address = ADDRESS;
    for (uint32_t i = 0; i < 4 - (address & 3); i++)
        store(chip, address + i, RT >> 8 * i & 0xFF, 1);
}

static void load_float(struct chip *chip, uint32_t address, unsigned to, unsigned size) {
    struct cpu *cpu = &chip->cpu;
    if (!cpu_fpu_usable(chip) || !check_alignment(chip, address, size, EXCEPTION_ADDRESS_LOAD))
        return;
    uint32_t low = load(chip, address, 4), high = size == 8 ? load(chip, address + 4, 4) : 0;
    if (GOOD)
        cpu->f[to] = (size == 8 ? (uint64_t)high << 32 : cpu->f[to] & ~(uint64_t)0xFFFFFFFFu) | low;
}

static void store_float(struct chip *chip, uint32_t address, unsigned from, unsigned size) {
    if (!cpu_fpu_usable(chip) || !check_alignment(chip, address, size, EXCEPTION_ADDRESS_STORE))
        return;
    store(chip, address, (uint32_t)chip->cpu.f[from], 4);
    if (size == 8)
        store(chip, address + 4, (uint32_t)(chip->cpu.f[from] >> 32), 4);
}

/* ---- groups ---- */

static void reserved(struct chip *chip, uint32_t word) {
    chip_fault(chip, "instruction %08x at %08x is not known here", word, chip->cpu.at);
}

INLINE void special(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    switch (word & 63) {
#define OP(code, ...)                                                                                        \
    case code: {                                                                                             \
        __VA_ARGS__;                                                                                         \
    } break;
#include "special.def"
    default:
        reserved(chip, word);
    }
}

static void regimm(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    unsigned kind = word >> 16 & 31;
    int32_t value = (int32_t)RS;
    bool taken = (kind & 1) != 0 ? value >= 0 : value < 0;
    if ((kind & 0x0C) != 0 || kind > 0x13) {
        if (kind == 0x1F)
            return; /* synci: there is no cache */
        reserved(chip, word);
        return;
    }
    if ((kind & 0x10) != 0)
        cpu->r[31] = cpu->at + 8;
    if ((kind & 2) != 0)
        branch_likely(cpu, word, taken);
    else
        branch(cpu, word, taken);
}

static void special2(struct chip *chip, uint32_t word) {
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
        reserved(chip, word);
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
        reserved(chip, word);
    }
}

static void special3(struct chip *chip, uint32_t word) {
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
        reserved(chip, word);
    }
}

/* Indexed loads and stores of floating point. */
static void cop1x(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    uint32_t address = RS + RT;
    switch (word & 63) {
    case 0x00:
        load_float(chip, address, word >> 6 & 31, 4);
        break;
    case 0x01:
        load_float(chip, address, word >> 6 & 31, 8);
        break;
    case 0x08:
        store_float(chip, address, word >> 11 & 31, 4);
        break;
    case 0x09:
        store_float(chip, address, word >> 11 & 31, 8);
        break;
    case 0x0F: /* prefx */
        break;
    default:
        reserved(chip, word);
    }
}

INLINE void execute(struct chip *chip, uint32_t word) {
    struct cpu *cpu = &chip->cpu;
    switch (word >> 26) {
#include "main.def"
#undef OP
    default:
        reserved(chip, word);
    }
}

/* KSEG0 and KSEG1 differ in one bit. */
INLINE uint32_t fetch(struct chip *chip, uint32_t pc) {
    uint32_t in_flash = (pc & 0xDFFFFFFFu) - (0x80000000u + FLASH_BASE);
    if (__builtin_expect(in_flash < MZ_FLASH_SIZE && (pc & 3) == 0, 1))
        return chip->flash[in_flash / 4];
    return bus_fetch(chip, pc);
}

void cpu_run(struct chip *chip) {
    struct cpu *cpu = &chip->cpu;
    while (chip->cycles < chip->limit) {
        uint32_t at = cpu->pc, next = cpu->next_pc;
        uint32_t word = fetch(chip, at);
        cpu->at = at;
        cpu->pc = next;
        cpu->next_pc = next + 4;
        cpu->in_slot = cpu->slot;
        cpu->slot = false;
        chip->cycles++;
        if (__builtin_expect(!cpu->broken, 1))
            execute(chip, word);
        cpu->r[0] = 0;
        if (__builtin_expect(cpu->broken, 0))
            cpu->broken = false;
    }
}

/* ---- exceptions ---- */

static void enter(struct cpu *cpu, uint32_t return_to, bool in_slot) {
    if ((cpu->status & STATUS_EXL) == 0) {
        cpu->epc = in_slot ? return_to - 4 : return_to;
        cpu->cause = (cpu->cause & 0x7FFFFFFFu) | (in_slot ? 0x80000000u : 0);
    }
    cpu->status |= STATUS_EXL;
}

static void go_to(struct cpu *cpu, uint32_t address) {
    cpu->pc = address;
    cpu->next_pc = address + 4;
    cpu->slot = false;
}

static void use_set(struct cpu *cpu, unsigned set) {
    cpu->srsctl = (cpu->srsctl & ~0x3CFu) | (cpu->srsctl & 15u) << 6 | set; /* PSS = CSS, CSS */
    cpu->r = cpu->set[set];
}

void cpu_exception(struct chip *chip, enum exception_code code, uint32_t vector) {
    struct cpu *cpu = &chip->cpu;
    uint32_t base = (cpu->status & STATUS_BEV) != 0 ? 0xBFC00200u : cpu->ebase & 0xFFFFF000u;
    if ((cpu->status & STATUS_BEV) != 0)
        chip_fault(chip, "exception %u at %08x before there are vectors", (unsigned)code, cpu->at);
    enter(cpu, cpu->at, cpu->in_slot);
    cpu->cause = (cpu->cause & ~0x7Cu) | (uint32_t)code << 2;
    use_set(cpu, cpu->srsctl >> 12 & 15); /* ESS */
    go_to(cpu, base + vector);
    cpu->broken = true;
}

/* The vector of the interrupt that evic.c has found. */
void cpu_interrupt(struct chip *chip) {
    struct cpu *cpu = &chip->cpu;
    enter(cpu, cpu->pc, false);
    cpu->cause = (cpu->cause & ~0x0003FC7Cu) | chip->level << 10;
    use_set(cpu, chip->priss->value >> 4 * chip->level & 15u);
    go_to(cpu, (cpu->ebase & 0xFFFFF000u) + chip->off[chip->irq]);
    cpu->waits = false;
    chip->running[chip->depth % REGISTER_SETS] = chip->irq;
    chip->began[chip->depth % REGISTER_SETS] = chip->cycles - chip->asleep;
    chip->depth++;
}

void cpu_reset(struct chip *chip) {
    struct cpu *cpu = &chip->cpu;
    memset(cpu, 0, sizeof *cpu);
    cpu->r = cpu->set[0];
    cpu->status = STATUS_BEV | STATUS_ERL;
    cpu->srsctl = 7u << 26; /* HSS: seven shadow sets */
    cpu->ebase = 0x80000000u;
    cpu->config = 2; /* K0: not cached */
    go_to(cpu, 0xBFC00000u);
    chip->depth = 0;
}
