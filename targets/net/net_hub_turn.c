/* SPDX-License-Identifier: MIT
 * Lines that the hub answers itself, $TRUST, $LOGIN of who is in, $QR, have their client's turn: they wait
 * among its other lines, with a mark that says whose they are, until the controller has answered all of that
 * client before them. Lines of others, and what the machine does, do not keep them waiting. */
#include "net_hub_inner.h"
#include "net_line.h"

#include <string.h>

_Static_assert((int)NET_CLIENTS <= (int)NET_LINE_MARKS, "a mark for each place");

static bool is_its_line(const struct net_hub *hub, const char *line, size_t size) {
    return size > 0 && line[0] == '$' &&
           (net_hub_is_access_line(line, size) || net_hub_is_qr_line(hub, line, size));
}

char net_hub_mark_of(const struct net_hub *hub, const struct net_client *client) {
    return (char)(NET_LINE_MARK + (client - hub->client));
}

static struct net_client *marked_client(struct net_hub *hub, const char *line) {
    return &hub->client[(uint8_t)*line - NET_LINE_MARK];
}

/* The rest of a line that the controller has got in part is none, nor is a damaged line. */
bool net_hub_mark_line(const struct net_hub *hub, struct net_client *owner) {
    const size_t size = owner->in.count - owner->whole;
    const bool is_rest = owner->in_long && owner->whole == 0;
    if (size == 0 || is_rest || !is_its_line(hub, net_queue_head(&owner->in) + owner->whole, size) ||
        net_line_sound(net_queue_head(&owner->in) + owner->whole, size) < size)
        return false;
    if (!net_queue_add(&owner->in, "", 1)) {
        owner->gone = true;
        return true;
    }
    char *line = owner->in.bytes + owner->in.begin + owner->whole;
    memmove(line + 1, line, size);
    *line = net_hub_mark_of(hub, owner);
    owner->called_off = false;
    return true;
}

/* ---- answers ---- */

static const char too_many[] = "Too many lines wait for answers: this one had no effect";

static void answer(struct net_hub *hub, struct net_client *client, const char *line, size_t size) {
    if (net_hub_is_qr_line(hub, line, size))
        net_hub_answer_qr(hub, client);
    else
        net_hub_answer_access(hub, client, line, size);
}

void net_hub_answer_line(struct net_hub *hub, struct net_client *client, const char *line, size_t size) {
    if (is_its_line(hub, line, size)) {
        answer(hub, client, line, size);
    } else if (size == 1 && *line == NET_LINE_STOPPED) {
        net_hub_refuse(hub, client, STATUS_LOCKED, NULL);
    } else if (size == 0) {
        net_hub_say(hub, client, "ok\r\n", 4);
    } else if (!net_hub_answer_reports(hub, client, line, size)) {
        if (!client->explained && client != hub->owner)
            net_hub_explain(hub, client);
        client->explained = true;
        net_hub_refuse(hub, client, STATUS_OBSERVER, NULL);
    }
}

static bool add_to_left(struct net_hub *hub, char mark, const char *line, size_t size) {
    const size_t before = hub->left.count;
    if (before + size + 2 <= hub->sizes.left && net_queue_add(&hub->left, &mark, 1) &&
        net_queue_add(&hub->left, line, size) && net_queue_add(&hub->left, "\n", 1))
        return true;
    net_queue_cut(&hub->left, before);
    return false;
}

void net_hub_refuse_in_turn(struct net_hub *hub, struct net_client *client) {
    client->in_left = true;
    if (client->lost_lines > 0 || !add_to_left(hub, net_hub_mark_of(hub, client), "?", 1))
        net_hub_lose_line(hub, client);
}

void net_hub_lose_line(struct net_hub *hub, struct net_client *client) {
    if (client->lost_lines < UINT32_MAX) {
        client->lost_lines++;
        hub->has_lost = true;
        return;
    }
    client->gone = true;
    hub->ops->event(hub->ctx, "disconnected: it does not wait for answers", client->name);
}

/* Where `left` has no more room they are counted, and refused in their turn: the client can always stop, so
 * its bytes are always read. */
void net_hub_answer_observer(struct net_hub *hub, struct net_client *client, const char *line, size_t size) {
    client->in_left = net_hub_waits_in_left(hub, client);
    if (client->lost_lines == 0 && !client->in_left)
        net_hub_answer_line(hub, client, line, size);
    else if (client->lost_lines > 0 || !add_to_left(hub, net_hub_mark_of(hub, client), line, size))
        net_hub_lose_line(hub, client);
}

/* ---- turns ---- */

/* @return bytes of the first line, with its mark and its LF */
static size_t first_line(const char *lines, size_t count) {
    const char *end = memchr(lines, '\n', count);
    return end == NULL ? count : (size_t)(end + 1 - lines);
}

