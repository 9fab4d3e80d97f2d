/* SPDX-License-Identifier: MIT */
#include "net_gate.h"

#include <string.h>

enum { FIRST_WAIT_US = 1000000, LONGEST_WAIT_US = 60000000 };

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

bool net_gate_may_try(const struct net_gate *gate, uint32_t now_us) {
    return gate->wait_us == 0 || now_us - gate->wrong_us >= gate->wait_us;
}

void net_gate_tried(struct net_gate *gate, bool good, uint32_t now_us) {
    uint32_t longer_us = gate->wait_us == 0 ? FIRST_WAIT_US : 2 * gate->wait_us;
    gate->wrong_us = now_us;
    gate->wait_us = good ? 0 : longer_us < LONGEST_WAIT_US ? longer_us : LONGEST_WAIT_US;
}

enum net_gate_result net_gate_try(struct net_gate *gate, const char *password, size_t size, uint32_t now_us) {
    uint8_t digest[SHA256_SIZE];
    if (!gate->shut)
        return NET_GATE_GOOD;
    if (!net_gate_may_try(gate, now_us))
        return NET_GATE_WAIT;
    digest_of(password, size, digest);
    bool good = sha256_is_equal(digest, gate->digest);
    net_gate_tried(gate, good, now_us);
    return good ? NET_GATE_GOOD : NET_GATE_WRONG;
}
