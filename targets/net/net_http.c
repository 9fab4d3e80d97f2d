/* SPDX-License-Identifier: MIT */
#include "net_http.h"

#include "net_http_request.h"
#include "net_places.h"
#include "net_websocket.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* An answer whose other end takes nothing for this long ends. Poor WiFi repeats a lost packet after several
 * seconds, and half a file is of no use. */
#define SLOW_US 30000000u

/* A request that has begun is complete after this long, or never. */
#define REQUEST_US 5000000u

/* While places are scarce: a newcomer's request is on its way for this long; an answer that is not taken, or
 * takes this long in all, makes room. */
#define YOUNG_US   250000u
#define STALLED_US 1000000u
#define OLD_US     10000000u

enum { ACCEPTS_A_ROUND = 8 };

static const char about_path[] = "/api/controller";
static const char discover_path[] = "/api/discover";
static const char network_path[] = "/api/network";
static const char pins_path[] = "/api/pins";
static const char stream_path[] = "/grbl";
static const char update_path[] = "/update";
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

/* @return the address of the page that sets the network up, for who has come through the own network; else
 * NULL */
static const char *own_page(const struct net_http_place *place, const struct net_http_site *site) {
    return site->portal == NULL ? NULL
                                : site->portal(site->setup, net_tcp_here(&place->stream), place->stream.peer);
}

