/* SPDX-License-Identifier: MIT
 * Whole packets of the binary protocol: the header around a payload. No state. [any context] */
#ifndef WIFICNC_WIRE_PACKET_H
#define WIFICNC_WIRE_PACKET_H

#include "wire/wire_gen.h"

#include <stdbool.h>
#include <stddef.h>

/** The largest packet that a device sends or must understand: motion in its full-length form is 374 bytes. */
enum { WIRE_PACKET_MAX = 512 };

/** Look at what came. Bytes behind the payload are ignored.
 *  @param[out] header  of the packet, when it is one; the payload is at bytes + WIRE_HEADER_SIZE
 *  @return false: too short, another magic or version, or damaged */
bool wire_open(const uint8_t *bytes, size_t count, struct wire_header *header);

/** Put the header before a payload that is already at packet + WIRE_HEADER_SIZE.
 *  @return size of the packet, bytes */
size_t wire_close(uint8_t *packet, uint8_t type, size_t payload_size, uint32_t sequence,
                  uint32_t timestamp_us);

/** Segments behind a payload's head of `head_size` bytes.
 *  @return false: count is not `least` .. 8, or the payload is too short for them */
bool wire_has_segments(const struct wire_header *header, size_t head_size, unsigned count, unsigned least);

#endif
