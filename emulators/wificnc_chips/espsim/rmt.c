/* SPDX-License-Identifier: MIT
 * RMT's transmitters: the ESP32's eight channels, the first four of the S3 (technical reference manuals,
 * chapter Remote Control). Each half word of a channel's memory is a level for so many ticks; one of no ticks
 * ends, or begins again. Receivers, carriers and access by the FIFO are not emulated. */
#include "esp.h"

#include <string.h>

enum { MEMORY = 0x800, ESP32_BLOCK = 64, S3_BLOCK = 48, S3_CHANNELS = 4 };
enum { CONFIG = 0x20, DATE = 0xFC };
enum { LEVEL_BIT = 15, TICKS = 0x7FFF, CYCLES_APB = 3, CYCLES_REF_TICK = 240, CYCLES_XTAL = 6 };

/* Registers of a chip, and bits of a channel's configuration. */
struct places {
    uint32_t raw, limit, conf, status; /* offsets; after RAW: ST, ENA, CLR */
    unsigned channels, block, signal, source;
    uint32_t start, rewind, loop, idle_level, idle_out, receive;
    unsigned end_bit, end_step, many_bit; /* of interrupts */
};
static const struct places places[2] = {
    {0xA0, 0xD0, 0xF0, 0x60, RMT_CHANNELS, ESP32_BLOCK, 87, 47, 1 << 0, 1 << 3, 1 << 6, 1 << 18, 1 << 19,
     1 << 1, 0, 3, 24},
    {0x70, 0xA0, 0xC0, 0x50, S3_CHANNELS, S3_BLOCK, 81, 40, 1 << 0, 1 << 1, 1 << 3, 1 << 5, 1 << 6, 1 << 0, 0,
     1, 8},
};
enum {
    S3_WRAP = 1 << 4,
    S3_STOP = 1 << 7,
    S3_CARRIER = 1 << 21,
    S3_TAKE_OVER = 1 << 24,
    S3_ONCE = 0x1800087
};
enum { S3_RECEIVERS = 0x30, S3_CLOCK_APB = 1, S3_CLOCK_XTAL = 3 };
enum { ESP32_WRAP = 1 << 1, ESP32_CARRIER = 1 << 28, ESP32_APB = 1 << 17 };

static const struct places *of(const struct esp *esp) {
    return &places[esp->chip];
}

static bool is_s3(const struct esp *esp) {
    return esp->chip == ES_ESP32S3;
}

/* ---- what a channel is set to ---- */

static uint32_t clock_cycles(struct esp *esp, const struct rmt_channel *channel) {
    if (!is_s3(esp))
        return (channel->conf1 & ESP32_APB) != 0 ? CYCLES_APB : CYCLES_REF_TICK;
    const uint32_t conf = esp->rmt.conf, selected = conf >> 24 & 3, divider = (conf >> 4 & 0xFF) + 1;
    if ((selected != S3_CLOCK_APB && selected != S3_CLOCK_XTAL) || (conf >> 12 & 0x3F) != 0)
        chip_fault(esp, "the clock of RMT (SYS_CONF %08x) is not emulated", conf);
    return (selected == S3_CLOCK_XTAL ? CYCLES_XTAL : CYCLES_APB) * divider;
}

static uint32_t tick_of(struct esp *esp, const struct rmt_channel *channel) {
    const uint32_t divider = (is_s3(esp) ? channel->conf1 >> 8 : channel->conf0) & 0xFF;
    return clock_cycles(esp, channel) * (divider == 0 ? 256 : divider);
}

static uint32_t words_of(const struct esp *esp, const struct rmt_channel *channel) {
    const uint32_t blocks = is_s3(esp) ? channel->conf1 >> 16 & 7 : channel->conf0 >> 24 & 15;
    return blocks * of(esp)->block;
}

static bool wraps(const struct esp *esp, const struct rmt_channel *channel) {
    return is_s3(esp) ? (channel->conf1 & S3_WRAP) != 0 : (esp->rmt.conf & ESP32_WRAP) != 0;
}

static bool has_carrier(const struct esp *esp, const struct rmt_channel *channel) {
    return is_s3(esp) ? (channel->conf1 & S3_CARRIER) != 0 : (channel->conf0 & ESP32_CARRIER) != 0;
}

