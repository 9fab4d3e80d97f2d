/* SPDX-License-Identifier: MIT
 * The access key of network clients: digests against published vectors, guessing slowed down, addresses that
 * are trusted, and what a locked client can do at the hub. */
#include "base/siphash.h"
#include "hub_wires.h"

#include <stdlib.h>

static bool is_hex(const uint8_t digest[SHA256_SIZE], const char *hex) {
    char text[2 * SHA256_SIZE + 1];
    for (unsigned i = 0; i < SHA256_SIZE; i++)
        snprintf(text + 2 * i, 3, "%02x", digest[i]);
    return strcmp(text, hex) == 0;
}

/* FIPS 180-2, appendix B; RFC 4231, cases 2 and 6. */
static void digests_are_the_published_ones(void) {
    uint8_t digest[SHA256_SIZE], key[131];
    struct sha256 sha;
    static const char two_blocks[] = "abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq";
    sha256_begin(&sha);
    sha256_add(&sha, two_blocks, 1); /* in pieces */
    sha256_add(&sha, two_blocks + 1, sizeof two_blocks - 2);
    sha256_end(&sha, digest);
    CHECK(is_hex(digest, "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1"));
    sha256_begin(&sha);
    for (int i = 0; i < 10000; i++)
        sha256_add(&sha,
                   "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa"
                   "aaaaaaaaaaaaaa",
                   100);
    sha256_end(&sha, digest);
    CHECK(is_hex(digest, "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0"));
    static const char what[] = "what do ya want for nothing?";
    sha256_hmac("Jefe", 4, what, sizeof what - 1, digest);
    CHECK(is_hex(digest, "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843"));
    static const char larger[] = "Test Using Larger Than Block-Size Key - Hash Key First";
    memset(key, 0xAA, sizeof key);
    sha256_hmac(key, sizeof key, larger, sizeof larger - 1, digest);
    CHECK(is_hex(digest, "60e431591ee0b67f0d8a26aacbf5b77f8e0bc6213728c5140546040f0ee37f54"));
}

/* RFC 7914, section 11; SipHash-1-3 as tests/wire/test_access.py compares it with Python's own. */
static void derived_digests_are_the_published_ones(void) {
    static const uint8_t key[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
    uint8_t digest[SHA256_SIZE], bytes[63];
    sha256_pbkdf2("passwd", 6, "salt", 4, 1, digest);
    CHECK(is_hex(digest, "55ac046e56e3089fec1691c22544b605f94185216dde0465e68b9d57c20dacbc"));
    sha256_pbkdf2("Password", 8, "NaCl", 4, 80000, digest);
    CHECK(is_hex(digest, "4ddcd8f60b98be21830cee5ef22701f9641a4418d04c0414aeff08876b34ab56"));
    for (unsigned i = 0; i < sizeof bytes; i++)
        bytes[i] = (uint8_t)i;
    CHECK(siphash(key, bytes, 15) == 0xD320D86D2A519956u);
    CHECK(siphash(key, bytes, 0) == 0xABAC0158050FC4DCu);
    CHECK(siphash(key, bytes, 63) == 0x9D199062B7BBB3A8u);
}

/* A try that came at `since_us` asks whether it is its turn. */
static enum access_result ask(struct access *access, uint64_t who, uint32_t since_us, const char *key,
                              uint32_t now_us) {
    access_poll(access, now_us);
    return access_try(access, who, since_us, key, strlen(key));
}

static enum access_result try_as(struct access *access, uint64_t who, const char *key, uint32_t now_us) {
    return ask(access, who, now_us, key, now_us);
}

static enum access_result try_at(struct access *access, const char *key, uint32_t now_us) {
    return try_as(access, 1, key, now_us);
}

/* Of a key without a letter, or of one that is too long, nothing is left to compare. */
static void a_key_that_is_none_lets_no_one_in(void) {
    static const char *const keys[] = {
        "", "---- ---- ----", "0123456789012345678901234567890123456789012345678901234567890123456789"};
    static const uint8_t salt[ACCESS_SALT] = {1};
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++)
        for (size_t k = 0; k < sizeof keys / sizeof keys[0]; k++) {
            struct access access, theirs;
            uint8_t nonce[ACCESS_NONCE], message[16 + ACCESS_NONCE] = "WiFiCNC login", proof[SHA256_SIZE];
            access_init(&access, keys[i], false, salt, 0);
            access_init(&theirs, keys[k], false, salt, 0);
            CHECK(try_as(&access, 1, keys[k], 0) == ACCESS_WRONG);
            access_nonce(&access, 7, nonce);
            memcpy(message + 16, nonce, sizeof nonce);
            sha256_hmac(theirs.secret, SHA256_SIZE, message, sizeof message, proof);
            CHECK(access_answer(&access, 2, 0, 7, proof) == ACCESS_WRONG);
        }
}

