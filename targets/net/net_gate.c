/* SPDX-License-Identifier: MIT */
#include "net_gate.h"

#include <string.h>

/* Digests are compared, not passwords: they are of one length, and sha256_is_equal() takes the same time
 * for all. */
static void digest_of(const char *password, size_t size, uint8_t digest[SHA256_SIZE]) {
    struct sha256 sha;
    sha256_begin(&sha);
    sha256_add(&sha, password, size);
    sha256_end(&sha, digest);
}

void net_gate_init(struct net_gate *gate, const char *password) {
    *gate = (struct net_gate){.shut = password != NULL && password[0] != '\0'};
    if (gate->shut)
        digest_of(password, strlen(password), gate->digest);
}

enum net_gate_result net_gate_try(struct net_gate *gate, uint64_t who, uint32_t since_us,
                                  const char *password, size_t size, uint32_t now_us) {
    uint8_t digest[SHA256_SIZE];
    if (!gate->shut)
        return NET_GATE_GOOD;
    if (!lockout_may_try(&gate->lockout, who, since_us, now_us))
        return NET_GATE_WAIT;
    digest_of(password, size, digest);
    bool good = sha256_is_equal(digest, gate->digest);
    lockout_note(&gate->lockout, who, good, now_us);
    return good ? NET_GATE_GOOD : NET_GATE_WRONG;
}
