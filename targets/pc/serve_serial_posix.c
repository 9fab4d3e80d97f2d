/* SPDX-License-Identifier: MIT */
#if !defined(_DEFAULT_SOURCE)
#define _DEFAULT_SOURCE /* CRTSCTS, B115200 */
#endif
#include "serve_serial.h"

#include <errno.h>
#include <fcntl.h>
#include <termios.h>
#include <unistd.h>

const int serve_serial_bad_format = EINVAL;
const char *const serve_serial_missing = NULL;

int serve_serial_open(const char *path, int *error) {
    const int port = open(path, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (port < 0) {
        *error = errno;
        return -1;
    }
    if (!isatty(port)) {
        *error = ENOTTY;
        close(port);
        return -1;
    }
    return port;
}

void serve_serial_close(int port) {
    close(port);
}

static speed_t speed_of(uint32_t baud) {
    static const struct {
        uint32_t baud;
        speed_t speed;
    } speeds[] = {
        {2400, B2400},       {4800, B4800},   {9600, B9600},
        {19200, B19200},     {38400, B38400}, {115200, B115200},
#ifdef B1000000
        {1000000, B1000000},
#endif
    };
    for (size_t i = 0; i < sizeof speeds / sizeof speeds[0]; i++)
        if (speeds[i].baud == baud)
            return speeds[i].speed;
    return B0;
}

bool serve_serial_configure(int port, uint32_t baud, int parity) {
    struct termios mode;
    const speed_t speed = speed_of(baud);
    if (speed == B0 || tcgetattr(port, &mode) != 0)
        return false;
    mode.c_iflag = 0;
    mode.c_oflag = 0;
    mode.c_lflag = 0;
    mode.c_cflag = CS8 | CREAD | CLOCAL | (parity != 0 ? PARENB : 0u) | (parity == 2 ? PARODD : 0u);
    mode.c_cc[VMIN] = 0;
    mode.c_cc[VTIME] = 0;
    if (cfsetispeed(&mode, speed) != 0 || cfsetospeed(&mode, speed) != 0 ||
        tcsetattr(port, TCSANOW, &mode) != 0)
        return false;
    tcflush(port, TCIFLUSH);
    return true;
}

void serve_serial_write(int port, const uint8_t *bytes, size_t count) {
    /* A port that takes nothing is a drive that does not answer. */
    if (write(port, bytes, count) < 0)
        return;
}

size_t serve_serial_read(int port, uint8_t *bytes, size_t size) {
    const ssize_t count = read(port, bytes, size);
    return count > 0 ? (size_t)count : 0;
}

static long result_of(ssize_t count) {
    if (count > 0)
        return (long)count;
    return count < 0 && errno != EAGAIN && errno != EINTR ? -1 : 0;
}

long serve_serial_take(int port, char *bytes, size_t size) {
    return result_of(read(port, bytes, size));
}

long serve_serial_give(int port, const char *bytes, size_t count) {
    return result_of(write(port, bytes, count));
}
