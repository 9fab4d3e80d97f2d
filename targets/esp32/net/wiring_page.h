/* SPDX-License-Identifier: MIT
 * /api/pins of the page: which signal is on which pin, by the keys of the storage (protocol/nvs.toml), and
 * another pin for it from the next start on. [controller task] Plain C: it is tested on a computer.
 *
 * Everything needs the access key, or a trusted address, also in the own network. Which pins are legal is
 * device/device.h's. The pins before return if no one comes after that start (net/update_trial.h). */
#ifndef WIFICNC_ESP32_WIRING_PAGE_H
#define WIFICNC_ESP32_WIRING_PAGE_H

#include "access/access.h"
#include "device/device.h"
#include "net_http.h"

struct wiring_page_options {
    struct device *device;
    struct access *access;
    /** The storage's key of a pin. @param index  as in struct device_wiring @return NULL: it is fixed */
    const char *(*key_of)(unsigned index);
    /** Why no flash may be written and nothing restarted now; NULL: it may. */
    const char *(*why_busy)(void *ctx);
    /** Soon: the answer goes out first. */
    void (*restart)(void *ctx);
    /** The clock of device_poll(). */
    uint64_t (*now_us)(void *ctx);
    void *ctx;
};

struct wiring_page;

/** [start] All that options point to outlives it. @return NULL: memory is short */
struct wiring_page *wiring_page_create(const struct wiring_page_options *options);

/** A request. @return false: not yet, ask again */
bool wiring_page_call(struct wiring_page *page, const struct net_http_call *call, struct net_http_late *out);

#endif
