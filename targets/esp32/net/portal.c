/* SPDX-License-Identifier: MIT */
#include "net/portal.h"

#include "net/network.h"
#include "net_dns.h"
#include "net_json.h"
#include "net_socket.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TICKET_BYTES = 16, TICKET_SIZE = 2 * TICKET_BYTES + 1, BODY_SIZE = 3072 };

_Static_assert(NET_CLIENTS <= 32, "a bit for each client");
_Static_assert((int)NET_JSON_VALUE > (int)DEVICE_TEXT_SIZE, "values are as long as they may be");

/* Members of a request: keys of the device, and what is to be done. */
enum member { SSID, PASSWORD, NAME, MODE, ADDRESS, GATEWAY, NETMASK, KEY, TICKET, SCAN, KEEP, MEMBERS };

struct wish {
    bool has[MEMBERS];
    char value[MEMBERS][NET_JSON_VALUE];
};

struct portal {
    struct portal_options options;
    int names;        /* the socket; -1: not open */
    uint8_t quads[4]; /* of options.address */
    uint32_t before;  /* bit = client of the hub that came before the network was changed */
    char ticket[TICKET_SIZE];
    struct wish wish; /* of the request that is read */
    char body[BODY_SIZE];
};

struct portal *portal_create(const struct portal_options *options) {
    struct portal *portal = calloc(1, sizeof *portal);
    struct net_address address = {0};
    if (portal == NULL)
        return NULL;
    portal->options = *options;
    portal->names = -1;
    (void)net_address_v4(options->address, 0, &address);
    memcpy(portal->quads, address.bytes, sizeof portal->quads);
    return portal;
}

const char *portal_page(void *portal, uint64_t here, uint64_t peer) {
    return network_is_own(here, peer) ? ((const struct portal *)portal)->options.page : NULL;
}

/* ---- how it is ---- */

