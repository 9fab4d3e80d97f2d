/* SPDX-License-Identifier: MIT
 * Timer groups: two timers of 64 bits each, counting the APB clock divided by 2 to 65536, up, with an alarm.
 * The counter's divider restarts when the timer is enabled. The watchdogs are registers only: they never
 * bite. */
#include "esp.h"

enum {
    CONFIG = 0x00,
    LOW = 0x04,
    HIGH = 0x08,
    UPDATE = 0x0C,
    ALARM_LOW = 0x10,
    ALARM_HIGH = 0x14,
    LOAD_LOW = 0x18,
    LOAD_HIGH = 0x1C,
    LOAD = 0x20,
    TIMER_SIZE = 0x24,
    WATCHDOG = 0x48,
    WATCHDOG_END = 0x68,
};

enum { CONFIG_ALARM = 1 << 10, CONFIG_LEVEL = 1 << 11, CONFIG_RELOAD = 1 << 29, CONFIG_UP = 1 << 30 };
#define CONFIG_RUN (1u << 31)

static const unsigned source_of_group[2][2] = {{14, 18},
                                               {50, 53}}; /* of timer 0; the other chip's are the S3's */

static uint32_t period(const struct timer *timer) {
    const uint32_t divider = timer->config >> 13 & 0xFFFF;
    return (ES_CPU_HZ / ES_APB_HZ) * (divider == 0 ? 65536 : divider == 1 ? 2 : divider);
}

static uint64_t count_of(const struct esp *esp, const struct timer *timer) {
    if ((timer->config & CONFIG_RUN) == 0)
        return timer->from;
    return timer->from + (esp->cycles - timer->since) / period(timer);
}

static void schedule(struct esp *esp, struct timer *timer) {
    const uint64_t alarm = (uint64_t)timer->alarm_high << 32 | timer->alarm_low;
    timer->alarm_at = NEVER;
    if ((timer->config & (CONFIG_RUN | CONFIG_ALARM)) == (CONFIG_RUN | CONFIG_ALARM)) {
        const uint64_t at = timer->since + (alarm > timer->from ? alarm - timer->from : 0) * period(timer);
        timer->alarm_at = at > esp->cycles ? at : esp->cycles;
    }
    chip_look(esp);
}

static void set_lines(struct esp *esp, unsigned number) {
    const struct timer_group *group = &esp->group[number];
    for (unsigned i = 0; i < 2; i++)
        matrix_set(esp, source_of_group[esp->chip][number] + i, (group->raw & group->enabled & 1u << i) != 0);
}

/* ---- registers ---- */

static void configure(struct esp *esp, struct timer *timer, uint32_t value) {
    const bool ran = (timer->config & CONFIG_RUN) != 0, runs = (value & CONFIG_RUN) != 0;
    if (ran && (!runs || (value ^ timer->config) >> 13 & 0xFFFF)) {
        timer->from = count_of(esp, timer);
        timer->since = esp->cycles;
    }
    if (!ran && runs)
        timer->since = esp->cycles;
    timer->config = value;
    if (runs && (value & CONFIG_UP) == 0)
        chip_fault(esp, "a timer that counts down is not emulated");
    if (runs && (value & CONFIG_RELOAD) != 0 && (value & CONFIG_ALARM) != 0)
        chip_fault(esp, "a timer that reloads itself is not emulated");
    schedule(esp, timer);
}

static void timer_store(struct esp *esp, struct timer *timer, uint32_t offset, uint32_t value) {
    switch (offset) {
    case CONFIG:
        configure(esp, timer, value);
        break;
    case UPDATE:
        timer->latched_low = (uint32_t)count_of(esp, timer);
        timer->latched_high = (uint32_t)(count_of(esp, timer) >> 32);
        break;
    case ALARM_LOW:
        timer->alarm_low = value;
        schedule(esp, timer);
        break;
    case ALARM_HIGH:
        timer->alarm_high = value;
        schedule(esp, timer);
        break;
    case LOAD_LOW:
        timer->load_low = value;
        break;
    case LOAD_HIGH:
        timer->load_high = value;
        break;
    case LOAD:
        timer->from = (uint64_t)timer->load_high << 32 | timer->load_low;
        timer->since = esp->cycles;
        schedule(esp, timer);
        break;
    default:
        break; /* LOW, HIGH: read only */
    }
}

