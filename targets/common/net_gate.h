/* SPDX-License-Identifier: MIT
 * The password of network clients, and how often it may be guessed. [task] Pure: no clock, no socket.
 *
 * Compared are digests, in constant time. After a wrong one nothing is looked at for a second, then for two,
 * four ... 60 s, whoever asks: a guesser has some 1500 tries a day. */
#ifndef WIFICNC_COMMON_NET_GATE_H
#define WIFICNC_COMMON_NET_GATE_H

#include "base/sha256.h"

enum net_gate_result {
    NET_GATE_GOOD,
    NET_GATE_WRONG,
    NET_GATE_WAIT, /* it was not looked at: too soon after a wrong one */
};

struct net_gate {
    bool shut; /* there is a password */
    uint8_t digest[SHA256_SIZE];
    uint32_t wait_us; /* after the last wrong one; 0: none since a good one */
    uint32_t wrong_us;
};

/** @param password  NUL-terminated; "" or NULL: none is asked for */
void net_gate_init(struct net_gate *gate, const char *password);

/** Someone says the password. @param now_us  wraps */
enum net_gate_result net_gate_try(struct net_gate *gate, const char *password, size_t size, uint32_t now_us);

/** For others that check a proof of the password themselves: whether they may now, and how it ended. */
bool net_gate_may_try(const struct net_gate *gate, uint32_t now_us);
void net_gate_tried(struct net_gate *gate, bool good, uint32_t now_us);

#endif
