/* SPDX-License-Identifier: MIT
 * Frames of Trinamic's single-wire UART and SPI. */
#include "drivers/tmc_frame.h"

#include <string.h>

#define SYNC           0x05u
#define TO_CONTROLLER  0xFFu /* the address in an answer */
#define CRC_POLYNOMIAL 0x07u

uint8_t tmc_crc(const uint8_t *bytes, size_t count) {
    unsigned crc = 0;
    for (size_t i = 0; i < count; i++) {
        for (unsigned bit = 0; bit < 8; bit++) {
            const unsigned top = (crc >> 7 ^ (unsigned)bytes[i] >> bit) & 1u;
            crc = (crc << 1 ^ (top != 0 ? CRC_POLYNOMIAL : 0)) & 0xFFu;
        }
    }
    return (uint8_t)crc;
}

static void put_value(uint8_t *bytes, uint32_t value) {
    for (unsigned i = 0; i < 4; i++)
        bytes[i] = (uint8_t)(value >> (24 - 8 * i));
}

static uint32_t take_value(const uint8_t *bytes) {
    return (uint32_t)bytes[0] << 24 | (uint32_t)bytes[1] << 16 | (uint32_t)bytes[2] << 8 | bytes[3];
}

size_t tmc_uart_read(uint8_t frame[TMC_UART_READ_SIZE], uint8_t address, uint8_t reg) {
    frame[0] = SYNC;
    frame[1] = address;
    frame[2] = reg;
    frame[3] = tmc_crc(frame, 3);
    return TMC_UART_READ_SIZE;
}

size_t tmc_uart_write(uint8_t frame[TMC_UART_FRAME_SIZE], uint8_t address, uint8_t reg, uint32_t value) {
    frame[0] = SYNC;
    frame[1] = address;
    frame[2] = reg | TMC_WRITE;
    put_value(frame + 3, value);
    frame[7] = tmc_crc(frame, 7);
    return TMC_UART_FRAME_SIZE;
}

bool tmc_uart_answer(const uint8_t *bytes, size_t count, uint8_t reg, uint32_t *value) {
    for (size_t at = 0; at + TMC_UART_FRAME_SIZE <= count; at++) {
        const uint8_t *frame = bytes + at;
        if ((frame[0] & 0x0Fu) != SYNC || frame[1] != TO_CONTROLLER || frame[2] != reg ||
            frame[7] != tmc_crc(frame, 7))
            continue;
        *value = take_value(frame + 3);
        return true;
    }
    return false;
}

bool tmc_uart_is_noisy(const uint8_t *bytes, size_t count, const uint8_t *request, size_t request_count) {
    if (count >= request_count && memcmp(bytes, request, request_count) == 0)
        return count > request_count;
    return count > 0;
}

/* What is sent first ends up in the last chip of the chain. */
static size_t at_of(unsigned chain, unsigned place) {
    return (size_t)(chain - 1 - place) * TMC_SPI_FRAME_SIZE;
}

size_t tmc_spi_frame(uint8_t *bytes, unsigned chain, unsigned place, uint8_t reg, uint32_t value) {
    const size_t count = (size_t)chain * TMC_SPI_FRAME_SIZE;
    memset(bytes, 0, count);
    bytes[at_of(chain, place)] = reg;
    put_value(bytes + at_of(chain, place) + 1, value);
    return count;
}

uint32_t tmc_spi_value(const uint8_t *bytes, unsigned chain, unsigned place, uint8_t *status) {
    const uint8_t *frame = bytes + at_of(chain, place);
    *status = frame[0];
    return take_value(frame + 1);
}
