/* SPDX-License-Identifier: MIT */
#include "chip/system.h"

#include "chip/clock.h"
#include "chip/interrupts.h"
#include "chip/sfr.h"
#include "task_periods.h"

#define COUNTS_IN_TICK (PIC32MZ_LOOP_PERIOD_US * CLOCK_COUNTS_IN_US)
#define FLASH_WAITS    2u /* Table 37-13: above 140 MHz */
#define FAULT_MARK     0xFA017E1Du
#define KSEG1_BIT      0x20000000u

/* Outlives a reset; written past the cache, which a reset empties. */
struct kept {
    uint32_t mark; /* FAULT_MARK: the rest is true */
    struct system_fault fault;
    uint32_t starts;    /* counted from whatever power-on has left here */
    uint32_t noise[16]; /* never written: some bits of it are others after each power-on */
};
static struct kept kept_cached __attribute__((section(".kept"), aligned(16)));

static volatile struct kept *kept(void) {
    return (volatile struct kept *)((uintptr_t)&kept_cached | KSEG1_BIT);
}

static struct {
    uint32_t count; /* CP0 Count that `us` belongs to, less what is less than a us */
    uint32_t us;
} now;

static void unlock(void) {
    SYSKEY = 0;
    SYSKEY = 0xAA996655u;
    SYSKEY = 0x556699AAu;
}

static void lock(void) {
    SYSKEY = 0;
}

void system_init(void) {
    interrupts_stop_all();
    uint32_t divider = PBDIV_ON | (CLOCK_BUS_DIVIDER - 1u);
    unlock();
    PB2DIV = divider;
    while ((PB2DIV & PBDIV_READY) == 0) {
    }
    PB3DIV = divider;
    while ((PB3DIV & PBDIV_READY) == 0) {
    }
    SFR_SET(CFGCON_ADDRESS) = CFGCON_OCACLK;
    SFR_CLR(CFGCON_ADDRESS) = CFGCON_JTAGEN;
    lock();
    PRECON = PRECON_PREFETCH | FLASH_WAITS;
    /* Time begins at 0 here, whatever Count was. */
    now.count = system_count();
}

static void set_compare(uint32_t count) {
    __asm__ volatile("mtc0 %0, $11\n\tehb" : : "r"(count));
}

void system_start_tick(void) {
    set_compare(system_count() + COUNTS_IN_TICK);
    interrupt_clear(IRQ_CORE_TIMER);
    interrupt_enable(IRQ_CORE_TIMER);
}

/* Counted from now, so ticks drift. They only wake the loop; time comes from Count. */
void on_tick(void) {
    set_compare(system_count() + COUNTS_IN_TICK);
    interrupt_clear(IRQ_CORE_TIMER);
}

uint32_t system_time_us(void) {
    uint32_t us = (system_count() - now.count) / CLOCK_COUNTS_IN_US;
    now.count += us * CLOCK_COUNTS_IN_US;
    now.us += us;
    return now.us;
}

void system_wait(void) {
    __asm__ volatile("wait");
}

void system_watchdog_start(void) {
    SFR_SET(WDTCON_ADDRESS) = WDTCON_ON;
}

void system_watchdog_clear(void) {
    WDTCON_KEY = WDTCON_CLEAR;
}

void system_reset(void) {
    (void)interrupts_hold();
    unlock();
    SFR_SET(RSWRST_ADDRESS) = RSWRST_SWRST;
    (void)SFR(RSWRST_ADDRESS); /* the read carries it out */
    for (;;) {
    }
}

uint32_t system_start_id(void) {
    uint32_t hash = 2166136261u ^ ++kept()->starts; /* FNV-1a, by words */
    for (unsigned n = 0; n < sizeof kept()->noise / sizeof kept()->noise[0]; n++)
        hash = (hash ^ kept()->noise[n]) * 16777619u;
    return hash | 1u;
}

enum system_restart system_take_restart(struct system_fault *fault) {
    bool faulted = kept()->mark == FAULT_MARK;
    bool bitten = (RCON & RCON_WDTO) != 0;
    fault->epc = kept()->fault.epc;
    fault->cause = kept()->fault.cause;
    /* Once: the next restart may have another reason. */
    kept()->mark = 0;
    RCON = 0;
    if (faulted)
        return RESTART_FAULT;
    return bitten ? RESTART_WATCHDOG : RESTART_POWER;
}

void fault(uint32_t epc, uint32_t cause) {
    kept()->fault.epc = epc;
    kept()->fault.cause = cause;
    /* Last, so that a second fault in here does not leave half a record that counts. */
    kept()->mark = FAULT_MARK;
    system_reset();
}
