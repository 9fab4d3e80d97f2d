/* SPDX-License-Identifier: MIT */
#include "base/lockout.h"

#include <stddef.h>

enum { FIRST_WAIT_S = 1, US_PER_S = 1000000 };

#define ASKS_EVERY_US 500000u /* at least; who does not has gone */
#define FORGET_US     600000000u

static struct lockout_place *place_of(struct lockout *lockout, uint64_t who) {
    struct lockout_place *found = NULL;
    for (unsigned i = 0; i < LOCKOUT_PLACES; i++) {
        struct lockout_place *place = &lockout->place[i];
        if (place->wait_s != 0 && place->who == who)
            return place;
        if (place->wait_s == 0 && found == NULL)
            found = place;
    }
    return found != NULL ? found : &lockout->others;
}

/* Whether this try is the oldest that waits here. Those of the same moment are one another's equals. */
static bool is_next(struct lockout_place *place, uint32_t since_us, uint32_t now_us) {
    bool others_is_there = place->claimed && now_us - place->asked_us < ASKS_EVERY_US;
    if (others_is_there && now_us - place->oldest_us > now_us - since_us)
        return false;
    place->claimed = true;
    place->oldest_us = since_us;
    place->asked_us = now_us;
    return true;
}

bool lockout_may_try(struct lockout *lockout, uint64_t who, uint32_t since_us, uint32_t now_us) {
    struct lockout_place *place = place_of(lockout, who);
    return place->wait_s == 0 || (is_next(place, since_us, now_us) &&
                                  now_us - place->wrong_us >= (uint32_t)place->wait_s * US_PER_S);
}

/* A right one leaves the wait as it is: its address may be that of a guesser, too. */
void lockout_note(struct lockout *lockout, uint64_t who, bool good, uint32_t now_us) {
    struct lockout_place *place = place_of(lockout, who);
    int longer_s = place->wait_s == 0 ? FIRST_WAIT_S : 2 * place->wait_s;
    place->claimed = false;
    if (good)
        return;
    place->who = who;
    place->wrong_us = now_us;
    place->wait_s = (uint8_t)(longer_s < LOCKOUT_LONGEST_S ? longer_s : LOCKOUT_LONGEST_S);
}

static void forget(struct lockout_place *place, uint32_t now_us) {
    if (now_us - place->wrong_us >= FORGET_US)
        place->wait_s = 0;
}

void lockout_poll(struct lockout *lockout, uint32_t now_us) {
    for (unsigned i = 0; i < LOCKOUT_PLACES; i++)
        forget(&lockout->place[i], now_us);
    forget(&lockout->others, now_us);
}

uint64_t lockout_ipv4(const uint8_t address[4]) {
    return 0x0000FFFF00000000u | (uint64_t)address[0] << 24 | (uint64_t)address[1] << 16 |
           (uint64_t)address[2] << 8 | address[3];
}
