/* SPDX-License-Identifier: MIT */
#include "shift_model.h"

#include "check.h"
#include "hal/i2s_registers.h"
#include "hal/spi_registers.h"
#include "pin_config.h"

#include <string.h>

/* What no test writes as a word: so a write of the same word again is seen. */
#define NOTHING 0x5A5AA5A5u

struct entry {
    uint32_t word;
    uint64_t due;
};

static volatile struct i2s_registers registers;
static volatile struct spi_registers no_spi; /* this chip does not send words by it */
static struct {
    struct entry fifo[I2S_FIFO_WORDS];
    unsigned first, count, most;
    struct entry sent;
    uint64_t frame; /* when the present one began */
    bool running, broken;
    uint64_t connected[3]; /* when: clock, data, latch */
    uint32_t chain, shown;
    bool level[64];
} i2s;

void shift_model_reset(uint64_t now) {
    memset(&i2s, 0, sizeof i2s);
    registers.fifo_wr = NOTHING;
    registers.int_raw = registers.int_clr = registers.conf = 0;
    i2s.frame = now / I2S_FRAME_CYCLES * I2S_FRAME_CYCLES;
    i2s.shown = 0xFFFFFFFFu; /* anything: they come up so */
}

static void show(uint32_t word, uint64_t at, uint64_t due) {
    const uint32_t before = i2s.shown;
    i2s.shown = word;
    if (before != word)
        lines_show(before, word, at, due);
}

static bool is_wired(void) {
    return i2s.connected[2] != 0;
}

static void end_frame(uint64_t at) {
    if (is_wired())
        show(i2s.sent.word, at, i2s.sent.due);
    if (i2s.count == 0)
        return;
    i2s.sent = i2s.fifo[i2s.first];
    i2s.first = (i2s.first + 1) % I2S_FIFO_WORDS;
    i2s.count--;
}

static void frames_until(uint64_t now) {
    if (i2s.broken || !i2s.running)
        return;
    while (i2s.frame + I2S_FRAME_CYCLES <= now) {
        i2s.frame += I2S_FRAME_CYCLES;
        end_frame(i2s.frame);
    }
}

static void take_word(uint64_t due) {
    const uint32_t word = registers.fifo_wr;
    registers.fifo_wr = NOTHING;
    if (word == NOTHING)
        return;
    if (i2s.count == I2S_FIFO_WORDS) {
        registers.int_raw |= STEP_I2S_FULL;
        return;
    }
    i2s.fifo[(i2s.first + i2s.count++) % I2S_FIFO_WORDS] = (struct entry){word, due};
    i2s.most = i2s.count > i2s.most ? i2s.count : i2s.most;
}

/* As a driver of the data sheet would read back what was configured. */
static void take_configuration(uint64_t now) {
    const uint32_t conf = registers.conf, wanted = STEP_I2S_RIGHT_FIRST | STEP_I2S_RIGHT_UPPER;
    if ((conf & STEP_I2S_RESET) != 0)
        i2s.count = 0;
    if (!i2s.running && (conf & STEP_I2S_START) != 0) {
        CHECK((conf & wanted) == wanted && registers.fifo_conf == STEP_I2S_WORDS_BY_CPU);
        CHECK(registers.clkm_conf == STEP_I2S_CLOCK && registers.sample_rate_conf == STEP_I2S_SAMPLE);
        CHECK(i2s.count > 0); /* or zeros would leave */
        i2s.running = true;
        i2s.frame = now;
        end_frame(now);
    }
    registers.int_raw &= ~registers.int_clr;
    registers.int_clr = 0;
}

void shift_model_pass(uint64_t written, uint64_t now, uint64_t due) {
    frames_until(written);
    take_word(due);
    take_configuration(written);
    frames_until(now);
}

volatile struct i2s_registers *shift_model_i2s(void) {
    return &registers;
}

volatile struct spi_registers *shift_model_spi(void) {
    return &no_spi;
}

void shift_model_break(void) {
    i2s.broken = true;
}

uint32_t shift_model_shown(void) {
    return i2s.shown;
}

bool shift_model_is_running(void) {
    return i2s.running && is_wired();
}

unsigned shift_model_most_words(void) {
    return i2s.most;
}

void shift_model_pin(unsigned gpio, bool level) {
    const bool rises = level && !i2s.level[gpio];
    i2s.level[gpio] = level;
    if (rises && gpio == PIN_I2SO_BCK)
        i2s.chain = i2s.chain << 1 | i2s.level[PIN_I2SO_DATA];
    if (rises && gpio == PIN_I2SO_WS)
        i2s.shown = i2s.chain;
}

/* A latch that rises before a whole word is in the registers would show rubbish. */
void shift_model_connect(unsigned gpio, uint32_t signal, uint64_t now) {
    static const unsigned pins[] = {PIN_I2SO_BCK, PIN_I2SO_DATA, PIN_I2SO_WS};
    static const uint32_t signals[] = {STEP_I2S_BCK_SIGNAL, STEP_I2S_DATA_SIGNAL, STEP_I2S_WS_SIGNAL};
    for (unsigned n = 0; n < 3; n++)
        if (pins[n] == gpio) {
            CHECK(signals[n] == signal);
            i2s.connected[n] = now;
        }
    if (gpio != PIN_I2SO_WS)
        return;
    CHECK(i2s.level[PIN_I2SO_WS] && i2s.running && i2s.connected[0] != 0 && i2s.connected[1] != 0);
    CHECK(now >= i2s.connected[0] + 2 * I2S_FRAME_CYCLES && now >= i2s.connected[1] + 2 * I2S_FRAME_CYCLES);
}
