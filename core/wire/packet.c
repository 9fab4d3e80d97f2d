/* SPDX-License-Identifier: MIT */
#include "wire/packet.h"

#include "wire/bytes.h"

enum { CHECKSUM_AT = 16 };

/* CRC-16/CCITT-FALSE (polynomial 0x1021), a byte at a time: a table would take 512 bytes of flash. crc is
 * 0xFFFF, or that of the bytes before. */
static uint16_t crc16(uint16_t crc, const uint8_t *bytes, size_t count) {
    unsigned sum = crc;
    for (size_t i = 0; i < count; i++) {
        unsigned x = (sum >> 8 ^ bytes[i]) & 0xFFu;
        x ^= x >> 4;
        sum = (sum << 8 ^ x << 12 ^ x << 5 ^ x) & 0xFFFFu;
    }
    return (uint16_t)sum;
}

/* Over header and payload, the checksum taken as zero. */
static uint16_t checksum_of(const uint8_t *packet, size_t size) {
    static const uint8_t zero[2] = {0, 0};
    uint16_t crc = crc16(0xFFFF, packet, CHECKSUM_AT);
    crc = crc16(crc, zero, sizeof zero);
    return crc16(crc, packet + WIRE_HEADER_SIZE, size - WIRE_HEADER_SIZE);
}

bool wire_open(const uint8_t *bytes, size_t count, struct wire_header *header) {
    if (count < WIRE_HEADER_SIZE)
        return false;
    wire_get_header(bytes, header);
    if (header->magic != WIRE_MAGIC || header->version != WIRE_VERSION ||
        header->length > count - WIRE_HEADER_SIZE)
        return false;
    return checksum_of(bytes, WIRE_HEADER_SIZE + (size_t)header->length) == header->checksum;
}

size_t wire_close(uint8_t *packet, uint8_t type, size_t payload_size, uint32_t sequence,
                  uint32_t timestamp_us) {
    struct wire_header header = {.magic = WIRE_MAGIC,
                                 .version = WIRE_VERSION,
                                 .type = type,
                                 .length = (uint16_t)payload_size,
                                 .sequence = sequence,
                                 .timestamp_us = timestamp_us};
    size_t size = WIRE_HEADER_SIZE + payload_size;
    wire_put_header(packet, &header);
    put_u16(packet + CHECKSUM_AT, checksum_of(packet, size));
    return size;
}

bool wire_has_segments(const struct wire_header *header, size_t head_size, unsigned count, unsigned least) {
    return count >= least && count <= WIRE_MOTION_SEGMENTS_MAX &&
           header->length >= head_size + (size_t)count * WIRE_SEGMENT_SIZE;
}
