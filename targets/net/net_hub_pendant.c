/* SPDX-License-Identifier: MIT
 * Pendants: hands at the machine, at ports of their own.
 *
 * A pendant never owns. Its real-time bytes act as the owner's. Its lines are read in a turn of its own,
 * which begins when the machine is at rest and has answered every other line, or in a parked hold, and ends
 * when all of the pendant's is done: meanwhile the owner's lines wait, so each answer is of one side only.
 * While a job runs or is held, a pendant's lines are refused: nothing of them starts later.
 *
 * 0x8B (MPG, grblHAL's) makes the turn last until it comes again, and has the lines of others refused. */
#include "net_hub_inner.h"
#include "net_line.h"

#include <string.h>

/* XON, XOFF and the form feed, by which pendants of FluidNC switch an echo off, are no part of a line. */
enum { FORM_FEED = 0x0C, XON = 0x11, XOFF = 0x13, DELETE = 0x7F };

enum { LINE_MAX_BYTES = 255, INSIDE_MAX = 8 }; /* of a pendant, in a line; lines that are not answered */

static const char unreadable[] = "Pendant: unreadable bytes; check its baud rate, cable and ground";
static const char no_control[] = "Pendant: 0x8B takes control";
static const char busy[] = "Pendant: a job runs or is held; hold and park it (0xA3) to jog";
static const char in_control[] = "The pendant is in control (MPG): 0x8B at the pendant, or $TAKE, ends that";

static enum machine_reads reads(const struct net_hub *hub) {
    return hub->ops->reads != NULL ? hub->ops->reads(hub->ctx) : MACHINE_READS_NOTHING;
}

/* ---- control by 0x8B ---- */

static void set_mpg(struct net_hub *hub, bool on) {
    hub->mpg = on;
    if (hub->ops->mpg != NULL)
        hub->ops->mpg(hub->ctx, on);
}

void net_hub_end_mpg(struct net_hub *hub) {
    if (!hub->mpg)
        return;
    net_hub_drop_lines(hub->hand);
    net_hub_put_realtime(hub, hub->hand, JOG_CANCEL);
    set_mpg(hub, false);
    net_hub_tell(hub, "The pendant has released control (MPG)");
}

/* Nothing of anyone else is under way: an answer that comes next is the pendant's. */
static bool may_begin(const struct net_hub *hub, enum machine_reads now) {
    const bool half_line = hub->owner != NULL && hub->owner->in_long;
    if (now == MACHINE_READS_OPERATORS)
        return hub->inside <= hub->inside_job && !half_line;
    return now == MACHINE_READS_LINES && hub->inside == 0 && !half_line;
}

static void toggle_mpg(struct net_hub *hub, struct net_client *client) {
    const bool others_wait = hub->left.count > 0 || (hub->owner != NULL && hub->owner->whole > 0);
    const bool others_turn = hub->hand != NULL && hub->hand != client;
    if (hub->mpg && !others_turn) {
        net_hub_end_mpg(hub);
        return;
    }
    if (others_turn || others_wait || (hub->hand == NULL && !may_begin(hub, reads(hub))) ||
        reads(hub) == MACHINE_READS_OPERATORS) {
        net_hub_say_message(hub, client, "Pendant: control (MPG) needs a machine at rest");
        return;
    }
    hub->hand = client;
    set_mpg(hub, true);
    net_hub_tell(hub, "The pendant is in control (MPG)");
}

/* ---- bytes ---- */

static void refuse_unreadable(struct net_hub *hub, struct net_client *client) {
    net_queue_cut(&client->in, client->whole);
    net_hub_refuse(hub, client, STATUS_LINE_TOO_LONG, client->told ? NULL : unreadable);
    client->told = true;
    client->garbled = client->spoiled = client->called_off = false;
}

static void end_pendants_line(struct net_hub *hub, struct net_client *client) {
    if (client->garbled || client->spoiled) {
        refuse_unreadable(hub, client);
        return;
    }
    client->told = false;
    net_hub_end_line(hub, client);
    if (net_queue_add(&client->in, "\n", 1))
        client->whole = client->in.count;
    else
        client->gone = true;
}

static void take_character(struct net_hub *hub, struct net_client *client, uint8_t byte) {
    const char character = (char)byte;
    if (byte == XON || byte == XOFF) {
        client->paused = byte == XOFF;
        return;
    }
    if (byte == FORM_FEED)
        return;
    if (byte == '\n' || byte == '\r') {
        end_pendants_line(hub, client);
        return;
    }
    client->garbled |= (byte < ' ' && byte != '\t') || byte == DELETE;
    client->garbled |= client->in.count - client->whole >= LINE_MAX_BYTES;
    if (!client->garbled && !net_queue_add(&client->in, &character, 1))
        client->gone = true;
}

