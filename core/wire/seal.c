/* SPDX-License-Identifier: MIT */
#include "wire/seal.h"

#include "wire/bytes.h"

#include <string.h>

enum { SEAL_WINDOW = 64, SEAL_LABEL = 16, SEAL_MAC_AT = 8 };

/* What each digest is for is part of it, so that none can be used as another. */
static void derive_digest(const uint8_t secret[SHA256_SIZE], const char label[SEAL_LABEL],
                          const uint8_t *device, const uint8_t *host, uint8_t out[SHA256_SIZE]) {
    uint8_t message[SEAL_LABEL + 2 * SEAL_NONCE];
    memcpy(message, label, SEAL_LABEL);
    memcpy(message + SEAL_LABEL, device, SEAL_NONCE);
    memcpy(message + SEAL_LABEL + SEAL_NONCE, host, SEAL_NONCE);
    sha256_hmac(secret, SHA256_SIZE, message, sizeof message, out);
}

void seal_derive(const uint8_t secret[SHA256_SIZE], const uint8_t *device, const uint8_t *host,
                 uint8_t proof[SHA256_SIZE], uint8_t key[SIPHASH_KEY]) {
    static const char proves[SEAL_LABEL] = "WMC3 host proof", seals[SEAL_LABEL] = "WMC3 datagrams";
    uint8_t digest[SHA256_SIZE];
    derive_digest(secret, proves, device, host, proof);
    derive_digest(secret, seals, device, host, digest);
    memcpy(key, digest, SIPHASH_KEY);
}

/* @return the same at any byte order */
static uint64_t mac_number(const uint8_t mac[8]) {
    return (uint64_t)get_u32(mac + 4) << 32 | get_u32(mac);
}

size_t seal_close(struct seal *seal, uint8_t *packet, size_t size) {
    if (seal->session == 0)
        return size;
    struct wire_seal end = {.session = seal->session, .counter = ++seal->counter};
    wire_put_seal(packet + size, &end);
    const uint64_t mac = siphash(seal->key, packet, size + SEAL_MAC_AT);
    put_u32(packet + size + SEAL_MAC_AT, (uint32_t)mac);
    put_u32(packet + size + SEAL_MAC_AT + 4, (uint32_t)(mac >> 32));
    return size + WIRE_SEAL_SIZE;
}

/* Counters do not wrap: before that a host begins another session. @return false: it has come before, or may
 * have */
static bool note_counter(struct seal *seal, uint32_t counter) {
    uint32_t ahead = counter - seal->counter, behind = seal->counter - counter;
    if (counter <= seal->counter) {
        uint64_t bit = behind < SEAL_WINDOW ? (uint64_t)1 << behind : 0;
        bool is_new = bit != 0 && counter != 0 && (seal->seen & bit) == 0;
        seal->seen |= bit;
        return is_new;
    }
    seal->seen = (ahead < SEAL_WINDOW ? seal->seen << ahead : 0) | 1;
    seal->counter = counter;
    return true;
}

bool seal_open(struct seal *seal, const uint8_t *packet, size_t size, size_t count) {
    struct wire_seal end;
    if (seal->session == 0 || count != size + WIRE_SEAL_SIZE)
        return false;
    wire_get_seal(packet + size, &end);
    if (end.session != seal->session) /* no secret, so a stranger's flood costs little */
        return false;
    /* One comparison of all bytes: the time does not tell how many were right. */
    const uint64_t differs = siphash(seal->key, packet, size + SEAL_MAC_AT) ^ mac_number(end.mac);
    return differs == 0 && note_counter(seal, end.counter);
}
