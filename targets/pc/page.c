/* SPDX-License-Identifier: MIT */
#include "page.h"

#include "net_connect.h"
#include "net_mdns_udp.h"
#include "net_socket.h"
#include "net_tcp.h"
#include "port.h"

#include <stdlib.h>
#include <string.h>

/* More than a controller has places for: the controller sends a message to one that comes too late. */
enum { LINKS = 2 * NET_CLIENTS, PIECE = 4096 };

#define SILENT_US 60000000u /* longer than browsers keep a connection for later */

enum { LOOK_MS = 1000 }; /* browsers that do not get on are noticed by net_http_poll() */

enum {
    POLL_WAKE,
    POLL_LISTENER,
    POLL_MDNS,
    POLL_PLACES,
    POLL_LINKS = POLL_PLACES + NET_HTTP_PLACES,
    POLL_COUNT = POLL_LINKS + 2 * LINKS
};

_Static_assert((int)POLL_COUNT <= (int)PORT_POLLS_MAX, "port_poll() takes them all");

/* Bytes on their way; more are read when these have gone. */
struct piece {
    char bytes[PIECE];
    size_t at, count;
};

/* A browser's stream and its connection to the controller. .ops NULL: the browser has gone; both: free. */
struct link {
    struct net_stream browser, controller;
    struct piece up, down; /* to the controller, to the browser */
    bool ended;            /* the controller says no more */
};

enum search { SEARCH_RESTS, SEARCH_WANTED, SEARCH_RUNS };

struct page {
    struct net_http http;
    struct net_http_site site;
    page_find *find;
    struct net_http_file file; /* the one that was found; .path NULL: none */
    struct link link[LINKS];
    const char *controller_host, *controller_port;
    enum search search;
    const struct net_http_late *found; /* of the search, while it is handed out */
    struct net_mdns mdns;
    int mdns_socket; /* -1: it is not announced */
    struct port_wake wake;
    struct port_poll poll[POLL_COUNT];
};

static bool is_open(const struct net_stream *stream) {
    return stream->ops != NULL;
}

static void shut(struct net_stream *stream) {
    if (is_open(stream))
        stream->ops->close(stream);
    stream->ops = NULL;
}

/* ---- links ---- */

/* @return false: the end that is written to has gone */
static bool push(struct piece *piece, const struct net_stream *to) {
    long sent = to->ops->write(to, piece->bytes + piece->at, piece->count);
    if (sent < 0)
        return false;
    piece->at += (size_t)sent;
    piece->count -= (size_t)sent;
    return true;
}

/* Passes bytes on as far as there is room. @return false: the end that is read has no more */
static bool pull(struct piece *piece, const struct net_stream *from) {
    if (piece->count > 0)
        return true;
    long count = from->ops->read(from, piece->bytes, PIECE);
    piece->at = 0;
    piece->count = count > 0 ? (size_t)count : 0;
    return count >= 0;
}

/* What a browser sent before it went still reaches the controller. */
static void move_up(struct link *link) {
    if (is_open(&link->browser) && !pull(&link->up, &link->browser))
        shut(&link->browser);
    if (link->up.count > 0 && !push(&link->up, &link->controller))
        link->ended = true;
    if (!is_open(&link->browser) && link->up.count == 0)
        link->ended = true;
}

/* Also when there is nothing to say: a pong may wait in the stream. */
static void move_down(struct link *link) {
    if (!link->ended && !pull(&link->down, &link->controller))
        link->ended = true;
    if (is_open(&link->browser) && !push(&link->down, &link->browser))
        shut(&link->browser);
}

static void move(struct link *link) {
    move_up(link);
    move_down(link);
    if (!link->ended || (is_open(&link->browser) && link->down.count > 0))
        return;
    shut(&link->browser);
    shut(&link->controller);
}

static bool connect_controller(const struct page *page, struct net_stream *stream) {
    int fd = net_connect(page->controller_host, page->controller_port);
    return fd >= 0 && net_tcp_stream(fd, stream);
}

/* A controller that has ended is found out by the browser, whose stream is closed. */
static void connect_browser(void *ctx, const struct net_stream *stream, const char *who) {
    struct page *page = ctx;
    struct net_stream browser = *stream;
    (void)who;
    for (struct link *link = page->link; link < page->link + LINKS; link++) {
        if (is_open(&link->controller))
            continue;
        memset(link, 0, sizeof *link);
        if (!connect_controller(page, &link->controller))
            break;
        link->browser = browser;
        return;
    }
    shut(&browser);
}

/* ---- files ---- */

static bool find_file(void *ctx, const char *path, struct net_http_file *out) {
    struct page *page = ctx;
    page->file.path = NULL;
    page->find(path);
    *out = page->file;
    out->path = path;
    return page->file.path != NULL;
}

void page_put_file(struct page *page, const char *type, const char *tag, const uint8_t *packed,
                   uint32_t packed_size, const uint8_t *plain, uint32_t plain_size, bool forever) {
    page->file = (struct net_http_file){.path = "",
                                        .type = type,
                                        .tag = tag,
                                        .packed = {packed, packed_size},
                                        .plain = {plain, plain_size},
                                        .forever = forever};
}

