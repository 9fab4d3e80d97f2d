/* SPDX-License-Identifier: MIT */
#include "serve_claim.h"

#include "port.h"

#include <errno.h>
#include <stdio.h>

enum { NAME_SIZE = 4096 };

int serve_claim(const char *path, int *error) {
    char name[NAME_SIZE];
    enum port_kind kind = port_kind_of(path);
    if (kind == PORT_FOLDER || kind == PORT_OTHER) {
        *error = kind == PORT_FOLDER ? EISDIR : EINVAL;
        return -1;
    }
    /* Not the file itself: that is replaced at every save, and a lock belongs to the file that was opened. */
    int length = snprintf(name, sizeof name, "%s.lock", path);
    if (length < 0 || length >= NAME_SIZE) {
        *error = ENAMETOOLONG;
        return -1;
    }
    return port_lock(name, error);
}

void serve_release(int claim) {
    port_unlock(claim);
}
