/* SPDX-License-Identifier: MIT
 * What steps through shift registers need of the ESP32-S3's GP-SPI2 (technical reference manual, chapter SPI
 * Controller, CPU-controlled transfers): the processor writes 32 bits into the buffer and starts a transfer.
 *
 * Declared here, because the ESP32's SPI has other registers, and all files compile for both chips. */
#ifndef WIFICNC_ESP32_SPI_REGISTERS_H
#define WIFICNC_ESP32_SPI_REGISTERS_H

#include <stdint.h>

struct spi_registers {
    uint32_t cmd, addr, ctrl, clock, user, user1, user2, ms_dlen, misc; /* 0x00 .. 0x20 */
    uint32_t din_mode, din_num, dout_mode, dma_conf;                    /* 0x24 .. 0x30 */
    uint32_t int_ena, int_clr, int_raw, int_st, int_set;                /* 0x34 .. 0x44 */
    uint32_t reserved[20];                                              /* 0x48 .. 0x94 */
    uint32_t w[16];                                                     /* 0x98 .. 0xD4 */
    uint32_t reserved_too[2], slave, slave1, clk_gate;                  /* 0xD8 .. 0xE8 */
};
_Static_assert(sizeof(struct spi_registers) == 0xEC, "SPI register summary");

#define STEP_SPI ((volatile struct spi_registers *)0x60024000u)

/* SPI_CMD_REG. The hardware clears both: UPDATE when it has taken the registers over, START at the end. */
#define STEP_SPI_UPDATE (1u << 23)
#define STEP_SPI_START  (1u << 24)

/* SPI_USER_REG, SPI_USER1_REG: data out alone; CS, which is the latch, falls a clock before the first bit and
 * rises a clock after the last, so the whole word is in the registers when they show it. */
#define STEP_SPI_OUT     (1u << 27 | 1u << 7 | 1u << 6)
#define STEP_SPI_HOLD    (1u << 22)
#define STEP_SPI_CS0     (0x3Eu << 0) /* SPI_MISC_REG: the other five are off; the clock rests low */
#define STEP_SPI_BITS    31u          /* SPI_MS_DLEN_REG: one less */
#define STEP_SPI_RESETS  (1u << 31 | 1u << 30 | 1u << 29) /* SPI_DMA_CONF_REG: what earlier transfers left */
#define STEP_SPI_CLOCKED (1u << 2 | 1u << 1 | 1u << 0)    /* SPI_CLK_GATE_REG: by the 80 MHz of the PLL */

/* SPI_CLOCK_REG: 80 MHz / 5, high for 2 of 5. */
#define STEP_SPI_CLOCK (4u << 12 | 1u << 6 | 4u)

/* SPI_DMA_INT_*_REG: an interrupt that only software raises and that reaches no processor here. */
#define STEP_SPI_LATE (1u << 20)

/* Signals of the GPIO matrix. */
#define STEP_SPI_CLOCK_SIGNAL 101u
#define STEP_SPI_DATA_SIGNAL  103u
#define STEP_SPI_CS_SIGNAL    110u

#endif
