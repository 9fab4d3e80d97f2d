/* SPDX-License-Identifier: MIT
 * The receiver of updates over a real socket of this computer: says its port on stdout, writes what it takes
 * to a file, and ends when an update is complete or stdin is closed. Usage: ota_serve PASSWORD FILE CHIP_ID
 */
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

static FILE *file;
static const char *path;

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

static bool stdin_is_open(void) {
    char byte;
    return read(STDIN_FILENO, &byte, 1) != 0;
}

int main(int argc, char **argv) {
    static const struct ota_ops ops = {
        .begin = begin, .is_signed = is_signed, .write = write_file, .end = end, .abort = abort_it};
    static struct ota ota;
    static struct access access_of;
    static const uint8_t salt[ACCESS_SALT] = {1, 2, 3};
    struct sockaddr_in here;
    socklen_t size = sizeof here;
    char address[NET_ADDRESS_SIZE];
    int error;
    uint8_t nonce[OTA_NONCE_SIZE] = {0};
    int listener = net_tcp_listen("127.0.0.1", "0", address, &error);
    if (argc != 4 || listener < 0 || getsockname(listener, (struct sockaddr *)&here, &size) != 0)
        return 2;
    const struct ota_image image = {
        .board = "esp32s3-zero", .chip_id = (uint16_t)atoi(argv[3]), .project = "wificnc"};
    path = argv[2];
    (void)signal(SIGPIPE, SIG_IGN);
    access_init(&access_of, argv[1], false, salt, 0);
    ota_init(&ota, &ops, NULL, &image, &access_of);
    printf("%d\n", ntohs(here.sin_port));
    fflush(stdout);
    (void)fcntl(STDIN_FILENO, F_SETFL, O_NONBLOCK);
    while (stdin_is_open() && !(ota.done && ota.state == OTA_FREE)) {
        struct net_stream stream;
        nonce[0]++;
        if (net_tcp_accept(listener, &stream, address))
            (void)ota_connect(&ota, &stream, nonce, 0);
        (void)ota_poll(&ota, 0);
        sched_yield();
    }
    return ota.done ? 0 : 1;
}
