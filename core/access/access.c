/* SPDX-License-Identifier: MIT */
#include "access/access.h"

#include <string.h>

#define DAY_US  86400000000u
#define KEEP_US 600000000u

/* Digests are compared, not keys: they are of one length, and sha256_is_equal() takes the same time for all.
 */
static void digest_of(const char *normal, size_t count, uint8_t digest[SHA256_SIZE]) {
    struct sha256 sha;
    sha256_begin(&sha);
    sha256_add(&sha, normal, count);
    sha256_end(&sha, digest);
}

/* Whatever nonces might tell about their key, they tell nothing about the secret. */
static void derive_nonce_key(struct access *access) {
    static const char label[] = "WiFiCNC nonces";
    uint8_t derived[SHA256_SIZE];
    sha256_hmac(access->secret, SHA256_SIZE, label, sizeof label, derived);
    memcpy(access->nonce_key, derived, sizeof access->nonce_key);
}

void access_init(struct access *access, const char *key, bool open, const uint8_t salt[ACCESS_SALT],
                 uint32_t now_us) {
    char normal[ACCESS_KEY_BYTES] = {0};
    memset(access, 0, sizeof *access);
    access->open = open;
    access->clock_us = now_us;
    memcpy(access->salt, salt, ACCESS_SALT);
    size_t count = access_normal_key(key, strlen(key), normal);
    access->has_key = count > 0;
    digest_of(normal, count, access->digest);
    if (access->has_key)
        sha256_pbkdf2(normal, count, salt, ACCESS_SALT, ACCESS_ROUNDS, access->secret);
    derive_nonce_key(access);
}

void access_poll(struct access *access, uint32_t now_us) {
    access->now_us += now_us - access->clock_us;
    access->clock_us = now_us;
    lockout_poll(&access->lockout, now_us);
    for (unsigned i = 0; i < ACCESS_TRUSTED; i++)
        if (access->trust[i].end_us <= access->now_us)
            access->trust[i] = (struct access_trust){0};
}

static const struct access_trust *place_of(const struct access *access, uint64_t who, uint64_t host) {
    for (unsigned i = 0; i < ACCESS_TRUSTED; i++)
        if (access->trust[i].who == who && access->trust[i].host == host)
            return &access->trust[i];
    return NULL;
}

bool access_may_at(const struct access *access, uint64_t who, uint64_t host) {
    return access->open || (who != 0 && place_of(access, who, host) != NULL);
}

bool access_is_turn(struct access *access, uint64_t who, uint32_t since_us) {
    return lockout_may_try(&access->lockout, who, since_us, access->clock_us);
}

enum access_result access_prove(struct access *access, uint64_t who, uint32_t since_us,
                                const uint8_t proof[SHA256_SIZE], const uint8_t right[SHA256_SIZE]) {
    if (!access_is_turn(access, who, since_us))
        return ACCESS_WAIT;
    bool good = sha256_is_equal(proof, right) && access->has_key;
    lockout_note(&access->lockout, who, good, access->clock_us);
    return good ? ACCESS_GOOD : ACCESS_WRONG;
}

enum access_result access_try(struct access *access, uint64_t who, uint32_t since_us, const char *key,
                              size_t size) {
    char normal[ACCESS_KEY_BYTES] = {0};
    uint8_t digest[SHA256_SIZE];
    digest_of(normal, access_normal_key(key, size, normal), digest);
    return access_prove(access, who, since_us, digest, access->digest);
}

void access_nonce(const struct access *access, uint32_t number, uint8_t nonce[ACCESS_NONCE]) {
    uint8_t question[5] = {(uint8_t)number, (uint8_t)(number >> 8), (uint8_t)(number >> 16),
                           (uint8_t)(number >> 24)};
    for (unsigned half = 0; half < 2; half++) {
        question[4] = (uint8_t)half;
        uint64_t digest = siphash(access->nonce_key, question, sizeof question);
        memcpy(nonce + half * sizeof digest, &digest, sizeof digest);
    }
}

enum access_result access_answer(struct access *access, uint64_t who, uint32_t since_us, uint32_t number,
                                 const uint8_t proof[SHA256_SIZE]) {
    static const char label[16] =
        "WiFiCNC login"; /* what the digest is for is part of it, as in wire/seal.c */
    uint8_t message[sizeof label + ACCESS_NONCE], right[SHA256_SIZE];
    if (!access_is_turn(access, who, since_us))
        return ACCESS_WAIT;
    memcpy(message, label, sizeof label);
    access_nonce(access, number, message + sizeof label);
    sha256_hmac(access->secret, SHA256_SIZE, message, sizeof message, right);
    return access_prove(access, who, since_us, proof, right);
}

bool access_trust_at(struct access *access, uint64_t who, uint64_t host, enum access_span span) {
    const struct access_trust *found = place_of(access, who, host);
    if (found == NULL)
        found = place_of(access, 0, 0);
    if (found == NULL)
        return span == ACCESS_NOT;
    struct access_trust *place = &access->trust[found - access->trust];
    access->changed |= span == ACCESS_ALWAYS || place->end_us == UINT64_MAX;
    if (span == ACCESS_NOT)
        *place = (struct access_trust){0};
    else
        *place = (struct access_trust){
            .who = who, .host = host, .end_us = span == ACCESS_ALWAYS ? UINT64_MAX : access->now_us + DAY_US};
    return true;
}

void access_keep(struct access *access, uint64_t who) {
    const struct access_trust *found = place_of(access, who, 0);
    const uint64_t end_us = access->now_us + KEEP_US;
    if (who != 0 && found != NULL && found->end_us < end_us)
        access->trust[found - access->trust].end_us = end_us;
}

void access_revoke(struct access *access, unsigned place) {
    access->changed |= access->trust[place].end_us == UINT64_MAX;
    access->trust[place] = (struct access_trust){0};
}

/* So short that it tells a reader of the store next to nothing about a weak key. */
static uint64_t mark_of_key(const struct access *access) {
    static const char label[] = "WiFiCNC trust";
    uint8_t derived[SHA256_SIZE];
    sha256_hmac(access->digest, SHA256_SIZE, label, sizeof label, derived);
    return (uint64_t)derived[0] << 16 | (uint64_t)derived[1] << 8 | derived[2];
}

/* Which of the numbers that are stored are followed by the other half of an IPv6 address: bits of the first
 * one, above the mark. */
static uint64_t has_host(unsigned at) {
    return (uint64_t)1 << (32 + at);
}

unsigned access_stored(const struct access *access, uint64_t stored[ACCESS_STORED]) {
    unsigned count = 1;
    stored[0] = mark_of_key(access);
    for (unsigned i = 0; i < ACCESS_TRUSTED; i++) {
        const struct access_trust *place = &access->trust[i];
        if (place->who == 0 || place->end_us != UINT64_MAX)
            continue;
        stored[0] |= place->host != 0 ? has_host(count) : 0;
        stored[count++] = place->who;
        if (place->host != 0)
            stored[count++] = place->host;
    }
    return count > 1 ? count : 0;
}

void access_restore(struct access *access, const uint64_t stored[], unsigned count) {
    const bool same_key = count > 0 && (uint32_t)stored[0] == mark_of_key(access);
    for (unsigned i = 1; same_key && i < count; i++) {
        const uint64_t who = stored[i];
        const bool halves = i < ACCESS_STORED && (stored[0] & has_host(i)) != 0;
        if (halves && ++i >= count)
            break;
        if (who != 0)
            (void)access_trust_at(access, who, halves ? stored[i] : 0, ACCESS_ALWAYS);
    }
    access->changed = false;
}
