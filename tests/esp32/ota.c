/* SPDX-License-Identifier: MIT
 * The receiver of updates, driven through its stream: good and bad uploads in pieces of any size. */
#include "net/ota.h"
#include "check.h"

#include <stdlib.h>
#include <string.h>

enum { IMAGE_SIZE = 200001 };

static struct {
    char in[4096], out[4096];
    size_t in_count, out_count;
    bool closed, ended;
} wire, other; /* of the sender, and of a newcomer */

static uint8_t flash[IMAGE_SIZE], image[IMAGE_SIZE];
static size_t flashed;
static unsigned began, aborted, ended;
static uint8_t signature[SIGNATURE_SIZE];
static const char *begin_says, *write_says, *end_says;

static long wire_read(const struct net_stream *stream, char *bytes, size_t size) {
    (void)stream;
    if (wire.in_count == 0)
        return wire.ended ? NET_ENDED : 0;
    size_t count = wire.in_count < size ? wire.in_count : size;
    memcpy(bytes, wire.in, count);
    memmove(wire.in, wire.in + count, wire.in_count -= count);
    return (long)count;
}

static long wire_write(const struct net_stream *stream, const char *bytes, size_t count) {
    (void)stream;
    memcpy(wire.out + wire.out_count, bytes, count);
    wire.out[wire.out_count += count] = '\0';
    return (long)count;
}

static void wire_close(const struct net_stream *stream) {
    (void)stream;
    wire.closed = true;
}

static long other_read(const struct net_stream *stream, char *bytes, size_t size) {
    (void)stream;
    (void)bytes;
    (void)size;
    return 0;
}

static long other_write(const struct net_stream *stream, const char *bytes, size_t count) {
    (void)stream;
    memcpy(other.out + other.out_count, bytes, count);
    other.out[other.out_count += count] = '\0';
    return (long)count;
}

static void other_close(const struct net_stream *stream) {
    (void)stream;
    other.closed = true;
}

static const char *begin(void *ctx, size_t size) {
    (void)ctx;
    began++;
    return size > IMAGE_SIZE ? "no room" : begin_says;
}

/* The real one is net/signature.c, which test_ota.py has. */
static bool is_signed(void *ctx, const uint8_t digest[SHA256_SIZE], const uint8_t given[SIGNATURE_SIZE]) {
    uint8_t right[SHA256_SIZE];
    struct sha256 sha;
    (void)ctx;
    CHECK(began == 1); /* the machine is locked and at rest meanwhile */
    sha256_begin(&sha);
    sha256_add(&sha, image, IMAGE_SIZE);
    sha256_end(&sha, right);
    return memcmp(digest, right, sizeof right) == 0 && memcmp(given, signature, SIGNATURE_SIZE) == 0;
}

static const char *write_flash(void *ctx, const uint8_t *bytes, size_t count) {
    (void)ctx;
    if (write_says != NULL)
        return write_says;
    memcpy(flash + flashed, bytes, count);
    flashed += count;
    return NULL;
}

static const char *end(void *ctx) {
    (void)ctx;
    ended++;
    return end_says;
}

static void abort_it(void *ctx) {
    (void)ctx;
    aborted++;
}

static struct access access_of;
static const uint8_t salt[ACCESS_SALT] = {5, 6, 7};
static struct ota ota;
static uint32_t now_us;

static void connect_from(uint64_t peer) {
    static const struct net_stream_ops ops = {.read = wire_read, .write = wire_write, .close = wire_close};
    static const uint8_t nonce[OTA_NONCE_SIZE] = {0xDE, 0xAD, 0xBE, 0xEF};
    access_poll(&access_of, now_us);
    memset(&wire, 0, sizeof wire);
    memset(flash, 0, sizeof flash);
    flashed = began = aborted = ended = 0;
    begin_says = write_says = end_says = NULL;
    CHECK(ota_connect(&ota, &(struct net_stream){.ops = &ops, .peer = peer}, nonce, now_us));
    wire.closed = false; /* one before it was */
}

static void connect_again(void) {
    connect_from(0);
}