enum { ASKS_US = 1000, LONGEST_US = LOCKOUT_LONGEST_S * 1000000 };

/* A try that asks until it is looked at. @return when, us after it came */
static uint32_t turn_of(struct access *gate, uint64_t who, const char *key, bool good, uint32_t since_us) {
    uint32_t now_us = since_us;
    enum access_result result;
    while ((result = ask(gate, who, since_us, key, now_us)) == ACCESS_WAIT)
        now_us += ASKS_US;
    CHECK(result == (good ? ACCESS_GOOD : ACCESS_WRONG));
    return now_us - since_us;
}

static void wrong_tries_become_slower_and_the_right_one_is_late_but_accepted(void) {
    static const uint32_t waits_us[] = {0, 1000000, 2000000, 4000000, 4000000, 4000000};
    struct access gate;
    uint32_t t_us = UINT32_MAX - 500000; /* the clock wraps meanwhile */
    begin(&gate, "correct horse");
    CHECK(!gate.open);
    for (unsigned i = 0; i < sizeof waits_us / sizeof waits_us[0]; i++) {
        uint32_t waited_us = turn_of(&gate, 1, "correct", false, t_us);
        CHECK(waited_us == waits_us[i]);
        t_us += waited_us;
    }
    CHECK(turn_of(&gate, 1, "correct horse", true, t_us) == LONGEST_US);
    t_us += LONGEST_US;
    CHECK(turn_of(&gate, 1, "correct horse", true, t_us) == 0);
}

/* Guessers at the owner's address that try again as soon as they were wrong. The one that has waited longest
 * is the next, so the owner waits for each of them once. */
static void among_many_guessers_at_one_address_the_right_key_has_its_turn(void) {
    enum { GUESSERS = 7 };
    struct access gate;
    uint32_t since_us[GUESSERS], now_us = 0, came_us = 60000000;
    bool good = false;
    begin(&gate, "correct horse");
    memset(since_us, 0, sizeof since_us);
    for (; !good && now_us < 200000000; now_us += ASKS_US) {
        for (unsigned n = 0; n < GUESSERS; n++)
            if (ask(&gate, 1, since_us[n], "wrong", now_us) == ACCESS_WRONG)
                since_us[n] = now_us + 1;
        good = now_us >= came_us && ask(&gate, 1, came_us, "correct horse", now_us) == ACCESS_GOOD;
    }
    CHECK(good && now_us - came_us <= (GUESSERS + 1) * (LONGEST_US + ASKS_US));
}

/* ... and one that has gone while it waited holds no other up for long. */
static void a_try_that_has_gone_is_passed_over(void) {
    struct access gate;
    begin(&gate, "correct horse");
    CHECK(try_at(&gate, "wrong", 0) == ACCESS_WRONG);
    CHECK(ask(&gate, 1, 10, "wrong", 999000) == ACCESS_WAIT);
    CHECK(ask(&gate, 1, 20, "correct horse", 1000000) == ACCESS_WAIT);
    CHECK(ask(&gate, 1, 20, "correct horse", 1600000) == ACCESS_GOOD);
}

