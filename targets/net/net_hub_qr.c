/* SPDX-License-Identifier: MIT
 * `$QR`: what a QR code of the page says, for a program that draws one, or to open. Only on request: it may
 * have the key. */
#include "net_hub_inner.h"
#include "net_line.h"

#include <stdio.h>
#include <string.h>

static const char qr_line[] = "$QR";

/* What a phone reads from the small code of a terminal (version 5, level L). */
enum { LINK_BYTES = 106 };

_Static_assert((int)LINK_BYTES < (int)NET_MESSAGE_SIZE, "a link fits a message");

/* As a part of an address of the page: what is neither letter, digit nor hyphen is encoded (RFC 3986, 2.1).
 * @return false: no room */
static bool add_key(char *link, size_t size, const char *key) {
    size_t at = strlen(link);
    int more = snprintf(link + at, size - at, "#key=");
    for (at += (size_t)more; *key != '\0' && at + 3 < size; key++) {
        const bool plain = (net_line_upper(*key) >= 'A' && net_line_upper(*key) <= 'Z') ||
                           (*key >= '0' && *key <= '9') || *key == '-';
        at += (size_t)snprintf(link + at, size - at, plain ? "%c" : "%%%02X", (unsigned char)*key);
    }
    return *key == '\0';
}

/* The key goes to who has a cable, as in net_hub_tell_key(). */
static void say_link(struct net_hub *hub, struct net_client *client, const char *address) {
    char link[LINK_BYTES + 1];
    const char *key = net_hub_key_for(hub, client);
    snprintf(link, sizeof link, "%s", address);
    const bool is_whole = key == NULL || add_key(link, sizeof link, key);
    net_hub_say_message(hub, client, is_whole ? link : address);
}

bool net_hub_is_qr_line(const struct net_hub *hub, const char *line, size_t size) {
    return hub->ops->page != NULL && size == sizeof qr_line - 1 && net_line_commands(line, size, qr_line);
}

void net_hub_answer_qr(struct net_hub *hub, struct net_client *client) {
    char address[NET_NAME_SIZE];
    if (!hub->ops->page(hub->ctx, address, sizeof address)) {
        net_hub_refuse(hub, client, STATUS_UNKNOWN_COMMAND, "No network: the page has no address yet");
        return;
    }
    say_link(hub, client, address);
    net_hub_say(hub, client, "ok\r\n", 4);
}