static void start(void) {
    static const struct ota_ops ops = {
        .begin = begin, .is_signed = is_signed, .write = write_flash, .end = end, .abort = abort_it};
    static const struct ota_image wanted = {
        .board = "esp32s3-devkitc", .chip_id = 9, .project = "wificnc", .digest = "0123456789abcdef"};
    access_init(&access_of, "correct horse", false, salt, now_us);
    ota_init(&ota, &ops, NULL, &wanted, &access_of);
    for (size_t i = 0; i < IMAGE_SIZE; i++)
        image[i] = (uint8_t)(i * 2654435761u >> 13);
    memset(image, 0, OTA_HEADER_SIZE);
    image[0] = 0xE9;
    image[12] = 9;
    memcpy(image + 80, "wificnc", 8);
    for (size_t i = 0; i < SIGNATURE_SIZE; i++)
        signature[i] = (uint8_t)(200 + i);
    connect_again();
}

static void put_hex(char *text, const uint8_t *bytes, size_t count) {
    for (size_t i = 0; i < count; i++)
        snprintf(text + 2 * i, 3, "%02x", bytes[i]);
}

static const char *option = ""; /* a word between signature and MAC */

/* The line of a sender that knows this key. */
static void ask_in_words(const char *key, const char *words) {
    char line[OTA_LINE_SIZE + 32], message[OTA_LINE_SIZE + 64], mac_hex[65];
    uint8_t mac[SHA256_SIZE];
    struct access theirs;
    snprintf(message, sizeof message, "deadbeef000000000000000000000000 %s", words);
    access_init(&theirs, key, false, salt, 0);
    sha256_hmac(theirs.secret, SHA256_SIZE, message, strlen(message), mac);
    put_hex(mac_hex, mac, sizeof mac);
    snprintf(line, sizeof line, "%s %s\n", words, mac_hex);
    wire.in_count = strlen(line);
    memcpy(wire.in, line, wire.in_count);
    (void)ota_poll(&ota, now_us);
}

static void ask_with(const char *key, size_t size, const uint8_t sealed[SIGNATURE_SIZE]) {
    char words[OTA_LINE_SIZE], digest_hex[65], sealed_hex[129];
    uint8_t digest[SHA256_SIZE];
    struct sha256 sha;
    sha256_begin(&sha);
    sha256_add(&sha, image, size <= IMAGE_SIZE ? size : 0);
    sha256_end(&sha, digest);
    put_hex(digest_hex, digest, sizeof digest);
    put_hex(sealed_hex, sealed, SIGNATURE_SIZE);
    snprintf(words, sizeof words, "%zu %s %s%s", size, digest_hex, sealed_hex, option);
    ask_in_words(key, words);
}

static void ask(const char *key, size_t size) {
    ask_with(key, size, signature);
}

static void send_image(size_t size, size_t piece) {
    for (size_t at = 0; at < size && !wire.closed; at += piece) {
        wire.in_count = size - at < piece ? size - at : piece;
        memcpy(wire.in, image + at, wire.in_count);
        while (wire.in_count > 0 && !wire.closed)
            (void)ota_poll(&ota, now_us);
    }
    (void)ota_poll(&ota, now_us);
}

static void a_good_image_arrives_whole_in_pieces_of_any_size(void) {
    static const size_t pieces[] = {1, 111, 112, 113, 1000, 4096};
    for (size_t i = 0; i < sizeof pieces / sizeof pieces[0]; i++) {
        start();
        CHECK(strncmp(wire.out, "WIFICNC-OTA 3 esp32s3-devkitc deadbeef", 38) == 0);
        ask("correct horse", IMAGE_SIZE);
        send_image(IMAGE_SIZE, pieces[i]);
        CHECK(flashed == IMAGE_SIZE && memcmp(flash, image, IMAGE_SIZE) == 0);
        CHECK(ended == 1 && aborted == 0 && wire.closed && ota.done && ota.state == OTA_FREE);
        CHECK(strstr(wire.out, "OK\n") && strstr(wire.out, "AT ") && strstr(wire.out, "DONE\n"));
    }
}

/* As GET api/controller has it (net/page.c), at any place and in pieces of any size. */
static void put_board(size_t at, const char *text) {
    memcpy(image + at, text, strlen(text));
}

static void an_image_for_another_board_of_the_chip_is_refused(void) {
    static const size_t pieces[] = {1, 7, 1000, 4096};
    static const size_t places[] = {OTA_HEADER_SIZE, 5000, IMAGE_SIZE - 60};
    for (size_t i = 0; i < 4 * 3; i++) {
        start();
        put_board(places[i / 4], "\"board\": \""); /* as the one that net/ota.c searches for */
        image[places[i / 4] + 10] = 0;
        put_board(places[i / 4] + 11, "\"board\"board\": \"mks-tinybee\", \"axes");
        ask("correct horse", IMAGE_SIZE);
        send_image(IMAGE_SIZE, pieces[i % 4]);
        CHECK(
            strstr(wire.out,
                   "ERROR this firmware is for the board mks-tinybee, and this board is esp32s3-devkitc\n"));
        CHECK(ended == 0 && aborted == 1 && !ota.done);
    }
}

