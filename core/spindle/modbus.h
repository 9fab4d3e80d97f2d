/* SPDX-License-Identifier: MIT
 * Frames of Modbus RTU on a bus: address, bytes, CRC-16. Huanyang's own frames are enclosed in the same way.
 * Pure: no clock, no bus. */
#ifndef WIFICNC_SPINDLE_MODBUS_H
#define WIFICNC_SPINDLE_MODBUS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    MODBUS_BODY_MAX = 8,                    /* bytes between address and CRC, of what is sent and awaited */
    MODBUS_FRAME_MAX = MODBUS_BODY_MAX + 3, /* with these */
    MODBUS_RX_SIZE = 32,                    /* a late answer and the right one after it */
    MODBUS_ADDRESS_MAX = 247,
};

/** @param count  1 .. MODBUS_BODY_MAX @return bytes of the frame */
size_t modbus_build(uint8_t frame[MODBUS_FRAME_MAX], uint8_t address, const uint8_t *body, size_t count);

/** What an answer must be between address and CRC. */
struct modbus_pattern {
    uint8_t bytes[MODBUS_BODY_MAX];
    uint8_t count;
    uint8_t any; /* bit n: byte n may be anything */
};

/** @param body  MODBUS_BODY_MAX bytes, or as many as the pattern has */
bool modbus_fits(const uint8_t *body, const struct modbus_pattern *pattern);

/** What was received since a request was sent; of more than fits in the newest bytes. */
struct modbus_rx {
    uint8_t bytes[MODBUS_RX_SIZE];
    uint8_t count;
    bool heard; /* anything at all */
};

void modbus_rx_reset(struct modbus_rx *rx);
void modbus_rx_put(struct modbus_rx *rx, const uint8_t *bytes, size_t count);

/** Looks for this answer at every place: what comes late, and noise before it, does not hide it.
 *  @param body  is filled in @return it is there, and its CRC is right */
bool modbus_rx_find(const struct modbus_rx *rx, uint8_t address, const struct modbus_pattern *pattern,
                    uint8_t body[MODBUS_BODY_MAX]);

/** The device refuses a request with this function code. @param code  its reason */
bool modbus_rx_refusal(const struct modbus_rx *rx, uint8_t address, uint8_t function, uint8_t *code);

/** The first bytes are a whole frame with a right CRC, of whomever. */
bool modbus_rx_has_frame(const struct modbus_rx *rx);

/** These bytes are in what was received, one after the other. */
bool modbus_rx_has(const struct modbus_rx *rx, const uint8_t *bytes, size_t count);

/** How long so many characters take, us. @param bits  of a character, with start, parity and stop */
uint32_t modbus_chars_us(uint32_t baud, unsigned bits, unsigned count);

/** Silence between two frames, us: 3.5 characters, above 19200 baud 1750 us. */
uint32_t modbus_gap_us(uint32_t baud, unsigned bits);

#endif
