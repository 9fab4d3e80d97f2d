/* SPDX-License-Identifier: MIT
 * A program for both cores: they count together, interrupt each other, and read each other's numbers. The
 * test looks at the words. */
#include "sdkconfig.h"

#include <stdint.h>

enum { COUNTS = 3000, LEVEL5 = 26, FROM_CPU = 1 };

#if CONFIG_IDF_TARGET_ESP32
#define CONTROL                                                                                              \
    ((volatile uint32_t *)0x3FF0002C) /* APPCPU_CTRL_A to D: reset, clock, stall, boot address               \
                                       */
#define ASK          ((volatile uint32_t *)0x3FF000DC) /* CPU_INTR_FROM_CPU_0 */
#define APP_MATRIX   ((volatile uint32_t *)0x3FF00218)
#define FIRST_SOURCE 24
#else
#define CONTROL      ((volatile uint32_t *)0x600C0000) /* CORE_1_CONTROL_0 and 1 */
#define ASK          ((volatile uint32_t *)0x600C0030)
#define APP_MATRIX   ((volatile uint32_t *)0x600C2800)
#define FIRST_SOURCE 79
#endif

volatile uint32_t counter, plain, ids[2], vectors, interrupts, woken, done, rounds[2];

static uint32_t ccount(void) {
    uint32_t value;
    __asm__ volatile("rsr %0, ccount" : "=r"(value));
    return value;
}

static uint32_t id(void) {
    uint32_t value;
    __asm__ volatile("rsr %0, prid" : "=r"(value));
    return value;
}

/* The second number is what an addition without an atomic instruction comes to. */
static void count(unsigned core) {
    for (unsigned i = 0; i < COUNTS; i++) {
        (void)__atomic_fetch_add(&counter, 1, __ATOMIC_SEQ_CST);
        plain = plain + 1;
        rounds[core]++;
    }
}

/* Level 5 is what the test has put at the vector. */
static void app(void) {
    ids[1] = id();
    __asm__ volatile("wsr %0, vecbase" ::"r"(vectors));
    APP_MATRIX[FIRST_SOURCE + FROM_CPU] = LEVEL5;
    __asm__ volatile("wsr %0, intenable\n\trsync\n\trsil a2, 0" ::"r"(1u << LEVEL5) : "a2");
    count(1);
    __asm__ volatile("waiti 0");
    woken = interrupts;
    __asm__ volatile("waiti 0");
}

static void start_app(void) {
#if CONFIG_IDF_TARGET_ESP32
    CONTROL[3] = (uint32_t)app;
    CONTROL[1] = 1;
    CONTROL[0] = 1;
    CONTROL[0] = 0;
#else
    CONTROL[1] = (uint32_t)app;
    CONTROL[0] = 2 | 4;
    CONTROL[0] = 2;
#endif
}

int main(void) {
    ids[0] = id();
    start_app();
    count(0);
    while (rounds[1] != COUNTS)
        ;
    for (uint32_t from = ccount(); ccount() - from < 24000;)
        ; /* it sleeps by now */
    ASK[FROM_CPU] = 1;
    while (woken == 0)
        ;
    done = 1;
    for (;;)
        ;
}
