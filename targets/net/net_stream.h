/* SPDX-License-Identifier: MIT
 * A byte stream that never blocks: a TCP connection, the pty, on a chip its serial port. The hub knows no
 * other. */
#ifndef WIFICNC_NET_STREAM_H
#define WIFICNC_NET_STREAM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { NET_GONE = -1, NET_ENDED = -2 };

/** From read() in place of a count, each followed by something else: bytes before the next one were lost, or
 * came damaged; NET_SPOILED: the line that comes next is not to be trusted, for a reason that was given
 * already. */
enum { NET_LOST = -3, NET_UNFRAMED = -4, NET_SPOILED = -5 };

/** A pendant at a port of its own (net_hub_pendant.c). */
enum net_pendant {
    NET_PENDANT_NONE,
    NET_PENDANT_TERMINAL, /* its lines are read whenever the machine is free */
    NET_PENDANT_MPG       /* ... after it has taken control by 0x8B */
};

struct net_stream;

struct net_stream_ops {
    /** @return bytes read; 0: nothing now; NET_ENDED: no more will come, but the other end may still listen;
     *  NET_GONE: it is not there any more; a serial port NET_LOST, NET_UNFRAMED, NET_SPOILED, too */
    long (*read)(const struct net_stream *stream, char *bytes, size_t size);
    /** @return bytes taken, 0 .. count; NET_GONE */
    long (*write)(const struct net_stream *stream, const char *bytes, size_t count);
    void (*close)(const struct net_stream *stream);
};

struct net_stream {
    const struct net_stream_ops *ops; /* NULL: no stream */
    void *ctx;                        /* the transport's own */
    int fd;                           /* for poll() */
    bool local;                       /* a wire or a file of this machine: needs no key */
    uint8_t pendant;                  /* enum net_pendant */
    bool telnet;                      /* the other end may speak telnet: IAC sequences are negotiation */
    uint64_t peer; /* tells addresses apart, of IPv6 networks (base/lockout.h); 0: of no network */
    uint64_t host; /* the other half of an IPv6 address, else 0 (struct access_trust) */
};

#endif