static void an_image_for_this_board_or_of_no_known_board_is_taken(void) {
    static const char *const boards[] = {"\"board\": \"esp32s3-devkitc\", ", "\"board\": \"%s\"",
                                         "\"board\": \"",
                                         "\"board\": \"esp32s3-devkitc\"\"board\": \"other\""};
    for (size_t i = 0; i < sizeof boards / sizeof boards[0]; i++) {
        start();
        put_board(9000, boards[i]);
        ask("correct horse", IMAGE_SIZE);
        send_image(IMAGE_SIZE, 1000);
        CHECK(ended == 1 && ota.done && flashed == IMAGE_SIZE && memcmp(flash, image, IMAGE_SIZE) == 0);
    }
}

static void another_board_can_be_meant(void) {
    option = " any-board";
    start();
    put_board(9000, "\"board\": \"mks-tinybee\"");
    ask("correct horse", IMAGE_SIZE);
    send_image(IMAGE_SIZE, 1000);
    CHECK(ended == 1 && ota.done && flashed == IMAGE_SIZE);
    start();
    ask("wrong horse", IMAGE_SIZE);
    CHECK(strstr(wire.out, "ERROR wrong access key\n") && began == 0);
    option = " all-boards";
    start();
    ask("correct horse", IMAGE_SIZE);
    CHECK(strstr(wire.out, "ERROR expected SIZE SHA256 SIGNATURE [any-board] MAC") && began == 0);
    option = "";
    start(); /* the word is for one upload */
    put_board(9000, "\"board\": \"mks-tinybee\"");
    ask("correct horse", IMAGE_SIZE);
    send_image(IMAGE_SIZE, 1000);
    CHECK(ended == 0 && !ota.done);
}

static void a_wrong_key_writes_nothing_and_slows_down(void) {
    start();
    ask("wrong horse", IMAGE_SIZE);
    CHECK(strstr(wire.out, "ERROR wrong access key\n") && began == 0 && wire.closed);
    connect_again();
    ask("correct horse", IMAGE_SIZE);
    CHECK(strstr(wire.out, "ERROR") == NULL && strstr(wire.out, "OK") == NULL && began == 0 && !wire.closed);
    now_us += 1000000;
    access_poll(&access_of, now_us);
    (void)ota_poll(&ota, now_us);
    CHECK(strstr(wire.out, "OK\n") && began == 1);
}

/* Who has the access key need not be who builds the firmware: a program on a trusted computer has it, too. */
static void an_image_that_is_not_signed_is_not_written(void) {
    uint8_t forged[SIGNATURE_SIZE];
    start();
    memcpy(forged, signature, sizeof forged);
    forged[63] ^= 1;
    ask_with("correct horse", IMAGE_SIZE, forged);
    CHECK(strstr(wire.out, "ERROR not signed with the key") && strstr(wire.out, "OK") == NULL);
    CHECK(began == 1 && aborted == 1 && flashed == 0 && wire.closed && ota.state == OTA_FREE && !ota.done);
    start();
    image[5000] ^= 1; /* the signature is of the image before */
    memset(forged, 0, sizeof forged);
    ask_with("correct horse", IMAGE_SIZE, forged);
    CHECK(strstr(wire.out, "ERROR not signed") && flashed == 0 && aborted == 1);
}

static void a_proof_for_another_image_is_worth_nothing(void) {
    start();
    ask("correct horse", IMAGE_SIZE);
    image[5000] ^= 1;
    send_image(IMAGE_SIZE, 4096);
    CHECK(strstr(wire.out, "ERROR the received image is damaged") && aborted == 1 && ended == 0 && !ota.done);
}

/* The rest of the image is read, or the sender would lose the reason with it; not for ever. */
static bool ends_after_a_while(void) {
    const bool stays = !wire.closed;
    now_us += OTA_LINGER_US + 1;
    wire.in_count = sizeof wire.in;
    (void)ota_poll(&ota, now_us);
    return stays && wire.closed && ota.state == OTA_FREE && flashed == 0;
}

