/* SPDX-License-Identifier: MIT
 * The chip as a whole: time, and what is seen from outside. */
#include "rom.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void chip_fault(struct esp *esp, const char *format, ...) {
    if (esp->stop == ES_FAULT)
        return;
    va_list words;
    va_start(words, format);
    vsnprintf(esp->fault, sizeof esp->fault, format, words);
    va_end(words);
    esp->stop = ES_FAULT;
    esp->limit = 0;
}

/* Each line once, as many as there is room for. */
void chip_note(struct esp *esp, const char *format, ...) {
    char line[160];
    va_list words;
    va_start(words, format);
    vsnprintf(line, sizeof line - 1, format, words);
    va_end(words);
    strcat(line, "\n");
    if (strstr(esp->notes, line) == NULL && strlen(esp->notes) + strlen(line) < sizeof esp->notes)
        strcat(esp->notes, line);
}

const char *es_notes(const struct esp *esp) {
    return esp->notes;
}

void chip_look(struct esp *esp) {
    esp->look = true;
    esp->limit = 0;
}

/* Room for `count` elements: no edge and no byte may be missing. */
bool chip_grow(void *array, size_t *room, size_t count, size_t size) {
    void **at = array;
    if (count <= *room)
        return true;
    const size_t wanted = 2 * count + 1024;
    void *grown = realloc(*at, wanted * size);
    if (grown == NULL)
        abort();
    *at = grown;
    *room = wanted;
    return true;
}

static const struct symbol *symbol_of(const struct esp *esp, uint32_t address) {
    for (size_t i = 0; i < esp->symbol_count; i++)
        if (address - esp->symbols[i].address < esp->symbols[i].size)
            return &esp->symbols[i];
    return NULL;
}

const char *chip_place(const struct esp *esp, uint32_t address, char text[96]) {
    const struct symbol *symbol = symbol_of(esp, address);
    if (symbol == NULL)
        snprintf(text, 96, "%08x", address);
    else
        snprintf(text, 96, "%08x (%.60s+%u)", address, symbol->name, address - symbol->address);
    return text;
}

uint32_t chip_ccount(const struct esp *esp) {
    return (uint32_t)esp->cycles + esp->cpu->ccount_from;
}

/* Causes as the boot ROM numbers them: a timer group's watchdog, software, the RTC's watchdog, core 0. The
 * manuals' chapter Reset and Clock: CPU reset; docs/espsim.md has the table. */
bool chip_keeps_outputs(const struct esp *esp) {
    return (esp->reset_cause >= 11 && esp->reset_cause <= 14) || esp->reset_cause == CAUSE_CPU_BY_GROUP_1;
}

/* All parts as after a reset. */
static void create_parts(struct esp *esp) {
    esp->block_count = 0;
    memset(esp->source, 0, sizeof esp->source);
    gpio_create(esp);
    io_mux_create(esp);
    timers_create(esp);
    watchdogs_create(esp);
    matrix_create(esp);
    uart_create(esp);
    usb_serial_create(esp);
    spi_create(esp);
    mmu_create(esp);
    rtc_create(esp);
    systimer_create(esp);
    efuse_create(esp);
    sha_create(esp);
    cores_create(esp);
    cache_reset(esp);
    parts_create(esp);
    dport_create(esp);
}

struct esp *es_create(enum es_chip chip) {
    struct esp *esp = calloc(1, sizeof *esp);
    if (esp == NULL)
        return NULL;
    esp->chip = chip;
    if (!bus_create(esp)) {
        es_destroy(esp);
        return NULL;
    }
    esp->reset_cause = CAUSE_POWER_ON;
    create_parts(esp);
    rom_put_code(esp);
    if (chip == ES_ESP32)
        rom_put_tables(esp);
    chip_look(esp);
    return esp;
}

