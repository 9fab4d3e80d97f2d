/* SPDX-License-Identifier: MIT */
#include "shift_model.h"

#include "check.h"
#include "hal/i2s_registers.h"
#include "hal/spi_registers.h"
#include "pin_config.h"

#include <string.h>

/* 240 MHz: the 80 MHz clock divided by 5, 32 bits, and a clock before and after them; UPDATE takes some. */
enum { BIT_CYCLES = 15, WORD_CYCLES = (32 + 2) * BIT_CYCLES, UPDATE_CYCLES = 30, PINS_OF_PORT = 3 };

static volatile struct spi_registers registers;
static volatile struct i2s_registers no_i2s; /* which this chip has no words for */
static struct {
    uint32_t known;        /* SPI_CMD_REG as it was left */
    uint64_t updated, end; /* when UPDATE and START clear themselves; 0: they are clear */
    uint32_t taken;        /* the word that leaves */
    uint64_t due;
    bool is_set_up, broken, connected[PINS_OF_PORT]; /* clock, data, latch */
    uint32_t chain, shown;
    bool level[64];
} spi;

void shift_model_reset(uint64_t now) {
    (void)now;
    memset(&spi, 0, sizeof spi);
    memset((void *)&registers, 0, sizeof registers);
    registers.user = 1u << 31 | 1u << 7 | 1u << 6; /* as after a reset of the peripheral */
    spi.shown = 0xFFFFFFFFu;                       /* anything: they come up so */
}

/* Bytes of the buffer leave from the lowest on, each from its highest bit on. */
static uint32_t word_of_chain(uint32_t buffer) {
    uint32_t word = 0;
    for (unsigned byte = 0; byte < 4; byte++)
        word = word << 8 | (buffer >> 8 * byte & 0xFF);
    return word;
}

static void end_transfer(void) {
    const uint32_t before = spi.shown, word = word_of_chain(spi.taken);
    CHECK(registers.w[0] == spi.taken); /* or half of another word has left */
    if (spi.connected[2]) {
        spi.shown = word;
        if (before != word)
            lines_show(before, word, spi.end, spi.due);
    }
    spi.end = 0;
}

static void clear_until(uint64_t now) {
    if (spi.updated != 0 && spi.updated <= now)
        spi.updated = 0;
    if (spi.end != 0 && spi.end <= now)
        end_transfer();
    spi.known = (spi.updated != 0 ? STEP_SPI_UPDATE : 0) | (spi.end != 0 ? STEP_SPI_START : 0);
}

/* What the manual asks of a master with data out alone, the lowest bits of the word last. */
static void check_set_up(void) {
    CHECK(registers.user == (1u << 27 | 1u << 7 | 1u << 6) && registers.ctrl == 0 && registers.slave == 0);
    CHECK(registers.ms_dlen == 31 && (registers.misc & 1u) == 0 && (registers.misc & 1u << 29) == 0);
    CHECK(registers.clock == (0u << 18 | 4u << 12 | 1u << 6 | 4u << 0) && registers.clk_gate == 7);
    CHECK((registers.user1 >> 22 & 31) == 1 && registers.dma_conf == 0);
}

static void take_command(uint64_t now, uint64_t due) {
    const uint32_t command = registers.cmd;
    if (command == spi.known)
        return;
    if (spi.broken) {
        spi.updated = spi.end = UINT64_MAX;
        return;
    }
    CHECK(spi.updated == 0 && spi.end == 0); /* a command while another one lasts would be lost */
    if ((command & STEP_SPI_UPDATE) != 0) {
        check_set_up();
        spi.is_set_up = true;
        spi.updated = now + UPDATE_CYCLES;
    } else if ((command & STEP_SPI_START) != 0) {
        CHECK(spi.is_set_up);
        spi.taken = registers.w[0];
        spi.due = due;
        spi.end = now + WORD_CYCLES;
    }
}

static void take_interrupts(void) {
    registers.int_raw = (registers.int_raw | registers.int_set) & ~registers.int_clr;
    registers.int_set = registers.int_clr = 0;
}

void shift_model_pass(uint64_t written, uint64_t now, uint64_t due) {
    const uint32_t command = registers.cmd;
    const uint32_t left = spi.known;
    clear_until(written);
    /* What was left is no command, though its bits have cleared themselves meanwhile. */
    registers.cmd = command == left ? spi.known : command;
    take_command(written, due);
    take_interrupts();
    clear_until(now);
    registers.cmd = spi.known;
}

void shift_model_break(void) {
    spi.broken = true;
}

uint32_t shift_model_shown(void) {
    return spi.shown;
}

bool shift_model_is_running(void) {
    return spi.is_set_up && spi.connected[2];
}

unsigned shift_model_most_words(void) {
    return 1;
}

void shift_model_pin(unsigned gpio, bool level) {
    const bool rises = level && !spi.level[gpio];
    spi.level[gpio] = level;
    if (rises && gpio == PIN_I2SO_BCK)
        spi.chain = spi.chain << 1 | spi.level[PIN_I2SO_DATA];
    if (rises && gpio == PIN_I2SO_WS)
        spi.shown = spi.chain;
}

/* CS rests high: the latch must not fall and rise between words. */
void shift_model_connect(unsigned gpio, uint32_t signal, uint64_t now) {
    static const unsigned pins[PINS_OF_PORT] = {PIN_I2SO_BCK, PIN_I2SO_DATA, PIN_I2SO_WS};
    static const uint32_t signals[PINS_OF_PORT] = {101, 103, 110}; /* FSPICLK, FSPID, FSPICS0 */
    for (unsigned n = 0; n < PINS_OF_PORT; n++)
        if (pins[n] == gpio) {
            CHECK(signals[n] == signal);
            spi.connected[n] = true;
        }
    if (gpio == PIN_I2SO_WS)
        CHECK(spi.level[PIN_I2SO_WS] && (spi.end == 0 || spi.end <= now) && spi.is_set_up);
}

volatile struct spi_registers *shift_model_spi(void) {
    return &registers;
}

volatile struct i2s_registers *shift_model_i2s(void) {
    return &no_i2s;
}
