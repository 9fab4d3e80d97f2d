/* SPDX-License-Identifier: MIT
 * The ESP32's I2S0 as a transmitter: words that the processor writes into the FIFO of 64 leave one after the
 * other, each in a frame of two channels of 16 bits, the upper half first, while WS is high; the last one is
 * repeated while the FIFO is empty (technical reference manual, chapter I2S Controller). What they do is seen
 * at shift registers (shift.c). Other formats, DMA and the receiver are not emulated. */
#include "esp.h"

#include <string.h>

enum {
    FIFO_WRITE = 0x00,
    CONF = 0x08,
    RAW = 0x0C,
    STATUS = 0x10,
    ENABLED = 0x14,
    CLEAR = 0x18,
    FIFO_CONF = 0x20,
    OUT_LINK = 0x30,
    IN_LINK = 0x34,
    CONF1 = 0xA0,
    CONF2 = 0xA8,
    CLOCK = 0xAC,
    RATE = 0xB0,
};
enum {
    CONF_RESETS = 0xF,
    CONF_FIFO_RESET = 1 << 2,
    CONF_START = 1 << 4,
    CONF_RIGHT_FIRST = 1 << 8,
    CONF_RIGHT_UPPER = 1 << 16,
    CONF_FORMAT = CONF_RIGHT_FIRST | CONF_RIGHT_UPPER,
};
enum {
    FIFO_BY_DMA = 1 << 12,
    FIFO_MODE = 7 << 13,
    STOPS = 1 << 8,
    AS_IT_IS = 1 << 3,
    OF_ANALOG_CLOCK = 1 << 21
};
enum { WORD_FULL = 1 << 4, EMPTY = 1 << 5, FRAME_BITS = 32, SOURCE = 32 };
enum { BCK_SIGNAL = 23, WS_SIGNAL = 25, DATA_SIGNAL = 163 };
enum { LINK_START = 1 << 29 };

static uint32_t *word_at(struct i2s *i2s, uint32_t offset) {
    return &i2s->word[offset / 4];
}

/* ---- frames ---- */

static void shift_frame(struct esp *esp, unsigned until) {
    struct i2s *i2s = &esp->i2s;
    const struct shift *shift = &esp->shift;
    const unsigned from = i2s->done;
    if (until <= from)
        return;
    i2s->done = until;
    if (!shift->is_wired || !gpio_is_routed(esp, shift->clock, BCK_SIGNAL))
        return;
    const unsigned count = until - from;
    const uint32_t mask = count == FRAME_BITS ? UINT32_MAX : (1u << count) - 1;
    const bool level = es_pin_level(esp, shift->data) != 0;
    const uint32_t bits = gpio_is_routed(esp, shift->data, DATA_SIGNAL) ? i2s->sent >> (FRAME_BITS - until)
                          : level                                       ? UINT32_MAX
                                                                        : 0;
    shift_bits(esp, bits & mask, count);
}

static void begin_frame(struct esp *esp) {
    struct i2s *i2s = &esp->i2s;
    if (esp->shift.is_wired && gpio_is_routed(esp, esp->shift.latch, WS_SIGNAL))
        shift_show(esp, i2s->frame);
    i2s->done = 0;
    if (i2s->count == 0) {
        i2s->raw |= EMPTY;
        return;
    }
    i2s->sent = i2s->fifo[i2s->first];
    i2s->first = (i2s->first + 1) % I2S_FIFO;
    i2s->count--;
}

/* Two frames of the same word, and all is as it stays. */
static void skip_frames(const struct esp *esp, struct i2s *i2s) {
    const uint64_t frames = (esp->cycles - i2s->frame) / (FRAME_BITS * (uint64_t)i2s->cycles);
    if (i2s->count == 0 && frames > 3)
        i2s->frame += (frames - 3) * FRAME_BITS * i2s->cycles;
}

static void set_line(struct esp *esp) {
    matrix_set(esp, SOURCE, (esp->i2s.raw & *word_at(&esp->i2s, ENABLED)) != 0);
}

void i2s_sync(struct esp *esp) {
    struct i2s *i2s = &esp->i2s;
    if (!i2s->runs || esp->cycles < i2s->frame)
        return;
    skip_frames(esp, i2s);
    while (i2s->frame + FRAME_BITS * (uint64_t)i2s->cycles <= esp->cycles) {
        shift_frame(esp, FRAME_BITS);
        i2s->frame += FRAME_BITS * (uint64_t)i2s->cycles;
        begin_frame(esp);
    }
    const uint64_t bits = (esp->cycles - i2s->frame + i2s->cycles / 2) / i2s->cycles; /* rising edges */
    shift_frame(esp, bits < FRAME_BITS ? (unsigned)bits : FRAME_BITS);
    set_line(esp);
}