static void images_for_something_else_are_refused_before_a_byte_is_written(void) {
    static const struct {
        size_t at;
        uint8_t byte;
        const char *said;
    } rows[] = {{0, 0x7F, "not an ESP32 firmware"}, {12, 0, "another chip"}, {80, 'x', "another product"}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        start();
        image[rows[i].at] = rows[i].byte;
        ask("correct horse", IMAGE_SIZE);
        send_image(IMAGE_SIZE, 64);
        CHECK(strstr(wire.out, rows[i].said) && flashed == 0 && aborted == 1 && ends_after_a_while());
    }
}

static void requests_that_are_none_are_refused(void) {
    static const char *const lines[] = {"\n", "GET / HTTP/1.1\n", "12 34 56\n", "99999999999999999999 x y\n",
                                        "-1 a b\n"};
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        start();
        strcpy(wire.in, lines[i]);
        wire.in_count = strlen(lines[i]);
        (void)ota_poll(&ota, now_us);
        CHECK(strstr(wire.out, "ERROR expected") && began == 0 && wire.closed);
    }
    start();
    memset(wire.in, 'a', sizeof wire.in);
    wire.in_count = sizeof wire.in;
    (void)ota_poll(&ota, now_us);
    CHECK(strstr(wire.out, "ERROR expected") && wire.closed);
}

static void the_machines_no_and_the_flashs_no_reach_the_sender(void) {
    start();
    begin_says = "the machine is moving";
    ask("correct horse", IMAGE_SIZE);
    CHECK(strstr(wire.out, "ERROR the machine is moving\n") && aborted == 0 && wire.closed);
    start();
    ask("correct horse", IMAGE_SIZE);
    write_says = "the flash is broken";
    send_image(IMAGE_SIZE, 1000);
    CHECK(strstr(wire.out, "ERROR the flash is broken\n") && aborted == 1 && ends_after_a_while());
    start();
    ask("correct horse", IMAGE_SIZE);
    end_says = "it cannot start";
    send_image(IMAGE_SIZE, 1000);
    CHECK(strstr(wire.out, "ERROR it cannot start\n") && ended == 1 && aborted == 0 && !ota.done);
}

static void a_sender_that_vanishes_or_sleeps_leaves_the_old_firmware(void) {
    start();
    ask("correct horse", IMAGE_SIZE);
    send_image(5000, 1000);
    wire.ended = true;
    (void)ota_poll(&ota, now_us);
    CHECK(aborted == 1 && ota.state == OTA_FREE && !ota.done);
    start();
    ask("correct horse", IMAGE_SIZE);
    (void)ota_poll(&ota, now_us + OTA_IDLE_US);
    CHECK(!wire.closed);
    (void)ota_poll(&ota, now_us + OTA_IDLE_US + 1);
    CHECK(wire.closed && aborted == 1 && ota.state == OTA_FREE);
}

/* @return it has the place */
static bool newcomer(uint64_t peer) {
    static const struct net_stream_ops ops = {.read = other_read, .write = other_write, .close = other_close};
    static const uint8_t nonce[OTA_NONCE_SIZE] = {0};
    memset(&other, 0, sizeof other);
    const bool in = ota_connect(&ota, &(struct net_stream){.ops = &ops, .peer = peer}, nonce, now_us);
    CHECK(in == (strstr(other.out, "WIFICNC-OTA 3 ") != NULL) && in != other.closed);
    return in;
}

static void who_has_proved_the_key_keeps_the_place(void) {
    start();
    ask("correct horse", IMAGE_SIZE);
    send_image(5000, 1000);
    CHECK(!newcomer(2) && strstr(other.out, "ERROR another upload is in progress\n") && !wire.closed);
    access_trust(&access_of, 2, ACCESS_DAY);
    CHECK(!newcomer(2) && aborted == 0 && !wire.closed);
}

/* Bytes now and then do not prolong it, whatever they are, and whether the line ends or not. */
static void a_proof_comes_within_ten_seconds(void) {
    static const uint32_t gaps_us[] = {1000000, 4900000, 8000000, 9900000};
    for (size_t i = 0; i < sizeof gaps_us / sizeof gaps_us[0]; i++) {
        start();
        uint32_t passed_us = 0;
        for (; !wire.closed && passed_us < 4 * OTA_PROOF_US; passed_us += gaps_us[i]) {
            now_us += gaps_us[i];
            wire.in[0] = '1';
            wire.in_count = 1;
            (void)ota_poll(&ota, now_us);
        }
        CHECK(wire.closed && passed_us <= OTA_PROOF_US + gaps_us[i] && ota.state == OTA_FREE && began == 0);
    }
    start();
    now_us += OTA_PROOF_US;
    ask("correct horse", IMAGE_SIZE); /* in time; what follows has its own patience */
    CHECK(strstr(wire.out, "OK\n"));
    now_us += OTA_IDLE_US;
    (void)ota_poll(&ota, now_us);
    CHECK(!wire.closed);
}

