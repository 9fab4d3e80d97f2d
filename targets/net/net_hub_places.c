/* SPDX-License-Identifier: MIT */
#include "net_hub.h"
#include "net_hub_inner.h"
#include "net_places.h"

#include <stdio.h>
#include <string.h>

/* MOMENT_US: a login that was typed before is on its way. SILENT_US: programs speak immediately. LOGIN_US: a
 * person types. FORGET_US: idle for long, before the clock wraps. */
#define MOMENT_US 1000000u
#define SILENT_US 10000000u
#define LOGIN_US  60000000u
#define FORGET_US 1800000000u

const char net_hub_locked_out[] =
    "Locked: log in at the web page, by wificnc login, or send $LOGIN=access key";

/* ---- who stays ---- */

void net_hub_note_heard(const struct net_hub *hub, struct net_client *client) {
    client->spoke = true;
    client->heard_us = hub->now_us;
}

static enum net_rank rank_of(const struct net_hub *hub, const struct net_client *client) {
    if (!net_hub_is_open(client))
        return NET_RANK_FREE;
    if (client->stream.local || client == hub->owner || client == hub->sender ||
        (net_hub_locks(hub) && !client->locked))
        return NET_RANK_STAYS;
    return client->locked || !client->spoke ? NET_RANK_UNPROVEN : NET_RANK_LISTENER;
}

static void fill_places(const struct net_hub *hub, struct net_place places[NET_CLIENTS]) {
    for (size_t i = 0; i < hub->sizes.clients; i++) {
        const struct net_client *client = &hub->client[i];
        places[i] = (struct net_place){.peer = client->stream.peer,
                                       .heard_us = client->waits ? hub->now_us : client->heard_us,
                                       .came_us = client->came_us,
                                       .rank = (uint8_t)rank_of(hub, client)};
    }
}

/* Of what an address may have before it has proven anything: two where places are scarce. */
static size_t unproven_places(const struct net_hub *hub) {
    return hub->sizes.clients / 3 > 2 ? hub->sizes.clients / 3 : 2;
}

bool net_hub_is_full(const struct net_hub *hub) {
    for (size_t i = 0; i < hub->sizes.clients; i++)
        if (hub->client[i].stream.ops == NULL)
            return false;
    return true;
}

/* ---- ends ---- */

static void lose_sender(struct net_hub *hub) {
    hub->sender = NULL;
    hub->sender_lost = hub->hand != NULL;
    if (hub->hand == NULL && hub->ops->left != NULL)
        hub->ops->left(hub->ctx, hub->left.count > 0);
}

void net_hub_remove_client(struct net_hub *hub, struct net_client *client) {
    if (client == hub->owner) {
        net_hub_call_off_jogs(client);
        net_hub_set_owner(hub, NULL);
    }
    if (client->in_left)
        net_hub_end_turns_of(hub, client);
    net_hub_disown_left(hub, client);
    if (client == hub->parked.operator)
        hub->parked.operator = NULL;
    if (client == hub->sender)
        lose_sender(hub);
    if (net_hub_is_pendant(client))
        net_hub_lose_pendant(hub, client);
    struct net_client removed = *client;
    net_queue_free(&client->in);
    net_queue_free(&client->out);
    *client = (struct net_client){0};
    removed.stream.ops->close(&removed.stream);
    hub->ops->event(hub->ctx, "disconnected", removed.name);
}

/* The last word goes around what waits: who gets here has not read that. */
static void say_why(const struct net_client *client, const char *why) {
    char line[NET_MESSAGE_SIZE];
    int size = snprintf(line, sizeof line, "[MSG:Disconnected: %s]\r\n", why);
    if (client->out.count == 0)
        (void)client->stream.ops->write(&client->stream, line, (size_t)size);
}

static void dismiss(struct net_hub *hub, struct net_client *client, const char *why) {
    say_why(client, why);
    net_hub_remove_client(hub, client);
}

static void end_untrusted(struct net_hub *hub, struct net_client *client) {
    say_why(client, "this address is not trusted any more");
    hub->ops->event(hub->ctx, "disconnected: its trust was revoked", client->name);
    client->gone = true;
}

