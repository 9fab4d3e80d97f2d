/* SPDX-License-Identifier: MIT */
#include "net_http.h"

#include "net_http_request.h"
#include "net_websocket.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* An answer whose other end takes nothing for this long ends. Poor WiFi repeats a lost packet after several
 * seconds, and half a file is of no use. */
#define SLOW_US 30000000u

static const char about_path[] = "/api/controller";
static const char discover_path[] = "/api/discover";
static const char stream_path[] = "/grbl";
static const char no_page[] = "This firmware does not include the web page. The Grbl stream is at port 23.\n";

/* ---- answers ---- */

/* @param more  header lines, each with its end; "" none */
static void answer(struct net_http_place *place, const char *status, const char *type, const char *more,
                   const char *body, size_t size) {
    int count = snprintf(place->head, NET_HTTP_HEAD,
                         "HTTP/1.1 %s\r\nContent-Type: %s\r\nContent-Length: %u\r\nConnection: close\r\n"
                         "X-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n"
                         "Cross-Origin-Resource-Policy: same-origin\r\n"
                         "Content-Security-Policy: frame-ancestors 'none'\r\n%s\r\n",
                         status, type, (unsigned)size, more);
    place->count = (size_t)count;
    place->sent = 0;
    place->answers = true;
    place->body = body;
    place->body_left = place->head_only ? 0 : size;
}

/* @param more  as of answer() @param body  outlives the answer */
static void refuse(struct net_http_place *place, const char *status, const char *more, const char *body) {
    answer(place, status, "text/plain; charset=utf-8", more, body, strlen(body));
}

/* A body that is to be sent after its owner is gone. @return NULL: memory is short */
static const char *keep(struct net_http_place *place, const void *body, size_t size) {
    place->own = malloc(size + 1);
    if (place->own != NULL)
        memcpy(place->own, body, size);
    return place->own;
}

static void answer_no_memory(struct net_http_place *place) {
    refuse(place, "503 Service Unavailable", "", "Out of memory.\n");
}

/* Each copy has its own tag: a cache may not mistake one for the other (RFC 9110, 8.8.3). */
static void answer_file(struct net_http_place *place, const struct net_http_file *file, bool keeps,
                        const struct net_http_request *request) {
    bool packs = request->takes_gzip && file->packed.bytes != NULL;
    const struct net_http_copy *copy = packs ? &file->packed : &file->plain;
    const char *body = keeps ? (const char *)copy->bytes : keep(place, copy->bytes, copy->size);
    char more[160], tag[48];
    if (body == NULL) {
        answer_no_memory(place);
        return;
    }
    snprintf(tag, sizeof tag, "\"%s%s\"", file->tag, packs ? "" : "-plain");
    bool known = strstr(request->tag, tag) != NULL;
    snprintf(more, sizeof more, "ETag: %s\r\n%sVary: Accept-Encoding\r\nCache-Control: %s\r\n", tag,
             packs ? "Content-Encoding: gzip\r\n" : "",
             file->forever ? "max-age=31536000, immutable" : "no-cache");
    answer(place, known ? "304 Not Modified" : "200 OK", file->type, more, body, copy->size);
    if (known)
        place->body_left = 0;
}

static void answer_about(struct net_http_place *place, const char *about) {
    answer(place, "200 OK", "application/json", "Cache-Control: no-store\r\n", about, strlen(about));
}

/* @return false: it has not come yet */
static bool answer_late(struct net_http_place *place, const struct net_http_site *site) {
    struct net_http_late late;
    if (!site->discover(site->ctx, &late))
        return false;
    const char *body = keep(place, late.body, strlen(late.body));
    if (body == NULL)
        answer_no_memory(place);
    else
        answer(place, late.status, late.type, "Cache-Control: no-store\r\n", body, strlen(late.body));
    return true;
}

static void answer_upgrade(struct net_http_place *place, const struct net_http_request *request) {
    char accept[NET_WEBSOCKET_ACCEPT_SIZE];
    net_websocket_accept(request->key, accept);
    place->count = (size_t)snprintf(place->head, NET_HTTP_HEAD,
                                    "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\n"
                                    "Connection: Upgrade\r\nSec-WebSocket-Accept: %s\r\n\r\n",
                                    accept);
    place->sent = place->body_left = 0;
    place->answers = place->upgrades = true;
}

/* Any page may open a WebSocket to any address; only the Origin tells where it came from. */
static void answer_stream(struct net_http_place *place, const struct net_http_request *request) {
    if (!request->upgrades)
        refuse(place, "426 Upgrade Required", "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n",
               "This address is a WebSocket.\n");
    else if (!net_http_origin_is_ours(request))
        refuse(place, "403 Forbidden", "", "Refused: the page comes from another origin.\n");
    else
        answer_upgrade(place, request);
}

static bool find_file(const struct net_http_site *site, const char *path, struct net_http_file *out) {
    if (site->find != NULL)
        return site->find(site->ctx, path, out);
    for (size_t i = 0; i < site->count; i++) {
        *out = site->files[i];
        if (strcmp(out->path, strcmp(path, "/") == 0 ? "/index.html" : path) == 0)
            return true;
    }
    return false;
}

static void answer_page(struct net_http_place *place, const struct net_http_site *site,
                        const struct net_http_request *request) {
    struct net_http_file file;
    if (site->count == 0 && site->find == NULL)
        refuse(place, "404 Not Found", "", no_page);
    else if (!find_file(site, request->path, &file))
        refuse(place, "404 Not Found", "", "File not found.\n");
    else if (!request->takes_gzip && file.plain.bytes == NULL)
        refuse(place, "406 Not Acceptable", "", "This page is available in gzip encoding only.\n");
    else
        answer_file(place, &file, site->find == NULL, request);
}

