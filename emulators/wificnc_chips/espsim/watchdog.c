/* SPDX-License-Identifier: MIT
 * Watchdogs: those of the timer groups and the RTC's. Four stages with an action each; a feed begins with the
 * first one again. Their registers change after the key alone. */
#include "esp.h"

#include <string.h>

#define KEY    0x50D83AA1u
#define ENABLE (1u << 31)

enum { STAGES = 4, SLOW_HZ = 150000 };
enum action { ACTION_NONE, ACTION_INTERRUPT, ACTION_RESET_CPU, ACTION_RESET_SYSTEM, ACTION_RESET_RTC };

static bool is_rtc(const struct esp *esp, const struct watchdog *dog) {
    return dog == &esp->watchdog[WATCHDOG_RTC];
}

static uint64_t cycles_of_stage(const struct esp *esp, const struct watchdog *dog) {
    const uint64_t prescale = dog->config[1] >> 16,
                   hold = dog->config[(is_rtc(esp, dog) ? 1 : 2) + dog->stage];
    if (is_rtc(esp, dog)) /* the S3 doubles the first stage: WDT_DELAY_SEL of its eFuse */
        return (hold << (esp->chip == ES_ESP32S3 && dog->stage == 0)) * (ES_CPU_HZ / SLOW_HZ);
    return hold * (prescale == 0 ? 1 : prescale) * (ES_CPU_HZ / ES_APB_HZ);
}

static enum action action_of(const struct esp *esp, const struct watchdog *dog) {
    if (is_rtc(esp, dog))
        return dog->config[0] >> (28 - 3 * dog->stage) & 7;
    return dog->config[0] >> (29 - 2 * dog->stage) & 3;
}

static void schedule(struct esp *esp, struct watchdog *dog) {
    dog->due = (dog->config[0] & ENABLE) != 0 ? dog->since + cycles_of_stage(esp, dog) : NEVER;
    chip_look(esp);
}

static void feed(struct esp *esp, struct watchdog *dog) {
    dog->stage = 0;
    dog->since = esp->cycles;
    schedule(esp, dog);
}

void watchdog_store(struct esp *esp, unsigned number, unsigned word, uint32_t value) {
    struct watchdog *dog = &esp->watchdog[number];
    const unsigned configs = is_rtc(esp, dog) ? 5 : 6;
    if (word == configs + 1) {
        dog->key = value;
        return;
    }
    if (dog->key != KEY)
        return;
    if (word == configs) {
        feed(esp, dog);
        return;
    }
    const bool begins = word == 0 && (value & ENABLE) != 0 && (dog->config[0] & ENABLE) == 0;
    dog->config[word] = value;
    if (begins)
        feed(esp, dog);
    else
        schedule(esp, dog);
}

uint32_t watchdog_load(const struct esp *esp, unsigned number, unsigned word) {
    const struct watchdog *dog = &esp->watchdog[number];
    const unsigned configs = is_rtc(esp, dog) ? 5 : 6;
    return word < configs ? dog->config[word] : word == configs + 1 ? dog->key : 0;
}

void watchdogs_create(struct esp *esp) {
    memset(esp->watchdog, 0, sizeof esp->watchdog);
    for (unsigned i = 0; i < WATCHDOGS; i++)
        esp->watchdog[i] = (struct watchdog){.key = KEY, .due = NEVER};
}

uint64_t watchdogs_next(const struct esp *esp) {
    uint64_t next = NEVER;
    for (unsigned i = 0; i < WATCHDOGS; i++)
        next = esp->watchdog[i].due < next ? esp->watchdog[i].due : next;
    return next;
}

/* Causes of a reset, as the boot ROM numbers them. */
static const unsigned causes[WATCHDOGS][5] = {{0, 0, 11, 7, 7}, {0, 0, 11, 8, 8}, {0, 0, 13, 9, 16}};
static const char *const names[WATCHDOGS] = {"watchdog of timer group 0", "watchdog of timer group 1",
                                             "RTC watchdog"};

static unsigned cause_of(const struct esp *esp, unsigned number, enum action action) {
    const bool is_group_1_of_s3 = number == 1 && action == ACTION_RESET_CPU && esp->chip == ES_ESP32S3;
    return is_group_1_of_s3 ? CAUSE_CPU_BY_GROUP_1 : causes[number][action];
}

static void bite(struct esp *esp, unsigned number) {
    struct watchdog *dog = &esp->watchdog[number];
    const enum action action = action_of(esp, dog);
    dog->since = dog->due;
    dog->stage = (dog->stage + 1) % STAGES;
    schedule(esp, dog);
    if (action == ACTION_INTERRUPT && number != WATCHDOG_RTC)
        timers_watchdog(esp, number);
    else if (action >= ACTION_RESET_CPU)
        chip_reset(esp, cause_of(esp, number, action), names[number]);
}

void watchdogs_event(struct esp *esp) {
    for (unsigned i = 0; i < WATCHDOGS; i++)
        if (esp->watchdog[i].due <= esp->cycles)
            bite(esp, i);
}
