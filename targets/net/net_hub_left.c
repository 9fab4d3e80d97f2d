/* SPDX-License-Identifier: MIT
 * Lines of former owners: whose they are, so that who comes into control again has the answers to its own. */
#include "net_hub_inner.h"
#include "net_line.h"

#include <string.h>

static uint32_t count_lines(const char *lines, size_t count) {
    uint32_t found = 0;
    for (size_t from = 0; from < count;) {
        const char *end = memchr(lines + from, '\n', count - from);
        found += !net_line_is_marked(lines + from);
        from = end == NULL ? count : (size_t)(end + 1 - lines);
    }
    return found;
}

/* Where there is no place for more, whose these and those before them are is forgotten. */
static void note_lines(struct net_hub *hub, const struct net_client *client, uint32_t lines) {
    struct net_hub_left *last = &hub->left_of[hub->lefts > 0 ? hub->lefts - 1 : 0];
    if (lines == 0)
        return;
    if (hub->lefts == NET_HUB_LEFTS) {
        last->client = last->client == client ? client : NULL;
        last->lines += lines;
        return;
    }
    hub->left_of[hub->lefts++] = (struct net_hub_left){.client = client, .lines = lines};
}

/* What the owner has sent stays in force: whole lines go to `left`. A half line is forgotten; if the
 * controller has got a part of it, it is ended, and its answer (too long) is no one's. */
void net_hub_leave_lines(struct net_hub *hub, struct net_client *client) {
    const uint32_t inside = net_hub_owners_inside(hub);
    const bool half = client->in.count > client->whole;
    client->in_left |= client->whole > 0 || inside > 0;
    if (hub->left.count == 0 && hub->inside_left == 0)
        hub->lefts = 0;
    if (client->whole == 0 && client->in_long) {
        net_queue_cut(&client->in, 0);
        if (net_queue_add(&client->in, "\n", 1))
            client->whole = 1;
    }
    const uint32_t waits = count_lines(net_queue_head(&client->in), client->whole);
    const bool fits = hub->left.count + client->whole <= hub->sizes.left &&
                      net_queue_add(&hub->left, net_queue_head(&client->in), client->whole);
    note_lines(hub, client, inside + (fits ? waits : 0));
    if (!fits)
        net_hub_tell(hub, "Queue full: lines of the previous owner discarded");
    else if (half)
        net_hub_tell_observers(hub, "Incomplete line discarded: the sender disconnected");
    client->skips |= half;
    client->in_long = client->called_off = false;
    client->whole = 0;
    net_queue_free(&client->in);
}

void net_hub_count_left(struct net_hub *hub) {
    if (hub->lefts == 0 || --hub->left_of[0].lines > 0)
        return;
    hub->lefts--;
    memmove(hub->left_of, hub->left_of + 1, hub->lefts * sizeof hub->left_of[0]);
}

void net_hub_disown_left(struct net_hub *hub, const struct net_client *client) {
    for (unsigned n = 0; n < hub->lefts; n++)
        if (hub->left_of[n].client == client)
            hub->left_of[n].client = NULL;
}