void es_destroy(struct esp *esp) {
    if (esp == NULL)
        return;
    mmu_destroy(esp);
    bus_destroy(esp);
    free(esp->flash.bytes);
    for (size_t i = 0; i < esp->symbol_count; i++)
        free(esp->symbols[i].name);
    free(esp->symbols);
    free(esp->edges);
    free(esp->w5500.sent);
    free(esp->usb.in);
    free(esp->usb.out);
    for (unsigned i = 0; i < UARTS; i++) {
        free(esp->uart[i].in);
        free(esp->uart[i].out);
    }
    free(esp);
}

/* ---- time ---- */

static uint64_t soonest(uint64_t a, uint64_t b) {
    return a < b ? a : b;
}

static void events(struct esp *esp) {
    timers_event(esp);
    uart_event(esp);
    watchdogs_event(esp);
    systimer_event(esp);
    parts_event(esp);
    special_timers(esp);
    esp->look = true;
}

static void look_around(struct esp *esp) {
    matrix_update(esp);
    esp->next_event = soonest(soonest(soonest(timers_next(esp), uart_next(esp)), parts_next(esp)),
                              soonest(soonest(special_next(esp), systimer_next(esp)), watchdogs_next(esp)));
    esp->look = false;
}

static void sleep_until(struct esp *esp, uint64_t until) {
    esp->cpu->idle += until - esp->cycles;
    esp->cycles = until;
}

/* What is due at this moment. */
static void settle(struct esp *esp) {
    if (esp->cycles >= esp->next_event)
        events(esp);
    if (esp->look)
        look_around(esp);
}

/* ---- resets ---- */

enum { LOOP_RESETS = 8 };
#define LOOP_CYCLES (5 * (uint64_t)ES_CPU_HZ)

void chip_reset(struct esp *esp, unsigned cause, const char *by) {
    esp->resets = true;
    esp->reset_cause = cause;
    esp->reset_by = by;
    chip_look(esp);
}

/* The chip starts from its flash again. Its RTC memory and its pins' drivers outside are as they were,
 * and after a reset of the processors what makes the signals at its pins. */
static void reset_now(struct esp *esp) {
    esp->resets = false;
    esp->reset_count++;
    esp->resets_in_a_row = esp->cycles - esp->reset_at < LOOP_CYCLES ? esp->resets_in_a_row + 1 : 1;
    esp->reset_at = esp->cycles;
    if (esp->flash.size == 0)
        chip_fault(esp, "the chip is reset (%s), and has no flash to start from", esp->reset_by);
    else if (esp->resets_in_a_row == LOOP_RESETS)
        chip_fault(esp,
                   "an endless boot loop: the chip was reset %d times within seconds, the last time by: %s",
                   LOOP_RESETS, esp->reset_by);
    else {
        create_parts(esp);
        (void)boot_again(esp);
    }
}

void chip_power_on(struct esp *esp) {
    esp->resets = false;
    esp->resets_in_a_row = 0;
    esp->reset_cause = CAUSE_POWER_ON;
    create_parts(esp);
}

/* Until both cores are there. */
static void work(struct esp *esp, uint64_t until) {
    while (esp->stop == ES_TIME && cores_turn(esp, until)) {
        settle(esp);
        if (esp->resets) {
            reset_now(esp);
            continue;
        }
        const bool taken = cpu_interrupt(esp);
        const uint64_t limit = soonest(soonest(esp->next_event, until), cores_limit(esp));
        if (esp->cpu->waits && !taken) {
            sleep_until(esp, limit);
            continue;
        }
        esp->limit = limit;
        if (esp->limit > esp->cycles)
            cpu_run(esp);
    }
    if (esp->stop == ES_TIME || esp->stop == ES_PLACE)
        settle(esp);
}

