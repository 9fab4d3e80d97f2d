/* SPDX-License-Identifier: MIT
 * The ESP32's controller task and page with the receiver of updates behind /update; the slot is a file. Says
 * its ports on stdout, telnet's and the page's. Each line of stdin is answered by `reached=0|1`: whether
 * someone who may command is connected over the network. Ends with stdin. Usage: update_serve KEY FILE */
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

enum { SLOT_SIZE = 200000, CHIP_ID = 9 };

static struct {
    struct controller *controller;
    struct ota ota;
    const char *path;
    FILE *file;
    bool locked;
    uint8_t nonce;
} slot;

static const char *begin(void *ctx, size_t size) {
    (void)ctx;
    if (size > SLOT_SIZE)
        return "the image is larger than its slot";
    const char *why = controller_why_busy(slot.controller);
    if (why != NULL)
        return why;
    slot.file = fopen(slot.path, "wb");
    slot.locked = true;
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
    slot.locked = false;
    return fclose(slot.file) == 0 ? NULL : "the disk is full";
}

static void abort_it(void *ctx) {
    (void)ctx;
    slot.locked = false;
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
    if (got == 1 && byte == '\n') {
        printf("reached=%d\n", controller_is_reached(slot.controller));
        fflush(stdout);
    }
    return got != 0;
}

static void start(char **argv, struct host *host, struct controller *controller) {
    static const struct net_hub_sizes sizes = {.clients = CLIENTS, .in = 2048, .out = 16384, .left = 2048};
    static const struct ota_ops ops = {
        .begin = begin, .is_signed = is_signed, .write = write_file, .end = end, .abort = abort_it};
    static const struct ota_image image = {
        .board = "esp32s3-devkitc", .chip_id = CHIP_ID, .project = "wificnc"};
    static const uint8_t salt[ACCESS_SALT];
    const struct page_names names = {.own = "WiFiCNC-1A2B", .update = update, .updates = &slot.ota};
    int error;
    controller_init(controller, &host->machine, &sizes);
    host->machine.out = controller_out(controller);
    access_init(&controller->access, argv[1], false, salt, hal_time_us(&host->hal));
    controller_set(controller, &(struct controller_options){.key = argv[1]});
    slot.controller = controller;
    slot.path = argv[2];
    ota_init(&slot.ota, &ops, NULL, &image, &controller->access);
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
        pass_a_millisecond(host);
        if (!more && !host->machine.drive.step.active)
            (void)nanosleep(&pace, NULL);
    }
    return 0;
}
