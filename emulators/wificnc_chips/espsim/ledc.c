/* SPDX-License-Identifier: MIT
 * LEDC: the ESP32's timers of high and low speed, the S3's of low speed (technical reference manuals, chapter
 * LED PWM Controller). A timer counts 2^resolution counts of divider / clock; a channel is high for `duty`
 * counts from HPOINT on, and as many sixteenths of all periods one count longer. A new divider and a new duty
 * count from the next period on, of low speed after PARA_UP. Fades and the S3's overflow counters are not
 * emulated. */
#include "esp.h"

#include <string.h>

enum { CHANNEL_SIZE = 0x14, CONF0 = 0x00, HPOINT = 0x04, DUTY = 0x08, CONF1 = 0x0C, DUTY_NOW = 0x10 };
enum { OUT_ENABLED = 1 << 2, IDLE_LEVEL = 1 << 3, PARA_UP = 1 << 4, OVERFLOW_COUNTER = 1 << 15 };
#define DUTY_START (1u << 31)
enum {
    DUTY_SCALE = 0x3FF,
    DUTY_FRACTION = 4,
    RAW = 0x0,
    STATUS = 0x4,
    ENABLED = 0x8,
    CLEAR = 0xC,
    CONF = 0x10
};
enum { SPEEDS_CHANNELS = 8, SPEEDS_TIMERS = 4 };
enum { CYCLES_APB = 3, CYCLES_XTAL = 6, CYCLES_RTC8M = 30, CYCLES_REF_TICK = 240, DIVIDER_MIN = 256 };

static bool is_s3(const struct esp *esp) {
    return esp->chip == ES_ESP32S3;
}

static unsigned channels_of(const struct esp *esp) {
    return is_s3(esp) ? SPEEDS_CHANNELS : LEDC_CHANNELS;
}

static unsigned timers_of(const struct esp *esp) {
    return is_s3(esp) ? SPEEDS_TIMERS : LEDC_TIMERS;
}

static bool is_slow(const struct esp *esp, unsigned number, unsigned of_speed) {
    return is_s3(esp) || number >= of_speed;
}

static unsigned timer_of(const struct esp *esp, unsigned channel) {
    return (esp->ledc.channel[channel].conf0 & 3) + channel / SPEEDS_CHANNELS * SPEEDS_TIMERS;
}

static uint64_t now_of(const struct esp *esp) {
    return esp->cycles << 8;
}

static uint64_t cycle_of(uint64_t at) {
    return (at + 255) >> 8;
}

/* ---- a timer's configuration: the S3's has its fields one bit lower ---- */

static uint32_t field(const struct esp *esp, uint32_t conf, unsigned esp32_bit) {
    return conf >> (esp32_bit - (is_s3(esp) ? 1 : 0));
}

static uint32_t divider_of(const struct esp *esp, uint32_t conf) {
    return field(esp, conf, 5) & 0x3FFFF;
}

static bool rests(const struct esp *esp, uint32_t conf) {
    return (field(esp, conf, 23) & 3) != 0; /* pause, reset */
}

/* Cycles of the timer's clock. */
static uint32_t clock_of(const struct esp *esp, unsigned number, uint32_t conf) {
    const uint32_t selected = esp->ledc.conf & 3;
    if (is_s3(esp))
        return selected == 1 ? CYCLES_APB : selected == 2 ? CYCLES_RTC8M : CYCLES_XTAL;
    if ((field(esp, conf, 25) & 1) == 0)
        return CYCLES_REF_TICK;
    return number < SPEEDS_TIMERS || (selected & 1) != 0 ? CYCLES_APB : CYCLES_RTC8M;
}

static void take_divider(struct esp *esp, unsigned number) {
    struct ledc_timer *timer = &esp->ledc.timer[number];
    timer->tick = (uint64_t)divider_of(esp, timer->taken) * clock_of(esp, number, timer->taken);
    timer->bits = timer->taken & (is_s3(esp) ? 15 : 31);
}

/* ---- channels ---- */

static bool is_out(const struct ledc_channel *channel) {
    return (channel->conf0 & OUT_ENABLED) != 0;
}

static void show(struct esp *esp, uint64_t at, unsigned number) {
    const struct ledc_channel *channel = &esp->ledc.channel[number];
    const unsigned first = is_s3(esp) ? 73 : 71;
    gpio_signal(esp, cycle_of(at), first + number,
                is_out(channel) ? channel->level : (channel->conf0 & IDLE_LEVEL) != 0);
}