static void add(struct portal *portal, size_t *count, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

static void add(struct portal *portal, size_t *count, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    const int more = vsnprintf(portal->body + *count, BODY_SIZE - *count, format, arguments);
    va_end(arguments);
    *count += (size_t)more; /* the largest answer without networks is a quarter of it */
}

static void add_text(struct portal *portal, size_t *count, const char *name, const char *text) {
    add(portal, count, ", \"%s\": ", name);
    *count += net_json_put_text(portal->body + *count, BODY_SIZE - *count, text);
}

static void add_address(struct portal *portal, size_t *count, const char *name, uint32_t address) {
    if (address == 0)
        add(portal, count, ", \"%s\": \"\"", name);
    else
        add(portal, count, ", \"%s\": \"%u.%u.%u.%u\"", name, (unsigned)(address & 0xFF),
            (unsigned)(address >> 8 & 0xFF), (unsigned)(address >> 16 & 0xFF), (unsigned)(address >> 24));
}

/* The strongest first; those that find no room are left out. */
static void add_networks(struct portal *portal, size_t *count) {
    enum { ROW = 6 * WIFI_SSID_MAX + 60 }; /* every byte of the name escaped */
    struct wifi_network found;
    bool any = false;
    add(portal, count, ", \"networks\": [");
    for (size_t i = 0; *count + ROW < BODY_SIZE && network_scanned(i, &found) == NETWORK_FOUND; i++) {
        add(portal, count, "%s{\"rssi_dbm\": %d, \"secured\": %s", any ? ", " : "", found.rssi_dbm,
            found.secured ? "true" : "false");
        add_text(portal, count, "name", found.name);
        add(portal, count, "}");
        any = true;
    }
    add(portal, count, "]}");
}

static bool may_set(const struct portal *portal, const struct net_http_call *call) {
    return call->own || access_may(portal->options.access, call->peer);
}

static const char *state_word(const struct device *device) {
    static const char *const words[] = {[WIFI_NO_NETWORK] = "none", [WIFI_JOINING] = "joining",
                                        [WIFI_JOINED] = "joined",   [WIFI_NOT_FOUND] = "not_found",
                                        [WIFI_FAILED] = "failed",   [WIFI_WRONG_PASSWORD] = "wrong_password"};
    return device->on_trial && device->joins ? "joining" : words[network_state()];
}

static void describe(struct portal *portal, const struct net_http_call *call, struct net_http_late *out) {
    const struct device *device = portal->options.device;
    const struct device_network *network = &device->kept_network;
    const uint32_t left_s = device_trial_s(device, portal->options.now_us(portal->options.ctx));
    struct wifi_network first;
    size_t count = 0;
    add(portal, &count, "{\"trial_s\": %u, \"state\": \"%s\", \"own\": %s, \"may\": %s, \"static\": %s",
        (unsigned)left_s, state_word(device), call->own ? "true" : "false",
        may_set(portal, call) ? "true" : "false", network->is_static ? "true" : "false");
    add(portal, &count, ", \"scanning\": %s",
        network_scanned(0, &first) == NETWORK_SCANNING ? "true" : "false");
    add_text(portal, &count, "name", network_name());
    add_text(portal, &count, "ssid", network->ssid);
    add_address(portal, &count, "joined", network_station_address());
    add_address(portal, &count, "address", network->address);
    add_address(portal, &count, "gateway", network->gateway);
    add_address(portal, &count, "netmask", network->netmask);
    add_networks(portal, &count);
    *out = (struct net_http_late){.status = "200 OK", .type = "application/json", .body = portal->body};
}

/* ---- what is asked for ---- */

static const char *const member_names[MEMBERS] = {
    [SSID] = "ssid",       [PASSWORD] = "password", [NAME] = "name",       [MODE] = "mode",
    [ADDRESS] = "address", [GATEWAY] = "gateway",   [NETMASK] = "netmask", [KEY] = "key",
    [TICKET] = "ticket",   [SCAN] = "scan",         [KEEP] = "keep"};

static bool take_member(void *ctx, const char *name, const char *value, bool is_text) {
    struct wish *wish = ctx;
    for (unsigned member = 0; member < MEMBERS; member++) {
        if (strcmp(name, member_names[member]) != 0)
            continue;
        const bool is_flag = member == SCAN || member == KEEP;
        if (wish->has[member] || is_text == is_flag || (is_flag && strcmp(value, "true") != 0))
            return false;
        wish->has[member] = true;
        memcpy(wish->value[member], value, strlen(value) + 1);
        return true;
    }
    return false;
}

static bool refuse(struct portal *portal, struct net_http_late *out, const char *status, const char *field,
                   const char *why) {
    snprintf(portal->body, BODY_SIZE, "{\"error\": \"%s\", \"field\": \"%s\"}", why, field);
    *out = (struct net_http_late){.status = status, .type = "application/json", .body = portal->body};
    return true;
}

static bool agree(struct portal *portal, struct net_http_late *out) {
    snprintf(portal->body, BODY_SIZE, "{\"ticket\": \"%s\"}", portal->ticket);
    *out = (struct net_http_late){.status = "200 OK", .type = "application/json", .body = portal->body};
    return true;
}

/* ---- another network ---- */

static bool set_text(struct device *device, uint16_t key, const char *value) {
    char text[DEVICE_TEXT_SIZE] = "";
    const size_t size = strlen(value);
    if (size >= sizeof text)
        return false;
    memcpy(text, value, size);
    return device_set_text(device, key, text) == DEVICE_DONE;
}

static bool set_address(struct device *device, uint16_t key, const char *value) {
    struct net_address address = {0};
    if (*value != '\0' && !net_address_v4(value, 0, &address))
        return false;
    const uint8_t *quads = address.bytes;
    const uint32_t number =
        quads[0] | (uint32_t)quads[1] << 8 | (uint32_t)quads[2] << 16 | (uint32_t)quads[3] << 24;
    return device_set(device, key, number) == DEVICE_DONE;
}

static bool set_mode(struct device *device, const char *value) {
    const bool is_static = strcmp(value, "static") == 0;
    return (is_static || strcmp(value, "dhcp") == 0) &&
           device_set(device, DEVICE_KEY_IP_MODE, is_static) == DEVICE_DONE;
}

static bool set_member(struct device *device, enum member member, const char *value) {
    static const uint16_t keys[] = {[SSID] = DEVICE_KEY_WIFI_SSID,     [PASSWORD] = DEVICE_KEY_WIFI_PASSWORD,
                                    [NAME] = DEVICE_KEY_HOST_NAME,     [MODE] = DEVICE_KEY_IP_MODE,
                                    [ADDRESS] = DEVICE_KEY_IP_ADDRESS, [GATEWAY] = DEVICE_KEY_IP_GATEWAY,
                                    [NETMASK] = DEVICE_KEY_IP_NETMASK};
    if (member == MODE)
        return set_mode(device, value);
    return member <= NAME ? set_text(device, keys[member], value) : set_address(device, keys[member], value);
}

static const char *why_not(enum member member) {
    static const char *const whys[] = {
        [SSID] = "The name of a network has 1 to 32 bytes.",
        [PASSWORD] = "A password has 8 to 63 characters; a network without one has none.",
        [NAME] = "The name of the controller has up to 31 letters, digits and inner hyphens.",
        [MODE] = "The mode is dhcp or static.",
        [ADDRESS] = "This is not an IPv4 address such as 192.168.1.50.",
        [GATEWAY] = "This is not an IPv4 address such as 192.168.1.1.",
        [NETMASK] = "This is not an IPv4 netmask such as 255.255.255.0."};
    return whys[member];
}

static void make_ticket(struct portal *portal) {
    uint8_t bytes[TICKET_BYTES];
    portal->options.random(portal->options.ctx, bytes, sizeof bytes);
    for (unsigned i = 0; i < TICKET_BYTES; i++)
        snprintf(portal->ticket + 2 * i, 3, "%02x", bytes[i]);
}

static bool change(struct portal *portal, const struct wish *wish, struct net_http_late *out) {
    struct device *device = portal->options.device;
    if (!portal->options.at_rest(portal->options.ctx))
        return refuse(portal, out, "409 Conflict", "",
                      "The machine is moving. Stop it, or wait until it stops.");
    if (wish->has[SSID] && !wish->has[PASSWORD])
        return refuse(portal, out, "400 Bad Request", "password",
                      "The password is missing; send an empty one for an open network.");
    for (enum member member = SSID; member <= NETMASK; member++)
        if (wish->has[member] && !set_member(device, member, wish->value[member])) {
            device_discard(device);
            return refuse(portal, out, "400 Bad Request", member_names[member], why_not(member));
        }
    if (!device_differs(device))
        return refuse(portal, out, "409 Conflict", "", "These are the settings that are already in use.");
    switch (device_save(device, portal->options.now_us(portal->options.ctx))) {
    case DEVICE_DONE:
        make_ticket(portal);
        return agree(portal, out);
    case DEVICE_NOT_STORED:
        return refuse(portal, out, "500 Internal Server Error", "", "The controller cannot store it.");
    case DEVICE_PIN:
        return refuse(portal, out, "409 Conflict", "", "Pins that another client has set cannot be stored.");
    default:
        return refuse(portal, out, "400 Bad Request", "address",
                      "Address, netmask and gateway do not fit together.");
    }
}

/* ---- requests ---- */

/* In constant time: a ticket is a secret. */
static bool has_ticket(const struct portal *portal, const struct wish *wish) {
    unsigned differs = portal->ticket[0] == '\0' || strlen(wish->value[TICKET]) != TICKET_SIZE - 1;
    for (unsigned i = 0; i < TICKET_SIZE - 1; i++)
        differs |= (unsigned)(portal->ticket[i] ^ wish->value[TICKET][i]);
    return wish->has[TICKET] && differs == 0;
}

static bool keep(struct portal *portal, const struct net_http_call *call, struct net_http_late *out) {
    if (call->own)
        return refuse(
            portal, out, "409 Conflict", "",
            "This shows that the own network works. Connect to the new network and open the page there.");
    if (!device_confirm(portal->options.device))
        return refuse(portal, out, "409 Conflict", "", "No network is on trial.");
    portal->ticket[0] = '\0';
    return agree(portal, out);
}

static bool scan(struct portal *portal, struct net_http_late *out) {
    if (!portal->options.at_rest(portal->options.ctx) || !network_scan())
        return refuse(portal, out, "409 Conflict", "",
                      "The controller cannot search now: the machine is moving, or a search is under way.");
    return agree(portal, out);
}

static bool obey(struct portal *portal, const struct net_http_call *call, const struct wish *wish,
                 struct net_http_late *out) {
    return wish->has[KEEP]   ? keep(portal, call, out)
           : wish->has[SCAN] ? scan(portal, out)
                             : change(portal, wish, out);
}

bool portal_network(void *ctx, const struct net_http_call *call, struct net_http_late *out) {
    struct portal *portal = ctx;
    struct access *access = portal->options.access;
    struct wish *wish = &portal->wish;
    if (call->topic == NET_HTTP_PINS)
        return wiring_page_call(portal->options.wiring, call, out);
    if (call->body == NULL) {
        describe(portal, call, out);
        return true;
    }
    *wish = (struct wish){.has = {false}};
    if (!net_json_read(call->body, take_member, wish))
        return refuse(portal, out, "400 Bad Request", "",
                      "Not understood: docs/web.md lists the members of this request.");
    if (may_set(portal, call) || (wish->has[KEEP] && has_ticket(portal, wish)))
        return obey(portal, call, wish, out);
    if (!wish->has[KEY])
        return refuse(portal, out, "401 Unauthorized", "key", "The access key of the controller is missing.");
    switch (access_try(access, call->peer, call->since_us, wish->value[KEY], strlen(wish->value[KEY]))) {
    case ACCESS_WAIT:
        return false;
    case ACCESS_GOOD:
        return obey(portal, call, wish, out);
    default:
        return refuse(portal, out, "401 Unauthorized", "key", "This is not the access key.");
    }
}

/* ---- a round ---- */

/* Someone who may command has come through the new network. */
static void look_for_contact(struct portal *portal) {
    struct device *device = portal->options.device;
    const struct net_hub *hub = portal->options.hub;
    for (unsigned i = 0; i < NET_CLIENTS; i++) {
        const struct net_client *client = &hub->client[i];
        const bool there = client->stream.ops != NULL && !client->stream.local;
        const uint32_t bit = (uint32_t)1 << i;
        if (!device->on_trial || device->joins)
            portal->before = there ? portal->before | bit : portal->before & ~bit;
        else if (!there)
            portal->before &= ~bit;
        else if ((portal->before & bit) == 0 && !client->locked &&
                 !network_is_own(net_tcp_here(&client->stream), client->stream.peer))
            (void)device_confirm(device);
    }
}

/* Only in our own network: in others it would be a name server that lies. */
static void serve_names(struct portal *portal) {
    const bool up = network_own_is_up();
    if (up && portal->names < 0)
        portal->names = net_dns_open(portal->options.address, portal->options.dns_port);
    if (!up && portal->names >= 0) {
        net_socket_close(portal->names);
        portal->names = -1;
    }
    if (portal->names >= 0)
        net_dns_poll(portal->names, portal->quads);
}

void portal_poll(struct portal *portal) {
    look_for_contact(portal);
    network_hold_own(portal->options.device->on_trial);
    serve_names(portal);
}
