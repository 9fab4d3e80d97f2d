/* SPDX-License-Identifier: MIT */
#include "hal/step_shift.h"

#include "hal/i2s_registers.h"
#include "hal/shift_port.h"

#include "driver/gpio.h"
#include "esp_rom_gpio.h"
#include "esp_rom_sys.h"
#include "soc/gpio_sig_map.h"

#include <stddef.h>

#define BY_SPI   (BOARD_STEP_ENGINE == BOARD_STEP_ENGINE_SPI)
#define ALL_AXES (AXIS_MASKS - 1)

#define WORD_NS     STEP_I2S_FRAME_NS
#define SETUP_WORDS ((BOARD_DIR_SETUP_NS + WORD_NS - 1) / WORD_NS)

/* The I2S' FIFO, and from its end to the latch. The SPI has sent its word when put() returns. */
enum { FIFO_WORDS = 64, LEAVING_WORDS = 4 };

static uint32_t shown; /* by step_shift_out() */

static HAL_INLINE void set_pin(uint8_t gpio, bool level) {
    (void)gpio_set_level((gpio_num_t)gpio, level);
}

/* Not by gpio_set_direction(): a pin of JTAG would stay JTAG's. */
static void make_pin(uint8_t gpio) {
    const gpio_config_t config = {.pin_bit_mask = 1ull << gpio, .mode = GPIO_MODE_OUTPUT};
    set_pin(gpio, false);
    (void)gpio_config(&config);
}

void step_shift_out(uint32_t word) {
    make_pin(PIN_I2SO_BCK);
    make_pin(PIN_I2SO_DATA);
    make_pin(PIN_I2SO_WS);
    for (unsigned bit = 32; bit-- != 0;) {
        set_pin(PIN_I2SO_DATA, (word >> (bit ^ STEP_SHIFT_ORDER) & 1) != 0);
        set_pin(PIN_I2SO_BCK, true);
        set_pin(PIN_I2SO_BCK, false);
    }
    set_pin(PIN_I2SO_WS, true);
    shown = word;
}

HAL_ISR void shift_port_connect(uint8_t gpio, uint32_t signal) {
    esp_rom_gpio_connect_out_signal(gpio, signal, false, false);
}

/* Numbers of the registers' outputs, of which step_pins_set() knows nothing. */
static bool outputs_of(const uint8_t pin[AXIS_COUNT], uint8_t output[AXIS_COUNT]) {
    for (unsigned motor = 0; motor < AXIS_COUNT; motor++) {
        if (pin[motor] != NO_PIN && !step_shift_has(pin[motor]))
            return false;
        output[motor] =
            pin[motor] == NO_PIN ? NO_PIN : (uint8_t)((pin[motor] - BOARD_I2SO_FIRST) ^ STEP_SHIFT_ORDER);
    }
    return true;
}

bool step_shift_group(struct hal_step *hal, const struct step_engine_board *board) {
    uint8_t steps[AXIS_COUNT], dirs[AXIS_COUNT];
    return outputs_of(board->step_gpio, steps) && outputs_of(board->dir_gpio, dirs) &&
           step_pins_set(&hal->pins, &board->gang, steps, dirs);
}

bool step_shift_init(struct hal_step *hal, const struct step_engine_board *board) {
    if (!step_shift_group(hal, board))
        return false;
    const uint32_t lines = hal->pins.step[ALL_AXES].bank[0] | hal->pins.dir[ALL_AXES].bank[0];
    hal->shifted = shown & ~lines;
    hal->shift_lines = hal->shift_inverted = 0;
    hal->shift_shown = hal->shifted;
    if (BY_SPI)
        shift_spi_start(hal->shifted);
    else
        shift_i2s_start(hal->shifted);
    return true;
}

static HAL_INLINE void put(uint32_t word) {
    if (BY_SPI)
        shift_spi_put(word);
    else
        shift_i2s_put(word);
}

/* Again until nothing has changed meanwhile: the e-stop's interrupt may come between reading and writing, and
 * its word must be the last one. */
HAL_ISR void step_shift_show(struct hal_step *hal) {
    for (uint32_t rest; (rest = step_shift_rest(hal)) != hal->shift_shown;) {
        put(rest);
        hal->shift_shown = rest;
    }
}

/* shift_shown stays: should the FIFO be full, the motion task's next round writes the word again. */
HAL_ISR void step_shift_cut(struct hal_step *hal, uint32_t high, uint32_t low) {
    (void)__atomic_fetch_or(&hal->shifted, high, __ATOMIC_RELAXED);
    (void)__atomic_fetch_and(&hal->shifted, ~low, __ATOMIC_RELAXED);
    put(step_shift_rest(hal));
}

/* A restart resets the I2S and SPI in the middle of a word (esp_system_reset_modules_on_exit()): without an
 * edge of the latch the registers do not show half of it. */
HAL_ISR void step_shift_freeze(struct hal_step *hal) {
    esp_rom_delay_us(FIFO_WORDS * WORD_NS / 1000u); /* no room was left for the word before */
    put(step_shift_rest(hal));
    esp_rom_delay_us(LEAVING_WORDS * WORD_NS / 1000u);
    set_pin(PIN_I2SO_WS, false); /* no edge that latches, whatever the peripheral's level is */
    shift_port_connect(PIN_I2SO_WS, SIG_GPIO_OUT_IDX);
}

bool step_shift_has_lost(void) {
    return BY_SPI ? shift_spi_has_lost() : shift_i2s_has_lost();
}

void step_shift_set_pulse(struct hal_step *hal, uint32_t ns) {
    hal->i2s_pulse_words = ns / WORD_NS;
    hal->i2s_setup_words = SETUP_WORDS > 0 ? SETUP_WORDS : 1; /* no line changes with a step line */
}

/* The lines of motors, whichever of them steps. */
static uint32_t lines_of(const uint8_t pin[AXIS_COUNT], unsigned motors) {
    uint8_t output[AXIS_COUNT];
    return outputs_of(pin, output) ? step_pins_bits(output, motors).bank[0] : 0;
}

void step_shift_invert(struct hal_step *hal, unsigned steps, unsigned dirs) {
    hal->shift_inverted = lines_of(hal->board->step_gpio, steps) | lines_of(hal->board->dir_gpio, dirs);
    hal->shift_lines = hal->pins.dir[hal->negative].bank[0] ^ hal->shift_inverted;
}

void step_shift_hold(struct hal_step *hal, axis_mask_t first, axis_mask_t second) {
    uint8_t steps[AXIS_COUNT];
    if (outputs_of(hal->board->step_gpio, steps))
        step_pins_hold(&hal->pins, &hal->board->gang, steps, first, second);
}
