/* SPDX-License-Identifier: MIT
 * The page of `wificnc serve --http`: the web server of the firmware (net_http.h), and for each browser a
 * connection to the controller, which may be any program with a TCP port.
 *
 *   browser -- WebSocket /grbl -- [page] -- TCP -- controller      byte for byte, both ways
 *
 * The controller keeps the rules of owner, observers and access key, as for every other client. One thread
 * calls all of this but page_wake(). */
#ifndef WIFICNC_PC_PAGE_H
#define WIFICNC_PC_PAGE_H

#include "net_http.h"
#include "net_mdns.h"

struct page;

/** Called in page_run(): looks for a file, and answers by page_put_file() before it returns, or not. */
typedef void page_find(const char *path);

/** A page that does not listen yet. All strings outlive it.
 *  @param name  of this computer in its networks @param names  others that lead here (net_http_site)
 *  @param about  the controller, as JSON
 *  @return NULL: memory is short */
struct page *page_create(const char *name, const char *names, const char *about, page_find *find);

/** The file that was asked for. Its texts and bytes are needed until page_find() returns.
 *  @param tag  of its content
 *  @param packed  by gzip; NULL: there is no such copy */
void page_put_file(struct page *page, const char *type, const char *tag, const uint8_t *packed,
                   uint32_t packed_size, const uint8_t *plain, uint32_t plain_size, bool forever);

/** Browsers become clients of the controller there. Without this call only files are served, as any web host
 * has them. */
void page_set_controller(struct page *page, const char *host, const char *port);

/** Listen. @param[out] address  "127.0.0.1:8080", the port that was got
 *  @return 0; an error of the system; or -1, when the host is unknown */
int page_listen(struct page *page, const char *host, const char *port, char address[NET_ADDRESS_SIZE]);

enum page_event {
    PAGE_WOKEN, /* by page_wake() */
    PAGE_ASKED, /* a browser asks for the other controllers: page_found() answers it */
    PAGE_FAILED /* waiting did */
};

/** [after page_listen()] Computers of the network find the page by multicast DNS. @param mdns  is copied
 *  @param host, port  "0.0.0.0" and NET_MDNS_PORT outside of tests
 *  @return false: another program has that port for itself */
bool page_announce(struct page *page, const struct net_mdns *mdns, const char *host, uint16_t port);

/** Serve until something happens. */
enum page_event page_run(struct page *page);

/** What browsers have asked for. The texts may go when this returns. */
void page_found(struct page *page, const char *status, const char *type, const char *body);

/** [any thread] page_run() returns. */
void page_wake(struct page *page);

/** Everyone is disconnected. */
void page_close(struct page *page);

#endif
