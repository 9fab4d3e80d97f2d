/* SPDX-License-Identifier: MIT
 * Trusted addresses at the hub of clients: who is let in by them, for how long, and by which hands. */
#include "hub_wires.h"

/* Clients 0 and 3 have one address. */
static void a_trusted_address_needs_no_login_until_that_is_revoked(void) {
    start("s3cret!?");
    CHECK(come(0, false));
    send(0, "$LOGIN=s3cret!?\n$trust=day\n");
    CHECK(strstr(wires[0].out, "trusted for a day") != NULL && got_count == 0);
    CHECK(come(3, false) && come(1, false));
    round_trip();
    CHECK(!hub.client[1].locked && hub.client[2].locked);
    send(3, "$TRUST=no\n");
    CHECK(strstr(wires[3].out, "ok\r\n") != NULL); /* an observer: the hub answers */
    wires[1].closed = true;
    round_trip();
    memset(&wires[1], 0, sizeof wires[1]);
    CHECK(!access_may(&the_gate, 1));
}

static void who_is_trusted_is_listed_and_revoked(void) {
    start("s3cret!?");
    CHECK(access_trust(&the_gate, lockout_ipv4((const uint8_t[4]){192, 168, 1, 20}), ACCESS_ALWAYS));
    CHECK(access_trust(&the_gate, lockout_ipv4((const uint8_t[4]){10, 0, 0, 255}), ACCESS_DAY));
    CHECK(access_trust(&the_gate, 0x20010db800010002u, ACCESS_ALWAYS));
    CHECK(come(0, false) && come(1, true));
    send(0, "$TRUST\n$TRUST=none\n$TRUST=no 1\n"); /* locked */
    CHECK(strstr(wires[0].out, "TRUST:") == NULL);
    send(1, "$trust\n");
    CHECK(strcmp(wires[1].out, "[TRUST:1,192.168.1.20,always]\r\n[TRUST:2,10.0.0.255,86400]\r\n"
                               "[TRUST:3,2001:db8:1:2,always]\r\nok\r\n") == 0);
    send(1, "$TRUST=no 2\n$TRUST=No 9\n$TRUST\n");
    CHECK(strcmp(wires[1].out,
                 "[MSG:That address is not trusted any more]\r\nok\r\n"
                 "[MSG:$TRUST is no, day, always, none, or no and a number]\r\nerror:3\r\n"
                 "[TRUST:1,192.168.1.20,always]\r\n[TRUST:3,2001:db8:1:2,always]\r\nok\r\n") == 0);
    send(1, "$TRUST=none\n$TRUST\n");
    CHECK(strcmp(wires[1].out, "[MSG:No address is trusted any more]\r\nok\r\nok\r\n") == 0 &&
          got_count == 0);
}

/* A stranger that came in by a trusted address does not stay, nor move the machine on; who has logged in
 * does. */
static void revoked_trust_ends_the_connections_that_it_has_let_in(void) {
    start("s3cret!?");
    CHECK(access_trust(&the_gate, 1, ACCESS_DAY)); /* of clients 0 and 3 */
    CHECK(come(0, false) && come(1, false) && come(3, false));
    full = true;
    send(0, "G0X1\nG0X2\n");
    CHECK(hub.owner == &hub.client[0]);
    send(3, "$LOGIN=s3cret!?\n"); /* in already, and it is no proof of the key */
    send(1, "$LOGIN=s3cret!?\n$TRUST=no 1\n");
    CHECK(strstr(wires[1].out, "ok\r\n") != NULL && !wires[1].closed);
    CHECK(strstr(wires[0].out, "[MSG:Disconnected: this address is not trusted any more]") != NULL);
    CHECK(wires[0].closed && wires[3].closed && owners_left == 1 && hub.owner != &hub.client[0]);
    start("s3cret!?"); /* one's own: it has its answer */
    CHECK(access_trust(&the_gate, 1, ACCESS_DAY) && come(0, false));
    send(0, "$TRUST=no\nG0X3\n");
    CHECK(strstr(wires[0].out, "not trusted any more]\r\nok\r\n") != NULL && wires[0].closed);
    CHECK(strstr(got, "X3") == NULL);
    start("s3cret!?"); /* a day is over: no job ends with it */
    CHECK(access_trust(&the_gate, 1, ACCESS_DAY) && come(0, false));
    send(0, "G0X1\n");
    for (unsigned hour = 0; hour < 25 * 2; hour++) {
        clock_us += 1800000000u;
        round_trip();
    }
    send(0, "G0X2\n");
    CHECK(!access_may(&the_gate, 1) && !wires[0].closed && strstr(got, "X2") != NULL);
}

static void wait_s(unsigned s) {
    for (; s > 0; s--) {
        clock_us += 1000000;
        round_trip();
    }
}

/* Clients 0 and 3 have one address. */
static void the_start_button_lets_in_who_has_just_tried_to_command(void) {
    start("s3cret!?");
    CHECK(come(0, false));
    pressed++;
    round_trip();
    CHECK(hub.client[0].locked); /* no client has tried */
    send(0, "G0X1\n");
    wait_s(59);
    CHECK(got_count == 0 && come(3, false));
    wires[0].out_count = 0;
    pressed++;
    round_trip();
    CHECK(strstr(wires[0].out, "[MSG:Let in by the start button]") != NULL && !hub.client[1].locked);
    send(0, "G0X2\n");
    CHECK(strcmp(got, "G0X2\n") == 0 && access_may(&the_gate, 1));
    pressed++; /* it asks for nothing more */
    round_trip();
    CHECK(!access_may(&the_gate, 2));
}

