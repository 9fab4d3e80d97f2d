/* SPDX-License-Identifier: MIT
 * What picolibc asks of its surroundings, by qemu's simcall (target/xtensa/xtensa-semi.c): files of this
 * computer, read only; output; the end. */
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/types.h>

enum { SIMCALL_EXIT = 1, SIMCALL_READ = 3, SIMCALL_WRITE = 4, SIMCALL_OPEN = 5, SIMCALL_CLOSE = 6 };
enum { STDIN, STDOUT };

static int simcall(int number, int first, int second, int third) {
    register int a2 __asm__("a2") = number;
    register int a3 __asm__("a3") = first;
    register int a4 __asm__("a4") = second;
    register int a5 __asm__("a5") = third;
    __asm__ volatile("simcall" : "+r"(a2), "+r"(a3) : "r"(a4), "r"(a5) : "memory");
    return a2;
}

void _exit(int code) {
    (void)simcall(SIMCALL_EXIT, code, 0, 0);
    for (;;) {
    }
}

int open(const char *path, int flags, ...) {
    return flags == 0 ? simcall(SIMCALL_OPEN, (int)path, 0, 0) : -1;
}

int close(int fd) {
    return simcall(SIMCALL_CLOSE, fd, 0, 0);
}

ssize_t read(int fd, void *bytes, size_t count) {
    return simcall(SIMCALL_READ, fd, (int)bytes, (int)count);
}

ssize_t write(int fd, const void *bytes, size_t count) {
    return simcall(SIMCALL_WRITE, fd, (int)bytes, (int)count);
}

off_t lseek(int fd, off_t offset, int from) {
    (void)fd;
    (void)offset;
    (void)from;
    return -1;
}

int unlink(const char *path) {
    (void)path;
    return -1;
}

int rename(const char *from, const char *to) {
    (void)from;
    (void)to;
    return -1;
}

int fsync(int fd) {
    (void)fd;
    return 0;
}

int getpid(void) {
    return 1;
}

int kill(int process, int signal) {
    (void)process;
    _exit(128 + signal);
}

/* One core, and nothing interrupts it. */
unsigned __atomic_fetch_or_4(volatile void *at, unsigned value, int order) {
    volatile unsigned *word = at;
    unsigned before = *word;
    (void)order;
    *word = before | value;
    return before;
}

unsigned __atomic_fetch_add_4(volatile void *at, unsigned value, int order) {
    volatile unsigned *word = at;
    unsigned before = *word;
    (void)order;
    *word = before + value;
    return before;
}

unsigned __atomic_fetch_sub_4(volatile void *at, unsigned value, int order) {
    return __atomic_fetch_add_4(at, 0u - value, order);
}

unsigned __atomic_fetch_and_4(volatile void *at, unsigned value, int order) {
    volatile unsigned *word = at;
    unsigned before = *word;
    (void)order;
    *word = before & value;
    return before;
}

unsigned __atomic_exchange_4(volatile void *at, unsigned value, int order) {
    volatile unsigned *word = at;
    unsigned before = *word;
    (void)order;
    *word = value;
    return before;
}

bool __atomic_compare_exchange_4(volatile void *at, void *expected, unsigned value, int success,
                                 int failure) {
    volatile unsigned *word = at;
    unsigned *wanted = expected, before = *word;
    bool same = before == *wanted;
    (void)success, (void)failure;
    *wanted = before;
    if (same)
        *word = value;
    return same;
}

static int put(char character, FILE *file) {
    (void)file;
    return write(STDOUT, &character, 1) == 1 ? (unsigned char)character : EOF;
}

static int get(FILE *file) {
    unsigned char byte;
    (void)file;
    return read(STDIN, &byte, 1) == 1 ? byte : EOF;
}

static FILE console = FDEV_SETUP_STREAM(put, get, NULL, _FDEV_SETUP_RW);
FILE *const stdin = &console;
FILE *const stdout = &console;
FILE *const stderr = &console;
