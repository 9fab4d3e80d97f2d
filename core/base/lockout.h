/* SPDX-License-Identifier: MIT
 * How often a password may be guessed. After a wrong one nothing of the same address is looked at for a
 * second, then for two, four ... 60 s; others are not held up. [task] Pure: no clock, no socket.
 *
 * The table is bounded. Who is wrong while it is full shares one more place with all others that have none,
 * so that many addresses guess LOCKOUT_PLACES + 1 times as fast as one at most: one has some 1500 tries a
 * day. */
#ifndef WIFICNC_BASE_LOCKOUT_H
#define WIFICNC_BASE_LOCKOUT_H

#include <stdbool.h>
#include <stdint.h>

enum { LOCKOUT_PLACES = 8 };

/** Who was wrong; the wait counts from the newest time. */
struct lockout_place {
    uint64_t who;
    uint32_t wait_us; /* 0: a free place */
    uint32_t wrong_us;
};

/** All zero: no one was wrong. */
struct lockout {
    struct lockout_place place[LOCKOUT_PLACES], others;
};

/** @param who  tells addresses apart: lockout_ipv4(), or 64 bits of another kind of address
 *  @param now_us  wraps @return false: it is too soon after a wrong one */
bool lockout_may_try(const struct lockout *lockout, uint64_t who, uint32_t now_us);

/** How a try has ended. */
void lockout_note(struct lockout *lockout, uint64_t who, bool good, uint32_t now_us);

/** Forget who has been quiet for ten minutes. Call it at least every half an hour: the clock wraps. */
void lockout_poll(struct lockout *lockout, uint32_t now_us);

/** @param address  in the network's order; no IPv6 prefix or link-local identifier in use looks like that */
uint64_t lockout_ipv4(const uint8_t address[4]);

#endif