enum es_stop es_run(struct esp *esp, uint64_t until_cycle) {
    if (esp->stop == ES_FAULT || esp->stop == ES_DARK)
        return esp->stop;
    if (esp->stop == ES_PLACE) { /* past it */
        esp->stop = ES_TIME;
        esp->passes = true;
        work(esp, soonest(esp->cycles + 1, until_cycle));
        esp->passes = false;
        cpu_forget(esp, esp->stop_at, 1);
    }
    work(esp, until_cycle);
    return esp->stop;
}

void es_stop_at(struct esp *esp, uint32_t address) {
    cpu_forget(esp, esp->stop_at, 1);
    cpu_forget(esp, address, 1);
    esp->stop_at = address;
    esp->stops = true;
}

unsigned es_resets(const struct esp *esp, const char **by) {
    *by = esp->reset_count == 0 ? "" : esp->reset_by;
    return esp->reset_count;
}

uint64_t es_cycles(const struct esp *esp) {
    return esp->cycles;
}

uint64_t es_instructions(const struct esp *esp) {
    uint64_t all = 0;
    for (unsigned core = 0; core < CORES; core++)
        all += esp->core[core].instructions;
    return all;
}

const char *es_fault(const struct esp *esp) {
    return esp->fault;
}

void es_level(const struct esp *esp, unsigned level, struct es_level *out) {
    *out = esp->level[level % LEVELS];
}

uint32_t es_symbol(const struct esp *esp, const char *name) {
    for (size_t i = 0; i < esp->symbol_count; i++)
        if (strcmp(esp->symbols[i].name, name) == 0)
            return esp->symbols[i].address;
    return 0;
}

/* ---- the processor from outside ---- */

void es_cpu_get(const struct esp *esp, unsigned core, struct es_cpu *out) {
    const struct cpu *cpu = &esp->core[core % CORES];
    *out = (struct es_cpu){.pc = cpu->pc,
                           .ps = cpu->ps,
                           .sar = cpu->sar,
                           .br = cpu->br,
                           .acclo = cpu->acclo,
                           .acchi = cpu->acchi,
                           .scompare1 = cpu->scompare1,
                           .lbeg = cpu->lbeg,
                           .lend = cpu->lend,
                           .lcount = cpu->lcount,
                           .windowbase = cpu->window_base,
                           .windowstart = cpu->window_start,
                           .epc1 = cpu->epc[1],
                           .exccause = cpu->exccause,
                           .excvaddr = cpu->excvaddr,
                           .vecbase = cpu->vecbase,
                           .cpenable = cpu->cpenable,
                           .intenable = cpu->intenable,
                           .interrupt = cpu_interrupts(cpu)};
    memcpy(out->a, cpu->a, sizeof out->a);
    memcpy(out->f, cpu->f, sizeof out->f);
}

void es_cpu_set(struct esp *esp, const struct es_cpu *in) {
    struct cpu *cpu = &esp->core[0];
    window_rotate(cpu, (int)(in->windowbase & 15) - (int)cpu->window_base);
    cpu->pc = in->pc;
    cpu->ps = in->ps;
    cpu->sar = in->sar;
    cpu->br = in->br;
    cpu->acclo = in->acclo;
    cpu->acchi = in->acchi;
    cpu->scompare1 = in->scompare1;
    cpu->lbeg = in->lbeg;
    cpu->lend = in->lend;
    cpu->lcount = in->lcount;
    cpu->window_start = in->windowstart;
    cpu->epc[1] = in->epc1;
    cpu->exccause = in->exccause;
    cpu->excvaddr = in->excvaddr;
    cpu->vecbase = in->vecbase;
    cpu->cpenable = in->cpenable;
    cpu->intenable = in->intenable;
    memcpy(cpu->a, in->a, sizeof cpu->a);
    memcpy(cpu->f, in->f, sizeof cpu->f);
    chip_look(esp);
}

uint32_t es_physical(struct esp *esp, unsigned number) {
    window_rotate(&esp->core[0], 0); /* the present window, too */
    return esp->core[0].physical[number % PHYSICAL];
}
