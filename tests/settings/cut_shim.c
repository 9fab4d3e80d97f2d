/* SPDX-License-Identifier: MIT
 * LD_PRELOAD: the power goes at the nth call with which a store's file is replaced (CUT_AT). What was written
 * and not yet flushed to the disk is gone then, or half of it is there (CUT_HALF). CUT_LOG: the number of
 * calls. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static FILE *file; /* the new one */
static char path[4096];
static bool synced;
static long calls, length;

static void count(void) {
    const char *at = getenv("CUT_AT"), *log = getenv("CUT_LOG");
    calls++;
    if (log != NULL) {
        int (*real_close)(FILE *) = (int (*)(FILE *))dlsym(RTLD_NEXT, "fclose");
        FILE *(*real_open)(const char *, const char *) =
            (FILE * (*)(const char *, const char *)) dlsym(RTLD_NEXT, "fopen");
        FILE *out = real_open(log, "w");
        fprintf(out, "%ld\n", calls);
        real_close(out);
    }
    if (at == NULL || atol(at) != calls)
        return;
    if (!synced && path[0] != '\0' && access(path, F_OK) == 0)
        (void)!truncate(path, getenv("CUT_HALF") != NULL ? length / 2 : 0);
    _exit(75);
}

FILE *fopen(const char *name, const char *mode) {
    FILE *(*real)(const char *, const char *) =
        (FILE * (*)(const char *, const char *)) dlsym(RTLD_NEXT, "fopen");
    size_t size = strlen(name);
    bool ours = size > 4 && strcmp(name + size - 4, ".new") == 0;
    if (ours)
        count();
    FILE *opened = real(name, mode);
    if (ours) {
        file = opened;
        synced = false;
        snprintf(path, sizeof path, "%s", name);
    }
    return opened;
}

size_t fwrite(const void *bytes, size_t size, size_t number, FILE *to) {
    size_t (*real)(const void *, size_t, size_t, FILE *) =
        (size_t (*)(const void *, size_t, size_t, FILE *))dlsym(RTLD_NEXT, "fwrite");
    if (file != NULL && to == file) {
        length = (long)(size * number);
        count();
    }
    return real(bytes, size, number, to);
}

int fflush(FILE *of) {
    int (*real)(FILE *) = (int (*)(FILE *))dlsym(RTLD_NEXT, "fflush");
    if (file != NULL && of == file)
        count();
    return real(of);
}

int fsync(int of) {
    int (*real)(int) = (int (*)(int))dlsym(RTLD_NEXT, "fsync");
    bool ours = file != NULL && of == fileno(file);
    if (ours)
        count();
    int result = real(of);
    synced |= ours;
    return result;
}

int fclose(FILE *of) {
    int (*real)(FILE *) = (int (*)(FILE *))dlsym(RTLD_NEXT, "fclose");
    if (file != NULL && of == file) {
        count();
        file = NULL;
    }
    return real(of);
}

int rename(const char *from, const char *to) {
    int (*real)(const char *, const char *) = (int (*)(const char *, const char *))dlsym(RTLD_NEXT, "rename");
    bool ours = path[0] != '\0' && strcmp(from, path) == 0;
    if (ours)
        count();
    int result = real(from, to);
    /* a rename that comes before its data on the disk brings an empty file */
    if (ours && !synced)
        (void)!truncate(to, 0);
    if (ours)
        count();
    return result;
}
