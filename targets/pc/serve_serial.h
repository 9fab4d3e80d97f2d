/* SPDX-License-Identifier: MIT
 * A serial port of this computer, for a bus or a pendant: an adapter, or a pty of a program that plays one.
 * One implementation for each system: serve_serial_posix.c, serve_serial_windows.c. */
#ifndef WIFICNC_PC_SERVE_SERIAL_H
#define WIFICNC_PC_SERVE_SERIAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** The error of a port that does not have a format. */
extern const int serve_serial_bad_format;

/** NULL where there are serial ports; else why not. */
extern const char *const serve_serial_missing;

/** @return -1 and *error */
int serve_serial_open(const char *path, int *error);
void serve_serial_close(int port);

/** 8 bits, one stop bit; what has come is dropped. @param parity  0 none, 1 even, 2 odd @return false: the
 * port cannot do that */
bool serve_serial_configure(int port, uint32_t baud, int parity);

void serve_serial_write(int port, const uint8_t *bytes, size_t count);

/** @return bytes that have come, without waiting */
size_t serve_serial_read(int port, uint8_t *bytes, size_t size);

/** As a stream of its own, without waiting. @return bytes; -1: the port is gone */
long serve_serial_take(int port, char *bytes, size_t size);
long serve_serial_give(int port, const char *bytes, size_t count);

#endif
