/* SPDX-License-Identifier: MIT
 * Two cores that take turns. The one that is behind works until it is about 1 us ahead of the other, or
 * something happens. In a turn it sees the memories as the other one has left them. Before it touches a
 * register of a peripheral it waits for the other one, so that these accesses have the order of time. The
 * same program makes the same turns. */
#include "esp.h"

/* Cycles of a turn, about 1 us. It changes, so that a loop is not always left at the same place. */
enum { TURN = 233, TURNS = 13 };

/* Bits of the S3's CORE_1_CONTROL_0; the ESP32 has a register for each. */
enum { RUNSTALL = 1, CLOCK = 2, RESET = 4 };

/* SW_STALL_APPCPU and SW_STALL_PROCPU: all of 0x86 stalls. */
enum { STALL = 0x86 };

static const uint32_t stack_of_app[2] = {0x3FFE4350, 0x3FCED710}; /* the end of the boot ROM's, for core 1 */

/* ---- turns ---- */

static struct cpu *other(const struct esp *esp) {
    return (struct cpu *)&esp->core[1 - esp->cpu->number];
}

static void make_current(struct esp *esp, struct cpu *cpu) {
    esp->cpu->cycles = esp->cycles;
    esp->cpu = cpu;
    esp->cycles = cpu->cycles;
    esp->turns++;
}

bool cores_turn(struct esp *esp, uint64_t until) {
    const struct cpu *cpu = esp->cpu;
    struct cpu *rival = other(esp);
    const bool is_behind = rival->runs && (rival->cycles < esp->cycles ||
                                           (rival->cycles == esp->cycles && rival->number < cpu->number));
    if (is_behind || !cpu->runs)
        make_current(esp, rival);
    return esp->cycles < until;
}

uint64_t cores_limit(const struct esp *esp) {
    const struct cpu *rival = other(esp);
    return rival->runs && !cpu_sleeps(rival) ? rival->cycles + TURN + esp->turns % TURNS : NEVER;
}

bool cores_wait(struct esp *esp) {
    const struct cpu *rival = other(esp);
    if (!rival->runs || rival->cycles >= esp->cycles)
        return false;
    esp->limit = 0;
    return true;
}

bool cores_retry(struct esp *esp) {
    const struct cpu *rival = other(esp);
    if (esp->in_rom || !rival->runs || rival->cycles + esp->cpu->spent >= esp->cycles)
        return false;
    esp->cycles -= esp->cpu->spent;
    esp->cpu->instructions--;
    esp->cpu->next = esp->cpu->pc;
    esp->cpu->broken = true;
    esp->limit = 0;
    return true;
}

/* ---- what lets a core run ---- */

static void begin_app(struct esp *esp) {
    struct cpu *cpu = &esp->core[1];
    cpu_reset(esp, cpu);
    cpu_start(esp, cpu, esp->app.boot, stack_of_app[esp->chip]);
    esp->app.has_begun = true;
}

/* A core that had no clock is where the other one is, in time. */
static void let_run(struct esp *esp, unsigned number, bool runs) {
    struct cpu *cpu = &esp->core[number];
    if (runs && !cpu->runs && cpu->cycles < esp->cycles) {
        cpu->idle += esp->cycles - cpu->cycles;
        cpu->cycles = esp->cycles;
    }
    cpu->runs = runs;
}

void cores_hold(struct esp *esp) {
    struct app_core *app = &esp->app;
    const bool is_on = (app->control & (CLOCK | RESET)) == CLOCK;
    const bool stalls = (app->control & RUNSTALL) != 0 || app->stalled[1] == STALL;
    if ((app->control & RESET) != 0)
        app->has_begun = false;
    if (is_on && !stalls && !app->has_begun && app->boot != 0)
        begin_app(esp);
    if (app->stalled[0] == STALL && !(app->has_begun && is_on && !stalls)) {
        chip_fault(esp, "both cores are stalled");
        return;
    }
    let_run(esp, 1, is_on && !stalls && app->has_begun);
    let_run(esp, 0, app->stalled[0] != STALL);
    chip_look(esp);
}

void cores_reset_app(struct esp *esp) {
    esp->app.has_begun = false;
    cores_hold(esp);
}

/* ---- registers: APPCPU_CTRL_A to D of the ESP32, CORE_1_CONTROL_0 and 1 of the S3 ---- */

static uint32_t esp32_load(struct esp *esp, uint32_t offset) {
    static const uint32_t bits[3] = {RESET, CLOCK, RUNSTALL};
    if (offset == 12)
        return esp->app.boot;
    return (esp->app.control & bits[offset / 4]) != 0;
}

static void esp32_store(struct esp *esp, uint32_t offset, uint32_t value) {
    static const uint32_t bits[3] = {RESET, CLOCK, RUNSTALL};
    struct app_core *app = &esp->app;
    if (offset == 12)
        app->boot = value;
    else
        app->control = (value & 1) != 0 ? app->control | bits[offset / 4] : app->control & ~bits[offset / 4];
    cores_hold(esp);
}

static uint32_t s3_load(struct esp *esp, uint32_t offset) {
    return offset == 0 ? esp->app.control : esp->app.boot;
}

static void s3_store(struct esp *esp, uint32_t offset, uint32_t value) {
    *(offset == 0 ? &esp->app.control : &esp->app.boot) = value;
    cores_hold(esp);
}

/* ---- CPU_INTR_FROM_CPU_0 to 3 ---- */

static unsigned first_source(const struct esp *esp) {
    return esp->chip == ES_ESP32 ? 24 : 79;
}

static uint32_t asks_load(struct esp *esp, uint32_t offset) {
    const unsigned source = first_source(esp) + offset / 4;
    return esp->source[0][source / 32] >> source % 32 & 1;
}

static void asks_store(struct esp *esp, uint32_t offset, uint32_t value) {
    matrix_set(esp, first_source(esp) + offset / 4, (value & 1) != 0);
}

void cores_create(struct esp *esp) {
    const bool is_s3 = esp->chip == ES_ESP32S3;
    if (esp->cpu != NULL)
        esp->cpu->cycles = esp->cycles;
    esp->cpu = &esp->core[0];
    if (esp->core[1].cycles < esp->cycles)
        esp->core[1].cycles = esp->cycles;
    esp->core[0].runs = true;
    esp->core[1].runs = false;
    esp->core[1].number = 1;
    esp->app = (struct app_core){.control = RESET};
    for (unsigned core = 0; core < CORES; core++)
        cpu_reset(esp, &esp->core[core]);
    if (is_s3)
        bus_add(esp, &(struct block){"control of core 1", 0x600C0000, 8, s3_load, s3_store, NULL});
    else
        bus_add(esp, &(struct block){"control of core 1", 0x3FF0002C, 16, esp32_load, esp32_store, NULL});
    bus_add(esp, &(struct block){"interrupts from cores", is_s3 ? 0x600C0030 : 0x3FF000DC, 16, asks_load,
                                 asks_store, NULL});
}