/* @return false: it has not come yet */
static bool answer_late(struct net_http_place *place, const struct net_http_site *site) {
    struct net_http_late late;
    const struct net_http_call call = {.topic = (enum net_http_topic)place->topic,
                                       .body = place->body_at > 0 ? place->head + place->body_at : NULL,
                                       .peer = place->stream.peer,
                                       .own = own_page(place, site) != NULL,
                                       .since_us = place->since_us};
    if (!(place->topic != NET_HTTP_NO_TOPIC ? site->network(site->setup, &call, &late)
                                            : site->discover(site->ctx, &late)))
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

static void refuse_method(struct net_http_place *place) {
    refuse(place, "405 Method Not Allowed", "Allow: GET, HEAD\r\n", "Only GET and HEAD are supported.\n");
}

/* @return NET_HTTP_NO_TOPIC: another address */
static enum net_http_topic topic_of(const struct net_http_site *site, const char *path) {
    return site->network == NULL                            ? NET_HTTP_NO_TOPIC
           : strcmp(path, network_path) == 0                ? NET_HTTP_NETWORK
           : site->has_pins && strcmp(path, pins_path) == 0 ? NET_HTTP_PINS
                                                            : NET_HTTP_NO_TOPIC;
}

/* A form of another page can send what it likes, but neither this Origin nor this type. */
static void answer_topic(struct net_http_place *place, const struct net_http_request *request,
                         enum net_http_topic topic, size_t body_at) {
    static const char type[] = "application/json";
    if (request->posts && !net_http_origin_is_ours(request))
        refuse(place, "403 Forbidden", "", "Refused: the page comes from another origin.\n");
    else if (request->posts && strncmp(request->type, type, sizeof type - 1) != 0)
        refuse(place, "415 Unsupported Media Type", "", "The Content-Type must be application/json.\n");
    else if (request->posts && !request->has_length)
        refuse(place, "411 Length Required", "", "The Content-Length of the request is missing.\n");
    else {
        place->waits = true;
        place->topic = (uint8_t)topic;
    }
    place->body_at = request->posts ? (uint16_t)body_at : 0;
}

/* Phones ask for some page of the internet to see whether there is one. */
static void answer_foreign(struct net_http_place *place, const struct net_http_site *site,
                           const struct net_http_request *request) {
    const char *page = request->posts ? NULL : own_page(place, site);
    char more[96];
    if (page == NULL) {
        refuse(place, "421 Misdirected Request", "",
               "Unknown host name: use the controller's address, or add the name to its list of names.\n");
        return;
    }
    snprintf(more, sizeof more, "Location: %s\r\nCache-Control: no-store\r\n", page);
    refuse(place, "302 Found", more, "The page of this controller is at the given location.\n");
}

/* @return false: it was refused */
static bool is_understood(struct net_http_place *place, struct net_http_request *request) {
    switch (net_http_parse(place->head, request)) {
    case NET_HTTP_BAD:
        refuse(place, "400 Bad Request", "", "Not an HTTP/1.1 request.\n");
        return false;
    case NET_HTTP_METHOD:
        refuse_method(place);
        return false;
    case NET_HTTP_BAD_HOST:
        refuse(place, "400 Bad Request", "", "The Host of the request is missing or malformed.\n");
        return false;
    case NET_HTTP_BAD_ORIGIN:
        refuse(place, "400 Bad Request", "", "The Origin of the request is malformed.\n");
        return false;
    case NET_HTTP_GOOD:
    default:
        return true;
    }
}

static void answer_request(struct net_http_place *place, const struct net_http_site *site, size_t body_at) {
    struct net_http_request request;
    if (!is_understood(place, &request))
        return;
    place->head_only = request.head_only;
    const enum net_http_topic topic = topic_of(site, request.path);
    /* Before anything is served: a page of another site whose name was made to lead here (DNS rebinding)
     * sends its own name. */
    if (!net_http_host_is_ours(request.host, site->name, site->names))
        answer_foreign(place, site, &request);
    else if (topic != NET_HTTP_NO_TOPIC)
        answer_topic(place, &request, topic, body_at);
    else if (request.posts)
        refuse_method(place);
    else if (site->connect != NULL && strcmp(request.path, stream_path) == 0)
        answer_stream(place, &request);
    else if (site->update != NULL && strcmp(request.path, update_path) == 0) {
        place->updates = true;
        answer_stream(place, &request);
    } else if (site->about != NULL && strcmp(request.path, about_path) == 0)
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
        if (place->updates)
            site->update(site->updates, &stream);
        else
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
static void read_request(struct net_http_place *place, const struct net_http_site *site, uint32_t now_us) {
    size_t room = NET_HTTP_HEAD - 1 - place->count;
    long count = place->stream.ops->read(&place->stream, place->head + place->count, room);
    if (count < 0) {
        end(place);
        return;
    }
    if (place->count == 0 && count > 0)
        place->heard_us = now_us;
    place->count += (size_t)count;
    place->head[place->count] = '\0';
    size_t head = 0;
    const bool damaged = memchr(place->head, '\0', place->count) != NULL; /* nothing behind a NUL is read */
    const size_t whole = damaged ? 0 : net_http_whole(place->head, &head);
    if (damaged)
        refuse(place, "400 Bad Request", "", "Not an HTTP/1.1 request.\n");
    else if (whole > 0 && place->count >= whole) {
        place->head[whole] = '\0';
        answer_request(place, site, head);
    } else if (whole > NET_HTTP_HEAD - 1)
        refuse(place, "413 Content Too Large", "", "The body of the request is too long.\n");
    else if (place->count == NET_HTTP_HEAD - 1)
        refuse(place, "431 Request Header Fields Too Large", "", "The request is too long.\n");
}

static uint32_t patience_us(const struct net_http_place *place, const struct net_http_site *site) {
    if (place->answers)
        return SLOW_US;
    return place->count > 0 && REQUEST_US < site->silent_us ? REQUEST_US : site->silent_us;
}

/* ---- newcomers ---- */

static enum net_rank rank_of(const struct net_http_place *place, uint32_t now_us) {
    uint32_t idle_us = now_us - place->heard_us;
    bool asks = !place->answers && !place->waits;
    if (place->stream.ops == NULL)
        return NET_RANK_FREE;
    bool stays = asks             ? idle_us < YOUNG_US
                 : place->answers ? idle_us < STALLED_US && now_us - place->since_us < OLD_US
                                  : true;
    return stays ? NET_RANK_STAYS : NET_RANK_UNPROVEN;
}

bool net_http_has_room(const struct net_http *http, uint32_t now_us) {
    for (const struct net_http_place *place = http->place; place < http->place + NET_HTTP_PLACES; place++)
        if (rank_of(place, now_us) != NET_RANK_STAYS)
            return true;
    return false;
}

/* @return NULL: none for this newcomer */
static struct net_http_place *place_for(struct net_http *http, uint64_t peer, uint32_t now_us) {
    const struct net_http_site *site = http->site;
    struct net_place places[NET_HTTP_PLACES];
    const struct net_newcomer newcomer = {
        .peer = peer, .owner = site->owner != NULL ? site->owner(site->ctx) : 0, .unproven = NET_HTTP_PLACES};
    for (size_t i = 0; i < NET_HTTP_PLACES; i++)
        places[i] = (struct net_place){.peer = http->place[i].stream.peer,
                                       .heard_us = http->place[i].heard_us,
                                       .came_us = now_us, /* each has a deadline here */
                                       .rank = (uint8_t)rank_of(&http->place[i], now_us)};
    int chosen = net_places_choose(places, NET_HTTP_PLACES, &newcomer, now_us);
    return chosen < 0 ? NULL : &http->place[chosen];
}

/* While everyone who has a place gets on, a connection waits in the backlog of the system. */
static void let_in(struct net_http *http, uint32_t now_us) {
    for (int i = 0; i < ACCEPTS_A_ROUND && net_http_has_room(http, now_us); i++) {
        struct net_http_place newcomer = {.heard_us = now_us, .since_us = now_us};
        if (!net_tcp_accept(http->listener, &newcomer.stream, newcomer.who))
            return;
        struct net_http_place *place = place_for(http, newcomer.stream.peer, now_us);
        newcomer.head = place == NULL ? NULL : malloc(NET_HTTP_HEAD);
        if (newcomer.head == NULL) {
            newcomer.stream.ops->close(&newcomer.stream);
            continue;
        }
        end(place);
        *place = newcomer;
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
            read_request(place, http->site, now_us);
        if (place->waits && answer_late(place, http->site))
            place->waits = false;
        if (place->stream.ops != NULL && place->answers)
            any |= send_answer(place, http->site, now_us);
        if (place->stream.ops != NULL && now_us - place->heard_us >= patience_us(place, http->site))
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
