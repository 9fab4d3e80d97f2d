/* SPDX-License-Identifier: MIT */
#include "hal/step_i2s.h"

#include "hal/i2s_words.h"

#include "driver/gpio.h"
#include "esp_private/periph_ctrl.h"
#include "esp_rom_gpio.h"
#include "esp_rom_sys.h"
#include "hal/i2s_ll.h"

#include <stddef.h>

#define WORD_NS  STEP_I2S_FRAME_NS
#define ALL_AXES (AXIS_MASKS - 1)

#define SETUP_WORDS ((BOARD_DIR_SETUP_NS + WORD_NS - 1) / WORD_NS)

_Static_assert(BOARD_STEP_GRID_NS == 0 || BOARD_STEP_GRID_NS == WORD_NS,
               "the clock's dividers make the board's grid");

/* Words that are written before the transmitter starts, so that none is missing when it does. */
enum { FIRST_WORDS = 4 };

static uint32_t shown; /* by step_i2s_shift_out() */

static void set_pin(uint8_t gpio, bool level) {
    (void)gpio_set_level((gpio_num_t)gpio, level);
}

/* Not by gpio_set_direction(): a pin of JTAG would stay JTAG's. */
static void make_pin(uint8_t gpio) {
    const gpio_config_t config = {.pin_bit_mask = 1ull << gpio, .mode = GPIO_MODE_OUTPUT};
    set_pin(gpio, false);
    (void)gpio_config(&config);
}

void step_i2s_shift_out(uint32_t word) {
    make_pin(PIN_I2SO_BCK);
    make_pin(PIN_I2SO_DATA);
    make_pin(PIN_I2SO_WS);
    for (unsigned bit = 32; bit-- != 0;) {
        set_pin(PIN_I2SO_DATA, (word >> bit & 1) != 0);
        set_pin(PIN_I2SO_BCK, true);
        set_pin(PIN_I2SO_BCK, false);
    }
    set_pin(PIN_I2SO_WS, true);
    shown = word;
}

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

static void connect(uint8_t gpio, uint32_t signal) {
    esp_rom_gpio_connect_out_signal(gpio, signal, false, false);
}

/* The latch last, from its high level: when it rises next, a whole word has been shifted. */
static void connect_pins(void) {
    connect(PIN_I2SO_DATA, STEP_I2S_DATA_SIGNAL);
    connect(PIN_I2SO_BCK, STEP_I2S_BCK_SIGNAL);
    esp_rom_delay_us(FIRST_WORDS * WORD_NS / 1000u);
    connect(PIN_I2SO_WS, STEP_I2S_WS_SIGNAL);
}

/* Numbers of the registers' outputs, of which step_pins_set() knows nothing. */
static bool outputs_of(const uint8_t pin[AXIS_COUNT], uint8_t output[AXIS_COUNT]) {
    for (unsigned motor = 0; motor < AXIS_COUNT; motor++) {
        if (pin[motor] != NO_PIN && !step_i2s_has(pin[motor]))
            return false;
        output[motor] = pin[motor] == NO_PIN ? NO_PIN : (uint8_t)(pin[motor] - BOARD_I2SO_FIRST);
    }
    return true;
}

bool step_i2s_group(struct hal_step *hal, const struct step_engine_board *board) {
    uint8_t steps[AXIS_COUNT], dirs[AXIS_COUNT];
    return outputs_of(board->step_gpio, steps) && outputs_of(board->dir_gpio, dirs) &&
           step_pins_set(&hal->pins, &board->gang, steps, dirs);
}

bool step_i2s_init(struct hal_step *hal, const struct step_engine_board *board) {
    if (!step_i2s_group(hal, board))
        return false;
    const uint32_t lines = hal->pins.step[ALL_AXES].bank[0] | hal->pins.dir[ALL_AXES].bank[0];
    hal->shifted = shown & ~lines;
    hal->i2s_lines = hal->i2s_inverted = 0;
    hal->i2s_shown = hal->shifted;
    PERIPH_RCC_ATOMIC() {
        i2s_ll_enable_bus_clock(0, true);
        i2s_ll_reset_register(0);
    }
    make_transmitter(hal->shifted);
    connect_pins();
    return true;
}

/* Again until nothing has changed meanwhile: the e-stop's interrupt may come between reading and writing, and
 * its word must be the last one. */
HAL_ISR void step_i2s_show(struct hal_step *hal) {
    for (uint32_t rest; (rest = step_i2s_rest(hal)) != hal->i2s_shown;) {
        step_i2s_put(rest, 1);
        hal->i2s_shown = rest;
    }
}

/* i2s_shown stays: should the FIFO be full, the motion task's next round writes the word again. */
HAL_ISR void step_i2s_cut(struct hal_step *hal, uint32_t high, uint32_t low) {
    (void)__atomic_fetch_or(&hal->shifted, high, __ATOMIC_RELAXED);
    (void)__atomic_fetch_and(&hal->shifted, ~low, __ATOMIC_RELAXED);
    step_i2s_put(step_i2s_rest(hal), 1);
}

bool step_i2s_has_lost(void) {
    const bool lost = (STEP_I2S->int_raw & STEP_I2S_FULL) != 0;
    STEP_I2S->int_clr = STEP_I2S_FULL;
    return lost;
}

void step_i2s_set_pulse(struct hal_step *hal, uint32_t ns) {
    hal->i2s_pulse_words = ns / WORD_NS;
    hal->i2s_setup_words = SETUP_WORDS > 0 ? SETUP_WORDS : 1; /* no line changes with a step line */
}

/* The lines of motors, whichever of them steps. */
static uint32_t lines_of(const uint8_t pin[AXIS_COUNT], unsigned motors) {
    uint8_t output[AXIS_COUNT];
    return outputs_of(pin, output) ? step_pins_bits(output, motors).bank[0] : 0;
}

void step_i2s_invert(struct hal_step *hal, unsigned steps, unsigned dirs) {
    hal->i2s_inverted = lines_of(hal->board->step_gpio, steps) | lines_of(hal->board->dir_gpio, dirs);
    hal->i2s_lines = hal->pins.dir[hal->negative].bank[0] ^ hal->i2s_inverted;
}

void step_i2s_hold(struct hal_step *hal, axis_mask_t first, axis_mask_t second) {
    uint8_t steps[AXIS_COUNT];
    if (outputs_of(hal->board->step_gpio, steps))
        step_pins_hold(&hal->pins, &hal->board->gang, steps, first, second);
}
