/* SPDX-License-Identifier: MIT
 * A crowd of strangers at the hub, in virtual time, a round a ms: the owner's stop and stream, who gets a
 * place, and who loses it. */
#include "hub_wires.h"
#include "net_opening.h"
#include "net_places.h"

enum { PLACES = 6, CROWD = 200, OWNER = 0, MS_US = 1000 };
enum { OWNER_ADDRESS = 1, STRANGER = 2, OTHER = 3 };

static void put_in(unsigned n, const char *text) {
    struct wire *wire = &wires[n];
    size_t count = strlen(text);
    if (wire->in_count + count > sizeof wire->in)
        return;
    memcpy(wire->in + wire->in_count, text, count);
    wire->in_count += count;
}

static bool is_here(unsigned n) {
    return hub.client[0].stream.ops != NULL && !wires[n].closed;
}

static void pass_ms(unsigned ms) {
    for (; ms > 0; ms--) {
        clock_us += MS_US;
        round_trip();
        for (unsigned n = 0; n < HUB_WIRES; n++)
            wires[n].out_count = 0; /* all read what they get */
        got_count = got_count < sizeof got / 2 ? got_count : 0;
    }
}

static void own(const char *key) {
    start_hub(key, PLACES);
    CHECK(come_from(OWNER, OWNER_ADDRESS, false));
    if (*key != '\0')
        put_in(OWNER, "$LOGIN=s3cret\n");
    put_in(OWNER, "G0X1\n");
    pass_ms(1);
    CHECK(hub.owner == &hub.client[0]);
}

/* Five packets a ms of 200 connections, of which each that was closed comes again. */
static void crowd_comes(unsigned round) {
    for (unsigned i = 0; i < 5; i++) {
        unsigned n = 1 + (5 * round + i) % CROWD;
        if (round < CROWD / 5 || wires[n].closed)
            (void)come_from(n, n % 2 ? STRANGER : OTHER, false);
        put_in(n, i % 2 ? "?\x18~G0X9\n" : "$LOGIN=x\n$TAKE\n?\n");
    }
}

/* Ten seconds: each line of the owner is there a ms after it was sent, in order, and so is each stop. */
static void a_crowd_holds_up_neither_the_owners_stop_nor_its_stream(void) {
    own("s3cret");
    for (unsigned round = 0; round < 10000; round++) {
        char line[24];
        crowd_comes(round);
        snprintf(line, sizeof line, round % 100 == 99 ? "!" : "G1X%u\n", round);
        put_in(OWNER, line);
        got_count = 0;
        got[0] = '\0';
        clock_us += MS_US;
        round_trip();
        hub.inside = 0; /* it was answered */
        const char *at = strstr(got, line);
        CHECK(at != NULL && strspn(got, "?") == (size_t)(at - got) &&
              at[strlen(line) + strspn(at + strlen(line), "?")] == '\0');
        for (unsigned n = 0; n < HUB_WIRES; n++)
            wires[n].out_count = 0;
    }
    CHECK(hub.owner == &hub.client[0] && !wires[OWNER].closed);
}

static void an_owner_that_has_lost_its_link_comes_back_through_any_crowd(void) {
    for (unsigned open = 0; open < 2; open++) {
        own(open ? "" : "s3cret");
        pass_ms(50);
        wires[OWNER].closed = true;
        for (unsigned round = 0; round < 100; round++) {
            for (unsigned n = 1; n <= CROWD; n++) {
                if (round == 0 || wires[n].closed)
                    (void)come_from(n, STRANGER + n, false); /* each from its own address */
                put_in(n, "?");
            }
            pass_ms(1);
        }
        CHECK(come_from(OWNER, OWNER_ADDRESS, false));
    }
}

/* What a sender that cannot log in relies on; the place of the owner is not for it. */
static void a_trusted_address_comes_in_through_any_crowd(void) {
    own("s3cret");
    CHECK(access_trust(&the_gate, OTHER, ACCESS_DAY));
    for (unsigned n = 1; n < PLACES; n++)
        (void)come_from(n, 100 + n, false);
    CHECK(!come_from(PLACES + 1, 1000, false));
    CHECK(come_from(PLACES + 2, OTHER, false) && !wires[OWNER].closed);
}

