/* SPDX-License-Identifier: MIT
 * `$QR`: the address of the page as a QR code. Only on request: blocks are no ASCII, and no sender asks for
 * them. Each row is a message, which senders of Grbl show and do not count. */
#include "net_hub_inner.h"
#include "net_line.h"
#include "net_qr.h"

#include <stdio.h>
#include <string.h>

static const char qr_line[] = "$QR";

_Static_assert((int)NET_QR_ROW <= (int)NET_MESSAGE_SIZE, "a row fits a message");

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
static void say_code(struct net_hub *hub, struct net_client *client, const char *address) {
    char link[NET_QR_TEXT + 1], row[NET_QR_ROW];
    struct net_qr qr;
    const char *key = net_hub_key_for(hub, client);
    snprintf(link, sizeof link, "%s", address);
    const bool with_key = key != NULL && add_key(link, sizeof link, key);
    if (!with_key)
        snprintf(link, sizeof link, "%s", address);
    if (!net_qr_make(&qr, link))
        return;
    for (unsigned i = 0; net_qr_row(&qr, i, row); i++)
        net_hub_say_message(hub, client, row);
    snprintf(row, sizeof row, "%s%s", address, with_key ? ", logged in" : "");
    net_hub_say_message(hub, client, row);
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
    say_code(hub, client, address);
    net_hub_say(hub, client, "ok\r\n", 4);
}
