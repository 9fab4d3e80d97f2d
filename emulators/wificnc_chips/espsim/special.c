/* SPDX-License-Identifier: MIT
 * Special registers (RSR, WSR, XSR) and user registers (RUR, WUR), by their numbers in the ISA Reference
 * Manual. */
#include "esp.h"

enum {
    LBEG = 0,
    LEND = 1,
    LCOUNT = 2,
    SAR = 3,
    BR = 4,
    SCOMPARE1 = 12,
    ACCLO = 16,
    ACCHI = 17,
    M0 = 32,
    WINDOWBASE = 72,
    WINDOWSTART = 73,
    IBREAKENABLE = 96,
    MEMCTL = 97,
    ATOMCTL = 99,
    IBREAKA0 = 128,
    DBREAKA0 = 144,
    DBREAKC0 = 160,
    CONFIGID0 = 176,
    EPC1 = 177,
    DEPC = 192,
    EPS2 = 194,
    CONFIGID1 = 208,
    EXCSAVE1 = 209,
    CPENABLE = 224,
    INTERRUPT = 226, /* INTSET when written */
    INTCLEAR = 227,
    INTENABLE = 228,
    PS = 230,
    VECBASE = 231,
    EXCCAUSE = 232,
    DEBUGCAUSE = 233,
    CCOUNT = 234,
    PRID = 235,
    ICOUNT = 236,
    ICOUNTLEVEL = 237,
    EXCVADDR = 238,
    CCOMPARE0 = 240,
    MISC0 = 244,
};

enum {
    USER_EXPSTATE = 230,
    USER_THREADPTR = 231,
    USER_FCR = 232,
    USER_FSR = 233,
    USER_F64 = 234 /* to 236 */
};

#define PS_WRITABLE 0x00070FFFu
/* What ESP-IDF knows the cores by. */
static const uint32_t processor_ids[CORES] = {0xCDCD, 0xABAB};

static const uint32_t config_ids[2][2] = {{0xC2BCFFFE, 0x1CC5FE96}, {0xC2F0FFFE, 0x23090F1F}};
static const uint8_t timer_interrupts[TIMERS] = {INTERRUPT_TIMER0, INTERRUPT_TIMER1, INTERRUPT_TIMER2};

/* Registers that are words and nothing else. @return NULL: another one */
static uint32_t *plain(struct cpu *cpu, unsigned number) {
    if (number >= M0 && number < M0 + 4)
        return &cpu->m[number - M0];
    if (number >= EPC1 && number < EPC1 + 7)
        return &cpu->epc[number - EPC1 + 1];
    if (number >= EPS2 && number < EPS2 + 6)
        return &cpu->eps[number - EPS2 + 2];
    if (number >= EXCSAVE1 && number < EXCSAVE1 + 7)
        return &cpu->excsave[number - EXCSAVE1 + 1];
    if (number >= MISC0 && number < MISC0 + 4)
        return &cpu->misc[number - MISC0];
    if (number >= CCOMPARE0 && number < CCOMPARE0 + TIMERS)
        return &cpu->ccompare[number - CCOMPARE0];
    switch (number) {
    case LBEG:
        return &cpu->lbeg;
    case LEND:
        return &cpu->lend;
    case LCOUNT:
        return &cpu->lcount;
    case SAR:
        return &cpu->sar;
    case BR:
        return &cpu->br;
    case SCOMPARE1:
        return &cpu->scompare1;
    case ACCLO:
        return &cpu->acclo;
    case ACCHI:
        return &cpu->acchi;
    case WINDOWSTART:
        return &cpu->window_start;
    case MEMCTL:
        return &cpu->memctl;
    case ATOMCTL:
        return &cpu->atomctl;
    case DEPC:
        return &cpu->depc;
    case CPENABLE:
        return &cpu->cpenable;
    case INTENABLE:
        return &cpu->intenable;
    case PS:
        return &cpu->ps;
    case VECBASE:
        return &cpu->vecbase;
    case EXCCAUSE:
        return &cpu->exccause;
    case DEBUGCAUSE:
        return &cpu->debugcause;
    case EXCVADDR:
        return &cpu->excvaddr;
    default:
        return NULL;
    }
}

static void unknown(struct esp *esp, const char *what, unsigned number) {
    char text[96];
    chip_fault(esp, "%s special register %u at %s is not emulated", what, number,
               chip_place(esp, esp->cpu->pc, text));
}

static bool is_for_debugger(unsigned number) {
    return number == IBREAKENABLE || number == IBREAKA0 || number == IBREAKA0 + 1 || number == DBREAKA0 ||
           number == DBREAKA0 + 1 || number == DBREAKC0 || number == DBREAKC0 + 1 || number == ICOUNT ||
           number == ICOUNTLEVEL;
}

static uint32_t value_of(struct esp *esp, unsigned number) {
    const uint32_t *word = plain(esp->cpu, number);
    if (word != NULL)
        return *word;
    switch (number) {
    case WINDOWBASE:
        return esp->cpu->window_base;
    case INTERRUPT:
        return cpu_interrupts(esp->cpu);
    case CCOUNT:
        return chip_ccount(esp);
    case PRID:
        return processor_ids[esp->cpu->number];
    case CONFIGID0:
        return config_ids[esp->chip][0];
    case CONFIGID1:
        return config_ids[esp->chip][1];
    default:
        if (!is_for_debugger(number))
            unknown(esp, "the", number);
        return 0;
    }
}

