/* SPDX-License-Identifier: MIT
 * Frames of Modbus RTU on a bus. */
#include "spindle/modbus.h"

#include <string.h>

#define CRC_START       0xFFFFu
#define CRC_POLYNOMIAL  0xA001u /* of Modbus, reflected */
#define FAST_BAUD       19200u  /* above it the silence is fixed */
#define FAST_GAP_US     1750u
#define REFUSAL         0x80u /* added to the function code */
#define FRAME_BYTES_MIN 4u    /* address, function, CRC */
#define ENDS            3u    /* address and CRC */

/* The low byte is sent first. */
static uint16_t crc_of(const uint8_t *bytes, size_t count) {
    uint32_t crc = CRC_START;
    for (size_t i = 0; i < count; i++) {
        crc ^= bytes[i];
        for (unsigned bit = 0; bit < 8; bit++)
            crc = (crc & 1u) != 0 ? crc >> 1 ^ CRC_POLYNOMIAL : crc >> 1;
    }
    return (uint16_t)crc;
}

size_t modbus_build(uint8_t frame[MODBUS_FRAME_MAX], uint8_t address, const uint8_t *body, size_t count) {
    frame[0] = address;
    memcpy(frame + 1, body, count);
    const uint16_t crc = crc_of(frame, count + 1);
    frame[count + 1] = (uint8_t)(crc & 0xFFu);
    frame[count + 2] = (uint8_t)(crc >> 8);
    return count + ENDS;
}

void modbus_rx_reset(struct modbus_rx *rx) {
    rx->count = 0;
    rx->heard = false;
}

void modbus_rx_put(struct modbus_rx *rx, const uint8_t *bytes, size_t count) {
    if (count == 0)
        return;
    rx->heard = true;
    if (count > MODBUS_RX_SIZE) {
        bytes += count - MODBUS_RX_SIZE;
        count = MODBUS_RX_SIZE;
    }
    const size_t room = MODBUS_RX_SIZE - rx->count;
    const size_t old = count > room ? count - room : 0;
    memmove(rx->bytes, rx->bytes + old, rx->count - old);
    memcpy(rx->bytes + rx->count - old, bytes, count);
    rx->count = (uint8_t)(rx->count - old + count);
}

/* The last two of these bytes are the CRC of the others. */
static bool is_sound(const uint8_t *bytes, size_t count) {
    const uint16_t crc = crc_of(bytes, count - 2);
    return bytes[count - 2] == (crc & 0xFFu) && bytes[count - 1] == crc >> 8;
}

bool modbus_fits(const uint8_t *body, const struct modbus_pattern *pattern) {
    for (unsigned i = 0; i < pattern->count; i++)
        if ((pattern->any >> i & 1) == 0 && body[i] != pattern->bytes[i])
            return false;
    return true;
}

bool modbus_rx_find(const struct modbus_rx *rx, uint8_t address, const struct modbus_pattern *pattern,
                    uint8_t body[MODBUS_BODY_MAX]) {
    const size_t size = pattern->count + ENDS;
    for (size_t at = 0; at + size <= rx->count; at++) {
        const uint8_t *frame = rx->bytes + at;
        if (frame[0] != address || !modbus_fits(frame + 1, pattern) || !is_sound(frame, size))
            continue;
        memcpy(body, frame + 1, pattern->count);
        return true;
    }
    return false;
}

bool modbus_rx_refusal(const struct modbus_rx *rx, uint8_t address, uint8_t function, uint8_t *code) {
    const struct modbus_pattern refusal = {.bytes = {(uint8_t)(function | REFUSAL)}, .count = 2, .any = 2};
    uint8_t body[MODBUS_BODY_MAX];
    if (!modbus_rx_find(rx, address, &refusal, body))
        return false;
    *code = body[1];
    return true;
}

bool modbus_rx_has_frame(const struct modbus_rx *rx) {
    for (size_t size = FRAME_BYTES_MIN; size <= rx->count; size++)
        if (is_sound(rx->bytes, size))
            return true;
    return false;
}

bool modbus_rx_has(const struct modbus_rx *rx, const uint8_t *bytes, size_t count) {
    for (size_t at = 0; at + count <= rx->count; at++)
        if (memcmp(rx->bytes + at, bytes, count) == 0)
            return true;
    return false;
}

uint32_t modbus_chars_us(uint32_t baud, unsigned bits, unsigned count) {
    return (uint32_t)(((uint64_t)bits * count * 1000000u + baud - 1) / baud);
}

uint32_t modbus_gap_us(uint32_t baud, unsigned bits) {
    return baud > FAST_BAUD ? FAST_GAP_US : modbus_chars_us(baud * 2, bits, 7);
}
