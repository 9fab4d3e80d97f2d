/* SPDX-License-Identifier: MIT
 * Automatic status reports at the hub, in virtual time: each client has its own, whether it commands, watches
 * or is locked out; none is flooded; a reset and the end of a connection end them. */
#include "hub_wires.h"

enum { OWNER, WATCHER, STRANGER, MS_US = 1000 };

/* A controller that answers `?` as it comes. */
static unsigned asked_of_controller(void) {
    unsigned count = 0;
    for (size_t i = 0; i < got_count; i++)
        count += got[i] == '?' || (uint8_t)got[i] == 0x87;
    got_count = 0;
    return count;
}

static void pass_ms(unsigned ms) {
    for (; ms > 0; ms--) {
        clock_us += MS_US;
        round_trip();
        if (asked_of_controller() > 0) {
            strcpy(says, "<Idle>\r\n");
            round_trip();
        }
    }
}

/* The controller answers all lines that it has. */
static void answer_all(void) {
    while (hub.inside > 0) {
        strcpy(says, "ok\r\n");
        round_trip();
    }
    got_count = 0;
}

static unsigned reports_at(unsigned n) {
    unsigned count = 0;
    for (const char *at = wires[n].out; (at = strstr(at, "<Idle>")) != NULL; at++)
        count++;
    wires[n].out_count = 0;
    wires[n].out[0] = '\0';
    return count;
}

static void begin_with(const char *key) {
    start(key);
    CHECK(come(OWNER, true) && come(WATCHER, true) && come(STRANGER, false));
    send(OWNER, "G0X1\n");
    for (unsigned n = 0; n < 3; n++)
        (void)reports_at(n);
    got_count = 0;
}

static void each_client_has_its_own_interval(void) {
    begin_with("");
    send(OWNER, "$RI=100\n");
    send(WATCHER, "$ri = 500\r\n");
    CHECK(strcmp(wires[WATCHER].out, "ok\r\n") == 0);
    CHECK(strcmp(got, "\n") == 0); /* the controller learns nothing of it, and answers the owner's */
    pass_ms(2000);
    CHECK(reports_at(OWNER) == 20);
    CHECK(reports_at(WATCHER) == 4);
    CHECK(reports_at(STRANGER) == 0);
    send(OWNER, "$RI=0\n");
    pass_ms(1000);
    CHECK(reports_at(OWNER) == 0);
    CHECK(reports_at(WATCHER) == 2);
}

static void a_request_is_answered_to_all_as_ever(void) {
    begin_with("");
    send(OWNER, "$RI=1000\n");
    send(WATCHER, "?");
    pass_ms(1);
    for (unsigned n = 0; n < 3; n++)
        CHECK(reports_at(n) == 1);
    send(STRANGER, "\x87");
    round_trip();
    CHECK(got_count == 1 && (uint8_t)got[0] == 0x87); /* an observer's full report is a full one */
}

/* The answers of a sender that counts them would change places else. */
static void the_owners_is_answered_in_its_turn(void) {
    begin_with("");
    answer_all();
    full = true;
    send(OWNER, "G1X2\n\x11 $ri=100\nG1X3\n$RI=20\n");
    CHECK(wires[OWNER].out_count == 0 && got_count == 0);
    full = false;
    round_trip();
    CHECK(strcmp(got, "G1X2\n\nG1X3\n$RI=20\n") == 0);
    answer_all();
    pass_ms(1000);
    CHECK(reports_at(OWNER) == 10);
}

static void what_is_no_interval_is_refused_and_changes_nothing(void) {
    static const char *const wrong[] = {"$RI=20\n",  "$RI=60001\n", "$RI=99999999999\n",
                                        "$RI=1e3\n", "$RI=\n",      "$RI=-1\n"};
    begin_with("");
    send(OWNER, "$RI=100\n");
    send(WATCHER, "$RI=200\n");
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        answer_all();
        send(OWNER, wrong[i]);
        CHECK(strcmp(got, wrong[i]) == 0); /* the controller refuses it */
        send(WATCHER, wrong[i]);
        CHECK(strstr(wires[WATCHER].out, "error:") != NULL);
    }
    got_count = 0;
    for (unsigned n = 0; n < 2; n++)
        (void)reports_at(n);
    pass_ms(1000);
    CHECK(reports_at(OWNER) == 10 && reports_at(WATCHER) == 5);
}

