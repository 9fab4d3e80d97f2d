/* SPDX-License-Identifier: MIT
 * The page that the firmware carries, at port 80. [controller task] The files lie in flash as they were
 * packed. */
#ifndef WIFICNC_ESP32_PAGE_H
#define WIFICNC_ESP32_PAGE_H

#include "net_http.h"
#include "net_hub.h"

/** Names of the page, which outlive it, and how its network is set up. */
struct page_names {
    const char *own;    /* of the controller in its networks */
    const char *others; /* net_http_site.names */
    /* As in net_http_site; NULL: there is no network to set. */
    bool (*network)(void *setup, const struct net_http_call *call, struct net_http_late *out);
    const char *(*portal)(void *setup, uint64_t here, uint64_t peer);
    void *setup;
    bool has_pins;
    /* Likewise; NULL: no updates are taken. */
    void (*update)(void *updates, const struct net_stream *stream);
    void *updates;
    const char *digest; /* of the firmware that runs; NULL: unknown */
};

/** Listen. @param hub  browsers become its clients
 *  @param host  NULL: all networks
 *  @param port  "80"
 *  @return false: *error is an errno */
bool page_start(struct net_hub *hub, const char *host, const struct page_names *names, const char *port,
                int *error);

/** A round. @return true: there is more to do immediately */
bool page_poll(uint32_t now_us);

#endif