/* A person types the key, which takes longer than a program's login. */
static void the_owner_that_came_back_has_time_to_log_in(void) {
    own("s3cret");
    wires[OWNER].closed = true;
    pass_ms(1);
    for (unsigned round = 0; round < 5000; round++) {
        for (unsigned n = 1; n <= CROWD / 10; n++)
            if (round == 0 || wires[n].closed)
                (void)come_from(n, STRANGER + n, false); /* each from its own address */
        if (round == 50)
            CHECK(come_from(OWNER, OWNER_ADDRESS, false));
        pass_ms(1);
        CHECK(round < 50 || !wires[OWNER].closed);
    }
    put_in(OWNER, "$LOGIN=s3cret\nG0X1\n");
    pass_ms(1);
    CHECK(hub.owner != NULL && hub.owner->stream.peer == OWNER_ADDRESS);
}

/* Even those who know the key leave one. */
static void a_place_is_kept_for_the_owners_address(void) {
    own("s3cret");
    for (unsigned n = 1; n < PLACES; n++) {
        CHECK(come_from(n, 10 + n, false));
        put_in(n, "$LOGIN=s3cret\n");
        pass_ms(1);
    }
    wires[OWNER].closed = true;
    pass_ms(1);
    CHECK(!come_from(PLACES, STRANGER, false));
    CHECK(come_from(OWNER, OWNER_ADDRESS, false));
    for (unsigned n = 1; n < PLACES; n++)
        CHECK(!wires[n].closed);
}

static void an_address_has_two_places_until_it_has_proven_anything(void) {
    own("s3cret");
    CHECK(come_from(1, STRANGER, false) && come_from(2, STRANGER, false) && !wires[1].closed);
    CHECK(come_from(3, STRANGER, false) && wires[1].closed && !wires[2].closed);
    put_in(2, "?");
    pass_ms(1);
    CHECK(come_from(4, STRANGER, false) && wires[3].closed && !wires[2].closed); /* the silent one goes */
    CHECK(come_from(5, OTHER, false) && !wires[2].closed && !wires[4].closed);
}

/* Where no one must log in, who has asked once may listen. */
static void a_newcomer_gets_the_place_of_the_one_that_is_idle_longest(void) {
    own("");
    for (unsigned n = 1; n < PLACES; n++) {
        CHECK(come_from(n, 10 + n, false));
        put_in(n, "?");
        pass_ms(2);
    }
    CHECK(!come_from(20, STRANGER, false) && wires[20].closed); /* all are busy */
    pass_ms(8000);
    put_in(1, "?");
    pass_ms(3000);
    CHECK(come_from(21, STRANGER, false));
    CHECK(!wires[OWNER].closed && !wires[1].closed && wires[2].closed && !wires[3].closed);
}

static void the_silent_are_disconnected_and_who_speaks_stays(void) {
    own("");
    CHECK(come_from(1, STRANGER, false) && come_from(2, OTHER, false) && come_from(3, 0, true));
    put_in(2, "?");
    pass_ms(9990);
    CHECK(!wires[1].closed);
    pass_ms(20);
    CHECK(wires[1].closed && strstr(wires[1].out, "[MSG:Disconnected: nothing received for 10 s]") != NULL);
    pass_ms(100000);
    CHECK(!wires[2].closed && !wires[3].closed && !wires[OWNER].closed);
}

static void who_does_not_log_in_goes_in_the_end(void) {
    own("s3cret");
    CHECK(come_from(1, STRANGER, false) && come_from(2, OTHER, false));
    for (unsigned s = 0; s < 120; s++) {
        put_in(2, "?");
        if (s == 0)
            put_in(1, "?");
        pass_ms(1000);
        CHECK(wires[1].closed == (s >= 60) && !wires[2].closed);
    }
}

