/* SPDX-License-Identifier: MIT
 * The page of the controller over HTTP, and Grbl's stream of bytes in a WebSocket. [task] Plain BSD sockets;
 * nothing blocks, and nobody who does not read or write holds anybody else up.
 *
 *   GET / ...                a file of the page, packed by gzip as it lies in flash
 *   GET /api/controller      who serves, as JSON
 *   GET /grbl, WebSocket     a client like any other: who owns, who observes and who must say a password is
 * the hub's
 *
 * Pages from elsewhere may not command: a request's Host must be an address or a name that no name server of
 * others gives away (against DNS rebinding), and the Origin of a WebSocket must be that host. A connection
 * has one request. */
#ifndef WIFICNC_NET_HTTP_H
#define WIFICNC_NET_HTTP_H

#include "net_stream.h"
#include "net_tcp.h"

#include <stdint.h>

/** NET_HTTP_HEAD: bytes of a request; Chromium's have some 500. */
enum { NET_HTTP_PLACES = 4, NET_HTTP_HEAD = 1536, NET_HTTP_ABOUT = 160, NET_HTTP_NAMES = 96 };

struct net_http_file {
    const char *path;     /* "/index.html" */
    const char *type;     /* Content-Type */
    const char *tag;      /* of its content: the ETag, without quotes */
    const uint8_t *bytes; /* gzip */
    uint32_t size;
    bool forever; /* its name changes with its content */
};

/** What does not change while it is served; all of it outlives the server. */
struct net_http_site {
    const struct net_http_file *files;
    size_t count;
    /** ASCII without quotes, together at most NET_HTTP_NAMES bytes; the name without .local */
    const char *name, *version, *board;
    unsigned axes;
    /** A browser has opened the stream; the callee owns it now */
    void (*connect)(void *ctx, const struct net_stream *stream, const char *who);
    void *ctx;
};

struct net_http_place {
    struct net_stream stream; /* .ops NULL: free */
    char who[NET_ADDRESS_SIZE];
    char *head;       /* the request as far as it came, then the head of the answer; NET_HTTP_HEAD bytes */
    size_t count;     /* of head */
    size_t sent;      /* of the answer's head */
    bool answers;     /* the request has come */
    bool upgrades;    /* ... and asks for the stream */
    const char *body; /* behind the head */
    size_t body_left;
    uint32_t heard_us; /* when it last got on */
};

struct net_http {
    const struct net_http_site *site;
    int listener; /* -1: closed */
    struct net_http_place place[NET_HTTP_PLACES];
};

/** Listen. @param host  NULL: all networks
 *  @return false: *error is an errno */
bool net_http_open(struct net_http *http, const struct net_http_site *site, const char *host,
                   const char *port, int *error);

/** Take what has come, send what there is room for. Call it every ms or so. @param now_us  wraps
 *  @return true: there is more to do at once */
bool net_http_poll(struct net_http *http, uint32_t now_us);

/** Everybody is disconnected. */
void net_http_close(struct net_http *http);

#endif
