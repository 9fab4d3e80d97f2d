/* SPDX-License-Identifier: MIT
 * Frames of Trinamic's single-wire UART and SPI. Pure: no clock, no bus. */
#ifndef WIFICNC_DRIVERS_TMC_FRAME_H
#define WIFICNC_DRIVERS_TMC_FRAME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    TMC_UART_READ_SIZE = 4,  /* sync, address, register, CRC */
    TMC_UART_FRAME_SIZE = 8, /* a write, and an answer: with four bytes of value before the CRC */
    TMC_SPI_FRAME_SIZE = 5,
    TMC_CHAIN_MAX = 6, /* chips in a row on one select */
    TMC_BYTES_MAX = TMC_CHAIN_MAX * TMC_SPI_FRAME_SIZE,
    TMC_WRITE = 0x80, /* added to a register */
};

/** [tests] CRC-8 of the UART, polynomial 7, each byte from its low bit on. */
uint8_t tmc_crc(const uint8_t *bytes, size_t count);

/** @return bytes of the request */
size_t tmc_uart_read(uint8_t frame[TMC_UART_READ_SIZE], uint8_t address, uint8_t reg);
size_t tmc_uart_write(uint8_t frame[TMC_UART_FRAME_SIZE], uint8_t address, uint8_t reg, uint32_t value);

/** Looks for the answer at every place: the request comes back before it, as there is only one wire.
 *  @return it is there and its CRC is right */
bool tmc_uart_answer(const uint8_t *bytes, size_t count, uint8_t reg, uint32_t *value);

/** Something else than the request was received: the request itself is echoed by the wire. */
bool tmc_uart_is_noisy(const uint8_t *bytes, size_t count, const uint8_t *request, size_t request_count);

/** A frame for one chip of a chain, and for the others a read of GCONF, which changes nothing.
 *  @param place  0: the chip next to the controller's output @param reg  with TMC_WRITE: a write
 *  @return bytes */
size_t tmc_spi_frame(uint8_t *bytes, unsigned chain, unsigned place, uint8_t reg, uint32_t value);

/** What a chip of a chain has sent in such a transfer: its status, and the value of the transfer before. */
uint32_t tmc_spi_value(const uint8_t *bytes, unsigned chain, unsigned place, uint8_t *status);

#endif
