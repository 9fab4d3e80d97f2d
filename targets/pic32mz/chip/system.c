/* SPDX-License-Identifier: MIT */
#include "chip/system.h"

#include "chip/clock.h"
#include "chip/interrupts.h"
#include "chip/sfr.h"
#include "task_periods.h"

#define COUNTS_IN_TICK (PIC32MZ_LOOP_PERIOD_US * CLOCK_COUNTS_IN_US)
#define FLASH_WAITS    2u /* Table 37-13: above 140 MHz */
#define RESTART_MARK   0xFA017E1Du
#define MOTION_MARK    0x5EA50A15u
#define KSEG1_BIT      0x20000000u

/* Outlives a reset; written past the cache, which a reset empties. Without power it is any bits. */
struct kept {
    uint32_t mark;   /* RESTART_MARK: the next four are true */
    uint32_t reason; /* enum hal_restart_cause */
    uint32_t epc, caller, cause;
    uint32_t motion; /* MOTION_MARK: axes moved */
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

void system_note_motion(bool moves) {
    kept()->motion = moves ? MOTION_MARK : 0;
}

/* ---- why the chip began again ---- */

/* Cause.ExcCode */
static const char *fault_name(uint32_t cause) {
    switch (cause >> 2 & 31u) {
    case 2:
    case 3:
        return "no memory at this address";
    case 4:
        return "address error on load";
    case 5:
        return "address error on store";
    case 6:
    case 7:
        return "bus error";
    case 9:
        return "breakpoint";
    case 10:
        return "unknown instruction";
    case 11:
        return "coprocessor off";
    case 13:
        return "trap";
    default:
        return NULL;
    }
}

/* What a bootloader that ran before has cleared is not known: with MOTION_MARK it was no quiet start. */
static enum hal_restart_cause cause_of(uint32_t flags, bool moved) {
    if ((flags & RCON_POR) != 0)
        return HAL_RESTART_NONE;
    if ((flags & (RCON_WDTO | RCON_DMTO)) != 0)
        return HAL_RESTART_WATCHDOG;
    if ((flags & RCON_BOR) != 0)
        return HAL_RESTART_BROWN_OUT;
    if (!moved)
        return HAL_RESTART_NONE;
    return (flags & RCON_EXTR) != 0 ? HAL_RESTART_EXTERNAL : HAL_RESTART_UNKNOWN;
}

const struct hal_restart *system_take_restart(void) {
    static struct hal_restart restart;
    const uint32_t flags = RCON;
    const bool noted = kept()->mark == RESTART_MARK && (flags & RCON_POR) == 0;
    restart.cause =
        noted ? (enum hal_restart_cause)kept()->reason : cause_of(flags, kept()->motion == MOTION_MARK);
    if (restart.cause == HAL_RESTART_FAULT) {
        restart.address[restart.address_count++] = kept()->epc;
        restart.address[restart.address_count++] = kept()->caller;
        restart.detail = fault_name(kept()->cause);
    }
    /* Once: the next restart may have another reason. */
    kept()->mark = kept()->motion = 0;
    RCON = 0;
    return restart.cause == HAL_RESTART_NONE ? NULL : &restart;
}

static void note_restart(enum hal_restart_cause reason) {
    kept()->reason = (uint32_t)reason;
    /* Last, so that a second fault in here does not leave half a record that counts. */
    kept()->mark = RESTART_MARK;
}

void fault(uint32_t epc, uint32_t caller, uint32_t cause) {
    kept()->epc = epc;
    kept()->caller = caller;
    kept()->cause = cause;
    note_restart(HAL_RESTART_FAULT);
    system_reset();
}

/* ---- the oscillator ---- */

bool system_has_clock(void) {
    return OSCCON_COSC(OSCCON) == COSC_PLL;
}

void system_note_lost_clock(void) {
    note_restart(HAL_RESTART_OSCILLATOR);
}

void system_use_backup_clock(void) {
    unlock();
    PB2DIV = PBDIV_ON; /* divided by 1 */
    while ((PB2DIV & PBDIV_READY) == 0) {
    }
    lock();
}