/* ---- playing ---- */

static void raise(struct esp *esp, unsigned bit) {
    esp->rmt.raw |= 1u << bit;
}

static void end(struct esp *esp, unsigned number) {
    struct rmt_channel *channel = &esp->rmt.channel[number];
    const struct places *p = of(esp);
    channel->plays = false;
    raise(esp, p->end_bit + p->end_step * number);
    if ((channel->conf1 & p->idle_out) != 0)
        gpio_signal(esp, channel->due, p->signal + number, (channel->conf1 & p->idle_level) != 0);
}

static void word_is_done(struct esp *esp, unsigned number) {
    struct rmt_channel *channel = &esp->rmt.channel[number];
    channel->at++;
    if (++channel->sent == (channel->limit & 0x1FF)) {
        channel->sent = 0;
        raise(esp, of(esp)->many_bit + number);
    }
    if (channel->at < words_of(esp, channel))
        return;
    channel->at = 0;
    if (!wraps(esp, channel))
        chip_fault(esp, "RMT's channel %u runs past the end of its memory", number);
}

/* The next level, at `due`. */
static void play(struct esp *esp, unsigned number) {
    struct rmt *rmt = &esp->rmt;
    struct rmt_channel *channel = &rmt->channel[number];
    const uint32_t place = (of(esp)->block * number + channel->at) % RMT_WORDS;
    uint32_t half = rmt->memory[place] >> (channel->second ? 16 : 0);
    if ((half & TICKS) == 0 && (channel->conf1 & of(esp)->loop) != 0) {
        channel->at = 0;
        channel->second = false;
        half = rmt->memory[of(esp)->block * number];
    }
    if ((half & TICKS) == 0) {
        end(esp, number);
        return;
    }
    gpio_signal(esp, channel->due, of(esp)->signal + number, (half >> LEVEL_BIT & 1) != 0);
    channel->due += (uint64_t)(half & TICKS) * tick_of(esp, channel);
    if (channel->second)
        word_is_done(esp, number);
    channel->second = !channel->second;
}

static void start(struct esp *esp, unsigned number) {
    struct rmt_channel *channel = &esp->rmt.channel[number];
    if (channel->plays)
        return;
    if (has_carrier(esp, channel)) {
        chip_fault(esp, "the carrier of RMT's channel %u is not emulated", number);
        return;
    }
    channel->plays = true;
    channel->second = false;
    channel->due = esp->cycles;
    play(esp, number);
}

static void schedule(struct esp *esp) {
    struct rmt *rmt = &esp->rmt;
    rmt->due = NEVER;
    for (unsigned i = 0; i < RMT_CHANNELS; i++)
        if (rmt->channel[i].plays && rmt->channel[i].due < rmt->due)
            rmt->due = rmt->channel[i].due;
    matrix_set(esp, of(esp)->source, (rmt->raw & rmt->enabled) != 0);
}

void rmt_event(struct esp *esp) {
    struct rmt *rmt = &esp->rmt;
    for (unsigned i = 0; i < RMT_CHANNELS; i++)
        while (rmt->channel[i].plays && rmt->channel[i].due <= esp->cycles)
            play(esp, i);
    schedule(esp);
}

/* ---- registers ---- */

static void idle(struct esp *esp, unsigned number) {
    const struct rmt_channel *channel = &esp->rmt.channel[number];
    if (!channel->plays && (channel->conf1 & of(esp)->idle_out) != 0)
        gpio_signal(esp, esp->cycles, of(esp)->signal + number, (channel->conf1 & of(esp)->idle_level) != 0);
}

static void configure(struct esp *esp, unsigned number, uint32_t value) {
    const struct places *p = of(esp);
    struct rmt_channel *channel = &esp->rmt.channel[number];
    if (!is_s3(esp) && (value & p->receive) != 0)
        chip_fault(esp, "the receiver of RMT's channel %u is not emulated", number);
    if ((value & p->rewind) != 0)
        channel->at = channel->sent = 0;
    channel->conf0 = is_s3(esp) ? value & ~(uint32_t)S3_ONCE : channel->conf0;
    if (!is_s3(esp) || (value & S3_TAKE_OVER) != 0)
        channel->conf1 = value & ~(p->start | (is_s3(esp) ? (uint32_t)S3_ONCE : 0));
    if (is_s3(esp) && (value & S3_STOP) != 0)
        channel->plays = false;
    if ((value & p->start) != 0)
        start(esp, number);
    idle(esp, number);
}

