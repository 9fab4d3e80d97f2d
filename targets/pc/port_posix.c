/* SPDX-License-Identifier: MIT */
#include "port.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

char **port_start(char **argv) {
    return argv;
}

uint64_t port_clock_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

void port_random(uint8_t *bytes, size_t count) {
    FILE *file = fopen("/dev/urandom", "rb");
    if (file == NULL || fread(bytes, 1, count, file) != count)
        abort(); /* no nonce at all is better than one that can be foretold */
    fclose(file);
}

const char *port_error_text(int error) {
    return strerror(error);
}

void port_say(const char *line, size_t size) {
    struct pollfd out = {.fd = STDOUT_FILENO, .events = POLLOUT};
    /* A reader that has stopped must not stop the controller: the line is dropped. */
    if (poll(&out, 1, 0) != 1 || (out.revents & POLLOUT) == 0)
        return;
    if (write(STDOUT_FILENO, line, size) < 0)
        return; /* no one there */
}

/* ---- waiting ---- */

static short to_system(short wanted) {
    return (short)(((wanted & PORT_READ) != 0 ? POLLIN : 0) | ((wanted & PORT_WRITE) != 0 ? POLLOUT : 0));
}

static short from_system(short found) {
    return (short)(((found & POLLIN) != 0 ? PORT_READ : 0) | ((found & POLLOUT) != 0 ? PORT_WRITE : 0) |
                   ((found & (POLLERR | POLLHUP | POLLNVAL)) != 0 ? PORT_LOST : 0));
}

int port_poll(struct port_poll *polls, size_t count, int timeout_ms, int *error) {
    struct pollfd system[PORT_POLLS_MAX];
    for (size_t i = 0; i < count; i++) {
        polls[i].found = 0;
        system[i] = (struct pollfd){.fd = polls[i].fd, .events = to_system(polls[i].wanted)};
    }
    int ready = poll(system, (nfds_t)count, timeout_ms);
    if (ready < 0) {
        *error = errno;
        return errno == EINTR ? 0 : -1;
    }
    for (size_t i = 0; i < count; i++)
        polls[i].found = from_system(system[i].revents);
    return ready;
}

int port_wake_open(struct port_wake *wake) {
    int ends[2];
    *wake = (struct port_wake){-1, -1};
    if (pipe(ends) != 0)
        return errno;
    *wake = (struct port_wake){ends[0], ends[1]};
    if (fcntl(ends[0], F_SETFL, O_NONBLOCK) == 0 && fcntl(ends[1], F_SETFL, O_NONBLOCK) == 0)
        return 0;
    return errno;
}

void port_wake_close(const struct port_wake *wake) {
    if (wake->wait_fd >= 0)
        close(wake->wait_fd);
    if (wake->wake_fd >= 0)
        close(wake->wake_fd);
}

void port_wake(const struct port_wake *wake) {
    const char byte = 0;
    int before = errno;
    if (write(wake->wake_fd, &byte, 1) < 0)
        errno = before; /* full: it was woken already */
}

bool port_wake_taken(const struct port_wake *wake) {
    char bytes[16];
    bool woken = false;
    while (read(wake->wait_fd, bytes, sizeof bytes) > 0)
        woken = true;
    return woken;
}

/* ---- requests to end ---- */

static struct port_wake requests; /* a signal handler can reach nothing else */

static void on_signal(int number) {
    (void)number;
    port_wake(&requests);
}

/* A program that is started in the background may inherit SIGINT as ignored, and it stays so: Ctrl-C at its
 * terminal is meant for others. */
static void catch_unless_ignored(int number, const struct sigaction *action) {
    struct sigaction inherited;
    if (sigaction(number, NULL, &inherited) == 0 && inherited.sa_handler != SIG_IGN)
        sigaction(number, action, NULL);
}

int port_catch_requests(int *wait_fd) {
    struct sigaction stop = {.sa_handler = on_signal}, ignore = {.sa_handler = SIG_IGN};
    int error = port_wake_open(&requests);
    if (error != 0)
        return error;
    *wait_fd = requests.wait_fd;
    sigemptyset(&stop.sa_mask);
    catch_unless_ignored(SIGINT, &stop);
    sigaction(SIGTERM, &stop, NULL);
    /* A client that has gone is reported by the write to it, and must not end the program. */
    sigaction(SIGPIPE, &ignore, NULL);
    return 0;
}

int port_parent_fd(void) {
    return STDIN_FILENO;
}

/* ---- locks ---- */

enum port_kind port_kind_of(const char *path) {
    struct stat status;
    if (stat(path, &status) != 0)
        return PORT_NOTHING;
    if (S_ISREG(status.st_mode))
        return PORT_FILE;
    return S_ISDIR(status.st_mode) ? PORT_FOLDER : PORT_OTHER;
}

int port_lock(const char *path, int *error) {
    struct flock whole = {.l_type = F_WRLCK, .l_whence = SEEK_SET};
    int lock = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (lock >= 0 && fcntl(lock, F_SETLK, &whole) == 0)
        return lock;
    *error = errno == EACCES && lock >= 0 ? EAGAIN : errno; /* POSIX allows both for a lock that is taken */
    if (lock >= 0)
        close(lock);
    return -1;
}

void port_unlock(int lock) {
    if (lock >= 0)
        close(lock);
}