static void answer_request(struct net_http_place *place, const struct net_http_site *site) {
    struct net_http_request request;
    switch (net_http_parse(place->head, &request)) {
    case NET_HTTP_BAD:
        refuse(place, "400 Bad Request", "", "Not an HTTP/1.1 request.\n");
        return;
    case NET_HTTP_METHOD:
        refuse(place, "405 Method Not Allowed", "Allow: GET, HEAD\r\n", "Only GET and HEAD are supported.\n");
        return;
    case NET_HTTP_GOOD:
        break;
    }
    place->head_only = request.head_only;
    /* Before anything is served: a page of another site whose name was made to lead here (DNS rebinding)
     * sends its own name. */
    if (!net_http_host_is_ours(request.host, site->name))
        refuse(place, "421 Misdirected Request", "", "Unknown host name: use the controller's address.\n");
    else if (site->connect != NULL && strcmp(request.path, stream_path) == 0)
        answer_stream(place, &request);
    else if (site->about != NULL && strcmp(request.path, about_path) == 0)
        answer_about(place, site->about);
    else if (site->discover != NULL && strcmp(request.path, discover_path) == 0)
        place->waits = true;
    else
        answer_page(place, site, &request);
}

/* ---- connections ---- */

static void end(struct net_http_place *place) {
    if (place->stream.ops != NULL)
        place->stream.ops->close(&place->stream);
    free(place->head);
    free(place->own);
    *place = (struct net_http_place){0};
}

/* The connection is the hub's from here on. */
static void hand_over(struct net_http_place *place, const struct net_http_site *site) {
    struct net_websocket *websocket = malloc(sizeof *websocket);
    struct net_stream stream;
    if (websocket != NULL) {
        net_websocket_open(websocket, &place->stream, &stream);
        /* So that end() does not close it. */
        place->stream.ops = NULL;
        site->connect(site->ctx, &stream, place->who);
    }
    end(place);
}

/* @return how many bytes went, 0: none now; -1: it has gone */
static long send_some(struct net_http_place *place) {
    bool in_head = place->sent < place->count;
    const char *bytes = in_head ? place->head + place->sent : place->body;
    size_t count = in_head ? place->count - place->sent : place->body_left;
    long sent = count == 0 ? 0 : place->stream.ops->write(&place->stream, bytes, count);
    if (sent <= 0)
        return sent;
    if (in_head) {
        place->sent += (size_t)sent;
    } else {
        place->body += sent;
        place->body_left -= (size_t)sent;
    }
    return sent;
}

/* @return true: some of it went, and there is more */
static bool send_answer(struct net_http_place *place, const struct net_http_site *site, uint32_t now_us) {
    long sent = send_some(place);
    bool all = place->sent == place->count && place->body_left == 0;
    if (sent > 0)
        place->heard_us = now_us;
    if (all && place->upgrades)
        hand_over(place, site);
    else if (all || sent < 0)
        end(place);
    return sent > 0 && !all;
}

/* What comes behind a request is nothing that this server has asked for. */
static void read_request(struct net_http_place *place, const struct net_http_site *site) {
    size_t room = NET_HTTP_HEAD - 1 - place->count;
    long count = place->stream.ops->read(&place->stream, place->head + place->count, room);
    if (count < 0) {
        end(place);
        return;
    }
    place->count += (size_t)count;
    place->head[place->count] = '\0';
    if (strstr(place->head, "\r\n\r\n") != NULL)
        answer_request(place, site);
    else if (place->count == NET_HTTP_HEAD - 1)
        refuse(place, "431 Request Header Fields Too Large", "", "The request is too long.\n");
}

/* Without a free place a connection waits in the backlog of the system, until one of the others is served. */
static void let_in(struct net_http *http, uint32_t now_us) {
    for (struct net_http_place *place = http->place; place < http->place + NET_HTTP_PLACES; place++) {
        if (place->stream.ops != NULL)
            continue;
        if (!net_tcp_accept(http->listener, &place->stream, place->who))
            return;
        place->heard_us = now_us;
        place->head = malloc(NET_HTTP_HEAD);
        if (place->head == NULL)
            end(place);
    }
}

bool net_http_open(struct net_http *http, const struct net_http_site *site, const char *host,
                   const char *port, char address[NET_ADDRESS_SIZE], int *error) {
    *http = (struct net_http){.site = site};
    http->listener = net_tcp_listen(host, port, address, error);
    return http->listener >= 0;
}

bool net_http_poll(struct net_http *http, uint32_t now_us) {
    bool any = false;
    if (http->listener < 0)
        return false;
    let_in(http, now_us);
    for (struct net_http_place *place = http->place; place < http->place + NET_HTTP_PLACES; place++) {
        if (place->stream.ops != NULL && !place->answers && !place->waits)
            read_request(place, http->site);
        if (place->waits && answer_late(place, http->site))
            place->waits = false;
        if (place->stream.ops != NULL && place->answers)
            any |= send_answer(place, http->site, now_us);
        if (place->stream.ops != NULL &&
            now_us - place->heard_us >= (place->answers ? SLOW_US : http->site->silent_us))
            end(place);
    }
    return any;
}

void net_http_close(struct net_http *http) {
    for (struct net_http_place *place = http->place; place < http->place + NET_HTTP_PLACES; place++)
        if (place->stream.ops != NULL)
            end(place);
    if (http->listener >= 0)
        net_socket_close(http->listener);
    http->listener = -1;
}
