/* SPDX-License-Identifier: MIT
 * A chain of 74HC595 and the peripheral before it, as steps through shift registers see them; a program has
 * one of both. i2s_model.c: the ESP32's I2S with a FIFO of 64 words, one of which leaves in each frame; the
 * last is repeated while there is none. The registers show a word when all of it has arrived, which is when
 * the next frame begins. spi_model.c: the ESP32-S3's SPI, where each word is a transfer that the processor
 * starts. */
#ifndef TEST_SHIFT_MODEL_H
#define TEST_SHIFT_MODEL_H

#include <stdbool.h>
#include <stdint.h>

enum { I2S_FRAME_CYCLES = 480, I2S_FIFO_WORDS = 64 };

/** The registers show another word. @param due  as it was when the word was written; of the test */
void lines_show(uint32_t before, uint32_t word, uint64_t at, uint64_t due);

void shift_model_reset(uint64_t now);

/** What the last access has written; then the frames until `now`. */
void shift_model_pass(uint64_t written, uint64_t now, uint64_t due);

/** The clock rests: nothing leaves any more. */
void shift_model_break(void);

uint32_t shift_model_shown(void);
bool shift_model_is_running(void);
unsigned shift_model_most_words(void);

/** A pin of the three, driven by hand. */
void shift_model_pin(unsigned gpio, bool level);

/** The GPIO matrix gives it to the peripheral. */
void shift_model_connect(unsigned gpio, uint32_t signal, uint64_t now);

volatile struct i2s_registers *shift_model_i2s(void);
volatile struct spi_registers *shift_model_spi(void);

#endif
