/* SPDX-License-Identifier: MIT */
#include "port_file.h"

#include <unistd.h>

FILE *port_open(const char *path, const char *mode) {
    return fopen(path, mode);
}

bool port_sync(FILE *file) {
    return fflush(file) == 0 && fsync(fileno(file)) == 0;
}

bool port_replace(const char *from, const char *to) {
    return rename(from, to) == 0;
}
