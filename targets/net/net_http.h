/* SPDX-License-Identifier: MIT
 * The page of the controller over HTTP, and Grbl's stream of bytes in a WebSocket. [task] Plain BSD sockets;
 * nothing blocks, and no one who does not read or write holds anyone else up.
 *
 *   GET / ...              a file of the page; in gzip encoding where there is such a copy (on a chip always)
 *
 *   GET /api/controller    who serves, as JSON
 *
 *   GET /api/discover      other controllers in this network, as JSON; a browser cannot look itself
 *
 *   GET, POST /api/network how this controller is on a network, and another one for it, as JSON
 *
 *   GET, POST /api/pins    which signal is on which pin, and another one for it, as JSON
 *
 *   GET /grbl, WebSocket   a client like any other: who owns, who observes and who must log in is the hub's
 *
 *   GET /update, WebSocket a new firmware: who may send it, and what it may be, is the callee's
 *
 * Pages from elsewhere may not command: a request's Host must be an address, a name that no name server of
 * others gives away (against DNS rebinding), or one of the site's list; and the Origin of a WebSocket must be
 * that host, as that of a POST. A connection has one request. In the controller's own network a request for
 * any other host is sent to the page that sets the network up: phones look for that.
 *
 * No client shuts others out: one that does not ask, or does not take its answer, gives its place to a
 * newcomer when all are taken (net_places.h). */
#ifndef WIFICNC_NET_HTTP_H
#define WIFICNC_NET_HTTP_H

#include "hal/net_sizes.h" // NET_HTTP_PLACES, NET_HTTP_HEAD
#include "net_stream.h"
#include "net_tcp.h"

#include <stdint.h>

/** Bytes of a file, NULL: there is no such copy. */
struct net_http_copy {
    const uint8_t *bytes;
    uint32_t size;
};

struct net_http_file {
    const char *path; /* "/index.html" */
    const char *type; /* Content-Type */
    const char *tag;  /* of its content: the ETag, without quotes */
    struct net_http_copy packed, plain;
    bool forever; /* its name changes with its content */
};

/** An answer that took its time. Its texts are copied. */
struct net_http_late {
    const char *status; /* "200 OK" */
    const char *type;
    const char *body;
};

/** Addresses whose answer is the target's. */
enum net_http_topic { NET_HTTP_NO_TOPIC, NET_HTTP_NETWORK, NET_HTTP_PINS };

/** A request for /api/network or /api/pins. */
struct net_http_call {
    enum net_http_topic topic;
    const char *body; /* of POST, JSON; NULL: GET */
    uint64_t peer;    /* net_stream.peer */
    bool own;         /* it came through the own network */
    uint32_t since_us;
};

/** What does not change while it is served; all of it outlives the server. */
struct net_http_site {
    const struct net_http_file *files;
    size_t count;
    /** Files that may change while they are served: looked for when they are asked for, in place of the
     * table. What *out points to is copied. NULL: the table is all. @return false: there is no such file */
    bool (*find)(void *ctx, const char *path, struct net_http_file *out);
    const char *name;  /* of this computer in its networks, without .local */
    const char *names; /* others that lead here, as "shop.lan, cnc.lan"; NULL: none */
    const char *about; /* who serves, as JSON; NULL: only files are served */
    /** A browser has opened the stream; the callee owns it now. NULL: none exists */
    void (*connect)(void *ctx, const struct net_stream *stream, const char *who);
    /** A browser has opened the stream of updates; the callee owns it now. NULL: none is taken here */
    void (*update)(void *updates, const struct net_stream *stream);
    void *updates;
    /** Someone waits for the other controllers; called every round until there is an answer. NULL: this
     * server does not look for them. @return false: not yet */
    bool (*discover)(void *ctx, struct net_http_late *out);
    /** How the network is, and another one for it; or likewise the pins, where topics has them; called every
     * round until there is an answer. NULL: this server has no network to set. @return false: not yet */
    bool (*network)(void *setup, const struct net_http_call *call, struct net_http_late *out);
    /** A connection came through the own network. @param here, peer  IPv4, net_stream.peer of both ends.
     *  @return the address of the page that sets the network up; NULL: it did not */
    const char *(*portal)(void *setup, uint64_t here, uint64_t peer);
    void *setup;   /* of network() and portal() */
    bool has_pins; /* network() answers NET_HTTP_PINS, too */
    /** The address that a place is kept for, as net_stream.peer; 0: none. NULL: there is no such address */
    uint64_t (*owner)(void *ctx);
    void *ctx;
    /** A connection that asks nothing for this long is closed. A browser that uses one at that moment reports
     * an error: where places are not scarce, longer than browsers keep one for later (Chromium: 10 s) */
    uint32_t silent_us;
};

struct net_http_place {
    struct net_stream stream; /* .ops NULL: free */
    char who[NET_ADDRESS_SIZE];
    char *head;       /* the request as far as it came, then the head of the answer; NET_HTTP_HEAD bytes */
    char *own;        /* a body that no one else keeps; NULL: none */
    size_t count;     /* of head */
    size_t sent;      /* of the answer's head */
    bool head_only;   /* the answer has no body */
    bool waits;       /* the request has come, its answer has not: site->discover(), site->network() */
    uint8_t topic;    /* ... the latter, enum net_http_topic; 0: the former */
    uint16_t body_at; /* ... and this is where the body of its POST begins in head; 0: it is a GET */
    bool answers;     /* there is an answer */
    bool upgrades;    /* ... and asks for a stream */
    bool updates;     /* ... that of updates */
    const char *body; /* behind the head */
    size_t body_left;
    uint32_t heard_us; /* when it last got on */
    uint32_t since_us; /* when it came */
};

struct net_http {
    const struct net_http_site *site;
    int listener; /* -1: closed */
    struct net_http_place place[NET_HTTP_PLACES];
};

/** Listen. @param host  NULL: all networks
 *  @param[out] address  as of net_tcp_listen()
 *  @return false: *error is an errno, or 0 when the host is unknown */
bool net_http_open(struct net_http *http, const struct net_http_site *site, const char *host,
                   const char *port, char address[NET_ADDRESS_SIZE], int *error);

/** A connection that waits can be let in: there is a place, or one that may be needed for it. */
bool net_http_has_room(const struct net_http *http, uint32_t now_us);

/** Take what has come, send what there is room for. Call it every ms or so. @param now_us  wraps
 *  @return true: there is more to do immediately */
bool net_http_poll(struct net_http *http, uint32_t now_us);

/** Everyone is disconnected. */
void net_http_close(struct net_http *http);

#endif
