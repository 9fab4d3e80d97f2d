/* SPDX-License-Identifier: MIT
 * Stops: what waits, and what is on its way, does not run behind them. */
#include "net_hub_inner.h"
#include "net_line.h"

enum { READS_AHEAD = 64 }; /* of one client, at a stop: who sends without end is not heard out */

/* ---- jogs that are called off ---- */

/* Whose lines wait behind what a stop ends now: a jog, or what the operator of a parked hold does. Behind a
 * ~ that waits they are the job's. */
static const struct net_queue *lines_behind(const struct net_hub *hub) {
    if (hub->ops->jogs != NULL && hub->ops->jogs(hub->ctx))
        return hub->jogs;
    if (hub->hand != NULL && hub->hand_parked)
        return &hub->hand->in;
    return hub->parked.on && !hub->parked.resumes && hub->owner != NULL ? &hub->owner->in : NULL;
}

static bool may_jog(const struct net_hub *hub, const struct net_client *client) {
    return net_hub_is_open(client) && (client == hub->owner || net_hub_is_pendant(client));
}

/* Jogs that still wait when they are called off must not run behind that: they become empty lines, so that
 * each has its answer; a half one when its rest has come. So does the controller with those that it has. */
static void call_off(struct net_client *client, const char *stopped) {
    struct net_queue *in = &client->in;
    client->called_off = in->count > client->whole;
    if (client->whole > 0)
        client->whole = net_line_call_off(in->bytes + in->begin, client->whole, &in->count, stopped);
}

void net_hub_call_off_jogs(struct net_client *client) {
    call_off(client, NULL);
}

/* What waits behind the jog that is stopped does not begin by that: it is refused, as while it moved. */
static void call_off_lines(const struct net_hub *hub, struct net_client *client) {
    const bool pendant = net_hub_is_pendant(client), behind = hub->stopped_jogs == &client->in;
    const char owners[] = {net_hub_mark_of(hub, client), NET_LINE_STOPPED, '\0'};
    const char pendants[] = {(char)NET_PENDANT_STOPPED, '\0'};
    call_off(client, !behind ? NULL : pendant ? pendants : owners);
}

static void call_off_all_jogs(struct net_hub *hub, const struct net_client *but) {
    struct net_queue *left = &hub->left;
    struct net_hub_lines *job = &hub->parked.job;
    if (job->in.count > 0) {
        job->called_off = job->in.count > job->whole;
        job->whole = net_line_call_off(job->in.bytes + job->in.begin, job->whole, &job->in.count, NULL);
    }
    if (left->count > 0)
        (void)net_line_call_off(left->bytes + left->begin, left->count, &left->count, NULL);
    /* cppcheck-suppress nullPointerArithmeticRedundantCheck ; `but` may be NULL, `client` never is */
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++)
        if (client != but && may_jog(hub, client))
            call_off_lines(hub, client);
}

/* ---- real-time bytes ---- */

void net_hub_drop_lines(struct net_client *client) {
    net_queue_drop(&client->in, client->in.count);
    client->whole = 0;
    client->in_long = client->called_off = false;
}

/* What follows a client's own reset is a new line; of another's, the rest of a line that no one takes. */
static void forget_lines(struct net_client *client, bool its_own) {
    client->skips = !its_own && (client->skips || client->in.count > client->whole || client->in_long);
    client->refuses_rest = false; /* the banner ends it */
    client->garbled &= !its_own;
    client->lost_lines = 0;
    net_hub_drop_lines(client);
}

void net_hub_forget_lines(struct net_hub *hub, const struct net_client *by) {
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++)
        if (may_jog(hub, client))
            forget_lines(client, client == by);
        else
            client->lost_lines = 0;
    net_queue_drop(&hub->left, hub->left.count);
    net_hub_forget_parked(hub);
    net_hub_end_turns(hub);
}

/* A reset forgets every line on its way. */
static void reset(struct net_hub *hub, const struct net_client *by) {
    static const char character = RESET;
    net_hub_forget_lines(hub, by);
    hub->ops->put(hub->ctx, &character, 1);
    hub->ops->act(hub->ctx);
    net_hub_hear(hub);
}

void net_hub_take_realtime(struct net_hub *hub, struct net_client *client, uint8_t byte) {
    const bool is_own = hub->jogs == &client->in;
    if ((byte == '!' || byte == JOG_CANCEL || byte == RESET) && !is_own && hub->ops->stopped_by_other != NULL)
        hub->ops->stopped_by_other(hub->ctx);
    net_hub_put_realtime(hub, client, byte);
}

void net_hub_put_realtime(struct net_hub *hub, struct net_client *client, uint8_t byte) {
    const char character = (char)byte;
    if (byte == '!' || byte == JOG_CANCEL || byte == DOOR)
        net_hub_put_kept_resume(hub);
    if (byte == '~' && net_hub_keep_resume(hub))
        return;
    if (byte == RESET)
        reset(hub, client);
    else if (net_hub_may_ask(hub, client) || !net_hub_want_report(client, byte)) {
        hub->asked |= byte == '?' || byte == FULL_STATUS;
        hub->ops->put(hub->ctx, &character, 1);
    }
    if (byte == PARK) /* it may be refused: then lines behind it are the job's */
        hub->ops->act(hub->ctx);
    if (byte == PARK || byte == '~')
        net_hub_follow_parked(hub);
    if (byte == RESET) {
        hub->resets = true;
        hub->reset_by = client;
    }
    if (byte == JOG_CANCEL || byte == '!') {
        hub->stops = true;
        hub->stopped_by = client;
        hub->stopped_jogs = lines_behind(hub);
        call_off_all_jogs(hub, NULL);
    }
}

/* @return true: nothing more of it has come; false: too many of its lines waited, and now there is room */
static bool is_heard_out(struct net_hub *hub, struct net_client *client, bool resets) {
    const size_t before = client->in.count;
    if (net_hub_wants_read(hub, client))
        return true;
    if (resets && client != hub->reset_by)
        forget_lines(client, false);
    else
        net_hub_call_off_jogs(client);
    return client->in.count == before;
}

static void read_ahead(struct net_hub *hub, struct net_client *client, bool resets) {
    for (unsigned n = 0; n < READS_AHEAD && may_jog(hub, client); n++)
        if (!net_hub_read(hub, client) && is_heard_out(hub, client, resets))
            return;
}

/* What others have sent before a stop and is not read yet is as what waits: how far the hub has read is
 * chance. A reset in that is its sender's, as any: its lines behind it are new. */
void net_hub_end_stop(struct net_hub *hub) {
    const bool stops = hub->stops, resets = hub->resets;
    const struct net_client *by = resets ? hub->reset_by : hub->stopped_by, *stopped_by = hub->stopped_by;
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++)
        if (client != by)
            read_ahead(hub, client, resets);
    if (hub->resets) {
        for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++)
            if (client != hub->reset_by && may_jog(hub, client))
                forget_lines(client, false);
        net_queue_drop(&hub->left, hub->left.count);
    }
    if (stops)
        call_off_all_jogs(hub, stopped_by);
    hub->stops = hub->resets = false;
    hub->stopped_jogs = NULL;
}