/* Sixteenths add up to a count. */
static void begin_period(struct esp *esp, unsigned number) {
    struct ledc *ledc = &esp->ledc;
    struct ledc_channel *channel = &ledc->channel[number];
    if (channel->changes) {
        channel->changes = false;
        channel->rises = channel->hpoint;
        channel->shown_duty = channel->duty;
        channel->conf1 &= ~DUTY_START;
        ledc->raw |= 1u << (timers_of(esp) + number);
    }
    channel->carry += channel->shown_duty & 15;
    channel->falls = channel->rises + (channel->shown_duty >> DUTY_FRACTION) + channel->carry / 16;
    channel->carry %= 16;
}

/* ---- timers ---- */

static bool is_used(const struct esp *esp, unsigned number) {
    bool used = (esp->ledc.enabled >> number & 1) != 0;
    for (unsigned i = 0; i < channels_of(esp); i++)
        used |= is_out(&esp->ledc.channel[i]) && timer_of(esp, i) == number;
    return used;
}

static uint32_t counts_of(const struct ledc_timer *timer) {
    return 1u << timer->bits;
}

static uint32_t next_count(const struct esp *esp, unsigned number) {
    const struct ledc_timer *timer = &esp->ledc.timer[number];
    uint32_t next = counts_of(timer);
    for (unsigned i = 0; i < channels_of(esp); i++) {
        const struct ledc_channel *channel = &esp->ledc.channel[i];
        if (timer_of(esp, i) != number)
            continue;
        if (channel->rises > timer->count && channel->rises < next)
            next = channel->rises;
        if (channel->falls > timer->count && channel->falls < next)
            next = channel->falls;
    }
    return next;
}

static void reach(struct esp *esp, unsigned number, uint64_t at) {
    const struct ledc_timer *timer = &esp->ledc.timer[number];
    for (unsigned i = 0; i < channels_of(esp); i++) {
        struct ledc_channel *channel = &esp->ledc.channel[i];
        if (timer_of(esp, i) != number)
            continue;
        if (timer->count == 0)
            begin_period(esp, i);
        if (timer->count == channel->rises)
            channel->level = true;
        if (timer->count == channel->falls)
            channel->level = false;
        show(esp, at, i);
    }
}

static void begin_timer(struct esp *esp, unsigned number, uint64_t at) {
    struct ledc_timer *timer = &esp->ledc.timer[number];
    timer->began = at;
    timer->count = 0;
    take_divider(esp, number);
    reach(esp, number, at);
}

static uint64_t next_of(const struct esp *esp, unsigned number) {
    const struct ledc_timer *timer = &esp->ledc.timer[number];
    return timer->runs ? timer->began + next_count(esp, number) * timer->tick : NEVER;
}

/* Nothing is seen of it: whole periods in one step. */
static void skip(struct esp *esp, unsigned number) {
    struct ledc_timer *timer = &esp->ledc.timer[number];
    const uint64_t period = timer->tick << timer->bits, periods = (now_of(esp) - timer->began) / period;
    if (timer->runs && !is_used(esp, number) && periods > 2) {
        timer->began += (periods - 2) * period;
        esp->ledc.raw |= 1u << number;
    }
}

static void advance(struct esp *esp, unsigned number) {
    struct ledc_timer *timer = &esp->ledc.timer[number];
    if (timer->runs)
        skip(esp, number);
    for (uint64_t at; (at = next_of(esp, number)) <= now_of(esp);) {
        timer->count = next_count(esp, number);
        if (timer->count == counts_of(timer)) {
            esp->ledc.raw |= 1u << number;
            begin_timer(esp, number, at);
        } else
            reach(esp, number, at);
    }
}

static void schedule(struct esp *esp) {
    struct ledc *ledc = &esp->ledc;
    uint64_t next = NEVER;
    for (unsigned i = 0; i < timers_of(esp); i++)
        if (ledc->timer[i].runs && is_used(esp, i))
            next = next_of(esp, i) < next ? next_of(esp, i) : next;
    ledc->due = next == NEVER ? NEVER : cycle_of(next);
    matrix_set(esp, is_s3(esp) ? 35 : 43, (ledc->raw & ledc->enabled) != 0);
}

void ledc_event(struct esp *esp) {
    for (unsigned i = 0; i < timers_of(esp); i++)
        advance(esp, i);
    schedule(esp);
}

/* ---- registers ---- */