/* ---- what a write does ---- */

static void schedule(struct esp *esp, unsigned timer) {
    const uint32_t distance = esp->cpu->ccompare[timer] - chip_ccount(esp);
    esp->cpu->timer_at[timer] = esp->cycles + (distance == 0 ? 1ull << 32 : distance);
}

static void schedule_all(struct esp *esp) {
    for (unsigned timer = 0; timer < TIMERS; timer++)
        schedule(esp, timer);
}

static uint32_t writable(const struct cpu *cpu, unsigned number, uint32_t value) {
    switch (number) {
    case SAR:
        return value & 63;
    case BR:
    case WINDOWSTART:
        return value & 0xFFFF;
    case ACCHI:
        return (uint32_t)(int8_t)value;
    case CPENABLE:
        return value & 1;
    case PS:
        return value & PS_WRITABLE;
    case VECBASE:
        return value & 0xFFFFFC00u;
    case EXCCAUSE:
        return value & 63;
    case DEBUGCAUSE:
        return cpu->debugcause;
    default:
        return value;
    }
}

static void set(struct esp *esp, unsigned number, uint32_t value) {
    struct cpu *cpu = esp->cpu;
    uint32_t *word = plain(cpu, number);
    if (word != NULL)
        *word = writable(cpu, number, value);
    else if (number == WINDOWBASE)
        window_rotate(cpu, (int)(value & 15) - (int)cpu->window_base);
    else if (number == INTERRUPT)
        cpu->latched |= value & INTERRUPTS_SOFTWARE;
    else if (number == INTCLEAR)
        cpu->latched &= ~(value & (INTERRUPTS_SOFTWARE | INTERRUPTS_EDGE));
    else if (number == CCOUNT) {
        cpu->ccount_from = value - (uint32_t)esp->cycles;
        schedule_all(esp);
    } else if (is_for_debugger(number)) {
        if (number == IBREAKENABLE ? value != 0 : (number & ~1u) == DBREAKC0 && (value & 0xC0000000u) != 0)
            chip_fault(esp, "a breakpoint of the processor is set, which is not emulated");
    } else
        unknown(esp, "writing", number);
    if (number >= CCOMPARE0 && number < CCOMPARE0 + TIMERS) {
        cpu->latched &= ~(1u << timer_interrupts[number - CCOMPARE0]);
        schedule(esp, number - CCOMPARE0);
    }
    if (number >= CCOUNT && number < CCOMPARE0 + TIMERS)
        chip_look(esp);
    else if (number >= INTERRUPT && number <= PS)
        cpu_check(esp);
}

void special_read(struct esp *esp, const struct op *op) {
    esp->cpu->a[op->t] = value_of(esp, op->other);
}

void special_write(struct esp *esp, const struct op *op) {
    set(esp, op->other, esp->cpu->a[op->t]);
}

void special_exchange(struct esp *esp, const struct op *op) {
    const uint32_t before = value_of(esp, op->other), with = esp->cpu->a[op->t];
    esp->cpu->a[op->t] = before;
    set(esp, op->other, with);
}

/* ---- user registers ---- */

static uint32_t *user(struct esp *esp, unsigned number) {
    switch (number) {
    case USER_EXPSTATE:
        return &esp->cpu->expstate;
    case USER_THREADPTR:
        return &esp->cpu->threadptr;
    case USER_FCR:
        return &esp->cpu->fcr;
    case USER_FSR:
        return &esp->cpu->fsr;
    case USER_F64: /* of the ESP32's double accelerator, whose instructions no compiler uses: saved with the
                      others */
    case USER_F64 + 1:
    case USER_F64 + 2:
        return &esp->cpu->f64[number - USER_F64];
    default: {
        char text[96];
        chip_fault(esp, "user register %u at %s is not emulated", number,
                   chip_place(esp, esp->cpu->pc, text));
        return NULL;
    }
    }
}

void special_user_read(struct esp *esp, const struct op *op) {
    const uint32_t *word = user(esp, op->other);
    if (word != NULL)
        esp->cpu->a[op->r] = *word;
}

void special_user_write(struct esp *esp, const struct op *op) {
    uint32_t *word = user(esp, op->other);
    if (word == NULL)
        return;
    *word = esp->cpu->a[op->t];
    if (op->other == USER_FCR && (*word & 3) != 0)
        chip_fault(esp, "rounding other than to nearest is not emulated");
}

/* ---- timers of the processor ---- */

void special_timers(struct esp *esp) {
    for (unsigned i = 0; i < CORES * TIMERS; i++) {
        struct cpu *cpu = &esp->core[i / TIMERS];
        const unsigned timer = i % TIMERS;
        if (cpu->timer_at[timer] > esp->cycles)
            continue;
        cpu->latched |= 1u << timer_interrupts[timer];
        cpu->timer_at[timer] += 1ull << 32;
    }
}

uint64_t special_next(const struct esp *esp) {
    uint64_t next = NEVER;
    for (unsigned i = 0; i < CORES * TIMERS; i++) {
        const uint64_t at = esp->core[i / TIMERS].timer_at[i % TIMERS];
        next = at < next ? at : next;
    }
    return next;
}
