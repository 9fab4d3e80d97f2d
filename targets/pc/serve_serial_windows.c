/* SPDX-License-Identifier: MIT */
#include "serve_serial.h"

#include <errno.h>

const int serve_serial_bad_format = EINVAL;
const char *const serve_serial_missing = "not on Windows: serial ports need Linux or macOS";

int serve_serial_open(const char *path, int *error) {
    (void)path;
    *error = ENOSYS;
    return -1;
}

void serve_serial_close(int port) {
    (void)port;
}

bool serve_serial_configure(int port, uint32_t baud, int parity) {
    (void)port;
    (void)baud;
    (void)parity;
    return false;
}

void serve_serial_write(int port, const uint8_t *bytes, size_t count) {
    (void)port;
    (void)bytes;
    (void)count;
}

size_t serve_serial_read(int port, uint8_t *bytes, size_t size) {
    (void)port;
    (void)bytes;
    (void)size;
    return 0;
}

long serve_serial_take(int port, char *bytes, size_t size) {
    (void)port;
    (void)bytes;
    (void)size;
    return -1;
}

long serve_serial_give(int port, const char *bytes, size_t count) {
    (void)port;
    (void)bytes;
    (void)count;
    return -1;
}
