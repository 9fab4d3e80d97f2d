/* SPDX-License-Identifier: MIT
 * Who in the network may command. [task] Pure: no clock, no socket, no storage.
 *
 * A controller has an access key. Who knows it commands; all others may look, hold and stop. A client is
 * known in two ways: its connection has given the key, or a proof of it; or its address is trusted, because
 * someone has logged in from there and said so, for a day or until that is revoked. Access may also be open
 * to all, if the owner has chosen that. Serial ports are no network. */
#ifndef WIFICNC_ACCESS_ACCESS_H
#define WIFICNC_ACCESS_ACCESS_H

#include "access/key.h"
#include "base/lockout.h"
#include "base/sha256.h"
#include "base/siphash.h"

enum {
    ACCESS_SALT = 16,
    ACCESS_NONCE = 16,
    ACCESS_ROUNDS = 2000, /* of PBKDF2; with a made key none would be needed */
    ACCESS_TRUSTED = 8,
    ACCESS_STORED = 2 * ACCESS_TRUSTED + 1
};

enum access_result {
    ACCESS_GOOD,
    ACCESS_WRONG,
    ACCESS_WAIT, /* it was not looked at, because it is not its turn: ask again, with the same since_us */
};

/** How long an address is trusted. */
enum access_span { ACCESS_NOT, ACCESS_DAY, ACCESS_ALWAYS };

struct access_trust {
    uint64_t who;    /* lockout_ipv4(), or 64 bits of another kind of address; 0: a free place */
    uint64_t host;   /* the other 64 bits of an IPv6 address; 0: it has no more */
    uint64_t end_us; /* UINT64_MAX: never */
};

struct access {
    bool open;
    bool has_key;                /* else none is right */
    bool changed;                /* the addresses that are trusted for ever: the target stores them */
    uint8_t digest[SHA256_SIZE]; /* of the key */
    uint8_t salt[ACCESS_SALT];   /* new at each start */
    uint8_t secret[SHA256_SIZE]; /* PBKDF2 of key and salt: what proofs are made with */
    uint8_t nonce_key[SIPHASH_KEY];
    struct lockout lockout;
    struct access_trust trust[ACCESS_TRUSTED];
    uint64_t now_us; /* does not wrap */
    uint32_t clock_us;
};

/** Takes some 0.1 s on a chip, for the secret. @param key  NUL-terminated; if it is none
 * (access_normal_key()), no one logs in @param open  to all, without the
 * key
 *  @param salt  unpredictable @param now_us  wraps */
void access_init(struct access *access, const char *key, bool open, const uint8_t salt[ACCESS_SALT],
                 uint32_t now_us);

/** Let trust and lockouts run out. Call it at least every half an hour: the clock wraps. */
void access_poll(struct access *access, uint32_t now_us);

/** A client of this address may command without a key. Guesses are counted by `who` alone, of IPv6 the
 * network: a guesser has all addresses of one; trust is in the whole address. @param host  as in access_trust
 */
bool access_may_at(const struct access *access, uint64_t who, uint64_t host);

/** The same of an address that is no IPv6 one. */
static inline bool access_may(const struct access *access, uint64_t who) {
    return access_may_at(access, who, 0);
}

/** Whether it is the turn of a try (base/lockout.h). @param since_us  access->clock_us when it came */
bool access_is_turn(struct access *access, uint64_t who, uint32_t since_us);

/** Someone says the key. Letter case, dashes and spaces do not count. @param since_us  of access_is_turn() */
enum access_result access_try(struct access *access, uint64_t who, uint32_t since_us, const char *key,
                              size_t size);

/** Someone proves to know the key, whether it is needed or not. @param proof  what was sent @param right what
 * it must be */
enum access_result access_prove(struct access *access, uint64_t who, uint32_t since_us,
                                const uint8_t proof[SHA256_SIZE], const uint8_t right[SHA256_SIZE]);

/** The nonce of a question, from its number: it cannot be foretold, and comes once for each number of a
 * start.
 */
void access_nonce(const struct access *access, uint32_t number, uint8_t nonce[ACCESS_NONCE]);

/** Someone answers that question with a proof of the key, which overheard is worth nothing.
 *  @param since_us  of access_is_turn() */
enum access_result access_answer(struct access *access, uint64_t who, uint32_t since_us, uint32_t number,
                                 const uint8_t proof[SHA256_SIZE]);

/** Trust this address from now on, instead of what was. @param host  as in access_trust
 *  @return false: all places are taken */
bool access_trust_at(struct access *access, uint64_t who, uint64_t host, enum access_span span);

/** The same of an address that is no IPv6 one. */
static inline bool access_trust(struct access *access, uint64_t who, enum access_span span) {
    return access_trust_at(access, who, 0, span);
}

/** The host of this address, which is no IPv6 one, is in control: its trust does not run out within the next
 * ten minutes, so its job is not held in the middle. */
void access_keep(struct access *access, uint64_t who);

/** Trust what is in this place no more. @param place  0 .. ACCESS_TRUSTED - 1 */
void access_revoke(struct access *access, unsigned place);

/** What is to be stored: a mark of the key, and the addresses that are trusted for ever. @return how many
 * numbers; 0: no address */
unsigned access_stored(const struct access *access, uint64_t stored[ACCESS_STORED]);

/** Trust these for ever, as they were stored: at the start. None, if the key is another one now: who changes
 * it shuts out all who were let in by the old one. */
void access_restore(struct access *access, const uint64_t stored[], unsigned count);

#endif
