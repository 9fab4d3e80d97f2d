/* SPDX-License-Identifier: MIT
 * Windows has no pseudo-terminal that looks like a serial port. */
#include "net_pty.h"

#include <errno.h>

const char *const net_pty_missing = "Windows has no pseudo-terminals. Use --tcp; for a sender that opens "
                                    "only serial ports, connect a pair of "
                                    "virtual COM ports (com0com) to that TCP port (hub4com)";

int net_pty_open(struct net_pty *pty, const char *link) {
    *pty = (struct net_pty){.link = link, .master = -1};
    return ENOTSUP;
}

/* cppcheck-suppress constParameterPointer ; the interface of all systems */
void net_pty_close(struct net_pty *pty) {
    (void)pty;
}

void net_pty_unlink(const struct net_pty *pty) {
    (void)pty;
}

/* cppcheck-suppress constParameterPointer ; the interface of all systems */
bool net_pty_opened(struct net_pty *pty, struct net_stream *stream) {
    (void)pty;
    (void)stream;
    return false;
}
