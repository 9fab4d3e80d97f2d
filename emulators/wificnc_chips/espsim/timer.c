/* SPDX-License-Identifier: MIT
 * Timer groups: two timers of 64 bits each, counting the APB clock divided by 2 to 65536, up, with an alarm
 * that may reload them; the ESP32's third one, LACT; the calibration of the slow clock. The counter's divider
 * restarts when the timer is enabled. */
#include "esp.h"

#include <string.h>

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
    CALIBRATION = 0x68,
    CALIBRATION_END = 0x70,
    LACT = 0x70,
    LACT_RTC = 0x74,
    LACT_END = 0x98,
    REST = 0x80, /* of the S3 */
    DATE = 0xF8,
};
enum { TIMERS_ALL = 6, LACT_NUMBER = 2, WATCHDOG_BIT = 2, LACT_BIT = 3 };
enum { CALIBRATION_READY = 1 << 15, XTAL_HZ = 40000000 };
#define CALIBRATION_START (1u << 31)

enum {
    CONFIG_XTAL = 1 << 9 /* S3 */,
    CONFIG_ALARM = 1 << 10,
    CONFIG_LEVEL = 1 << 11,
    CONFIG_RELOAD = 1 << 29,
    CONFIG_UP = 1 << 30
};
#define CONFIG_RUN (1u << 31)

static const unsigned source_of_group[2][2] = {{14, 18},
                                               {50, 53}}; /* of timer 0; the other chip's are the S3's */

static struct timer *timer_of(const struct esp *esp, unsigned number) {
    return (struct timer *)&esp->group[number / 3].timer[number % 3];
}

static uint32_t period(const struct esp *esp, const struct timer *timer) {
    const uint32_t divider = timer->config >> 13 & 0xFFFF;
    const bool by_xtal = esp->chip == ES_ESP32S3 && (timer->config & CONFIG_XTAL) != 0;
    return (ES_CPU_HZ / (by_xtal ? (uint32_t)XTAL_HZ : (uint32_t)ES_APB_HZ)) * (divider == 0   ? 65536
                                                                                : divider == 1 ? 2
                                                                                               : divider);
}

static uint64_t count_of(const struct esp *esp, const struct timer *timer) {
    if ((timer->config & CONFIG_RUN) == 0)
        return timer->from;
    return timer->from + (esp->cycles - timer->since) / period(esp, timer);
}

static void schedule(struct esp *esp, struct timer *timer) {
    const uint64_t alarm = (uint64_t)timer->alarm_high << 32 | timer->alarm_low;
    timer->alarm_at = NEVER;
    if ((timer->config & (CONFIG_RUN | CONFIG_ALARM)) == (CONFIG_RUN | CONFIG_ALARM)) {
        const uint64_t at =
            timer->since + (alarm > timer->from ? alarm - timer->from : 0) * period(esp, timer);
        timer->alarm_at = at > esp->cycles ? at : esp->cycles;
    }
    chip_look(esp);
}

