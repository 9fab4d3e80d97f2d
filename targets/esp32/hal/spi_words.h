/* SPDX-License-Identifier: MIT
 * Words for shift registers, each a transfer of GP-SPI2. After hal_step.h's structure. */
#ifndef WIFICNC_ESP32_SPI_WORDS_H
#define WIFICNC_ESP32_SPI_WORDS_H

#include "hal/spi_registers.h"

#include <stddef.h>

/* UPDATE takes a few clocks of the SPI; a clock that rests must not hold an interrupt up. */
enum { STEP_SPI_UPDATE_CYCLES = 240 };

#ifdef __XTENSA__
/* An address that a compiler does not compute again for each register; stores without the memw that it puts
 * before each volatile one: the bus keeps the order of these. */
#define STEP_SPI_TAKE(port)                                                                                  \
    volatile struct spi_registers *port = STEP_SPI;                                                          \
    __asm__("" : "+r"(port))
#define STEP_SPI_LOAD(port, name) ((port)->name)
#define STEP_SPI_STORE(port, name, value)                                                                    \
    __asm__ volatile("s32i %0, %1, %2" ::"r"(value), "r"(port), "i"(offsetof(struct spi_registers, name))    \
                     : "memory")
#else
#define STEP_SPI_TAKE(port)               (void)0
#define STEP_SPI_LOAD(port, name)         (STEP_SPI->name)
#define STEP_SPI_STORE(port, name, value) (STEP_SPI->name = (value))
#endif

/* Whoever calls this has waited for as long as any word takes. One that is not done even so has stopped, and
 * this one would be lost with it: a fault, which step_shift_has_lost() finds.
 * @return when it began, in cycles: its way to the pins is as long as that of any other word */
static HAL_INLINE uint32_t step_spi_put(uint32_t word) {
    STEP_SPI_TAKE(port);
    if (STEP_SPI_LOAD(port, cmd) != 0) {
        STEP_SPI_STORE(port, int_set, STEP_SPI_LATE);
        return esp_cpu_get_cycle_count();
    }
    STEP_SPI_STORE(port, w[0], word);
    STEP_SPI_STORE(port, cmd, STEP_SPI_UPDATE);
    const uint32_t given = esp_cpu_get_cycle_count();
    while (STEP_SPI_LOAD(port, cmd) != 0 && esp_cpu_get_cycle_count() - given < STEP_SPI_UPDATE_CYCLES) {
    }
    const uint32_t begin = esp_cpu_get_cycle_count();
    STEP_SPI_STORE(port, cmd, STEP_SPI_START);
    return begin;
}

#endif