void net_hub_take_pendant(struct net_hub *hub, struct net_client *client, uint8_t byte) {
    if (!net_line_is_realtime(byte)) {
        take_character(hub, client, byte);
        return;
    }
    if (byte == MPG_TOGGLE) {
        toggle_mpg(hub, client);
        return;
    }
    if ((byte == JOG_CANCEL || byte == '!') && hub->owner != NULL)
        net_hub_call_off_jogs(hub->owner);
    net_hub_put_realtime(hub, client, byte);
}

void net_hub_doubt_pendant(struct net_hub *hub, struct net_client *client) {
    if (hub->hand == client)
        net_hub_put_realtime(hub, client, JOG_CANCEL);
}

/* ---- lines ---- */

static size_t first_line(const struct net_client *client) {
    const char *line = net_queue_head(&client->in);
    const char *end = memchr(line, '\n', client->whole);
    return end == NULL ? client->whole : (size_t)(end + 1 - line);
}

/* Each line has its answer, an empty one `ok`. */
static void refuse_lines(struct net_hub *hub, struct net_client *client, enum status status,
                         const char *why) {
    while (client->whole > 0) {
        const size_t size = first_line(client);
        net_queue_drop(&client->in, size);
        client->whole -= size;
        if (size == 1) {
            net_hub_say(hub, client, "ok\r\n", 4);
            continue;
        }
        net_hub_refuse(hub, client, status, client->explained ? NULL : why);
        client->explained = true;
    }
}

static bool feed_hand(struct net_hub *hub, struct net_client *client) {
    const uint32_t before = hub->inside;
    if (hub->inside_hand >= INSIDE_MAX || client->out.count >= hub->sizes.out / 2)
        return false;
    const size_t fed = net_hub_feed_lines(hub, &client->in, client->whole);
    client->whole -= fed;
    hub->inside_hand = (uint8_t)(hub->inside_hand + hub->inside - before);
    return fed > 0;
}

/* @return true: its lines were fed or refused */
static bool look_at(struct net_hub *hub, struct net_client *client) {
    const enum machine_reads now = reads(hub);
    if (hub->hand == client)
        return feed_hand(hub, client);
    if (client->stream.pendant == NET_PENDANT_MPG || hub->mpg) {
        refuse_lines(hub, client, STATUS_PENDANT, hub->mpg ? in_control : no_control);
        return true;
    }
    if (hub->hand == NULL && hub->inside_hand == 0 && may_begin(hub, now)) {
        hub->hand = client;
        return feed_hand(hub, client);
    }
    if (now != MACHINE_READS_NOTHING || hub->hand != NULL)
        return false;
    refuse_lines(hub, client, STATUS_PENDANT, busy);
    return true;
}

/* What it has begun is done, and it has nothing more to say. */
static void end_turn(struct net_hub *hub) {
    const enum machine_reads now = reads(hub);
    if (hub->hand == NULL || hub->mpg || hub->inside_hand > 0 || hub->hand->whole > 0)
        return;
    if (now == MACHINE_READS_LINES || now == MACHINE_READS_OPERATORS)
        hub->hand = NULL;
}

bool net_hub_feed_pendants(struct net_hub *hub) {
    bool any = false;
    end_turn(hub);
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++)
        if (net_hub_is_open(client) && net_hub_is_pendant(client) && client->whole > 0)
            any |= look_at(hub, client);
    if (hub->mpg && hub->owner != NULL && hub->owner->whole > 0) {
        refuse_lines(hub, hub->owner, STATUS_PENDANT, in_control);
        any = true;
    }
    return any;
}

/* Also for the rest of a line that is under way: a pendant's line that waits would else wait for ever. */
bool net_hub_waits_for_pendant(const struct net_hub *hub) {
    if (hub->hand != NULL || hub->inside_hand > 0)
        return true;
    if (hub->owner != NULL && hub->owner->in_long)
        return false;
    for (const struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++)
        if (net_hub_is_open(client) && net_hub_is_pendant(client) && client->whole > 0)
            return true;
    return false;
}

bool net_hub_is_for(const struct net_hub *hub, const struct net_client *client, bool is_news) {
    const bool of_hand = hub->inside_hand > 0;
    if (is_news)
        return true;
    return net_hub_is_pendant(client) ? of_hand && client == hub->hand : !of_hand;
}

/* ---- ends ---- */

void net_hub_forget_pendants(struct net_hub *hub) {
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++)
        if (net_hub_is_open(client) && net_hub_is_pendant(client))
            net_hub_drop_lines(client);
    hub->inside_hand = 0;
    if (!hub->mpg)
        hub->hand = NULL;
}

/* No one sees what it has started. Answers that are still due are no one's. */
void net_hub_lose_pendant(struct net_hub *hub, struct net_client *client) {
    if (hub->hand != client)
        return;
    net_hub_drop_lines(client);
    if (hub->mpg)
        net_hub_end_mpg(hub);
    hub->hand = NULL;
    if (hub->ops->pendant_left != NULL)
        hub->ops->pendant_left(hub->ctx);
}
