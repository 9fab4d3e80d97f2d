/* SPDX-License-Identifier: MIT
 * Both cores: what starts the second, the time that they share, and flash that one of them writes while the
 * other one stops, as ESP-IDF does it. In IRAM. */
#include "bare.h"

#include "esp_attr.h"
#include "sdkconfig.h"

enum { STACK_WORDS = 4096, STACK_BASE = 16, TIMER0 = 6, APB_DIVIDER = 80 };
enum { FLASH_PLACE = 0x3F0000, PAGE_WORDS = 16 };

#if CONFIG_IDF_TARGET_ESP32
#define CONTROL                                                                                              \
    ((volatile uint32_t *)0x3FF0002C)               /* APPCPU_CTRL_A to D: reset, clock, stall, boot address \
                                                     */
#define TIMER     ((volatile uint32_t *)0x3FF60000) /* timer 0 of group 1 */
#define SPI1      ((volatile uint32_t *)0x3FF42000)
#define CACHE     ((volatile uint32_t *)0x3FF00040)
#define CACHE_ON  (1u << 3)
#define SPI_STATE 4
#define SPI_DATA  32
#else
#define CONTROL ((volatile uint32_t *)0x600C0000) /* CORE_1_CONTROL_0 and 1 */
#define TIMER   ((volatile uint32_t *)0x60020000)
#endif

static uint32_t stack[STACK_WORDS] __attribute__((aligned(16)));
static void (*core1_runs)(void);
static uint32_t vectors;
static volatile uint32_t wants_flash, stands;

/* Its own stack, the processor's window of which is saved below; floats; the timer that ends a wait. */
static void IRAM_ATTR core1_begins(void) {
    uint32_t *top = &stack[STACK_WORDS - STACK_BASE];
    top[-3] = (uint32_t)&stack[STACK_WORDS];
    __asm__ volatile("wsr %0, vecbase\n\twsr %1, cpenable\n\twsr %2, intenable\n\trsync" ::"r"(vectors),
                     "r"(1), "r"(1u << TIMER0));
    __asm__ volatile("rsil a2, 0" ::: "a2");
    __asm__ volatile("mov a1, %0\n\tcallx8 %1" ::"r"(top), "r"(core1_runs) : "a8", "a9", "a10", "a11");
}

void IRAM_ATTR bare_start_core1(void (*run)(void)) {
    core1_runs = run;
    TIMER[0] = 1u << 31 | 1u << 30 | APB_DIVIDER << 13;
    __asm__ volatile("rsr %0, vecbase" : "=r"(vectors));
    __asm__ volatile("wsr %0, intenable\n\trsync" ::"r"(1u << TIMER0));
#if CONFIG_IDF_TARGET_ESP32
    CONTROL[3] = (uint32_t)core1_begins;
    CONTROL[1] = 1;
    CONTROL[0] = 1;
    CONTROL[0] = 0;
#else
    CONTROL[1] = (uint32_t)core1_begins;
    CONTROL[0] = 2 | 4;
    CONTROL[0] = 2;
#endif
}

uint32_t IRAM_ATTR bare_timer_us(void) {
    TIMER[3] = 1;
    return TIMER[1];
}

void IRAM_ATTR bare_stall(void) {
    if (wants_flash == 0)
        return;
    stands = 1;
    while (wants_flash != 0) {
    }
    stands = 0;
}

#if CONFIG_IDF_TARGET_ESP32
enum { WREN = 1 << 30, RDSR = 1 << 27, PP = 1 << 25, SE = 1 << 24, BUSY = 1 };

static void IRAM_ATTR command(uint32_t bit) {
    SPI1[0] = bit;
    while (SPI1[0] != 0) {
    }
}

static void IRAM_ATTR wait_for_flash(void) {
    do
        command(RDSR);
    while ((SPI1[SPI_STATE] & BUSY) != 0);
}

static void IRAM_ATTR write_page(void) {
    for (unsigned word = 0; word < PAGE_WORDS; word++)
        SPI1[SPI_DATA + word] = word;
    SPI1[1] = FLASH_PLACE | PAGE_WORDS * 4u << 24;
    command(PP);
}

void IRAM_ATTR bare_write_flash(bool erases) {
    wants_flash = 1;
    while (stands == 0) {
    }
    *CACHE &= ~CACHE_ON;
    command(WREN);
    SPI1[1] = FLASH_PLACE;
    if (erases)
        command(SE);
    else
        write_page();
    wait_for_flash();
    *CACHE |= CACHE_ON;
    wants_flash = 0;
    while (stands != 0) {
    }
}
#else
void bare_write_flash(bool erases) {
    (void)erases;
}
#endif
