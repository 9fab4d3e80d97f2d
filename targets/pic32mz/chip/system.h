/* SPDX-License-Identifier: MIT
 * Clocks, time, watchdog and restart of the chip. */
#ifndef WIFICNC_PIC32MZ_SYSTEM_H
#define WIFICNC_PIC32MZ_SYSTEM_H

#include "hal/compiler.h"
#include "hal/hal.h"

#include <stdbool.h>
#include <stdint.h>

/** CP0 Count: CLOCK_COUNT_HZ, wraps every 43 s. [any context] */
static HAL_INLINE uint32_t system_count(void) {
    uint32_t count;
    __asm__ volatile("mfc0 %0, $9" : "=r"(count));
    return count;
}

/** [start] Bus clocks, prefetch, which timers the output compares use. Interrupts are off. */
void system_init(void);

/** [start] The tick, 1 kHz, that wakes the task from system_wait(). */
void system_start_tick(void);

/** [task] us since power-on, wraps at 2^32. Must be asked every 40 s at least. */
uint32_t system_time_us(void);

/** [task] Sleep until any interrupt; 1 ms at most. */
void system_wait(void);

/** [start] From now on the chip resets itself when system_watchdog_clear() is not called for 2 s. */
void system_watchdog_start(void);
void system_watchdog_clear(void);

/** [any context] Reset the chip: all pins become inputs. */
__attribute__((noreturn)) void system_reset(void);

/** [start] Once: why the chip began again. NULL: power-on, or a reset while nothing moved. */
const struct hal_restart *system_take_restart(void);

/** [task] Whether axes move or may be about to: then a reset from outside is one that loses the position. */
void system_note_motion(bool moves);

/** [start, NMI] Whether the clock is the one that clock.h says. */
bool system_has_clock(void);

/** Once after each start. @return another number each time, not 0: by chance after power-on, by a count after
 * resets */
uint32_t system_start_id(void);

/** [NMI] The oscillator has failed: what the next start reports. */
void system_note_lost_clock(void);

/** [NMI, or start on the backup clock] PBCLK2 becomes CLOCK_BACKUP_HZ. Nothing runs as planned any more. */
void system_use_backup_clock(void);

/** Exceptions, from startup.S. @param epc  address of the instruction. caller  $ra there. cause  CP0 Cause */
__attribute__((noreturn)) void fault(uint32_t epc, uint32_t caller, uint32_t cause);

/** The tick's interrupt, from startup.S. */
void on_tick(void);

#endif
