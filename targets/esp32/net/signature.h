/* SPDX-License-Identifier: MIT
 * Whether a firmware image comes from who has the private key: ECDSA with P-256 and SHA-256. [task]
 *
 * By ESP-IDF's mbedTLS. Its own signed apps have another scheme on each chip, and look at an image when it is
 * in the flash; here both chips have one, and what is refused was never written. No eFuse is burnt, so a
 * cable can always install another firmware. */
#ifndef WIFICNC_ESP32_SIGNATURE_H
#define WIFICNC_ESP32_SIGNATURE_H

#include "base/sha256.h"

#include <stdbool.h>
#include <stdint.h>

enum {
    SIGNATURE_KEY_SIZE = 65, /* a point of the curve: 04, X, Y */
    SIGNATURE_SIZE = 64      /* both numbers, the most significant byte first */
};

/** Takes some 0.1 s, and some KB of the heap meanwhile. @param digest  of the image @return false, too, when
 * the key is none or memory is short */
bool signature_is_good(const uint8_t key[SIGNATURE_KEY_SIZE], const uint8_t digest[SHA256_SIZE],
                       const uint8_t signature[SIGNATURE_SIZE]);

#endif
