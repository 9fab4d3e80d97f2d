/* SPDX-License-Identifier: MIT
 * How often a key may be guessed: tries wait for their turn, and none is refused unseen. After a wrong one
 * the next of the same address is looked at a second later, then two, then four; others are not held up. Of
 * the tries that wait at one address the oldest is the next, so a right key among any number of wrong ones is
 * accepted after LOCKOUT_LONGEST_S for each that came before it. [task] Pure: no clock, no socket.
 *
 * A connection has one try at a time, so what waits is as bounded as connections are. The table is bounded,
 * too: who is wrong while it is full shares one more place with all others that have none, so that many
 * addresses guess LOCKOUT_PLACES + 1 times as fast as one at most: one has some 22,000 tries a day. */
#ifndef WIFICNC_BASE_LOCKOUT_H
#define WIFICNC_BASE_LOCKOUT_H

#include <stdbool.h>
#include <stdint.h>

enum { LOCKOUT_PLACES = 5, LOCKOUT_LONGEST_S = 4 };

/** Who was wrong, and whose turn is next there. */
struct lockout_place {
    uint64_t who;
    uint32_t wrong_us;
    uint32_t oldest_us; /* when the try came that is the next */
    uint32_t asked_us;  /* when it last asked; one that does not ask has gone */
    uint8_t wait_s;     /* behind a wrong one; 0: a free place */
    bool claimed;       /* there is such a try */
};

/** All zero: no one was wrong. */
struct lockout {
    struct lockout_place place[LOCKOUT_PLACES], others;
};

/** Whether it is a try's turn: look at it then, and call lockout_note(). Else ask again, every 100 ms or so.
 *  @param who  tells addresses apart: lockout_ipv4(), or 64 bits of another kind of address: of IPv6 its
 * network
 *  @param since_us  when the try came, the same each time it asks  @param now_us  wraps, as all of them */
bool lockout_may_try(struct lockout *lockout, uint64_t who, uint32_t since_us, uint32_t now_us);

/** How a try has ended. */
void lockout_note(struct lockout *lockout, uint64_t who, bool good, uint32_t now_us);

/** Forget who has been quiet for ten minutes. Call it at least every half an hour: the clock wraps. */
void lockout_poll(struct lockout *lockout, uint32_t now_us);

/** @param address  in the network's order; no IPv6 prefix or link-local identifier in use looks like that */
uint64_t lockout_ipv4(const uint8_t address[4]);

#endif