/* The controller has answered all of the owner before its first line. Lines of others do not keep it waiting,
 * but what it had sent before it lost control does, unless it is the operator of a parked hold. */
static bool is_turn_of(const struct net_hub *hub, const struct net_client *owner) {
    if (hub->parked.inside > 0)
        return false;
    if (hub->parked.on)
        return net_hub_operators_bytes(hub) > 0 && net_hub_has_room_for_operator(hub, owner);
    return net_hub_owners_inside(hub) == 0 && net_hub_lines_allowed(hub) > 0 &&
           !net_hub_waits_in_left(hub, owner);
}

/* What follows the revocation of one's own trust is not read any more. */
static bool answer_owner(struct net_hub *hub, struct net_client *owner) {
    bool any = false;
    while (owner->whole > 0 && net_line_is_marked(net_queue_head(&owner->in)) && net_hub_is_open(owner) &&
           is_turn_of(hub, owner)) {
        const size_t size = first_line(net_queue_head(&owner->in), owner->whole);
        net_hub_answer_line(hub, owner, net_queue_head(&owner->in) + 1, size - 2);
        net_hub_drop_operators(hub, size);
        if (owner->refused)
            net_hub_drop_lines(owner);
        any = true;
    }
    return any;
}

static bool has_room(const struct net_hub *hub, struct net_client *client) {
    if (client->out.count >= hub->sizes.out / 4)
        net_hub_write(client);
    return client->out.count < hub->sizes.out / 4;
}

static void refuse_for_want_of_room(struct net_hub *hub, struct net_client *client) {
    net_hub_refuse(hub, client, STATUS_OBSERVER, client->explained ? NULL : too_many);
    client->explained = true;
}

/* Who does not read its answers keeps no one waiting: they are short then. */
static bool answer_left(struct net_hub *hub) {
    bool any = net_hub_look_whose(hub);
    while (hub->left.count > 0 && hub->inside_left == 0 && net_line_is_marked(net_queue_head(&hub->left))) {
        const char *line = net_queue_head(&hub->left);
        const size_t size = first_line(line, hub->left.count);
        struct net_client *client = marked_client(hub, line);
        if (has_room(hub, client))
            net_hub_answer_line(hub, client, line + 1, size - 2);
        else if (line[1] == '?') /* one of many that had not begun: refused as it reads */
            net_hub_lose_line(hub, client);
        else
            refuse_for_want_of_room(hub, client);
        net_queue_drop(&hub->left, size);
        any = true;
        (void)net_hub_look_whose(hub);
    }
    return any;
}

/* As many as there is room for: what is lost is many lines. */
static bool refuse_lost(struct net_hub *hub, struct net_client *client) {
    bool any = false;
    while (client->lost_lines > 0 && net_hub_is_open(client) && client->out.count < hub->sizes.out / 2) {
        refuse_for_want_of_room(hub, client);
        client->lost_lines--;
        any = true;
    }
    return any;
}

static bool refuse_all_lost(struct net_hub *hub) {
    bool any = false;
    hub->has_lost = false;
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++) {
        if (client->lost_lines == 0 || net_hub_is_pendant(client))
            continue;
        const bool waits =
            net_hub_waits_in_left(hub, client) || (hub->parked.inside > 0 && client == hub->parked.operator);
        any |= !waits && refuse_lost(hub, client);
        hub->has_lost |= client->lost_lines > 0;
    }
    return any;
}

bool net_hub_answer_turns(struct net_hub *hub) {
    bool any = answer_left(hub);
    any |= hub->has_lost && refuse_all_lost(hub);
    return (hub->owner != NULL && answer_owner(hub, hub->owner)) || any;
}

/* ---- ends ---- */

/* Its trust was revoked, so it cannot trust itself again. */
static bool is_shut_out(const struct net_hub *hub, const struct net_client *client) {
    return client->by_trust && net_hub_locks(hub) && !net_hub_trusts(hub, &client->stream);
}

void net_hub_end_turns_of(struct net_hub *hub, struct net_client *client) {
    char *lines = hub->left.count > 0 ? hub->left.bytes + hub->left.begin : NULL;
    size_t to = 0, size;
    client->gone = true; /* no one to answer */
    for (size_t from = 0, end = hub->left.count; from < end; from += size) {
        size = first_line(lines + from, end - from);
        if (net_line_is_marked(lines + from) && marked_client(hub, lines + from) == client) {
            if (!is_shut_out(hub, client))
                net_hub_answer_line(hub, client, lines + from + 1, size - 2);
            continue;
        }
        memmove(lines + to, lines + from, size);
        to += size;
    }
    hub->left.count = to;
}
