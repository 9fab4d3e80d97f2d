/* SPDX-License-Identifier: MIT
 * The firmware's Improv (targets/esp32/link/improv.c) at a pty, which is this program's input and output. The
 * only network is "Werkstatt". Its clock is fast, so that a network that is not there is given up after a
 * second. */
#include "link/improv.h"

#include <fcntl.h>
#include <poll.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { FASTER = 30, JOIN_US = 3000000 };

static char network[64];
static uint32_t asked_us;

static long pty_read(const struct net_stream *stream, char *bytes, size_t size) {
    (void)stream;
    ssize_t count = read(STDIN_FILENO, bytes, size);
    return count > 0 ? count : 0;
}

static long pty_write(const struct net_stream *stream, const char *bytes, size_t count) {
    (void)stream;
    ssize_t taken = write(STDOUT_FILENO, bytes, count);
    return taken > 0 ? taken : 0;
}

static void pty_close(const struct net_stream *stream) {
    (void)stream;
}

static uint32_t now_us(void *ctx) {
    struct timespec now;
    (void)ctx;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint32_t)(((uint64_t)now.tv_sec * 1000000u + (uint64_t)now.tv_nsec / 1000u) * FASTER);
}

static bool join(void *ctx, const char *name, const char *password) {
    (void)ctx;
    (void)password;
    strcpy(network, name);
    asked_us = now_us(NULL);
    return strcmp(name, "moving") != 0;
}

static bool joined(void *ctx, char *address) {
    (void)ctx;
    strcpy(address, "http://192.168.1.20/");
    return strcmp(network, "Werkstatt") == 0 && now_us(NULL) - asked_us > JOIN_US;
}

static bool scan(void *ctx) {
    (void)ctx;
    return true;
}

static enum improv_scan scanned(void *ctx, size_t index, struct improv_network *found) {
    static const struct improv_network networks[] = {{"Werkstatt", -48, true}, {"Freifunk", -80, false}};
    (void)ctx;
    if (index >= sizeof networks / sizeof networks[0])
        return IMPROV_NO_MORE;
    *found = networks[index];
    return IMPROV_NETWORK;
}

int main(void) {
    static const struct net_stream_ops port = {.read = pty_read, .write = pty_write, .close = pty_close};
    static const struct improv_ops ops = {
        .join = join, .joined = joined, .scan = scan, .scanned = scanned, .now_us = now_us};
    static const struct improv_info info = {"WiFiCNC", "1.0", "esp32s3", "WiFiCNC-1A2B"};
    static struct improv improv;
    struct net_stream stream;
    char bytes[256];
    fcntl(STDIN_FILENO, F_SETFL, O_NONBLOCK);
    improv_init(&improv, &(struct net_stream){.ops = &port}, &info, &ops, &stream);
    for (;;) {
        struct pollfd in = {.fd = STDIN_FILENO, .events = POLLIN};
        (void)poll(&in, 1, 5);
        long count = stream.ops->read(&stream, bytes, sizeof bytes);
        if (count > 0 && memchr(bytes, '\n', (size_t)count) != NULL)
            (void)stream.ops->write(&stream, "ok\r\n", 4);
    }
}
