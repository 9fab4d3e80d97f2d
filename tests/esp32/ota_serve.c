/* SPDX-License-Identifier: MIT
 * The receiver of updates over a real socket of this computer: says its port on stdout, writes what it takes
 * to a file, and ends when stdin is closed. Usage: ota_serve PASSWORD FILE CHIP_ID [FATE]
 *
 * A complete update restarts it. FATE is what becomes of the new firmware: "kept" confirms it once it is
 * reached; "trial" never does; "old" is a power cut before it runs, "crash" one after it was reached; after
 * "gone" nothing answers. */
#include "net/ota.h"
#include "net_tcp.h"
#include "signing_key.h"

#include <fcntl.h>
#include <netinet/in.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { DIGEST_AT = 176 };

static FILE *file;
static const char *path, *fate = "kept";
static struct ota ota;
static struct access access_of;
static char running[OTA_DIGEST_DIGITS + 1] = "0ld0ld0ld0ld0ld0";
static struct ota_image image = {.board = "esp32s3-zero", .project = "wificnc", .digest = running};
static bool runs_new;

static const char *begin(void *ctx, size_t size) {
    (void)ctx;
    (void)size;
    file = fopen(path, "wb");
    return file != NULL ? NULL : "no file";
}

static bool is_signed(void *ctx, const uint8_t digest[SHA256_SIZE], const uint8_t signature[SIGNATURE_SIZE]) {
    static const uint8_t key[SIGNATURE_KEY_SIZE] = {SIGNING_KEY};
    (void)ctx;
    return signature_is_good(key, digest, signature);
}

static const char *write_file(void *ctx, const uint8_t *bytes, size_t count) {
    (void)ctx;
    return fwrite(bytes, 1, count, file) == count ? NULL : "the disk is full";
}

static const char *end(void *ctx) {
    (void)ctx;
    return fclose(file) == 0 ? NULL : "the disk is full";
}

static void abort_it(void *ctx) {
    (void)ctx;
    (void)fclose(file);
    (void)remove(path);
}

static const struct ota_ops ops = {
    .begin = begin, .is_signed = is_signed, .write = write_file, .end = end, .abort = abort_it};

static void restart(bool with_new) {
    uint8_t bytes[OTA_DIGEST_DIGITS / 2] = {0};
    ota_init(&ota, &ops, NULL, &image, &access_of);
    runs_new = ota.on_trial = with_new;
    snprintf(running, sizeof running, "0ld0ld0ld0ld0ld0");
    if (!with_new)
        return;
    FILE *slot = fopen(path, "rb");
    if (slot == NULL || fseek(slot, DIGEST_AT, SEEK_SET) != 0 || fread(bytes, sizeof bytes, 1, slot) != 1)
        exit(3);
    (void)fclose(slot);
    for (size_t i = 0; i < sizeof bytes; i++)
        snprintf(running + 2 * i, 3, "%02x", bytes[i]);
}

/* @return false: nothing answers any more */
static bool follow_fate(void) {
    if (ota.state != OTA_FREE)
        return true;
    if (ota.done && strcmp(fate, "gone") == 0)
        return false;
    if (ota.done)
        restart(strcmp(fate, "old") != 0);
    else if (runs_new && ota.reached && strcmp(fate, "crash") == 0)
        restart(false);
    else if (runs_new && ota.reached && strcmp(fate, "trial") != 0)
        ota.on_trial = false;
    return true;
}

static bool stdin_is_open(void) {
    char byte;
    return read(STDIN_FILENO, &byte, 1) != 0;
}

int main(int argc, char **argv) {
    static const uint8_t salt[ACCESS_SALT] = {1, 2, 3};
    struct sockaddr_in here;
    socklen_t size = sizeof here;
    char address[NET_ADDRESS_SIZE];
    int error;
    uint8_t nonce[OTA_NONCE_SIZE] = {0};
    int listener = net_tcp_listen("127.0.0.1", "0", address, &error);
    if (argc < 4 || listener < 0 || getsockname(listener, (struct sockaddr *)&here, &size) != 0)
        return 2;
    image.chip_id = (uint16_t)atoi(argv[3]);
    path = argv[2];
    fate = argc > 4 ? argv[4] : fate;
    (void)signal(SIGPIPE, SIG_IGN);
    access_init(&access_of, argv[1], false, salt, 0);
    ota_init(&ota, &ops, NULL, &image, &access_of);
    printf("%d\n", ntohs(here.sin_port));
    fflush(stdout);
    (void)fcntl(STDIN_FILENO, F_SETFL, O_NONBLOCK);
    while (stdin_is_open()) {
        struct net_stream stream;
        nonce[0]++;
        if (listener >= 0 && net_tcp_accept(listener, &stream, address))
            (void)ota_connect(&ota, &stream, nonce, 0);
        (void)ota_poll(&ota, 0);
        if (listener >= 0 && !follow_fate()) {
            (void)close(listener);
            listener = -1;
        }
        sched_yield();
    }
    return 0;
}
