/* SPDX-License-Identifier: MIT
 * What proves who has sent a packet. [task] Pure.
 *
 * Host and device know an access key and make a secret of it (PBKDF2 with the device's salt). At
 * authentication both choose a nonce; from secret and nonces follow the host's proof and the key of the
 * session that begins. Behind each datagram of that session stand a counter and a message authentication code
 * over all before it, so a datagram proves itself: its source address says nothing, and none counts twice. */
#ifndef WIFICNC_WIRE_SEAL_H
#define WIFICNC_WIRE_SEAL_H

#include "base/sha256.h"
#include "base/siphash.h"
#include "wire/wire_gen.h"

#include <stdbool.h>

enum { SEAL_NONCE = 16 };

/** A host's session, at both ends. All zero: there is none. */
struct seal {
    uint32_t session; /* never 0 */
    uint32_t counter; /* the newest that was sent, or has come */
    uint64_t seen;    /* at the device: bit n is the one n before it */
    uint8_t key[SIPHASH_KEY];
};

/** @param device, host  their nonces, SEAL_NONCE bytes @param[out] proof  of the host
 *  @param[out] key  of the session */
void seal_derive(const uint8_t secret[SHA256_SIZE], const uint8_t *device, const uint8_t *host,
                 uint8_t proof[SHA256_SIZE], uint8_t key[SIPHASH_KEY]);

/** Put the seal behind a packet that is whole. @param packet  room for WIRE_SEAL_SIZE bytes more
 *  @return its size with that; the same as before without a session */
size_t seal_close(struct seal *seal, uint8_t *packet, size_t size);

/** Look at what is behind a packet. @param count  of all that came; beyond `size` is what may be a seal
 *  @return true: it is of this session, and has not come before; that is noted */
bool seal_open(struct seal *seal, const uint8_t *packet, size_t size, size_t count);

#endif
