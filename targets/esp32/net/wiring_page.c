/* SPDX-License-Identifier: MIT */
#include "net/wiring_page.h"

#include "net_json.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { BODY_SIZE = 1024, FIELD_SIZE = 12, NUMBER_MAX = 3 };

struct wiring_page {
    struct wiring_page_options options;
    struct wish {
        bool restart, has_key;
        char key[NET_JSON_VALUE];
        uint8_t count;
        struct {
            uint8_t index, pin;
        } pin[DEVICE_PINS];
    } wish; /* of the request that is read */
    char body[BODY_SIZE];
};

struct wiring_page *wiring_page_create(const struct wiring_page_options *options) {
    struct wiring_page *page = calloc(1, sizeof *page);
    if (page != NULL)
        page->options = *options;
    return page;
}

static void answer(struct wiring_page *page, const char *status, struct net_http_late *out) {
    *out = (struct net_http_late){.status = status, .type = "application/json", .body = page->body};
}

static bool refuse(struct wiring_page *page, struct net_http_late *out, const char *status, const char *field,
                   const char *why) {
    snprintf(page->body, BODY_SIZE, "{\"error\": \"%s\", \"field\": \"%s\"}", why, field);
    answer(page, status, out);
    return true;
}

static bool describe(struct wiring_page *page, const struct net_http_call *call, struct net_http_late *out) {
    const struct device *device = page->options.device;
    int at = snprintf(page->body, BODY_SIZE, "{\"may\": %s, \"pins\": {",
                      access_may(page->options.access, call->peer) ? "true" : "false");
    const char *comma = "";
    for (unsigned index = 0; index < DEVICE_PINS && at + FIELD_SIZE + 8 < BODY_SIZE; index++) {
        const char *key = page->options.key_of(index);
        if (key == NULL)
            continue;
        at += snprintf(page->body + at, (size_t)(BODY_SIZE - at), "%s\"%s\": %u", comma, key,
                       device->kept_wiring.pin[index]);
        comma = ", ";
    }
    snprintf(page->body + at, (size_t)(BODY_SIZE - at), "}}");
    answer(page, "200 OK", out);
    return true;
}

/* ---- what is asked for ---- */

/* @return DEVICE_PINS: no pin that can be moved */
static unsigned index_of(const struct wiring_page *page, const char *name) {
    unsigned index = 0;
    for (; index < DEVICE_PINS; index++) {
        const char *key = page->options.key_of(index);
        if (key != NULL && strcmp(key, name) == 0)
            break;
    }
    return index;
}

static bool take_pin(struct wiring_page *page, const char *name, const char *value) {
    struct wish *wish = &page->wish;
    const unsigned index = index_of(page, name);
    const size_t digits = strspn(value, "0123456789");
    if (index == DEVICE_PINS || digits == 0 || digits > NUMBER_MAX || value[digits] != '\0' ||
        atoi(value) > UINT8_MAX)
        return false;
    for (unsigned i = 0; i < wish->count; i++)
        if (wish->pin[i].index == index)
            return false;
    wish->pin[wish->count].index = (uint8_t)index;
    wish->pin[wish->count++].pin = (uint8_t)atoi(value);
    return true;
}

static bool take_member(void *ctx, const char *name, const char *value, bool is_text) {
    struct wiring_page *page = ctx;
    struct wish *wish = &page->wish;
    if (strcmp(name, "key") == 0 && is_text && !wish->has_key) {
        wish->has_key = true;
        memcpy(wish->key, value, strlen(value) + 1);
        return true;
    }
    if (strcmp(name, "restart") == 0 && !is_text && strcmp(value, "true") == 0) {
        wish->restart = true;
        return true;
    }
    return !is_text && take_pin(page, name, value);
}

/* ---- other pins ---- */

static const char *why_not(enum device_answer answer) {
    return answer == DEVICE_FIXED ? "This signal cannot be moved on this board."
           : answer == DEVICE_PIN
               ? "The rules of this board do not allow this pin: wificnc boards check lists those "
                 "that are legal."
               : "A pin is a number from 0 to 63, or 255 for none.";
}

static bool stage(struct wiring_page *page, struct net_http_late *out) {
    for (unsigned i = 0; i < page->wish.count; i++) {
        const unsigned index = page->wish.pin[i].index;
        const enum device_answer result =
            device_set(page->options.device, device_pin_key(index), page->wish.pin[i].pin);
        if (result == DEVICE_DONE)
            continue;
        device_discard(page->options.device);
        (void)refuse(page, out, "400 Bad Request", page->options.key_of(index), why_not(result));
        return false;
    }
    return true;
}

static bool store(struct wiring_page *page, struct net_http_late *out) {
    switch (device_save(page->options.device, page->options.now_us(page->options.ctx))) {
    case DEVICE_DONE:
        return true;
    case DEVICE_PIN:
        (void)refuse(page, out, "400 Bad Request", "", "Two signals would have the same pin.");
        return false;
    default:
        (void)refuse(page, out, "500 Internal Server Error", "", "The controller cannot store it.");
        return false;
    }
}

static bool obey(struct wiring_page *page, struct net_http_late *out) {
    struct device *device = page->options.device;
    const char *busy = page->options.why_busy(page->options.ctx);
    if (busy != NULL)
        return refuse(page, out, "409 Conflict", "", busy);
    if (page->wish.count > 0) {
        if (device_differs(device))
            return refuse(page, out, "409 Conflict", "",
                          "Another client is about to change pins or the network.");
        if (!stage(page, out) || !store(page, out))
            return true;
    }
    if (page->wish.restart)
        page->options.restart(page->options.ctx);
    snprintf(page->body, BODY_SIZE, "{}");
    answer(page, "200 OK", out);
    return true;
}

bool wiring_page_call(struct wiring_page *page, const struct net_http_call *call, struct net_http_late *out) {
    struct wish *wish = &page->wish;
    struct access *access = page->options.access;
    if (call->body == NULL)
        return describe(page, call, out);
    *wish = (struct wish){.count = 0};
    if (!net_json_read(call->body, take_member, page))
        return refuse(page, out, "400 Bad Request", "",
                      "Not understood: docs/web.md lists the members of this request.");
    if (access_may(access, call->peer))
        return obey(page, out);
    if (!wish->has_key)
        return refuse(page, out, "401 Unauthorized", "key", "The access key of the controller is missing.");
    switch (access_try(access, call->peer, call->since_us, wish->key, strlen(wish->key))) {
    case ACCESS_WAIT:
        return false;
    case ACCESS_GOOD:
        return obey(page, out);
    default:
        return refuse(page, out, "401 Unauthorized", "key", "This is not the access key.");
    }
}
