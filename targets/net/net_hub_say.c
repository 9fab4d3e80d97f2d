/* SPDX-License-Identifier: MIT
 * What the hub itself says to clients. */
#include "net_hub_inner.h"

#include <stdio.h>

const char net_hub_nobody[] = "No client is in control: the first line takes control";

void net_hub_say(struct net_hub *hub, struct net_client *client, const char *bytes, size_t count) {
    size_t most = client == hub->owner ? 2 * hub->sizes.out : hub->sizes.out;
    if (!net_hub_is_open(client))
        return;
    if (client->out.count + count <= most && net_queue_add(&client->out, bytes, count))
        return;
    client->gone = true;
    hub->ops->event(hub->ctx, "disconnected: it does not read", client->name);
}

void net_hub_say_message(struct net_hub *hub, struct net_client *client, const char *text) {
    char line[NET_MESSAGE_SIZE + sizeof "[MSG:]\r\n"];
    int size = snprintf(line, sizeof line, "[MSG:%s]\r\n", text);
    net_hub_say(hub, client, line, (size_t)size);
}

void net_hub_tell(struct net_hub *hub, const char *text) {
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++)
        if (!client->locked)
            net_hub_say_message(hub, client, text);
}

void net_hub_tell_observers(struct net_hub *hub, const char *text) {
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++)
        if (client != hub->owner && !client->locked)
            net_hub_say_message(hub, client, text);
}

void net_hub_refuse(struct net_hub *hub, struct net_client *client, enum status status, const char *why) {
    char line[sizeof "error:-2147483648\r\n"];
    if (why != NULL)
        net_hub_say_message(hub, client, why);
    int size = snprintf(line, sizeof line, "error:%d\r\n", (int)status);
    net_hub_say(hub, client, line, (size_t)size);
}

void net_hub_explain(struct net_hub *hub, struct net_client *observer) {
    char text[NET_NAME_SIZE + 64];
    if (hub->owner == NULL) {
        net_hub_say_message(hub, observer, net_hub_nobody);
        return;
    }
    snprintf(text, sizeof text, "Observer: %s is in control, $TAKE takes control", hub->owner->name);
    net_hub_say_message(hub, observer, text);
}

/* Notices for a client that may take control from now on. */
void net_hub_greet(struct net_hub *hub, struct net_client *client) {
    char text[NET_MESSAGE_SIZE];
    for (unsigned n = 0; hub->ops->notice != NULL && hub->ops->notice(hub->ctx, n, text, sizeof text); n++)
        net_hub_say_message(hub, client, text);
    if (net_hub_is_pendant(client))
        return;
    net_hub_tell_key(hub, client);
    if (hub->owner != NULL)
        net_hub_explain(hub, client);
}