static void store_timer(struct esp *esp, unsigned number, uint32_t value) {
    struct ledc_timer *timer = &esp->ledc.timer[number];
    const uint32_t update = is_s3(esp) ? 1u << 25 : 1u << 26;
    timer->conf = value & ~update;
    if (!is_slow(esp, number, SPEEDS_TIMERS) || (value & update) != 0)
        timer->taken = timer->conf;
    const bool runs = !rests(esp, value) && divider_of(esp, timer->taken) >= DIVIDER_MIN;
    if ((field(esp, value, 24) & 1) != 0) /* reset */
        timer->count = 0;
    else if (timer->runs && !runs)
        timer->count = (uint32_t)((now_of(esp) - timer->began) / timer->tick);
    else if (!timer->runs && runs && timer->count == 0)
        begin_timer(esp, number, now_of(esp));
    else if (!timer->runs && runs)
        timer->began = now_of(esp) - timer->count * timer->tick;
    timer->runs = runs;
}

static void update_channel(struct esp *esp, unsigned number) {
    struct ledc_channel *channel = &esp->ledc.channel[number];
    if ((channel->conf1 & DUTY_START) == 0)
        return;
    if ((channel->conf1 & DUTY_SCALE) != 0)
        chip_fault(esp, "a fade of LEDC's channel %u is not emulated", number);
    channel->changes = true;
}

static void store_channel(struct esp *esp, unsigned number, uint32_t offset, uint32_t value) {
    struct ledc_channel *channel = &esp->ledc.channel[number];
    const bool waits = is_slow(esp, number, SPEEDS_CHANNELS);
    if (offset == CONF0) {
        channel->conf0 = value & ~(uint32_t)PARA_UP;
        if (is_s3(esp) && (value & OVERFLOW_COUNTER) != 0)
            chip_fault(esp, "the overflow counter of LEDC's channel %u is not emulated", number);
        if (waits && (value & PARA_UP) != 0)
            update_channel(esp, number);
        show(esp, now_of(esp), number);
    } else if (offset == HPOINT)
        channel->hpoint = value & 0xFFFFF;
    else if (offset == DUTY)
        channel->duty = value & 0x1FFFFFF;
    else if (offset == CONF1) {
        channel->conf1 = value;
        if (!waits)
            update_channel(esp, number);
    }
}

static uint32_t timers_at(const struct esp *esp) {
    return channels_of(esp) * CHANNEL_SIZE;
}

static uint32_t interrupts_at(const struct esp *esp) {
    return timers_at(esp) + 8 * timers_of(esp);
}

static void store(struct esp *esp, uint32_t offset, uint32_t value) {
    struct ledc *ledc = &esp->ledc;
    ledc_event(esp);
    if (offset < timers_at(esp))
        store_channel(esp, offset / CHANNEL_SIZE, offset % CHANNEL_SIZE, value);
    else if (offset < interrupts_at(esp) && offset % 8 == timers_at(esp) % 8)
        store_timer(esp, (offset - timers_at(esp)) / 8, value);
    else if (offset == interrupts_at(esp) + ENABLED)
        ledc->enabled = value;
    else if (offset == interrupts_at(esp) + CLEAR)
        ledc->raw &= ~value;
    else if (offset == interrupts_at(esp) + CONF)
        ledc->conf = value;
    schedule(esp);
}

static uint32_t load_channel(const struct ledc_channel *channel, uint32_t offset) {
    const uint32_t words[] = {channel->conf0, channel->hpoint, channel->duty, channel->conf1,
                              channel->shown_duty};
    return words[offset / 4];
}

static uint32_t load_timer(const struct esp *esp, const struct ledc_timer *timer, uint32_t offset) {
    if (offset == 0)
        return timer->conf;
    return timer->runs ? (uint32_t)((now_of(esp) - timer->began) / timer->tick) : timer->count;
}

static uint32_t load(struct esp *esp, uint32_t offset) {
    const struct ledc *ledc = &esp->ledc;
    ledc_event(esp);
    if (offset < timers_at(esp))
        return load_channel(&ledc->channel[offset / CHANNEL_SIZE], offset % CHANNEL_SIZE);
    if (offset < interrupts_at(esp))
        return load_timer(esp, &ledc->timer[(offset - timers_at(esp)) / 8], (offset - timers_at(esp)) % 8);
    const uint32_t words[] = {ledc->raw, ledc->raw & ledc->enabled, ledc->enabled, 0, ledc->conf};
    return offset - interrupts_at(esp) < sizeof words ? words[(offset - interrupts_at(esp)) / 4] : 0;
}

void ledc_create(struct esp *esp) {
    if (!chip_keeps_outputs(esp))
        esp->ledc = (struct ledc){.due = NEVER};
    bus_add(esp, &(struct block){"LEDC", is_s3(esp) ? 0x60019000 : 0x3FF59000, 0x200, load, store, NULL});
    gpio_has_signals(esp, is_s3(esp) ? 73 : 71, channels_of(esp));
}
