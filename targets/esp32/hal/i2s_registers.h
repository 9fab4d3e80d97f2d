/* SPDX-License-Identifier: MIT
 * What steps through shift registers need of the ESP32's first I2S peripheral (technical reference manual,
 * chapter I2S Controller): words that the processor writes into the FIFO leave one after the other, each in a
 * frame of 32 bits; the last one is repeated while the FIFO is empty. No DMA.
 *
 * Declared here, because the ESP32-S3's header has no such FIFO, and all files compile for both chips. */
#ifndef WIFICNC_ESP32_I2S_REGISTERS_H
#define WIFICNC_ESP32_I2S_REGISTERS_H

#include <stdint.h>

struct i2s_registers {
    uint32_t fifo_wr, fifo_rd, conf, int_raw, int_st, int_ena, int_clr, timing, fifo_conf; /* 0x00 .. 0x20 */
    uint32_t rx_eof_num, conf_single_data, conf_chan;                                      /* 0x24 .. 0x2C */
    uint32_t of_dma_and_codecs[28];                                                        /* 0x30 .. 0x9C */
    uint32_t conf1, pd_conf, conf2, clkm_conf, sample_rate_conf, pdm_conf;                 /* 0xA0 .. 0xB4 */
};
_Static_assert(sizeof(struct i2s_registers) == 0xB8, "I2S register summary");

#define STEP_I2S ((volatile struct i2s_registers *)0x3FF4F000u)

/* I2S_CONF_REG. The right channel, which is the word's upper half, is sent while WS is high, and first: so WS
 * rises, and the registers show a word, when all of it is in them. */
#define STEP_I2S_RESET       (1u << 0 | 1u << 2) /* transmitter and its FIFO */
#define STEP_I2S_START       (1u << 4)
#define STEP_I2S_RIGHT_FIRST (1u << 8)
#define STEP_I2S_RIGHT_UPPER (1u << 16)

#define STEP_I2S_WORDS_BY_CPU (1u << 19) /* I2S_FIFO_CONF_REG: mode 0, 16 bits of two channels; no DMA */
#define STEP_I2S_AS_IT_IS     (1u << 3) /* I2S_CONF1_REG: no compression; clocks continue without new words */

/* I2S_CLKM_CONF_REG and I2S_SAMPLE_RATE_CONF_REG: 160 MHz, divided twice; 16 bits of a channel. */
#define STEP_I2S_CLOCK_MHZ   160u
#define STEP_I2S_DIVIDER     5u
#define STEP_I2S_BIT_DIVIDER 2u
#define STEP_I2S_CLOCK       (STEP_I2S_DIVIDER | 1u << 20)
#define STEP_I2S_SAMPLE      (STEP_I2S_BIT_DIVIDER | STEP_I2S_BIT_DIVIDER << 6 | 16u << 12 | 16u << 18)
#define STEP_I2S_FRAME_NS    (32u * STEP_I2S_DIVIDER * STEP_I2S_BIT_DIVIDER * 1000u / STEP_I2S_CLOCK_MHZ)

#define STEP_I2S_FULL (1u << 4) /* I2S_INT_RAW_REG, I2S_INT_CLR_REG: the FIFO was full */

/* Signals of the GPIO matrix. */
#define STEP_I2S_BCK_SIGNAL  23u
#define STEP_I2S_WS_SIGNAL   25u
#define STEP_I2S_DATA_SIGNAL 163u

#endif