static void set_lines(struct esp *esp, unsigned number) {
    const struct timer_group *group = &esp->group[number];
    for (unsigned i = 0; i < (esp->chip == ES_ESP32 ? 4u : 3u); i++)
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

/* LACT has one register more, behind its first. */
static uint32_t lact_offset(uint32_t offset) {
    return offset == LACT ? CONFIG : offset - LACT_RTC;
}

/* The slow clock against the crystal: done immediately. Periods of which clock, bits 13 and 14: the RTC's, 8
 * MHz / 256, 32 kHz. */
static void calibrate(struct timer_group *group, uint32_t value) {
    static const uint32_t hz[4] = {150000, 33203, 32768, 150000};
    const uint64_t periods = value >> 16 & 0x7FFF;
    group->calibration[0] = value & ~(uint32_t)CALIBRATION_READY;
    if ((value & CALIBRATION_START) == 0)
        return;
    group->calibration[0] |= CALIBRATION_READY;
    group->calibration[1] = (uint32_t)(periods * XTAL_HZ / hz[value >> 13 & 3]) << 7 | 1;
}

static bool has_lact(const struct esp *esp, uint32_t offset) {
    return esp->chip == ES_ESP32 && offset >= LACT && offset < LACT_END;
}

static void store(struct esp *esp, unsigned number, uint32_t offset, uint32_t value) {
    struct timer_group *group = &esp->group[number];
    if (offset < WATCHDOG)
        timer_store(esp, &group->timer[offset / TIMER_SIZE], offset % TIMER_SIZE, value);
    else if (offset < CALIBRATION)
        watchdog_store(esp, number, (offset - WATCHDOG) / 4, value);
    else if (offset == CALIBRATION)
        calibrate(group, value);
    else if (has_lact(esp, offset) && offset != LACT_RTC)
        timer_store(esp, &group->timer[LACT_NUMBER], lact_offset(offset), value);
    else if (offset == interrupts_at(esp))
        group->enabled = value & 15;
    else if (offset == interrupts_at(esp) + 12)
        group->raw &= ~value;
    else if (!has_lact(esp, offset) && offset < DATE && offset != REST)
        chip_fault(esp, "the register %02x of timer group %u is not emulated", offset, number);
    set_lines(esp, number);
}

static uint32_t load(struct esp *esp, unsigned number, uint32_t offset) {
    const struct timer_group *group = &esp->group[number];
    if (offset < WATCHDOG)
        return timer_load(&group->timer[offset / TIMER_SIZE], offset % TIMER_SIZE);
    if (offset < CALIBRATION)
        return watchdog_load(esp, number, (offset - WATCHDOG) / 4);
    if (offset < CALIBRATION_END)
        return group->calibration[(offset - CALIBRATION) / 4];
    if (has_lact(esp, offset))
        return offset == LACT_RTC ? 0 : timer_load(&group->timer[LACT_NUMBER], lact_offset(offset));
    const uint32_t words[4] = {group->enabled, group->raw, group->raw & group->enabled, 0};
    if (offset - interrupts_at(esp) < sizeof words)
        return words[(offset - interrupts_at(esp)) / 4];
    if (offset < DATE && offset != REST)
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
    bus_add(esp, &(struct block){"timer group 0", base, 0x100, load0, store0, NULL});
    bus_add(esp, &(struct block){"timer group 1", base + 0x1000, 0x100, load1, store1, NULL});
    memset(esp->group, 0, sizeof esp->group);
    for (unsigned i = 0; i < TIMERS_ALL; i++)
        *timer_of(esp, i) = (struct timer){.config = CONFIG_UP | CONFIG_RELOAD | 1u << 13, .alarm_at = NEVER};
}

uint64_t timers_next(const struct esp *esp) {
    uint64_t next = NEVER;
    for (unsigned i = 0; i < TIMERS_ALL; i++) {
        const uint64_t at = timer_of(esp, i)->alarm_at;
        next = at < next ? at : next;
    }
    return next;
}

void timers_watchdog(struct esp *esp, unsigned group) {
    esp->group[group].raw |= 1u << WATCHDOG_BIT;
    set_lines(esp, group);
}

/* The alarm is used up. The ESP32 asks for LEVEL_INT; the S3 has no such bit. */
static void alarm(struct esp *esp, unsigned number, unsigned group) {
    struct timer *timer = timer_of(esp, number);
    const unsigned bit = number % 3 == LACT_NUMBER ? LACT_BIT : number % 3;
    if ((timer->config & CONFIG_RELOAD) != 0) {
        timer->from = (uint64_t)timer->load_high << 32 | timer->load_low;
        timer->since = timer->alarm_at;
    }
    timer->alarm_at = NEVER;
    timer->config &= ~(uint32_t)CONFIG_ALARM;
    if (esp->chip == ES_ESP32S3 || (timer->config & CONFIG_LEVEL) != 0)
        esp->group[group].raw |= 1u << bit;
    set_lines(esp, group);
}

void timers_event(struct esp *esp) {
    for (unsigned i = 0; i < TIMERS_ALL; i++)
        if (timer_of(esp, i)->alarm_at <= esp->cycles)
            alarm(esp, i, i / 3);
}
