/* SPDX-License-Identifier: MIT
 * `$QR` at the hub of clients: the page's address, with the key for a cable only. */
#include "hub_wires.h"

#include <stdio.h>

static const char *page_address = "http://192.168.4.7/";
static const char *stored_key = "k7qf3-x2m9d-0abcd-efghj";

static bool page(void *ctx, char *text, size_t size) {
    (void)ctx;
    snprintf(text, size, "%s", page_address);
    return page_address[0] != '\0';
}

static const char *key(void *ctx) {
    (void)ctx;
    return stored_key;
}

static void start_with_page(void) {
    static struct net_hub_ops ops;
    start(stored_key);
    ops = *hub.ops;
    ops.page = page;
    ops.key = key;
    hub.ops = &ops;
}

/* By cable; the messages of its connection have been read. */
static void come_by_cable(void) {
    CHECK(come(0, true));
    round_trip();
}

/* A message, then ok: nothing else. */
static bool shows(unsigned n, const char *link) {
    char expected[sizeof wires[0].out];
    snprintf(expected, sizeof expected, "[MSG:%s]\r\nok\r\n", link);
    return strcmp(wires[n].out, expected) == 0;
}

static void a_cable_gets_the_address_and_the_key(void) {
    start_with_page();
    come_by_cable();
    send(0, "$QR\n");
    CHECK(shows(0, "http://192.168.4.7/#key=k7qf3-x2m9d-0abcd-efghj"));
    CHECK(got_count == 0);
    stored_key = "m\xC3\xBChle & 12#?34";
    start_with_page();
    come_by_cable();
    send(0, "$qr\n");
    CHECK(shows(0, "http://192.168.4.7/#key=m%C3%BChle%20%26%2012%23%3F34"));
}

static void a_key_that_finds_no_room_is_left_out(void) {
    stored_key = "################################################################";
    start_with_page();
    come_by_cable();
    send(0, "$QR\n");
    CHECK(shows(0, "http://192.168.4.7/"));
    stored_key = "k7qf3-x2m9d-0abcd-efghj";
}

static void a_network_client_gets_the_address_alone(void) {
    start_with_page();
    CHECK(come(0, false) && come(1, false) && access_trust(&the_gate, 3, ACCESS_DAY) && come(2, false));
    send(0, "$LOGIN=k7qf3-x2m9d-0abcd-efghj\n");
    send(0, "$QR\n");
    CHECK(shows(0, "http://192.168.4.7/"));
    send(2, "$QR\n"); /* an observer */
    CHECK(shows(2, "http://192.168.4.7/"));
    send(1, "$QR\n"); /* not logged in */
    CHECK(strstr(wires[1].out, "error:") != NULL && strstr(wires[1].out, "http") == NULL);
}

/* Where access is open a key means nothing. */
static void open_access_has_no_key(void) {
    static struct net_hub_ops ops;
    start("");
    ops = *hub.ops;
    ops.page = page;
    ops.key = key;
    hub.ops = &ops;
    come_by_cable();
    send(0, "$QR\n");
    CHECK(shows(0, "http://192.168.4.7/"));
}

static void without_a_network_it_is_refused(void) {
    page_address = "";
    start_with_page();
    come_by_cable();
    send(0, "$QR\n");
    CHECK(strcmp(wires[0].out, "[MSG:No network: the page has no address yet]\r\nerror:3\r\n") == 0);
    start(""); /* no page at all: a line like any other */
    come_by_cable();
    send(0, "$QR\n");
    CHECK(strcmp(got, "$QR\n") == 0);
    page_address = "http://192.168.4.7/";
}

/* Lines of a job are answered once each, in order, whatever lies between. */
static void lines_around_it_keep_their_answers(void) {
    start_with_page();
    come_by_cable();
    send(0, "G0X1\n$QR\nG0X2\n");
    CHECK(strcmp(got, "G0X1\n") == 0 && wires[0].out_count == 0);
    strcpy(says, "error:22\r\n");
    round_trip();
    round_trip();
    CHECK(strncmp(wires[0].out, "error:22\r\n[MSG:", 15) == 0);
    CHECK(strcmp(got, "G0X1\nG0X2\n") == 0);
}

int main(void) {
    a_cable_gets_the_address_and_the_key();
    a_key_that_finds_no_room_is_left_out();
    a_network_client_gets_the_address_alone();
    open_access_has_no_key();
    without_a_network_it_is_refused();
    lines_around_it_keep_their_answers();
    net_hub_close(&hub);
    return report();
}
