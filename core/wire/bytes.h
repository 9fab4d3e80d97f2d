/* SPDX-License-Identifier: MIT
 * Little-endian numbers at any address. */
#ifndef WIFICNC_WIRE_BYTES_H
#define WIFICNC_WIRE_BYTES_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

static inline void put_u8(uint8_t *at, uint8_t value) {
    *at = value;
}
static inline void put_u16(uint8_t *at, uint16_t value) {
    at[0] = (uint8_t)value;
    at[1] = (uint8_t)(value >> 8);
}
static inline void put_u32(uint8_t *at, uint32_t value) {
    put_u16(at, (uint16_t)value);
    put_u16(at + 2, (uint16_t)(value >> 16));
}
static inline void put_i8(uint8_t *at, int8_t value) {
    put_u8(at, (uint8_t)value);
}
static inline void put_i32(uint8_t *at, int32_t value) {
    put_u32(at, (uint32_t)value);
}
static inline void put_zero(uint8_t *at, size_t count) {
    memset(at, 0, count);
}
/** Text into a field of `count` bytes, padded with NUL; what is longer is cut. */
static inline void put_text(uint8_t *at, const char *text, size_t count) {
    size_t size = 0;
    while (size < count && text[size] != '\0')
        size++;
    memcpy(at, text, size);
    put_zero(at + size, count - size);
}

static inline uint8_t get_u8(const uint8_t *at) {
    return *at;
}
static inline uint16_t get_u16(const uint8_t *at) {
    return (uint16_t)(at[0] | at[1] << 8);
}
static inline uint32_t get_u32(const uint8_t *at) {
    return (uint32_t)get_u16(at) | (uint32_t)get_u16(at + 2) << 16;
}
static inline int8_t get_i8(const uint8_t *at) {
    return (int8_t)*at;
}
static inline int32_t get_i32(const uint8_t *at) {
    return (int32_t)get_u32(at);
}
/** A field of `count` bytes; `text` has room for count + 1 and ends with NUL. */
static inline void get_text(const uint8_t *at, char *text, size_t count) {
    memcpy(text, at, count);
    text[count] = '\0';
}

#endif