static void who_guesses_holds_nobody_else_up(void) {
    struct access gate;
    begin(&gate, "correct horse");
    for (uint64_t who = 1; who <= LOCKOUT_PLACES; who++)
        CHECK(try_as(&gate, who, "wrong", 0) == ACCESS_WRONG);
    CHECK(try_as(&gate, 99, "correct horse", 0) == ACCESS_GOOD);
    CHECK(try_as(&gate, 1, "correct horse", 999999) == ACCESS_WAIT);
    CHECK(try_as(&gate, 1, "correct horse", 2000000) == ACCESS_GOOD);
}

/* One try of each of ever new addresses, all the time: as many as so many single ones have, no more. */
static void many_addresses_gain_no_more_than_the_table_has_places(void) {
    struct access gate;
    uint64_t who = 1;
    unsigned looked_at = 0;
    begin(&gate, "correct horse");
    const uint64_t day_us = 24ull * 3600 * 1000000;
    for (uint64_t t_us = 0; t_us < day_us; t_us += 250000) {
        access_poll(&gate, (uint32_t)t_us);
        looked_at += try_as(&gate, who++, "wrong", (uint32_t)t_us) == ACCESS_WRONG;
    }
    CHECK(looked_at <= (LOCKOUT_PLACES + 1) * 22000);
}

/* ... whatever the moments at which it tries: patient for as long as it takes to be forgotten. */
static void patience_gains_nothing(void) {
    struct access gate;
    unsigned looked_at = 0;
    uint64_t t_us = 0;
    begin(&gate, "correct horse");
    for (unsigned burst = 0; t_us < 24ull * 3600 * 1000000; burst++) {
        for (uint64_t wait_us = 1000000; wait_us <= LONGEST_US; wait_us *= 2, looked_at++) {
            CHECK(try_as(&gate, 1, "wrong", (uint32_t)t_us) == ACCESS_WRONG);
            t_us += wait_us;
        }
        t_us += 600000000;
        access_poll(&gate, (uint32_t)t_us);
    }
    CHECK(looked_at < 1500);
}

static void after_hours_of_quiet_nobody_waits(void) {
    struct access gate;
    begin(&gate, "correct horse");
    CHECK(try_at(&gate, "wrong", 5) == ACCESS_WRONG);
    for (uint64_t t_us = 0; t_us <= 1ull << 32; t_us += 1ull << 29)
        access_poll(&gate, (uint32_t)t_us);
    CHECK(try_at(&gate, "correct horse", 6) == ACCESS_GOOD); /* the clock has wrapped */
}

static void case_dashes_and_spaces_of_a_key_do_not_count(void) {
    struct access gate;
    begin(&gate, "k7qf3-x2m9d-0abcd-efghj");
    CHECK(try_at(&gate, "K7QF3X2M9D 0ABCD EFGHJ", 0) == ACCESS_GOOD);
    CHECK(try_at(&gate, "K7QF3X2M9D 0ABCD EFGH", 0) == ACCESS_WRONG);
}

/* Only where it is trusted. */
static void trust_does_not_run_out_while_its_host_is_in_control(void) {
    const uint64_t minute_us = 60000000u;
    struct access gate;
    begin(&gate, "correct horse");
    access_keep(&gate, 3);
    access_keep(&gate, 0);
    CHECK(!access_may(&gate, 3) && access_trust(&gate, 1, ACCESS_DAY) &&
          access_trust(&gate, 2, ACCESS_ALWAYS));
    for (uint64_t t_us = 0; t_us < 30 * 60 * minute_us; t_us += minute_us) {
        access_poll(&gate, (uint32_t)t_us);
        access_keep(&gate, 1);
        access_keep(&gate, 2);
        CHECK(access_may(&gate, 1));
    }
    for (uint64_t t_us = 30 * 60 * minute_us; t_us < 30 * 60 * minute_us + 11 * minute_us; t_us += minute_us)
        access_poll(&gate, (uint32_t)t_us);
    CHECK(!access_may(&gate, 1) && access_may(&gate, 2));
}