/* ---- the other controllers of this network ---- */

static bool discover(void *ctx, struct net_http_late *out) {
    struct page *page = ctx;
    if (page->found == NULL) {
        page->search = page->search == SEARCH_RESTS ? SEARCH_WANTED : page->search;
        return false;
    }
    *out = *page->found;
    return true;
}

static uint32_t now_us(void) {
    return (uint32_t)(port_clock_ns() / 1000);
}

void page_found(struct page *page, const char *status, const char *type, const char *body) {
    const struct net_http_late found = {.status = status, .type = type, .body = body};
    page->found = &found;
    (void)net_http_poll(&page->http, now_us());
    page->found = NULL;
    page->search = SEARCH_RESTS;
}

/* ---- start and end ---- */

struct page *page_create(const char *name, const char *names, const char *about, page_find *find) {
    struct page *page = calloc(1, sizeof *page);
    if (page == NULL)
        return NULL;
    page->site = (struct net_http_site){
        .name = name, .names = names, .about = about, .find = find_file, .ctx = page, .silent_us = SILENT_US};
    page->find = find;
    page->http.listener = -1;
    page->mdns_socket = -1;
    page->wake = (struct port_wake){-1, -1};
    return page;
}

void page_set_controller(struct page *page, const char *host, const char *port) {
    page->controller_host = host;
    page->controller_port = port;
    page->site.connect = connect_browser;
    page->site.discover = discover;
}

int page_listen(struct page *page, const char *host, const char *port, char address[NET_ADDRESS_SIZE]) {
    int error = port_wake_open(&page->wake);
    if (error != 0)
        return error;
    if (net_http_open(&page->http, &page->site, host, port, address, &error))
        return 0;
    return error != 0 ? error : -1;
}

bool page_announce(struct page *page, const struct net_mdns *mdns, const char *host, uint16_t port) {
    page->mdns = *mdns;
    page->mdns_socket = net_mdns_open(host, port);
    if (page->mdns_socket < 0)
        return false;
    net_mdns_join(page->mdns_socket, &page->mdns);
    return true;
}

void page_close(struct page *page) {
    if (page->mdns_socket >= 0) {
        net_mdns_leave(page->mdns_socket, &page->mdns);
        net_socket_close(page->mdns_socket);
    }
    for (struct link *link = page->link; link < page->link + LINKS; link++) {
        shut(&link->browser);
        shut(&link->controller);
    }
    net_http_close(&page->http);
    port_wake_close(&page->wake);
    free(page);
}

/* ---- serving ---- */

static void await(struct port_poll *slot, const struct net_stream *stream, bool reads, bool writes) {
    short wanted = (short)((reads ? PORT_READ : 0) | (writes ? PORT_WRITE : 0));
    *slot = (struct port_poll){.fd = is_open(stream) && wanted != 0 ? stream->fd : -1, .wanted = wanted};
}

static void fill_poll(struct page *page) {
    const struct net_http *http = &page->http;
    for (unsigned i = 0; i < NET_HTTP_PLACES; i++) {
        const struct net_http_place *place = &http->place[i];
        await(&page->poll[POLL_PLACES + i], &place->stream, !place->answers && !place->waits, place->answers);
    }
    for (unsigned i = 0; i < LINKS; i++) {
        const struct link *link = &page->link[i];
        await(&page->poll[POLL_LINKS + 2 * i], &link->browser, link->up.count == 0, link->down.count > 0);
        await(&page->poll[POLL_LINKS + 2 * i + 1], &link->controller, !link->ended && link->down.count == 0,
              link->up.count > 0);
    }
    bool lets_in = net_http_has_room(http, now_us());
    page->poll[POLL_LISTENER] = (struct port_poll){.fd = lets_in ? http->listener : -1, .wanted = PORT_READ};
    page->poll[POLL_MDNS] = (struct port_poll){.fd = page->mdns_socket, .wanted = PORT_READ};
    page->poll[POLL_WAKE] = (struct port_poll){.fd = page->wake.wait_fd, .wanted = PORT_READ};
}

enum page_event page_run(struct page *page) {
    bool more = false;
    for (;;) {
        fill_poll(page);
        int error, ready = port_poll(page->poll, POLL_COUNT, more ? 0 : LOOK_MS, &error);
        if (ready < 0)
            return PAGE_FAILED;
        if (port_wake_taken(&page->wake))
            return PAGE_WOKEN;
        if (page->mdns_socket >= 0)
            net_mdns_poll(page->mdns_socket, &page->mdns, now_us());
        more = net_http_poll(&page->http, now_us()) || ready > 0; /* a stream that closes is read twice */
        for (struct link *link = page->link; link < page->link + LINKS; link++)
            if (is_open(&link->controller))
                move(link);
        if (page->search == SEARCH_WANTED) {
            page->search = SEARCH_RUNS;
            return PAGE_ASKED;
        }
    }
}

void page_wake(struct page *page) {
    port_wake(&page->wake);
}
