/* SPDX-License-Identifier: MIT */
#include "base/lockout.h"

#include <stddef.h>

#define FIRST_WAIT_US   1000000u
#define LONGEST_WAIT_US 60000000u
#define FORGET_US 600000000u /* longer than what guessing slower would gain by a wait of a second again */

static const struct lockout_place *place_of(const struct lockout *lockout, uint64_t who) {
    const struct lockout_place *found = NULL;
    for (unsigned i = 0; i < LOCKOUT_PLACES; i++) {
        const struct lockout_place *place = &lockout->place[i];
        if (place->wait_us != 0 && place->who == who)
            return place;
        if (place->wait_us == 0 && found == NULL)
            found = place;
    }
    return found != NULL ? found : &lockout->others;
}

bool lockout_may_try(const struct lockout *lockout, uint64_t who, uint32_t now_us) {
    const struct lockout_place *place = place_of(lockout, who);
    return now_us - place->wrong_us >= place->wait_us;
}

void lockout_note(struct lockout *lockout, uint64_t who, bool good, uint32_t now_us) {
    struct lockout_place *place = (struct lockout_place *)place_of(lockout, who);
    uint32_t longer_us = place->wait_us == 0 ? FIRST_WAIT_US : 2 * place->wait_us;
    if (good && place == &lockout->others)
        return; /* others were wrong there, too */
    *place = (struct lockout_place){.who = who,
                                    .wrong_us = now_us,
                                    .wait_us = good                          ? 0
                                               : longer_us < LONGEST_WAIT_US ? longer_us
                                                                             : LONGEST_WAIT_US};
}

static void forget(struct lockout_place *place, uint32_t now_us) {
    if (now_us - place->wrong_us >= FORGET_US)
        place->wait_us = 0;
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