static void an_address_is_trusted_for_a_day_or_always(void) {
    const uint64_t hour_us = 3600ull * 1000000;
    struct access gate;
    begin(&gate, "correct horse");
    CHECK(!access_may(&gate, 1) && !access_may(&gate, 0));
    CHECK(access_trust(&gate, 1, ACCESS_DAY) && access_trust(&gate, 2, ACCESS_ALWAYS));
    for (uint64_t t_us = 0; t_us < 24 * hour_us; t_us += hour_us / 2) {
        access_poll(&gate, (uint32_t)t_us);
        CHECK(access_may(&gate, 1) && access_may(&gate, 2) && !access_may(&gate, 3));
    }
    access_poll(&gate, (uint32_t)(24 * hour_us));
    CHECK(!access_may(&gate, 1) && access_may(&gate, 2));
    CHECK(access_trust(&gate, 2, ACCESS_NOT) && !access_may(&gate, 2));
}

static void when_all_places_are_taken_no_trust_is_lost(void) {
    struct access gate;
    begin(&gate, "correct horse");
    for (uint64_t who = 1; who <= ACCESS_TRUSTED; who++)
        CHECK(access_trust(&gate, who, ACCESS_DAY));
    CHECK(!access_trust(&gate, 99, ACCESS_DAY) && !access_may(&gate, 99));
    CHECK(access_trust(&gate, 7, ACCESS_ALWAYS) && access_may(&gate, 1)); /* it has a place */
    CHECK(access_trust(&gate, 1, ACCESS_NOT) && access_trust(&gate, 99, ACCESS_DAY));
}

static void open_access_asks_for_no_key(void) {
    struct access gate;
    begin(&gate, "");
    CHECK(access_may(&gate, 1) && access_may(&gate, 0));
}

/* ---- at the hub ---- */

static void a_locked_client_can_ask_for_status_hold_and_stop(void) {
    start("s3cret!?");
    CHECK(come(0, false));
    round_trip();
    CHECK(strstr(wires[0].out, "[MSG:Locked") != NULL);
    send(0, "G1X10F100\n~\x18\x9d$X\n$TAKE\n$TRUST=day\n");
    CHECK(got_count == 0 && hub.owner == NULL);
    send(0, "?");
    CHECK(strcmp(got, "?") == 0);
    strcpy(says, "<Idle|MPos:0.000>\r\n[GC:G0]\r\nok\r\n");
    send(0, "");
    CHECK(strcmp(wires[0].out, "<Idle|MPos:0.000>\r\n") == 0);
    net_hub_tell(&hub, "something inside");
    send(0, "");
    CHECK(wires[0].out_count == 0);
    send(0, "!\x85");
    CHECK(strcmp(got, "?!\x85") == 0 && hub.owner == NULL);
}

static void wait_for_the_turn(void) {
    clock_us += 5000000;
    round_trip();
}

/* Senders count answers: one that gets none waits for ever. The message is for the person at it, once for all
 * lines that come together. */
static void each_line_of_a_locked_client_has_one_answer(void) {
    static const char why[] =
        "[MSG:Locked: log in at the web page, by wificnc login, or send $LOGIN=access key]\r\n";
    char wanted[256];
    start("s3cret!?");
    CHECK(come(0, false));
    round_trip();
    send(0, "G0X1\r\n\r\n$$\n?\n$TAKE\r");
    snprintf(wanted, sizeof wanted, "%serror:180\r\nok\r\nerror:180\r\nok\r\nerror:180\r\n", why);
    CHECK(strcmp(wires[0].out, wanted) == 0 && strcmp(got, "?") == 0);
    send(0, "\nG0X2\n"); /* the second half of a line end is no line */
    snprintf(wanted, sizeof wanted, "%serror:180\r\n", why);
    CHECK(strcmp(wires[0].out, wanted) == 0);
    send(0, "$LOGIN=s4cret!?\r\n");
    CHECK(strcmp(wires[0].out, "[MSG:Wrong access key]\r\nerror:180\r\n") == 0);
    wait_for_the_turn();
    send(0, "$LOGIN=s3cret!?\r\n");
    CHECK(strcmp(wires[0].out, "ok\r\n") == 0 && hub.owner == NULL); /* its LF has taken nothing */
}