static void a_byte_turns_them_off_and_on_as_they_were(void) {
    begin_with("");
    send(WATCHER, "$RI=100\n");
    send(WATCHER, "\x8c");
    pass_ms(1000);
    CHECK(reports_at(WATCHER) == 0);
    send(WATCHER, "\x8c");
    pass_ms(1000);
    CHECK(reports_at(WATCHER) == 10);
    send(OWNER, "\x8c"); /* no interval was set */
    pass_ms(1000);
    CHECK(reports_at(OWNER) == 0);
}

static void a_locked_client_may_have_them(void) {
    begin_with("s3cret");
    send(STRANGER, "$RI=100\n");
    CHECK(strcmp(wires[STRANGER].out, "ok\r\n") == 0);
    pass_ms(1000);
    CHECK(reports_at(STRANGER) == 10);
    send(STRANGER, "\x8c");
    pass_ms(1000);
    CHECK(reports_at(STRANGER) == 0);
    send(STRANGER, "G0X1\n");
    CHECK(strstr(wires[STRANGER].out, "error:180") != NULL);
    CHECK(hub.owner == &hub.client[OWNER]);
}

static void a_reset_ends_them(void) {
    begin_with("");
    send(OWNER, "$RI=100\n");
    send(WATCHER, "$RI=100\n");
    strcpy(says, "\r\nGrbl 1.1h ['$' for help]\r\n");
    round_trip();
    (void)reports_at(OWNER);
    pass_ms(1000);
    CHECK(reports_at(OWNER) == 0 && reports_at(WATCHER) == 0);
}

static void the_end_of_a_connection_ends_them(void) {
    begin_with("");
    send(WATCHER, "$RI=100\n");
    wires[WATCHER].closed = true;
    pass_ms(1);
    CHECK(come(WATCHER, true));
    (void)reports_at(WATCHER);
    pass_ms(1000);
    CHECK(reports_at(WATCHER) == 0);
}

/* It reads nothing for a minute, is not disconnected for it, and has few reports to read afterwards. */
static void a_client_that_does_not_read_is_not_flooded(void) {
    begin_with("");
    send(WATCHER, "$RI=50\n");
    stuck = &wires[WATCHER];
    pass_ms(60000);
    CHECK(hub.client[WATCHER].out.count < 2 * NET_LINE_SIZE + sizeof "<Idle>\r\n");
    CHECK(!wires[WATCHER].closed);
    stuck = NULL;
    pass_ms(1);
    CHECK(reports_at(WATCHER) > 0);
    pass_ms(1000);
    CHECK(reports_at(WATCHER) == 20);
}

/* The controller answers `?` after homing only. */
static void reports_that_come_late_are_one(void) {
    begin_with("");
    send(WATCHER, "$RI=100\n");
    (void)reports_at(WATCHER);
    for (unsigned ms = 0; ms < 5000; ms++) {
        clock_us += MS_US;
        round_trip();
        got_count = 0;
    }
    strcpy(says, "<Idle>\r\n");
    round_trip();
    CHECK(reports_at(WATCHER) == 1 && reports_at(OWNER) == 0);
}

int main(void) {
    each_client_has_its_own_interval();
    a_request_is_answered_to_all_as_ever();
    the_owners_is_answered_in_its_turn();
    what_is_no_interval_is_refused_and_changes_nothing();
    a_byte_turns_them_off_and_on_as_they_were();
    a_locked_client_may_have_them();
    a_reset_ends_them();
    the_end_of_a_connection_ends_them();
    a_client_that_does_not_read_is_not_flooded();
    reports_that_come_late_are_one();
    net_hub_close(&hub);
    return report();
}
