/* SPDX-License-Identifier: MIT */
#include "net_places.h"

#define LISTENER_IDLE_US 10000000u /* one that says less gives its place to anyone */
/* A right key among wrong ones of its address has had its turn by then (base/lockout.h). */
#define LOGIN_TURNS_US 30000000u

enum { KEEPS_ONE_FROM = 3 }; /* with fewer places none is kept */

struct crowd {
    const struct net_place *places;
    size_t count;
    const struct net_newcomer *newcomer;
    uint32_t now_us;
};

static size_t count_of(const struct crowd *crowd, uint64_t peer, enum net_rank least, enum net_rank most) {
    size_t found = 0;
    for (size_t i = 0; i < crowd->count; i++) {
        const struct net_place *place = &crowd->places[i];
        found += place->rank >= least && place->rank <= most &&
                 (place->rank == NET_RANK_FREE || place->peer == peer);
    }
    return found;
}

static size_t places_of(const struct crowd *crowd, uint64_t peer) {
    return count_of(crowd, peer, NET_RANK_UNPROVEN, NET_RANK_STAYS);
}

static uint32_t idle_us(const struct crowd *crowd, const struct net_place *place) {
    return crowd->now_us - place->heard_us;
}

static bool may_go(const struct net_place *place) {
    return place->rank == NET_RANK_UNPROVEN || place->rank == NET_RANK_LISTENER;
}

/* Of an address with so many more places than the newcomer's that it does not have fewer afterwards. */
static bool has_too_many(const struct crowd *crowd, const struct net_place *place) {
    return place->rank == NET_RANK_UNPROVEN &&
           places_of(crowd, place->peer) >= places_of(crowd, crowd->newcomer->peer) + 2;
}

static bool is_idle(const struct crowd *crowd, const struct net_place *place) {
    return (place->rank == NET_RANK_UNPROVEN && idle_us(crowd, place) >= crowd->newcomer->login_us) ||
           (place->rank == NET_RANK_LISTENER && idle_us(crowd, place) >= LISTENER_IDLE_US);
}

/* Who only looks, however busily, does not keep out who may want to log in. */
static bool has_not_logged_in(const struct crowd *crowd, const struct net_place *place) {
    return place->rank == NET_RANK_UNPROVEN && crowd->now_us - place->came_us >= LOGIN_TURNS_US &&
           places_of(crowd, crowd->newcomer->peer) == 0;
}

static bool is_own_unproven(const struct crowd *crowd, const struct net_place *place) {
    return place->rank == NET_RANK_UNPROVEN && place->peer == crowd->newcomer->peer;
}

static bool is_anyone(const struct crowd *crowd, const struct net_place *place) {
    (void)crowd;
    return may_go(place);
}

/* The kept place, with someone of the owner's address in it who may be typing the key. */
static bool is_kept(const struct crowd *crowd, const struct net_place *place) {
    const struct net_newcomer *newcomer = crowd->newcomer;
    return !newcomer->local && newcomer->owner != 0 && place->peer == newcomer->owner &&
           newcomer->peer != newcomer->owner && crowd->count >= KEEPS_ONE_FROM &&
           places_of(crowd, newcomer->owner) == 1;
}

/* The unproven before listeners, then the one that has been idle longest. @return -1: none */
static int find(const struct crowd *crowd,
                bool (*fits)(const struct crowd *crowd, const struct net_place *place)) {
    int found = -1;
    for (size_t i = 0; i < crowd->count; i++) {
        const struct net_place *place = &crowd->places[i], *best = found < 0 ? place : &crowd->places[found];
        bool better = place->rank < best->rank ||
                      (place->rank == best->rank && idle_us(crowd, place) > idle_us(crowd, best));
        if (fits(crowd, place) && !is_kept(crowd, place) && (found < 0 || better))
            found = (int)i;
    }
    return found;
}

static int free_place(const struct crowd *crowd) {
    for (size_t i = 0; i < crowd->count; i++)
        if (crowd->places[i].rank == NET_RANK_FREE)
            return (int)i;
    return -1;
}

/* The last free place is the owner's, unless it has one. */
static bool must_spare(const struct crowd *crowd) {
    const struct net_newcomer *newcomer = crowd->newcomer;
    return newcomer->owner != 0 && newcomer->owner != newcomer->peer && crowd->count >= KEEPS_ONE_FROM &&
           places_of(crowd, newcomer->owner) == 0 && count_of(crowd, 0, NET_RANK_FREE, NET_RANK_FREE) <= 1;
}

int net_places_choose(const struct net_place *places, size_t count, const struct net_newcomer *newcomer,
                      uint32_t now_us) {
    const struct crowd crowd = {.places = places, .count = count, .newcomer = newcomer, .now_us = now_us};
    size_t unproven = count_of(&crowd, newcomer->peer, NET_RANK_UNPROVEN, NET_RANK_UNPROVEN);
    if (!newcomer->local && unproven >= newcomer->unproven)
        return find(&crowd, is_own_unproven);
    int place = newcomer->local || !must_spare(&crowd) ? free_place(&crowd) : -1;
    if (place < 0)
        place = find(&crowd, has_too_many);
    if (place < 0)
        place = find(&crowd, is_idle);
    if (place < 0)
        place = find(&crowd, has_not_logged_in);
    if (place < 0 && (newcomer->local || newcomer->trusted || newcomer->peer == newcomer->owner))
        place = find(&crowd, is_anyone);
    return place;
}