static void each_line_of_an_observer_has_one_answer(void) {
    start("");
    CHECK(come(0, false) && come(1, false));
    send(0, "G1X10F100\n");
    send(1, "G0X1\r\n\r\n$$\nG0X2\n");
    CHECK(strcmp(wires[1].out, "[MSG:Observer: client is in control, $TAKE takes control]\r\nerror:181\r\n"
                               "ok\r\nerror:181\r\nerror:181\r\n") == 0);
    CHECK(strcmp(got, "G1X10F100\n") == 0);
}

/* It reads, so it stays, however much it sends. */
static void a_flood_of_refused_lines_ends_no_connection_that_reads(void) {
    char flood[500];
    start("s3cret!?");
    CHECK(come(0, false));
    for (unsigned n = 0; n < 40; n++) {
        for (size_t i = 0; i + 1 < sizeof flood; i++)
            flood[i] = i % 2 == 0 ? 'x' : '\n';
        flood[sizeof flood - 1] = '\0';
        send(0, flood);
        while (wires[0].in_count > 0) {
            CHECK(wires[0].out_count <= 1024);
            wires[0].out_count = 0;
            round_trip();
        }
    }
    CHECK(hub.client[0].stream.ops != NULL && got_count == 0);
}

/* Some senders reset whatever they connect to; a second screen's stop holds first. */
static void an_observer_holds_and_behind_that_resets(void) {
    start("");
    CHECK(come(0, false) && come(1, false));
    send(0, "G1X10F100\n");
    send(1, "\x18~$X\n");
    CHECK(strcmp(got, "G1X10F100\n") == 0 && strstr(wires[1].out, "hold first") != NULL);
    send(1, "!");
    CHECK(strcmp(got, "G1X10F100\n!") == 0);
    send(1, "\x18");
    CHECK(strcmp(got, "G1X10F100\n!\x18") == 0 && hub.owner == &hub.client[0]);
}

static void the_key_lets_in_and_may_have_real_time_characters(void) {
    start("s3cret!?");
    CHECK(come(0, false));
    send(0, "$login=s3cret!?\nG0X1\n");
    CHECK(strstr(wires[0].out, "ok\r\n") != NULL && hub.owner == &hub.client[0]);
    CHECK(strcmp(got, "G0X1\n") == 0);
}

static void unhex(const char *text, uint8_t *bytes, size_t count) {
    for (size_t i = 0; i < count; i++) {
        char digits[3] = {text[2 * i], text[2 * i + 1], 0};
        bytes[i] = (uint8_t)strtoul(digits, NULL, 16);
    }
}

/* As a program does it: from what the controller says and the key alone. */
static void prove(unsigned n, const char *key, char line[128]) {
    uint8_t nonce[16], salt[16], secret[SHA256_SIZE], message[32] = "WiFiCNC login", proof[SHA256_SIZE];
    unsigned rounds = 0;
    send(n, "$login\n");
    const char *said = strstr(wires[n].out, "[LOGIN:");
    CHECK(said != NULL && strstr(said, "]\r\nok\r\n") != NULL);
    if (said == NULL)
        return;
    unhex(said + 7, nonce, sizeof nonce);
    unhex(said + 40, salt, sizeof salt);
    CHECK(sscanf(said + 73, "%u]", &rounds) == 1 && rounds == ACCESS_ROUNDS);
    sha256_pbkdf2(key, strlen(key), salt, sizeof salt, rounds, secret);
    memcpy(message + 16, nonce, sizeof nonce);
    sha256_hmac(secret, sizeof secret, message, sizeof message, proof);
    strcpy(line, "$LOGIN=");
    for (unsigned i = 0; i < sizeof proof; i++)
        sprintf(line + 7 + 2 * i, "%02x", proof[i]);
    strcat(line, "\n");
}

static void a_proof_lets_in_without_the_key(void) {
    char line[128] = "";
    start("s3cret!?");
    CHECK(come(0, false));
    prove(0, "s3cret!?", line);
    CHECK(hub.client[0].locked);
    send(0, line);
    CHECK(!hub.client[0].locked && strstr(wires[0].out, "ok\r\n") != NULL && got_count == 0);
    send(0, "$LOGIN\n"); /* in already: nothing to prove */
    CHECK(strcmp(wires[0].out, "ok\r\n") == 0);
    send(0, "G0X1\n");
    CHECK(strcmp(got, "G0X1\n") == 0);
}

