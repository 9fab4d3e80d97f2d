/* SPDX-License-Identifier: MIT
 * The ESP32's controller task and page with the receiver of updates behind /update; the slot is a file. Says
 * its ports on stdout, telnet's and the page's. Each line of stdin is answered by `reached=0|1`: whether
 * someone who may command is connected over the network. Ends with stdin. Usage: update_serve KEY FILE
 *
 * A complete update restarts the receiver: the new firmware is on trial until it was reached. After an "o" on
 * stdin the one before it returns instead. */
#include "app/controller.h"
#include "net/ota.h"
#include "net/page.h"
#include "serve_rounds.h"
#include "signing_key.h"

#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { SLOT_SIZE = 200000, CHIP_ID = 9, DIGEST_AT = 176 };

#define OLD_DIGEST "0ld0ld0ld0ld0ld0"

static struct {
    struct host *host;
    struct controller *controller;
    struct ota ota;
    const char *path;
    FILE *file;
    uint8_t nonce;
    bool returns; /* the old firmware */
    char digest[OTA_DIGEST_DIGITS + 1];
} slot = {.digest = OLD_DIGEST};

static const char *begin(void *ctx, size_t size) {
    (void)ctx;
    if (size > SLOT_SIZE)
        return "the image is larger than its slot";
    const char *why = controller_why_busy(slot.controller);
    if (why != NULL)
        return why;
    slot.file = fopen(slot.path, "wb");
    virtual_lock(slot.host, HAL_LOCK_UPDATE);
    return slot.file != NULL ? NULL : "no file";
}

static bool is_signed(void *ctx, const uint8_t digest[SHA256_SIZE], const uint8_t signature[SIGNATURE_SIZE]) {
    static const uint8_t key[SIGNATURE_KEY_SIZE] = {SIGNING_KEY};
    (void)ctx;
    return signature_is_good(key, digest, signature);
}

static const char *write_file(void *ctx, const uint8_t *bytes, size_t count) {
    (void)ctx;
    return fwrite(bytes, 1, count, slot.file) == count ? NULL : "the disk is full";
}

static const char *end(void *ctx) {
    (void)ctx;
    virtual_lock(slot.host, HAL_LOCK_NONE);
    return fclose(slot.file) == 0 ? NULL : "the disk is full";
}

static void abort_it(void *ctx) {
    (void)ctx;
    virtual_lock(slot.host, HAL_LOCK_NONE);
    (void)fclose(slot.file);
    (void)remove(slot.path);
}

static void update(void *updates, const struct net_stream *stream) {
    const uint8_t nonce[OTA_NONCE_SIZE] = {++slot.nonce};
    (void)ota_connect(updates, stream, nonce, page_time_us());
}

/* @return false: it is closed */
static bool read_stdin(void) {
    char byte;
    ssize_t got = read(STDIN_FILENO, &byte, 1);
    slot.returns |= got == 1 && byte == 'o';
    if (got == 1 && byte == '\n') {
        printf("reached=%d\n", controller_is_reached(slot.controller));
        fflush(stdout);
    }
    return got != 0;
}

static void start_receiver(void) {
    static const struct ota_ops ops = {
        .begin = begin, .is_signed = is_signed, .write = write_file, .end = end, .abort = abort_it};
    static const struct ota_image image = {
        .board = "esp32s3-devkitc", .chip_id = CHIP_ID, .project = "wificnc", .digest = slot.digest};
    ota_init(&slot.ota, &ops, NULL, &image, &slot.controller->access);
}

static void read_digest(void) {
    uint8_t bytes[OTA_DIGEST_DIGITS / 2];
    FILE *file = fopen(slot.path, "rb");
    if (file == NULL || fseek(file, DIGEST_AT, SEEK_SET) != 0 || fread(bytes, sizeof bytes, 1, file) != 1)
        exit(3);
    (void)fclose(file);
    for (size_t i = 0; i < sizeof bytes; i++)
        snprintf(slot.digest + 2 * i, 3, "%02x", bytes[i]);
}

/* What becomes of an update when its sender has gone. */
static void follow_update(void) {
    if (slot.ota.state != OTA_FREE)
        return;
    if (slot.ota.done) {
        if (!slot.returns)
            read_digest();
        start_receiver();
        slot.ota.on_trial = !slot.returns;
    } else if (slot.ota.reached) {
        slot.ota.on_trial = false;
    }
}

static void start(char **argv, struct host *host, struct controller *controller) {
    static const struct net_hub_sizes sizes = {.clients = CLIENTS, .in = 2048, .out = 16384, .left = 2048};
    static const uint8_t salt[ACCESS_SALT];
    const struct page_names names = {
        .own = "WiFiCNC-1A2B", .update = update, .updates = &slot.ota, .digest = OLD_DIGEST};
    int error;
    controller_init(controller, &host->machine, &sizes);
    host->machine.out = controller_out(controller);
    access_init(&controller->access, argv[1], false, salt, hal_time_us(&host->hal));
    controller_set(controller, &(struct controller_options){.key = argv[1]});
    slot.host = host;
    slot.controller = controller;
    slot.path = argv[2];
    host->machine.board.digest = OLD_DIGEST;
    start_receiver();
    if (!controller_listen(controller, "127.0.0.1", "0", &error) ||
        !page_start(&controller->hub, "127.0.0.1", &names, "0", &error))
        exit(1);
    printf("%u %u\n", port_of(controller->listener), port_of(other_listener(controller->listener)));
    fflush(stdout);
}

int main(int argc, char **argv) {
    static struct controller controller;
    static const struct timespec pace = {.tv_nsec = 100000}; /* leaves the processor to other tests */
    struct host *host = host_create(&board);
    if (argc != 3 || host == NULL)
        return 2;
    (void)signal(SIGPIPE, SIG_IGN);
    start(argv, host, &controller);
    (void)fcntl(STDIN_FILENO, F_SETFL, O_NONBLOCK);
    while (read_stdin()) {
        bool more = page_poll(page_time_us());
        more |= controller_round(&controller);
        more |= ota_poll(&slot.ota, page_time_us());
        follow_update();
        pass_a_millisecond(host);
        if (!more && !host->machine.drive.step.active)
            (void)nanosleep(&pace, NULL);
    }
    return 0;
}
