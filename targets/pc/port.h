/* SPDX-License-Identifier: MIT
 * What the servers of the PC ask of its operating system besides sockets (net_socket.h) and files
 * (port_file.h). One implementation for each: port_posix.c, port_windows.c. An error is the system's own
 * number, 0 none. */
#ifndef WIFICNC_PC_PORT_H
#define WIFICNC_PC_PORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** Once, before anything else of a program. @return its arguments in UTF-8, NULL-terminated, or NULL */
char **port_start(char **argv);

/** Time since some moment, ns; never goes back. */
uint64_t port_clock_ns(void);

/** Bytes that cannot be foretold; without any the program ends. */
void port_random(uint8_t *bytes, size_t count);

const char *port_error_text(int error);

/** Prints a line to stdout. If the program that reads it does not keep up, the line is left out instead of
 * holding this one up. */
void port_say(const char *line, size_t size);

/* ---- waiting ---- */

enum { PORT_POLLS_MAX = 192 };
enum { PORT_READ = 1, PORT_WRITE = 2, PORT_LOST = 4 };

/** A socket or a terminal to wait for. */
struct port_poll {
    int fd;       /* -1: none */
    short wanted; /* PORT_READ, PORT_WRITE or both; PORT_LOST always */
    short found;
};

/** Wait for one of up to PORT_POLLS_MAX. @return how many were found; -1: *error; a signal is no error */
int port_poll(struct port_poll *polls, size_t count, int timeout_ms, int *error);

/** What ends a wait from outside. */
struct port_wake {
    int wait_fd; /* for port_poll(); -1: none */
    int wake_fd;
};

/** @return 0 or an error */
int port_wake_open(struct port_wake *wake);
void port_wake_close(const struct port_wake *wake);

/** [any thread, signal handlers] */
void port_wake(const struct port_wake *wake);

/** Whether it was woken since the last call. */
bool port_wake_taken(const struct port_wake *wake);

/** From now on a request to end this program (Ctrl-C, SIGTERM, a closed console) makes *wait_fd readable, and
 * a client that vanishes is seen by the write that fails. @return 0 or an error */
int port_catch_requests(int *wait_fd);

/** Readable when the program at the other end of stdin has gone. @return -1: not possible */
int port_parent_fd(void);

/* ---- locks ---- */

enum port_kind { PORT_NOTHING, PORT_FILE, PORT_FOLDER, PORT_OTHER };

enum port_kind port_kind_of(const char *path);

/** Lock the file for this process; it is created. @return -1 and *error; EAGAIN: another process has it */
int port_lock(const char *path, int *error);
void port_unlock(int lock);

#endif