static void a_proof_counts_once_and_only_where_it_was_asked(void) {
    char line[128] = "", other[128] = "";
    start("s3cret!?");
    CHECK(come(0, false) && come(1, false));
    prove(1, "s3cret!?", other);
    prove(0, "s3cret!?", line);
    CHECK(strcmp(line, other) != 0);
    send(1, line); /* overheard, before its owner has used it */
    wait_for_the_turn();
    CHECK(hub.client[1].locked && strstr(wires[1].out, "Wrong access key") != NULL);
    send(1, other); /* its own, after a wrong one: the question is spent */
    wait_for_the_turn();
    CHECK(hub.client[1].locked);
    send(0, line);
    CHECK(!hub.client[0].locked && come(2, false));
    send(2, line); /* again, without a question */
    wait_for_the_turn();
    CHECK(hub.client[2].locked);
    prove(2, "s3cret!?", other);
    send(2, line); /* again, to another question */
    wait_for_the_turn();
    CHECK(hub.client[2].locked && got_count == 0);
    prove(2, "s4cret!?", other);
    send(2, other);
    wait_for_the_turn();
    CHECK(hub.client[2].locked);
}

/* Clients 0 and 3 have one address. */
static void a_proof_waits_for_its_turn_and_counts_then(void) {
    char line[128] = "";
    start("s3cret!?");
    CHECK(come(0, false) && come(3, false));
    prove(0, "s3cret!?", line);
    send(3, "$LOGIN=wrong\n");
    send(0, line);
    CHECK(hub.client[0].locked && wires[0].out_count == 0);
    clock_us = 1000000;
    round_trip();
    CHECK(!hub.client[0].locked);
}

/* Clients 0 and 3 have one address. */
static void wrong_keys_slow_down_their_address(void) {
    start("s3cret!?");
    CHECK(come(0, false) && come(1, false) && come(3, false));
    send(0, "$LOGIN=s4cret!?\n");
    CHECK(strstr(wires[0].out, "Wrong access key") != NULL);
    send(3, "$LOGIN=s3cret!?\nG0X3\n");
    CHECK(wires[3].out_count == 0 && hub.client[2].locked);
    send(1, "$LOGIN=s3cret!?\n");
    CHECK(!hub.client[1].locked);
    clock_us = 999999;
    round_trip();
    CHECK(hub.client[2].locked && got_count == 0);
    clock_us = 1000000;
    round_trip();
    CHECK(!hub.client[2].locked && hub.client[0].locked);
    CHECK(strcmp(got, "G0X3\n") == 0); /* what came behind it has waited with it */
}

static void lines_of_any_length_cost_no_memory_before_the_login(void) {
    char flood[500];
    start("s3cret!?");
    CHECK(come(0, false));
    memset(flood, 'x', sizeof flood - 1);
    flood[sizeof flood - 1] = '\0';
    for (int i = 0; i < 100; i++)
        send(0, flood);
    CHECK(hub.client[0].in.count < 100 && got_count == 0);
}

static void a_wire_needs_no_key(void) {
    start("s3cret!?");
    CHECK(come(0, true));
    send(0, "G0X1\n");
    CHECK(strcmp(got, "G0X1\n") == 0);
}

static void locked_clients_make_room(void) {
    start("s3cret!?");
    CHECK(come(0, true) && come(1, false) && come(2, false));
    clock_us = 2000000;
    net_hub_tick(&hub, clock_us);
    CHECK(come(3, false) && wires[1].closed && !wires[0].closed);
    send(2, "$LOGIN=s3cret!?\n");
    send(3, "$LOGIN=s3cret!?\n");
    CHECK(!come(1, false) && wires[1].closed);
}

static void the_owner_is_missed_when_it_has_gone(void) {
    start("");
    CHECK(come(0, false) && come(1, false));
    send(0, "G0X1\n");
    wires[1].closed = true;
    round_trip();
    CHECK(owners_left == 0);
    wires[0].closed = true;
    round_trip();
    CHECK(owners_left == 1 && hub.owner == NULL);
}