static uint32_t timer_load(const struct timer *timer, uint32_t offset) {
    const uint32_t words[] = {timer->config,     timer->latched_low, timer->latched_high, 0, timer->alarm_low,
                              timer->alarm_high, timer->load_low,    timer->load_high,    0};
    return words[offset / 4];
}

static uint32_t interrupts_at(const struct esp *esp) {
    return esp->chip == ES_ESP32 ? 0x98 : 0x70;
}

static void store(struct esp *esp, unsigned number, uint32_t offset, uint32_t value) {
    struct timer_group *group = &esp->group[number];
    if (offset < WATCHDOG)
        timer_store(esp, &group->timer[offset / TIMER_SIZE], offset % TIMER_SIZE, value);
    else if (offset < WATCHDOG_END)
        group->watchdog[(offset - WATCHDOG) / 4] = value;
    else if (offset == interrupts_at(esp))
        group->enabled = value & 7;
    else if (offset == interrupts_at(esp) + 12)
        group->raw &= ~value;
    else
        chip_fault(esp, "the register %02x of timer group %u is not emulated", offset, number);
    set_lines(esp, number);
}

static uint32_t load(struct esp *esp, unsigned number, uint32_t offset) {
    const struct timer_group *group = &esp->group[number];
    if (offset < WATCHDOG)
        return timer_load(&group->timer[offset / TIMER_SIZE], offset % TIMER_SIZE);
    if (offset < WATCHDOG_END)
        return group->watchdog[(offset - WATCHDOG) / 4];
    const uint32_t words[4] = {group->enabled, group->raw, group->raw & group->enabled, 0};
    if (offset - interrupts_at(esp) < sizeof words)
        return words[(offset - interrupts_at(esp)) / 4];
    chip_fault(esp, "the register %02x of timer group %u is not emulated", offset, number);
    return 0;
}

static void store0(struct esp *esp, uint32_t offset, uint32_t value) {
    store(esp, 0, offset, value);
}

static void store1(struct esp *esp, uint32_t offset, uint32_t value) {
    store(esp, 1, offset, value);
}

static uint32_t load0(struct esp *esp, uint32_t offset) {
    return load(esp, 0, offset);
}

static uint32_t load1(struct esp *esp, uint32_t offset) {
    return load(esp, 1, offset);
}

void timers_create(struct esp *esp) {
    const uint32_t base = esp->chip == ES_ESP32 ? 0x3FF5F000 : 0x6001F000;
    bus_add(esp, &(struct block){"timer group 0", base, 0x100, load0, store0});
    bus_add(esp, &(struct block){"timer group 1", base + 0x1000, 0x100, load1, store1});
    for (unsigned number = 0; number < 2; number++)
        for (unsigned i = 0; i < 2; i++)
            esp->group[number].timer[i] =
                (struct timer){.config = CONFIG_UP | CONFIG_RELOAD | 1u << 13, .alarm_at = NEVER};
}

uint64_t timers_next(const struct esp *esp) {
    uint64_t next = NEVER;
    for (unsigned i = 0; i < 4; i++) {
        const uint64_t at = esp->group[i / 2].timer[i % 2].alarm_at;
        next = at < next ? at : next;
    }
    return next;
}

/* The alarm is used up. The ESP32 asks for LEVEL_INT; the S3 has no such bit. */
void timers_event(struct esp *esp) {
    for (unsigned i = 0; i < 4; i++) {
        struct timer *timer = &esp->group[i / 2].timer[i % 2];
        if (timer->alarm_at > esp->cycles)
            continue;
        timer->alarm_at = NEVER;
        timer->config &= ~(uint32_t)CONFIG_ALARM;
        if (esp->chip == ES_ESP32S3 || (timer->config & CONFIG_LEVEL) != 0)
            esp->group[i / 2].raw |= 1u << i % 2;
        set_lines(esp, i / 2);
    }
}
