/* SPDX-License-Identifier: MIT
 * What a request of HTTP/1.1 (RFC 9112) says, as far as this server asks. [task] Pure. */
#ifndef WIFICNC_NET_HTTP_REQUEST_H
#define WIFICNC_NET_HTTP_REQUEST_H

#include <stdbool.h>
#include <stddef.h>

enum net_http_parsed {
    NET_HTTP_GOOD,
    NET_HTTP_BAD,
    NET_HTTP_METHOD, /* neither GET, HEAD nor POST */
    NET_HTTP_BAD_HOST,
    NET_HTTP_BAD_ORIGIN,
};

/** Texts lie in the request itself; "" where it has none. */
struct net_http_request {
    const char *path; /* without the query */
    const char *host, *origin;
    const char *key;  /* Sec-WebSocket-Key */
    const char *tag;  /* If-None-Match */
    const char *type; /* Content-Type */
    bool head_only;   /* HEAD */
    bool posts;       /* POST */
    bool has_length;  /* of the body: a Content-Length, and nothing else that says it */
    bool takes_gzip;
    bool upgrades; /* a whole handshake of a WebSocket, version 13 */
};

/** How long a request is as a whole, once its head is there; only POST has a body here. @param text
 * NUL-terminated @param[out] head  bytes up to the body @return 0: the head is not complete */
size_t net_http_whole(const char *text, size_t *head);

/** @param text  NUL-terminated, with the empty line at its end; it is cut into pieces */
enum net_http_parsed net_http_parse(char *text, struct net_http_request *request);

/** Whether the Host of a request can be ours: an address, localhost, or a name that no name server of others
 * gives away: NAME.local, our own, and those of a list. @param name  ours, without .local @param names  the
 * list, with commas between them; NULL: none */
bool net_http_host_is_ours(const char *host, const char *name, const char *names);

/** Whether the page that opens a WebSocket came from here. Programs say no Origin. */
bool net_http_origin_is_ours(const struct net_http_request *request);

#endif