/* Client 0 sends what the controller has no room for, and vanishes; client 1 looks on. */
static void lose_lines(void) {
    start("");
    CHECK(come(0, false) && come(1, false));
    full = true;
    send(0, "G0X1\nG0X2\n");
    wires[0].closed = true;
    round_trip();
    CHECK(owners_left == 1 && waited && got_count == 0);
    full = false;
}

static void a_banner(void) {
    strcpy(says, "ALARM:6\r\n\r\nGrbl 1.1h ['$' for help]\r\n");
    wires[1].out_count = 0;
    wires[1].out[0] = '\0';
    net_hub_hear(&hub);
    net_hub_flush(&hub);
}

static void a_reset_of_the_controller_forgets_what_a_lost_sender_has_sent(void) {
    lose_lines();
    a_banner();
    round_trip();
    CHECK(got_count == 0);
    CHECK(strstr(wires[1].out, "[MSG:Queued lines discarded by the reset]") != NULL);
    send(1, "G0X3\n");
    CHECK(strcmp(got, "G0X3\n") == 0);
}

/* Without a reset they wait for the next client's `~`, as what the controller has got. */
static void what_a_lost_sender_has_sent_waits_in_order(void) {
    lose_lines();
    send(1, "G0X3\n");
    round_trip();
    CHECK(strcmp(got, "G0X1\nG0X2\nG0X3\n") == 0);
}

/* As the controller does with what it has got: all before the banner is gone, a file's rest, too. */
static void a_reset_of_the_controller_forgets_what_its_owner_has_sent(void) {
    start("");
    CHECK(come(0, false) && come(1, false));
    full = true;
    send(0, "G0X1\nG0X2\nG0X");
    full = false;
    a_banner();
    round_trip();
    CHECK(got_count == 0);
    CHECK(strstr(wires[0].out, "[MSG:Queued lines discarded by the reset]") != NULL);
    send(0, "9\nG0X4\n");
    CHECK(strcmp(got, "G0X4\n") == 0); /* the rest of a half line is no line */
    a_banner();
    CHECK(strstr(wires[1].out, "discarded by the reset") == NULL); /* nothing waited */
}

int main(void) {
    a_key_that_is_none_lets_no_one_in();
    digests_are_the_published_ones();
    derived_digests_are_the_published_ones();
    wrong_tries_become_slower_and_the_right_one_is_late_but_accepted();
    among_many_guessers_at_one_address_the_right_key_has_its_turn();
    a_try_that_has_gone_is_passed_over();
    who_guesses_holds_nobody_else_up();
    many_addresses_gain_no_more_than_the_table_has_places();
    patience_gains_nothing();
    after_hours_of_quiet_nobody_waits();
    case_dashes_and_spaces_of_a_key_do_not_count();
    an_address_is_trusted_for_a_day_or_always();
    trust_does_not_run_out_while_its_host_is_in_control();
    when_all_places_are_taken_no_trust_is_lost();
    open_access_asks_for_no_key();
    a_locked_client_can_ask_for_status_hold_and_stop();
    each_line_of_a_locked_client_has_one_answer();
    each_line_of_an_observer_has_one_answer();
    a_flood_of_refused_lines_ends_no_connection_that_reads();
    an_observer_holds_and_behind_that_resets();
    the_key_lets_in_and_may_have_real_time_characters();
    a_proof_lets_in_without_the_key();
    a_proof_counts_once_and_only_where_it_was_asked();
    a_proof_waits_for_its_turn_and_counts_then();
    wrong_keys_slow_down_their_address();
    lines_of_any_length_cost_no_memory_before_the_login();
    a_wire_needs_no_key();
    locked_clients_make_room();
    the_owner_is_missed_when_it_has_gone();
    a_reset_of_the_controller_forgets_what_a_lost_sender_has_sent();
    what_a_lost_sender_has_sent_waits_in_order();
    a_reset_of_the_controller_forgets_what_its_owner_has_sent();
    net_hub_close(&hub);
    return report();
}
