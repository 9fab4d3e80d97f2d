/* SPDX-License-Identifier: MIT
 * Lines of former owners: whose they are, so that who comes into control again has the answers to its own. In
 * the queue `left` a line that is none says whose those behind it are; of what the controller has got,
 * inside_of does. */
#include "net_hub_inner.h"
#include "net_line.h"

#include <string.h>

_Static_assert(NET_LINES_OF + (int)NET_CLIENTS <= (int)NET_LINES_OF_NOBODY, "a byte for each place");
_Static_assert((int)NET_LINE_MARK + NET_LINE_MARKS <= (int)NET_LINES_OF, "other marks are below");

enum { WHOSE_SIZE = 2 }; /* of a line that says whose others are */

static uint8_t place_of(const struct net_hub *hub, const struct net_client *client) {
    return (uint8_t)(client - hub->client);
}

static bool add_left(struct net_hub *hub, const struct net_client *client) {
    const char whose[WHOSE_SIZE] = {(char)(NET_LINES_OF + place_of(hub, client)), '\n'};
    const size_t before = hub->left.count;
    if (client->whole == 0)
        return true;
    if (before + client->whole <= hub->sizes.left && /* all of an owner's lines find room */
        net_queue_add(&hub->left, whose, WHOSE_SIZE) &&
        net_queue_add(&hub->left, net_queue_head(&client->in), client->whole))
        return true;
    net_queue_cut(&hub->left, before);
    return false;
}

static void lose_lines(struct net_hub *hub, struct net_client *client) {
    net_hub_tell(hub, "Queue full: lines of the previous owner discarded");
    for (size_t n = 0; n < client->whole; n++)
        if (net_queue_head(&client->in)[n] == '\n')
            net_hub_lose_line(hub, client);
}

/* What the owner has sent stays in force: whole lines go to `left`. A half line is forgotten; if the
 * controller has got a part of it, it is ended, and its answer (too long) is no one's. */
void net_hub_leave_lines(struct net_hub *hub, struct net_client *client) {
    const uint32_t inside = net_hub_owners_inside(hub);
    const bool half = client->in.count > client->whole;
    client->in_left |= client->whole > 0 || inside > 0;
    if (client->whole == 0 && client->in_long) {
        net_queue_cut(&client->in, 0);
        if (net_queue_add(&client->in, "\n", 1))
            client->whole = 1;
    }
    net_hub_note_left(hub, (uint8_t)(place_of(hub, client) + 1), inside);
    if (!add_left(hub, client))
        lose_lines(hub, client);
    else if (half)
        net_hub_tell_observers(hub, "Incomplete line discarded: the sender disconnected");
    client->skips |= half;
    client->in_long = client->called_off = false;
    client->whole = 0;
    net_queue_free(&client->in);
}

void net_hub_note_left(struct net_hub *hub, uint8_t of, uint32_t lines) {
    for (; lines > 0; lines--, hub->inside_left++)
        if (hub->inside_left < NET_LINES_INSIDE)
            hub->inside_of[hub->inside_left] = of;
}

/* @param says  a line that says whose others are @return as hub->left_of */
static uint8_t whose(const char *says) {
    const uint8_t byte = (uint8_t)*says;
    return byte == NET_LINES_OF_NOBODY ? 0 : (uint8_t)(byte - NET_LINES_OF + 1);
}

bool net_hub_look_whose(struct net_hub *hub) {
    bool any = false;
    while (hub->left.count > 0 && net_line_says_whose(net_queue_head(&hub->left))) {
        hub->left_of = whose(net_queue_head(&hub->left));
        net_queue_drop(&hub->left, WHOSE_SIZE);
        any = true;
    }
    return any;
}

/* ---- lines that control was taken from ---- */

/* @param of  as hub->left_of */
static void refuse_line_of(struct net_hub *hub, uint8_t of) {
    if (of > 0 && net_hub_is_open(&hub->client[of - 1]))
        net_hub_refuse_in_turn(hub, &hub->client[of - 1]);
}

/* Those that the controller has, which are the newest of `inside` that are neither a pendant's nor the
 * operator's. */
static void refuse_inside(struct net_hub *hub) {
    const bool pendants = hub->inside_hand > 0 && !hub->hand_parked; /* then no one else has any there */
    if (pendants)
        return;
    const uint32_t dropped = hub->ops->drop_unread(hub->ctx), owners = net_hub_owners_inside(hub);
    uint32_t lefts = dropped > owners ? dropped - owners : 0;
    lefts = lefts < hub->inside_left ? lefts : hub->inside_left;
    hub->inside -= dropped;
    hub->inside_left -= lefts;
    for (uint32_t n = 0; n < lefts; n++)
        refuse_line_of(hub, hub->inside_of[hub->inside_left + n]);
    for (uint32_t n = lefts; n < dropped && hub->owner != NULL; n++)
        net_hub_refuse_in_turn(hub, hub->owner);
    if (hub->owner != NULL)
        hub->owner->in_long = false;
}

/* Those of the hub itself are answered in their turn. */
static void refuse_left(struct net_hub *hub, struct net_queue *left, uint8_t of) {
    for (size_t size; left->count > 0; net_queue_drop(left, size)) {
        const char *line = net_queue_head(left), *end = memchr(line, '\n', left->count);
        size = end == NULL ? left->count : (size_t)(end + 1 - line);
        if (net_line_says_whose(line))
            of = whose(line);
        else if (!net_line_is_marked(line))
            refuse_line_of(hub, of);
        else if (!net_queue_add(&hub->left, line, size))
            refuse_line_of(hub, (uint8_t)((uint8_t)*line - NET_LINE_MARK + 1));
    }
}

void net_hub_refuse_unread(struct net_hub *hub) {
    struct net_client *owner = hub->owner;
    struct net_queue left = hub->left;
    const uint8_t of = hub->left_of;
    if (hub->ops->drop_unread == NULL)
        return;
    hub->left = (struct net_queue){0};
    hub->left_of = 0;
    refuse_inside(hub);
    refuse_left(hub, &left, of);
    net_queue_free(&left);
    if (owner == NULL)
        return;
    for (size_t n = 0; n < owner->whole; n++)
        if (net_queue_head(&owner->in)[n] == '\n')
            net_hub_refuse_in_turn(hub, owner);
    net_queue_drop(&owner->in, owner->whole);
    owner->whole = 0;
}

void net_hub_count_left(struct net_hub *hub) {
    if (hub->inside_left == 0)
        return;
    hub->inside_left--;
    memmove(hub->inside_of, hub->inside_of + 1, NET_LINES_INSIDE - 1);
}

void net_hub_disown_left(struct net_hub *hub, const struct net_client *client) {
    const uint8_t place = place_of(hub, client);
    char *lines = hub->left.count > 0 ? hub->left.bytes + hub->left.begin : NULL;
    for (size_t from = 0; from < hub->left.count;) {
        const char *end = memchr(lines + from, '\n', hub->left.count - from);
        if ((uint8_t)lines[from] == NET_LINES_OF + place)
            lines[from] = (char)NET_LINES_OF_NOBODY;
        from = end == NULL ? hub->left.count : (size_t)(end + 1 - lines);
    }
    if (hub->left_of == place + 1)
        hub->left_of = 0;
    for (unsigned n = 0; n < NET_LINES_INSIDE; n++)
        if (hub->inside_of[n] == place + 1)
            hub->inside_of[n] = 0;
}