/* Nothing new comes until a word is written, or a pin is routed. */
static bool is_steady(const struct esp *esp) {
    const struct i2s *i2s = &esp->i2s;
    const struct shift *shift = &esp->shift;
    if (i2s->count != 0)
        return false;
    if ((i2s->word[ENABLED / 4] & EMPTY & ~i2s->raw) != 0)
        return false;
    return !shift->is_wired || !gpio_is_routed(esp, shift->latch, WS_SIGNAL) || shift->shown == i2s->sent ||
           !gpio_is_routed(esp, shift->clock, BCK_SIGNAL) || !gpio_is_routed(esp, shift->data, DATA_SIGNAL);
}

uint64_t i2s_next(const struct esp *esp) {
    const struct i2s *i2s = &esp->i2s;
    return i2s->runs && !is_steady(esp) ? i2s->frame + FRAME_BITS * (uint64_t)i2s->cycles : NEVER;
}

/* ---- registers ---- */

/* 160 MHz, divided twice. */
static bool take_clock(struct esp *esp) {
    struct i2s *i2s = &esp->i2s;
    const uint32_t clock = *word_at(i2s, CLOCK), rate = *word_at(i2s, RATE);
    const uint32_t divider = clock & 0xFF, bit_divider = rate & 0x3F;
    const bool has_fraction = (clock >> 8 & 0x3F) != 0, is_odd = divider * bit_divider % 2 != 0;
    if (divider < 2 || bit_divider < 2 || has_fraction || is_odd || (clock & OF_ANALOG_CLOCK) != 0 ||
        (rate >> 12 & 0x3F) != FRAME_BITS / 2) {
        chip_fault(esp, "the clock of I2S0 (%08x, %08x) is not emulated", clock, rate);
        return false;
    }
    i2s->cycles = divider * bit_divider * 3 / 2;
    return true;
}

static void start(struct esp *esp) {
    struct i2s *i2s = &esp->i2s;
    const uint32_t fifo = *word_at(i2s, FIFO_CONF), conf1 = *word_at(i2s, CONF1);
    if ((*word_at(i2s, CONF) & ~(uint32_t)CONF_START) != CONF_FORMAT ||
        (fifo & (FIFO_BY_DMA | FIFO_MODE)) != 0 || (conf1 & (STOPS | AS_IT_IS)) != AS_IT_IS ||
        *word_at(i2s, CONF2) != 0)
        chip_fault(esp, "I2S0 with CONF %08x, FIFO_CONF %08x, CONF1 %08x is not emulated",
                   *word_at(i2s, CONF), fifo, conf1);
    else if (take_clock(esp)) {
        i2s->runs = true;
        i2s->frame = esp->cycles;
        begin_frame(esp);
    }
}

static void configure(struct esp *esp, uint32_t value) {
    struct i2s *i2s = &esp->i2s;
    if ((value & CONF_FIFO_RESET) != 0)
        i2s->count = 0;
    *word_at(i2s, CONF) = value & ~(uint32_t)CONF_RESETS;
    if ((value & CONF_START) == 0)
        i2s->runs = false;
    else if (!i2s->runs)
        start(esp);
}

static void put(struct i2s *i2s, uint32_t value) {
    if (i2s->count == I2S_FIFO)
        i2s->raw |= WORD_FULL;
    else
        i2s->fifo[(i2s->first + i2s->count++) % I2S_FIFO] = value;
}

static void store(struct esp *esp, uint32_t offset, uint32_t value) {
    struct i2s *i2s = &esp->i2s;
    i2s_sync(esp);
    if (offset == FIFO_WRITE)
        put(i2s, value);
    else if (offset == CONF)
        configure(esp, value);
    else if (offset == CLEAR)
        i2s->raw &= ~value;
    else if ((offset == OUT_LINK || offset == IN_LINK) && (value & LINK_START) != 0)
        chip_fault(esp, "DMA of I2S0 is not emulated");
    else if (offset != RAW && offset != STATUS)
        *word_at(i2s, offset) = value;
    set_line(esp);
    chip_look(esp);
}

static uint32_t load(struct esp *esp, uint32_t offset) {
    struct i2s *i2s = &esp->i2s;
    i2s_sync(esp);
    if (offset == RAW)
        return i2s->raw;
    if (offset == STATUS)
        return i2s->raw & *word_at(i2s, ENABLED);
    return offset == FIFO_WRITE || offset == CLEAR ? 0 : *word_at(i2s, offset);
}

void i2s_reset(struct esp *esp) {
    memset(&esp->i2s, 0, sizeof esp->i2s);
    *word_at(&esp->i2s, FIFO_CONF) = FIFO_BY_DMA;
}

void i2s_create(struct esp *esp) {
    if (!chip_keeps_outputs(esp))
        i2s_reset(esp);
    if (esp->chip != ES_ESP32)
        return;
    bus_add(esp, &(struct block){"I2S0", 0x3FF4F000, 0x100, load, store, NULL});
    gpio_has_signals(esp, BCK_SIGNAL, 1);
    gpio_has_signals(esp, WS_SIGNAL, 1);
    gpio_has_signals(esp, DATA_SIGNAL, 1);
}