static void who_tries_all_day_has_one_minute_of_the_button(void) {
    start("s3cret!?");
    CHECK(come(0, false));
    for (unsigned n = 0; n < 600; n++) {
        send(0, "G0X1\n");
        wait_s(1);
    }
    pressed++;
    round_trip();
    CHECK(!access_may(&the_gate, 1) && hub.client[0].locked);
    wait_s(60); /* quiet */
    CHECK(come(0, false));
    send(0, "G0X1\n");
    pressed++;
    round_trip();
    CHECK(access_may(&the_gate, 1));
}

static void the_button_lets_in_no_one_of_several(void) {
    start("s3cret!?");
    CHECK(come(0, false) && come(1, false) && come(2, true));
    send(0, "G0X1\n");
    send(1, "G0X1\n");
    wires[2].out_count = 0;
    pressed++;
    round_trip();
    CHECK(!access_may(&the_gate, 1) && !access_may(&the_gate, 2));
    CHECK(strstr(wires[2].out, "several addresses have tried") != NULL);
    wait_s(61);
    CHECK(come(1, false));
    send(1, "G0X1\n"); /* the other one has given up */
    pressed++;
    round_trip();
    CHECK(!access_may(&the_gate, 1) && access_may(&the_gate, 2));
}

static void a_button_without_room_for_more_trust_says_so(void) {
    start("s3cret!?");
    CHECK(come(0, false) && come(2, true));
    for (unsigned n = 0; n < ACCESS_TRUSTED; n++)
        CHECK(access_trust(&the_gate, 100 + n, ACCESS_ALWAYS));
    send(0, "G0X1\n");
    wires[2].out_count = 0;
    pressed++;
    round_trip();
    CHECK(hub.client[0].locked && strstr(wires[2].out, "$TRUST=no") != NULL);
}

/* Who guesses has all addresses of its network, but others in it are not let in. */
static void trust_is_in_an_address_and_guesses_are_of_its_network(void) {
    const uint64_t network = 0x20010db800010002u;
    start_hub("s3cret!?", 4);
    CHECK(come_by(0, network, 0xa1, false) && come_by(1, network, 0xa2, false));
    send(0, "$LOGIN=s3cret!?\n$TRUST=always\n");
    CHECK(strstr(wires[0].out, "are trusted") != NULL && access_may_at(&the_gate, network, 0xa1));
    CHECK(!access_may_at(&the_gate, network, 0xa2) && !access_may(&the_gate, network));
    send(1, "G0X1\n");
    CHECK(strstr(wires[1].out, "error:180") != NULL && hub.client[1].locked && got_count == 0);
    CHECK(come_by(2, network, 0xa1, false) && !hub.client[2].locked);
    send(0, "$TRUST\n");
    CHECK(strcmp(wires[0].out, "[TRUST:1,2001:db8:1:2:0:0:0:a1,always]\r\nok\r\n") == 0);
    send(1, "$LOGIN=wrong\n");
    CHECK(come_by(3, network, 0xa3, false));
    send(3, "$LOGIN=s3cret!?\n"); /* it waits for the turn of its network */
    CHECK(strstr(wires[3].out, "ok") == NULL && hub.client[3].locked);
    clock_us += 5000000;
    round_trip();
    CHECK(!hub.client[3].locked);
}

/* In the network of who has tried that one address is let in; a second one makes it doubtful. */
static void the_button_tells_addresses_of_a_network_apart(void) {
    const uint64_t network = 0x20010db800010002u;
    start_hub("s3cret!?", 4);
    CHECK(come_by(0, network, 1, false) && come_by(1, network, 2, false) && come(2, true));
    send(0, "G0X1\n");
    pressed++;
    round_trip();
    CHECK(!hub.client[0].locked && hub.client[1].locked && !access_may_at(&the_gate, network, 2));
    CHECK(come_by(3, network, 3, false));
    send(1, "G0X1\n");
    send(3, "G0X1\n");
    pressed++;
    round_trip();
    CHECK(hub.client[1].locked && hub.client[3].locked);
}

static void a_link_local_address_is_listed_as_such(void) {
    start("s3cret!?");
    CHECK(access_trust_at(&the_gate, 0x0211223344556677u, 0x0211223344556677u, ACCESS_DAY) && come(1, true));
    send(1, "$TRUST\n");
    CHECK(strcmp(wires[1].out, "[TRUST:1,fe80::211:2233:4455:6677,86400]\r\nok\r\n") == 0);
}

static void a_trust_that_cannot_be_is_refused(void) {
    start("s3cret!?");
    CHECK(come(0, false) && come(1, true));
    send(0, "$LOGIN=s3cret!?\n$TRUST=week\n");
    CHECK(strstr(wires[0].out, "no, day, always") != NULL && strstr(wires[0].out, "error:3") != NULL &&
          got_count == 0);
    CHECK(!access_may(&the_gate, 1));
    send(1, "$TRUST=day\n");
    CHECK(strstr(wires[1].out, "serial port") != NULL && strstr(wires[1].out, "error:3") != NULL);
}

int main(void) {
    a_trusted_address_needs_no_login_until_that_is_revoked();
    who_is_trusted_is_listed_and_revoked();
    revoked_trust_ends_the_connections_that_it_has_let_in();
    the_start_button_lets_in_who_has_just_tried_to_command();
    who_tries_all_day_has_one_minute_of_the_button();
    the_button_lets_in_no_one_of_several();
    a_button_without_room_for_more_trust_says_so();
    a_trust_that_cannot_be_is_refused();
    trust_is_in_an_address_and_guesses_are_of_its_network();
    the_button_tells_addresses_of_a_network_apart();
    a_link_local_address_is_listed_as_such();
    net_hub_close(&hub);
    return report();
}