/* net_hub_flush() removes them, so what they have sent is dealt with as that of any sender that is lost. */
void net_hub_end_untrusted(struct net_hub *hub, const struct net_client *asks) {
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++) {
        if (!net_hub_is_open(client) || !client->by_trust || net_hub_trusts(hub, &client->stream))
            continue;
        if (client == asks)
            client->refused = true; /* behind its answer */
        else
            end_untrusted(hub, client);
    }
}

void net_hub_close(struct net_hub *hub) {
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++)
        if (client->stream.ops != NULL)
            net_hub_remove_client(hub, client);
    net_queue_free(&hub->left);
    net_hub_forget_parked(hub);
}

/* ---- newcomers ---- */

/* @return NULL: all places are taken by clients that stay */
static struct net_client *place_for(struct net_hub *hub, const struct net_stream *stream) {
    struct net_place places[NET_CLIENTS];
    const struct net_newcomer newcomer = {.peer = stream->peer,
                                          .owner = hub->owner_peer,
                                          .unproven = unproven_places(hub),
                                          .login_us = MOMENT_US,
                                          .local = stream->local,
                                          .trusted = net_hub_locks(hub) && net_hub_trusts(hub, stream)};
    fill_places(hub, places);
    int chosen = net_places_choose(places, hub->sizes.clients, &newcomer, hub->now_us);
    if (chosen < 0)
        return NULL;
    struct net_client *client = &hub->client[chosen];
    if (client->stream.ops != NULL && client->gone)
        net_hub_remove_client(hub, client);
    else if (client->stream.ops != NULL)
        dismiss(hub, client, "another client needs this place");
    return client;
}

bool net_hub_connect(struct net_hub *hub, const struct net_stream *stream, const char *name) {
    static const char full[] = "[MSG:Connection refused: all client slots are in use]\r\n";
    struct net_client *client = place_for(hub, stream);
    if (client == NULL) {
        stream->ops->write(stream, full, sizeof full - 1);
        stream->ops->close(stream);
        hub->ops->event(hub->ctx, "refused, all client slots are in use", name);
        return false;
    }
    const bool knocks = net_hub_locks(hub) && !stream->local;
    const bool trusted = knocks && net_hub_trusts(hub, stream);
    *client = (struct net_client){.stream = *stream,
                                  .locked = knocks && !trusted,
                                  .by_trust = trusted,
                                  .opened = !stream->telnet,
                                  .heard_us = hub->now_us,
                                  .came_us = hub->now_us};
    hub->has_pendants |= net_hub_is_pendant(client);
    snprintf(client->name, sizeof client->name, "%s", name);
    hub->ops->event(hub->ctx, "connected", name);
    if (client->locked)
        net_hub_say_message(hub, client, net_hub_locked_out);
    else
        net_hub_greet(hub, client);
    return true;
}

/* ---- time ---- */

static void end_the_silent(struct net_hub *hub, struct net_client *client) {
    uint32_t idle_us = hub->now_us - client->heard_us;
    enum net_rank rank = rank_of(hub, client);
    if (idle_us > FORGET_US)
        client->heard_us = hub->now_us - FORGET_US;
    if (hub->now_us - client->came_us > FORGET_US)
        client->came_us = hub->now_us - FORGET_US;
    if (rank != NET_RANK_UNPROVEN || client->waits)
        return;
    if (!client->spoke && idle_us >= SILENT_US)
        dismiss(hub, client, "nothing received for 10 s");
    else if (client->locked && idle_us >= LOGIN_US)
        dismiss(hub, client, "not logged in, and nothing received for 60 s");
}

void net_hub_tick(struct net_hub *hub, uint32_t now_us) {
    hub->now_us = now_us;
    net_hub_follow_button(hub);
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++) {
        if (!net_hub_is_open(client))
            continue;
        if (client->waits)
            net_hub_log_in_again(hub, client);
        end_the_silent(hub, client);
    }
}
