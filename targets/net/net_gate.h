/* SPDX-License-Identifier: MIT
 * The password of network clients, and how often it may be guessed (base/lockout.h). [task] Pure: no clock,
 * no socket. Compared are digests, in constant time. */
#ifndef WIFICNC_NET_GATE_H
#define WIFICNC_NET_GATE_H

#include "base/lockout.h"
#include "base/sha256.h"

enum net_gate_result {
    NET_GATE_GOOD,
    NET_GATE_WRONG,
    NET_GATE_WAIT, /* it was not looked at, because it is not its turn: try it again, with the same since_us
                    */
};

struct net_gate {
    bool shut; /* there is a password */
    uint8_t digest[SHA256_SIZE];
    struct lockout lockout;
};

/** @param password  NUL-terminated; "" or NULL: none is asked for */
void net_gate_init(struct net_gate *gate, const char *password);

/** Someone says the password. @param who  net_stream.peer @param since_us  when it came @param now_us  wraps
 */
enum net_gate_result net_gate_try(struct net_gate *gate, uint64_t who, uint32_t since_us,
                                  const char *password, size_t size, uint32_t now_us);

#endif
