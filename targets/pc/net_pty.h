/* SPDX-License-Identifier: MIT
 * A pseudo-terminal that looks like a Grbl board's serial port to a sender, under a fixed name.
 *
 * The sender may open and close it as often as it likes; each opening is a new connection. While no one has
 * it open, poll() would report a hang-up for ever: then do not poll it, ask net_pty_opened() now and then. */
#ifndef WIFICNC_PC_NET_PTY_H
#define WIFICNC_PC_NET_PTY_H

#include "net_stream.h"

enum { NET_PTY_NAME_SIZE = 64 };

struct net_pty {
    int master;
    bool attached;                 /* a stream of it is in use */
    const char *link;              /* the caller's; outlives this */
    char slave[NET_PTY_NAME_SIZE]; /* /dev/pts/N */
};

/** NULL; or why this system has none, and what to do instead. */
extern const char *const net_pty_missing;

/** Make one, raw and without echo, and a symbolic link to it. A link that leads nowhere (left over from a
 * crash) is replaced, anything else at that path is not.
 *  @return 0, or errno; EEXIST: there is something at `link` */
int net_pty_open(struct net_pty *pty, const char *link);

/** Remove the link, if it is still ours: no one shall open it any more. */
void net_pty_unlink(const struct net_pty *pty);

void net_pty_close(struct net_pty *pty);

/** Not attached, but someone has opened it: attach. @return true and the stream */
bool net_pty_opened(struct net_pty *pty, struct net_stream *stream);

#endif