static void store_config(struct esp *esp, uint32_t offset, uint32_t value) {
    const bool is_second = (offset & 4) != 0;
    if (is_s3(esp) && offset >= S3_RECEIVERS) {
        if (is_second && (value & of(esp)->receive) != 0)
            chip_fault(esp, "receivers of RMT are not emulated");
        esp->rmt.rest[offset / 4] = value;
    } else if (is_s3(esp))
        configure(esp, (offset - CONFIG) / 4, value);
    else if (is_second)
        configure(esp, (offset - CONFIG) / 8, value);
    else
        esp->rmt.channel[(offset - CONFIG) / 8].conf0 = value;
}

static void store(struct esp *esp, uint32_t offset, uint32_t value) {
    const struct places *p = of(esp);
    struct rmt *rmt = &esp->rmt;
    rmt_event(esp);
    if (offset >= MEMORY)
        rmt->memory[(offset - MEMORY) / 4] = value;
    else if (offset < CONFIG)
        chip_fault(esp, "access to RMT's memory by its FIFO is not emulated");
    else if (offset < p->status)
        store_config(esp, offset, value);
    else if (offset == p->raw + 8)
        rmt->enabled = value;
    else if (offset == p->raw + 12)
        rmt->raw &= ~value;
    else if (offset == p->conf)
        rmt->conf = value;
    else if (offset - p->limit < 4 * p->channels)
        rmt->channel[(offset - p->limit) / 4].limit = value;
    else if (offset <= DATE)
        rmt->rest[offset / 4] = value;
    schedule(esp);
}

static uint32_t load_config(const struct esp *esp, uint32_t offset) {
    if (is_s3(esp))
        return offset >= S3_RECEIVERS ? esp->rmt.rest[offset / 4]
                                      : esp->rmt.channel[(offset - CONFIG) / 4].conf0;
    const struct rmt_channel *channel = &esp->rmt.channel[(offset - CONFIG) / 8];
    return (offset & 4) != 0 ? channel->conf1 | channel->plays : channel->conf0;
}

static uint32_t load(struct esp *esp, uint32_t offset) {
    const struct places *p = of(esp);
    const struct rmt *rmt = &esp->rmt;
    rmt_event(esp);
    if (offset >= MEMORY)
        return rmt->memory[(offset - MEMORY) / 4];
    if (offset >= CONFIG && offset < p->status)
        return load_config(esp, offset);
    const uint32_t words[] = {rmt->raw, rmt->raw & rmt->enabled, rmt->enabled, 0};
    if (offset - p->raw < sizeof words)
        return words[(offset - p->raw) / 4];
    if (offset == p->conf)
        return rmt->conf;
    if (offset - p->limit < 4 * p->channels)
        return rmt->channel[(offset - p->limit) / 4].limit;
    return offset <= DATE ? rmt->rest[offset / 4] : 0;
}

static void reset(struct esp *esp) {
    struct rmt *rmt = &esp->rmt;
    memset(rmt, 0, sizeof *rmt);
    rmt->due = NEVER;
    for (unsigned i = 0; i < RMT_CHANNELS; i++) {
        rmt->channel[i].limit = 0x80;
        rmt->channel[i].conf0 = is_s3(esp) ? 0 : 1u << 28 | 1 << 24 | 2;
    }
    if (is_s3(esp))
        rmt->conf = S3_CLOCK_APB << 24 | 1 << 4;
}

void rmt_create(struct esp *esp) {
    if (!chip_keeps_outputs(esp))
        reset(esp);
    bus_add(esp, &(struct block){"RMT", is_s3(esp) ? 0x60016000 : 0x3FF56000, MEMORY + 4 * RMT_WORDS, load,
                                 store, NULL});
    gpio_has_signals(esp, of(esp)->signal, of(esp)->channels);
}