static void a_newcomer_displaces_who_has_not_proved_the_key(void) {
    static const char *const lines[] = {"", "1", "1 2 3\n"}; /* silent, in a line, refused */
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        start();
        wire.in_count = strlen(lines[i]);
        memcpy(wire.in, lines[i], wire.in_count);
        (void)ota_poll(&ota, now_us);
        CHECK(newcomer(2) && wire.closed && began == 0);
    }
    start();
    CHECK(newcomer(2) && strstr(wire.out, "ERROR another sender has connected"));
}

/* One address that connects again and again keeps no one else out. */
static void who_left_without_a_proof_displaces_no_one(void) {
    start(); /* a stranger */
    ota.stream.peer = 7;
    connect_from(2);
    for (int i = 0; i < 100; i++)
        CHECK(!newcomer(7) && !wire.closed);
    ask("correct horse", IMAGE_SIZE);
    CHECK(strstr(wire.out, "OK\n"));
    start(); /* the stranger comes when the place is taken, and stays */
    connect_from(2);
    CHECK(newcomer(7) && wire.closed);
    CHECK(!newcomer(2)); /* for ten seconds */
    now_us += OTA_PROOF_US + 1;
    (void)ota_poll(&ota, now_us);
    CHECK(other.closed && newcomer(7));
    connect_from(2);
    CHECK(other.closed && !newcomer(7) && !wire.closed);
}

static void a_trusted_address_precedes_others(void) {
    start();
    access_trust(&access_of, 2, ACCESS_DAY);
    ota.left = 2;
    CHECK(newcomer(2) && wire.closed);
    for (uint64_t peer = 10; peer < 20; peer++)
        CHECK(!newcomer(peer));
}

/* Without an image: who has sent one confirms it. */
static void the_firmware_that_runs_is_reached_by_a_proof(void) {
    start();
    CHECK(strstr(wire.out, " 0123456789abcdef kept\n") && !ota.reached);
    ask_in_words("wrong horse", "confirm");
    CHECK(strstr(wire.out, "ERROR wrong access key\n") && !ota.reached && wire.closed);
    start();
    ota.on_trial = true;
    connect_again();
    CHECK(strstr(wire.out, " 0123456789abcdef trial\n"));
    ask_in_words("correct horse", "confirm");
    CHECK(strstr(wire.out, "OK\n") && ota.reached && wire.closed && began == 0 && !ota.done);
    start();
    ask_in_words("correct horse", "confirm 12");
    CHECK(strstr(wire.out, "ERROR expected") && !ota.reached && began == 0);
}

/* What answers until the restart is the old firmware. */
static void no_one_is_let_in_before_the_restart(void) {
    start();
    ask("correct horse", IMAGE_SIZE);
    send_image(IMAGE_SIZE, 4096);
    CHECK(ota.done && !newcomer(2));
    CHECK(strcmp(other.out, "ERROR the controller is about to restart with a new firmware\n") == 0);
}

int main(void) {
    a_good_image_arrives_whole_in_pieces_of_any_size();
    an_image_for_another_board_of_the_chip_is_refused();
    an_image_for_this_board_or_of_no_known_board_is_taken();
    another_board_can_be_meant();
    a_wrong_key_writes_nothing_and_slows_down();
    an_image_that_is_not_signed_is_not_written();
    a_proof_for_another_image_is_worth_nothing();
    images_for_something_else_are_refused_before_a_byte_is_written();
    requests_that_are_none_are_refused();
    the_machines_no_and_the_flashs_no_reach_the_sender();
    a_sender_that_vanishes_or_sleeps_leaves_the_old_firmware();
    who_has_proved_the_key_keeps_the_place();
    a_proof_comes_within_ten_seconds();
    a_newcomer_displaces_who_has_not_proved_the_key();
    who_left_without_a_proof_displaces_no_one();
    a_trusted_address_precedes_others();
    the_firmware_that_runs_is_reached_by_a_proof();
    no_one_is_let_in_before_the_restart();
    return report();
}
