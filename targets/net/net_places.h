/* SPDX-License-Identifier: MIT
 * Who gets a place when there are more connections than places, so that no client shuts others out. [task]
 * Pure: no clock, no socket.
 *
 * An address has a bounded number of places for connections that have proven nothing. When all places are
 * taken, a newcomer gets that of a connection that has proven nothing, of an address with at least two more
 * places than its own, or else that of one that has been idle for some time; one without a place that of
 * whoever has not logged in for longer than a login may wait for its turn. One place is kept for the
 * address of the owner, free or with a connection of that address, so that an owner that has lost its link
 * can come back and has the time to log in. */
#ifndef WIFICNC_NET_PLACES_H
#define WIFICNC_NET_PLACES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum net_rank {
    NET_RANK_FREE,     /* no one is there */
    NET_RANK_UNPROVEN, /* said nothing useful yet; where access is locked: is not logged in */
    NET_RANK_LISTENER, /* did, and commands nothing */
    NET_RANK_STAYS,    /* the owner, a sender, who is logged in, a wire of this machine */
};

struct net_place {
    uint64_t peer;     /* net_stream.peer */
    uint32_t heard_us; /* when it last said something useful; wraps */
    uint32_t came_us;  /* when it connected; wraps */
    uint8_t rank;      /* enum net_rank */
};

struct net_newcomer {
    uint64_t peer;
    uint64_t owner;    /* address that a place is kept for; 0: none */
    size_t unproven;   /* places that an address may have for connections that have proven nothing */
    uint32_t login_us; /* a connection that has proven nothing keeps its place for this time */
    bool local;        /* a wire of this machine, which has its place in any case */
    bool trusted;      /* its address may command: one of the others goes for it */
};

/** @return a free place, or that of a connection that must go for the newcomer; -1: the newcomer must go */
int net_places_choose(const struct net_place *places, size_t count, const struct net_newcomer *newcomer,
                      uint32_t now_us);

#endif
