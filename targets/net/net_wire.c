/* SPDX-License-Identifier: MIT */
#include "net_wire.h"

#include "net_places.h"
#include "net_tcp.h"
#include "wire/bytes.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

/* Taken in one round, so that a flood leaves time for everything else. */
enum { DATAGRAMS_A_ROUND = 64, ACCEPTS_A_ROUND = 16 };

/* A host speaks immediately. A moment is what its login needs. */
#define MOMENT_US 1000000u
#define SILENT_US 10000000u

enum { UNPROVEN_AN_ADDRESS = 2 };

/* Longest reply with its size. */
enum { REPLY_MAX = 2 + WIRE_PACKET_MAX };

_Static_assert((int)NET_WIRE_OUT >= (int)REPLY_MAX, "a reply has room when nothing waits");

/* cppcheck-suppress constParameterPointer ; the type of ops->send is fixed */
void net_wire_send(void *ctx, const struct session_peer *to, const uint8_t *packet, size_t size) {
    const struct net_wire *wire = ctx;
    struct net_address at = {.port = to->port};
    memcpy(at.bytes, to->address, sizeof to->address);
    if (wire->udp >= 0)
        net_socket_send(wire->udp, &at, packet, size);
}

/* ---- ports ---- */

int net_wire_open(struct net_wire *wire, const char *address, struct session *session) {
    char port[8], name[NET_ADDRESS_SIZE];
    struct net_address here;
    int error = EINVAL;
    *wire = (struct net_wire){.listener = -1, .udp = -1, .session = session};
    snprintf(port, sizeof port, "%u", (unsigned)WIRE_CONTROL_PORT);
    if (net_address_v4(address, WIRE_UDP_PORT, &here))
        wire->udp = net_socket_udp(&here, false, &error);
    if (wire->udp < 0)
        return error;
    net_socket_watch_unreachable(wire->udp);
    wire->listener = net_tcp_listen(address, port, name, &error);
    if (wire->listener >= 0)
        return 0;
    net_wire_close(wire);
    return error != 0 ? error : EINVAL;
}

static void drop(struct net_wire *wire, int place, bool left) {
    struct net_wire_client *client = &wire->client[place];
    client->stream.ops->close(&client->stream);
    client->stream.ops = NULL;
    session_disconnect(wire->session, place, left);
}

void net_wire_close(struct net_wire *wire) {
    for (int i = 0; i < SESSION_CLIENTS; i++)
        if (wire->client[i].stream.ops != NULL)
            drop(wire, i, false);
    if (wire->listener >= 0)
        net_socket_close(wire->listener);
    if (wire->udp >= 0)
        net_socket_close(wire->udp);
    wire->listener = wire->udp = -1;
}

/* ---- UDP ---- */

/* Reports to there end. */
static void read_unreachable(struct net_wire *wire) {
    struct net_address to;
    for (int i = 0; i < DATAGRAMS_A_ROUND && net_socket_unreachable(wire->udp, &to); i++) {
        struct session_peer at = {.port = to.port};
        memcpy(at.address, to.bytes, sizeof at.address);
        session_unreachable(wire->session, &at);
    }
}

static void read_datagrams(struct net_wire *wire) {
    _Alignas(4) uint8_t bytes[WIRE_PACKET_MAX]; /* siphash() reads words */
    struct net_address from;
    for (int i = 0; i < DATAGRAMS_A_ROUND; i++) {
        long count = net_socket_receive(wire->udp, bytes, sizeof bytes, &from);
        if (count == NET_NOTHING)
            return;
        if (count < 0)
            continue;
        struct session_peer peer = {.port = from.port};
        memcpy(peer.address, from.bytes, sizeof peer.address);
        session_datagram(wire->session, &peer, bytes, (size_t)count);
    }
}

/* ---- TCP ---- */

static uint32_t clock_us(const struct net_wire *wire) {
    return (uint32_t)wire->session->now_us;
}

/* The last message, or the connection. One that waits for an answer is not idle. */
static uint32_t heard_us(const struct net_wire *wire, int place) {
    const struct session_client *client = &wire->session->client[place];
    return client->waits ? clock_us(wire) : (uint32_t)client->heard_us;
}

static enum net_rank rank_of(const struct net_wire *wire, int place) {
    const struct session *session = wire->session;
    const struct session_client *client = &session->client[place];
    bool locks = !session->options.access->open;
    if (wire->client[place].stream.ops == NULL)
        return NET_RANK_FREE;
    bool owns = session->owner.on && memcmp(client->address, session->owner.address, 4) == 0;
    bool streams = session->stream.open && session->stream.client == place;
    bool known = client->authenticated || access_may(session->options.access, lockout_ipv4(client->address));
    if (streams || (locks ? known : owns))
        return NET_RANK_STAYS;
    return locks || !wire->client[place].spoke ? NET_RANK_UNPROVEN : NET_RANK_LISTENER;
}