/* After a start no address is the owner's. Observers that ask for reports all day, one of each address. */
static void who_is_not_logged_in_makes_room_for_another_address(void) {
    start_hub("s3cret", PLACES);
    for (unsigned n = 0; n < PLACES; n++)
        CHECK(come_from(n, 10 + n, false));
    for (unsigned round = 0; round < 150; round++) {
        for (unsigned n = 0; n < PLACES; n++)
            put_in(n, "?");
        pass_ms(200);
        if (round == 120)
            CHECK(!come_from(20, STRANGER, false)); /* each has time to log in */
    }
    CHECK(!come_from(21, 12, false)); /* that has a place */
    CHECK(come_from(22, STRANGER, false));
    unsigned closed = 0;
    for (unsigned n = 0; n < PLACES; n++)
        closed += wires[n].closed;
    CHECK(closed == 1);
    put_in(22, "$LOGIN=s3cret\nG0X1\n");
    pass_ms(1);
    CHECK(hub.owner != NULL && hub.owner->stream.peer == STRANGER);
}

static void a_wire_of_the_machine_always_has_its_place(void) {
    start_hub("", PLACES);
    for (unsigned n = 1; n <= PLACES; n++) {
        CHECK(come_from(n, 10 + n, false));
        put_in(n, "?");
        pass_ms(1);
    }
    CHECK(come_from(OWNER, 0, true));
    CHECK(come_from(7, 0, true) && is_here(OWNER));
}

/* ---- the first bytes ---- */

static enum net_opening_is opens(const char *text, size_t size) {
    enum net_opening_is what = NET_OPENING_MORE;
    for (size_t i = 0; i < size && what == NET_OPENING_MORE; i++)
        what = net_opening_take(text, i, (uint8_t)text[i]);
    return what;
}

static void requests_and_lines_are_told_apart_by_their_first_bytes(void) {
    static const char *const requests[] = {"GET /",      "POST x", "CONNECT a:1", "OPTIONS *", "PRI *",
                                           "x-method /", "get /",  "M-SEARCH *",  "PATCH /",   "BREW_IT /"};
    static const char *const lines[] = {
        "G0",  "$",      "?",     "\n",     "G 0", "T1",  "(GET /)", " GET /", "~",    "X",   "GO\n",
        "G\n", "GETX\n", "GET\n", "/GET /", "%",   "N10", "POST\r",  "\x18",   "\x85", "M 3", "G X1"};
    for (unsigned i = 0; i < sizeof requests / sizeof requests[0]; i++)
        CHECK(opens(requests[i], strlen(requests[i])) == NET_OPENING_HTTP);
    for (unsigned i = 0; i < sizeof lines / sizeof lines[0]; i++)
        CHECK(opens(lines[i], strlen(lines[i])) ==
              (strcmp(lines[i], "X") == 0 ? NET_OPENING_MORE : NET_OPENING_LINES));
    CHECK(opens("\x16", 1) == NET_OPENING_FOREIGN && opens("\0\1", 2) == NET_OPENING_FOREIGN);
    CHECK(opens("\0G", 2) == NET_OPENING_LINES &&
          opens("abcdefghijklmnopqrstuvwxyz", 26) == NET_OPENING_LINES);
}

int main(void) {
    a_crowd_holds_up_neither_the_owners_stop_nor_its_stream();
    an_owner_that_has_lost_its_link_comes_back_through_any_crowd();
    the_owner_that_came_back_has_time_to_log_in();
    a_trusted_address_comes_in_through_any_crowd();
    a_place_is_kept_for_the_owners_address();
    an_address_has_two_places_until_it_has_proven_anything();
    a_newcomer_gets_the_place_of_the_one_that_is_idle_longest();
    the_silent_are_disconnected_and_who_speaks_stays();
    who_does_not_log_in_goes_in_the_end();
    who_is_not_logged_in_makes_room_for_another_address();
    a_wire_of_the_machine_always_has_its_place();
    requests_and_lines_are_told_apart_by_their_first_bytes();
    net_hub_close(&hub);
    return report();
}
