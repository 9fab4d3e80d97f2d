/* SPDX-License-Identifier: MIT */
#include "hal/shift_port.h"

#include "hal/i2s_words.h"

#include "esp_private/periph_ctrl.h"
#include "esp_rom_sys.h"
#include "hal/i2s_ll.h"

#define WORD_NS STEP_I2S_FRAME_NS

_Static_assert(BOARD_STEP_GRID_NS == 0 || BOARD_STEP_GRID_NS == WORD_NS,
               "the clock's dividers make the board's grid");

/* Words that are written before the transmitter starts, so that none is missing when it does. */
enum { FIRST_WORDS = 4 };

/* Each register whole: what another program left there, such as a bootloader, does not count. */
static void make_transmitter(uint32_t word) {
    const uint32_t conf = STEP_I2S_RIGHT_FIRST | STEP_I2S_RIGHT_UPPER;
    STEP_I2S->conf = conf | STEP_I2S_RESET;
    STEP_I2S->conf = conf;
    STEP_I2S->conf2 = 0;
    STEP_I2S->pdm_conf = 0;
    STEP_I2S->int_ena = 0;
    STEP_I2S->conf_chan = 0;
    STEP_I2S->conf1 = STEP_I2S_AS_IT_IS;
    STEP_I2S->fifo_conf = STEP_I2S_WORDS_BY_CPU;
    STEP_I2S->clkm_conf = STEP_I2S_CLOCK;
    STEP_I2S->sample_rate_conf = STEP_I2S_SAMPLE;
    step_i2s_put(word, FIRST_WORDS);
    STEP_I2S->int_clr = STEP_I2S_FULL;
    STEP_I2S->conf = conf | STEP_I2S_START;
}

/* The latch last, from its high level: when it rises next, a whole word has been shifted. */
static void connect_pins(void) {
    shift_port_connect(PIN_I2SO_DATA, STEP_I2S_DATA_SIGNAL);
    shift_port_connect(PIN_I2SO_BCK, STEP_I2S_BCK_SIGNAL);
    esp_rom_delay_us(FIRST_WORDS * WORD_NS / 1000u);
    shift_port_connect(PIN_I2SO_WS, STEP_I2S_WS_SIGNAL);
}

void shift_i2s_start(uint32_t word) {
    PERIPH_RCC_ATOMIC() {
        i2s_ll_enable_bus_clock(0, true);
        i2s_ll_reset_register(0);
    }
    make_transmitter(word);
    connect_pins();
}

HAL_ISR void shift_i2s_put(uint32_t word) {
    step_i2s_put(word, 1);
}

bool shift_i2s_has_lost(void) {
    const bool lost = (STEP_I2S->int_raw & STEP_I2S_FULL) != 0;
    STEP_I2S->int_clr = STEP_I2S_FULL;
    return lost;
}