/* The host that commands, or did last. */
static uint64_t owner_peer(const struct session *session) {
    static const uint8_t nobody[4];
    bool any = memcmp(session->owner.address, nobody, sizeof nobody) != 0;
    return any ? lockout_ipv4(session->owner.address) : 0;
}

/* @return -1: none */
static int place_for(const struct net_wire *wire, uint64_t peer) {
    struct net_place places[SESSION_CLIENTS];
    const struct access *access = wire->session->options.access;
    const struct net_newcomer newcomer = {.peer = peer,
                                          .trusted = !access->open && access_may(access, peer),
                                          .owner = owner_peer(wire->session),
                                          .unproven = UNPROVEN_AN_ADDRESS,
                                          .login_us = MOMENT_US};
    for (int i = 0; i < SESSION_CLIENTS; i++) {
        const struct net_wire_client *client = &wire->client[i];
        places[i] = (struct net_place){.peer = client->stream.peer,
                                       .heard_us = heard_us(wire, i),
                                       .came_us = client->came_us,
                                       .rank = (uint8_t)rank_of(wire, i)};
    }
    int chosen = net_places_choose(places, SESSION_CLIENTS, &newcomer, clock_us(wire));
    int silent = session_place(wire->session);
    bool is_taken = silent >= 0 && wire->client[silent].stream.ops != NULL;
    return chosen < 0 && is_taken ? silent : chosen;
}

static void accept_clients(struct net_wire *wire) {
    struct net_stream stream;
    char name[NET_ADDRESS_SIZE];
    for (int i = 0; i < ACCEPTS_A_ROUND && net_tcp_accept(wire->listener, &stream, name); i++) {
        struct net_address peer;
        int place = place_for(wire, stream.peer);
        if (place < 0 || !net_socket_peer(stream.fd, &peer)) {
            stream.ops->close(&stream);
            continue;
        }
        if (wire->client[place].stream.ops != NULL)
            drop(wire, place, false);
        net_tcp_keep_alive(&stream); /* nothing may continue because no one says that the host has gone */
        wire->client[place] = (struct net_wire_client){.stream = stream, .came_us = clock_us(wire)};
        session_connect(wire->session, place, peer.bytes);
    }
}

/* A message is taken only when its reply has room: a host that does not read is not read either. */
bool net_wire_wants_read(const struct net_wire_client *client) {
    return client->out_count + REPLY_MAX <= NET_WIRE_OUT;
}

/* @return false: the connection has failed */
static bool write_replies(struct net_wire_client *client) {
    if (client->out_count == 0)
        return true;
    long count = client->stream.ops->write(&client->stream, (const char *)client->out, client->out_count);
    if (count < 0)
        return false;
    client->out_count -= (size_t)count;
    memmove(client->out, client->out + count, client->out_count);
    return true;
}

/* Whole messages that have come, as long as there is room for their replies.
 * @return false: that is not this protocol */
static bool answer_messages(struct net_wire *wire, int place) {
    struct net_wire_client *client = &wire->client[place];
    while (client->in_count >= 2 && net_wire_wants_read(client)) {
        /* Each message has its size before it (docs/protocol.md). One that cannot be is no message of
         * ours, and where the next one begins is not known: the connection ends. */
        size_t size = get_u16(client->in);
        if (size == 0 || size > WIRE_CONTROL_MAX)
            return false;
        if (client->in_count < 2 + size)
            break;
        if (session_must_wait(wire->session, place, client->in + 2, size))
            break;
        uint8_t *reply = client->out + client->out_count;
        size_t reply_size = session_request(wire->session, place, client->in + 2, size, reply + 2);
        if (reply_size > 0) {
            put_u16(reply, (uint16_t)reply_size);
            client->out_count += 2 + reply_size;
        }
        client->in_count -= 2 + size;
        client->spoke = true;
        memmove(client->in, client->in + 2 + size, client->in_count);
        if (!write_replies(client))
            return false;
    }
    return true;
}

static void read_client(struct net_wire *wire, int place) {
    struct net_wire_client *client = &wire->client[place];
    size_t room = sizeof client->in - client->in_count;
    long count = room == 0
                     ? 0
                     : client->stream.ops->read(&client->stream, (char *)client->in + client->in_count, room);
    if (count > 0)
        client->in_count += (size_t)count;
    if (count < 0 || !answer_messages(wire, place))
        drop(wire, place, true);
}

void net_wire_round(struct net_wire *wire) {
    read_unreachable(wire);
    read_datagrams(wire);
    for (int i = 0; i < SESSION_CLIENTS; i++) {
        struct net_wire_client *client = &wire->client[i];
        if (client->stream.ops == NULL)
            continue;
        if (!write_replies(client))
            drop(wire, i, true);
        else if (!client->spoke && clock_us(wire) - heard_us(wire, i) >= SILENT_US)
            drop(wire, i, false);
        else if (net_wire_wants_read(client))
            read_client(wire, i);
    }
    accept_clients(wire);
}
