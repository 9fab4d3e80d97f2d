/* SPDX-License-Identifier: MIT
 * Datagrams and connections come in; the time that a host may be silent runs out. */
#include "session/inner.h"

#include <string.h>

#define LISTENER_US                                                                                          \
    (WIRE_LISTENER_S * 1000000ull) /* a host that was not heard of for this long gets no more reports */
#define CLIENT_IDLE_US (WIRE_CLIENT_IDLE_S * 1000000ull) /* its place may be given to another one */
#define STRANGERS_US   50000u /* between two reports to addresses that have proven nothing */
#define JOG_US         (WIRE_JOG_LIFE_MS * 1000ull)
#define OWNER_US       10000u  /* the time-outs of an owner are looked at this often */
#define TRIAL_US       100000u /* a network on trial is looked at this often */
#define BOUNCES_US     1000u   /* inputs are looked at this often until they are quiet */

/* What a controller and an I/O module have in common. No stream was ever opened: -1, because 0 is the
 * place of a real connection, and session_disconnect() compares with it. */
static void begin(struct session *session, const struct hal *hal, const struct session_options *options,
                  const struct session_ops *ops, void *ctx) {
    memset(session, 0, sizeof *session);
    session->hal = hal;
    session->ops = ops;
    session->ctx = ctx;
    session->options = *options;
    session->clock_us = hal_time_us(hal);
    session->stream.client = -1;
}

void session_init(struct session *session, struct machine *machine, const struct session_options *options,
                  const struct session_ops *ops, void *ctx) {
    begin(session, machine_hal(machine), options, ops, ctx);
    session->machine = machine;
    session->settings = machine_settings(machine);
    /* What the machine counted before this session is not reported by it. */
    session->probes_done = machine_host(machine)->probes_done;
    session->late_refusals = machine_host(machine)->late_refusals;
}

void session_init_module(struct session *session, struct session_module *module,
                         const struct session_options *options, const struct session_ops *ops, void *ctx) {
    begin(session, module->hal, options, ops, ctx);
    session->module = module;
    session->settings = &module->settings;
}

/* Its reports are not given to a host that only asks. */
static bool keeps_reports(const struct session *session, const uint8_t address[4]) {
    return session_has_client(session, address) ||
           (session->owner.on && session_same(address, session->owner.address));
}

/* The place of this address, or the one that it may have: free; or, for a host that keeps its reports, that
 * of one that does not, the longest silent. @return NULL: none */
static struct session_listener *listener_of(struct session *session, const uint8_t address[4]) {
    struct session_listener *found = NULL;
    const bool keeps = keeps_reports(session, address);
    bool found_taken = false;
    for (unsigned i = 0; i < SESSION_LISTENERS; i++) {
        struct session_listener *listener = &session->listener[i];
        const bool taken = session_reports_to(session, listener);
        if (listener->used && session_same(listener->address, address))
            return listener;
        if (taken && (!keeps || keeps_reports(session, listener->address)))
            continue;
        if (found == NULL || (found_taken && (!taken || listener->heard_us < found->heard_us))) {
            found = listener;
            found_taken = taken;
        }
    }
    return found;
}

/* This host gets reports from now on. */
static void listen(struct session *session, const uint8_t address[4]) {
    struct session_listener *listener = listener_of(session, address);
    if (listener == NULL)
        return;
    bool known = listener->used && session_same(listener->address, address);
    listener->used = true;
    listener->closed = 0;
    memcpy(listener->address, address, sizeof listener->address);
    listener->heard_us = session->now_us;
    if (!known)
        session_send_status(session, address);
}

/* Its host commands, or has proven on a connection of this address that it knows the key. */
static bool is_proven(const struct session *session, const uint8_t address[4]) {
    bool proven = session->owner.on && session_same(session->owner.address, address);
    for (unsigned i = 0; i < SESSION_CLIENTS; i++)
        proven |= session->client[i].authenticated && session_same(session->client[i].address, address);
    return proven;
}

void session_unreachable(struct session *session, const struct session_peer *at) {
    const uint16_t port = session->options.status_port;
    const bool of_module =
        session_is_module(session) && at->port == port + WIRE_IO_STATUS_PORT - WIRE_STATUS_PORT;
    if ((at->port != port && !of_module) || is_proven(session, at->address))
        return;
    for (unsigned i = 0; i < SESSION_LISTENERS; i++)
        if (session->listener[i].used && session_same(session->listener[i].address, at->address))
            session->listener[i].closed |= of_module ? 2 : 1;
}

/* A source address may be forged, so that what is sent there hits someone else: who is neither known nor
 * connected gets no more bytes than it sends, and rarely. @param size  of what it has sent */
static bool may_answer_stranger(struct session *session, size_t size, size_t answer) {
    if (size < WIRE_HEADER_SIZE + answer || session->now_us < session->stranger_us)
        return false;
    session->stranger_us = session->now_us + STRANGERS_US;
    return true;
}

/* By the seal behind it, of the session of a connection of this address: what another address sends again
 * takes nothing from the host, not even its number. */
static bool is_sealed(struct session *session, const uint8_t address[4], const struct wire_header *header,
                      const uint8_t *bytes, size_t size) {
    for (unsigned i = 0; i < SESSION_CLIENTS; i++) {
        struct session_client *client = &session->client[i];
        if (!session_same(client->address, address) ||
            !seal_open(&client->seal, bytes, WIRE_HEADER_SIZE + (size_t)header->length, size))
            continue;
        client->heard_us = session->now_us; /* who sends only datagrams is not silent: they end with it */
        return true;
    }
    return false;
}

/* What is not motion, and was not refused as unknown. */
static void act_at_once(struct session *session, const struct session_peer *from,
                        const struct wire_header *header, const uint8_t *payload, enum wire_refusal refusal) {
    /* A refused motion packet is passed on, too: a stream is answered with how far it is. An I/O module has
     * no host queue that it could look at. */
    if (header->type == WIRE_STREAM_SEGMENTS && refusal != WIRE_REFUSAL_IO_MODULE)
        stream_segments(session, from, header, payload, refusal);
    else if (header->type != WIRE_STREAM_SEGMENTS && refusal == WIRE_REFUSAL_NONE)
        (void)session_command(session, from->address, header->type, payload);
}

/* The number of what is not known to be of this host is not one of its numbers. */
static void note_number(struct session *session, const struct session_peer *from,
                        const struct wire_header *header, bool known) {
    if (known)
        session_note_sequence(session, from->address, header->sequence);
}

static void act(struct session *session, const struct session_peer *from, const struct wire_header *header,
                const uint8_t *payload, enum wire_refusal refusal, bool known) {
    struct session_pace pace;
    bool moved = false;
    bool resumes = header->type == WIRE_RESUME; /* a gap is older than it, and holds before it */
    if (resumes)
        note_number(session, from, header, known);
    if (header->type == WIRE_MOTION)
        moved = session_motion(session, from->address, header, payload, refusal, &pace);
    else
        act_at_once(session, from, header, payload, refusal);
    /* After the command, which may have made this host the owner: only the owner's numbers count, from
     * this one on. */
    if (!resumes)
        note_number(session, from, header, known);
    if (moved)
        session_note_moved(session, &pace, header->sequence);
}

void session_datagram(struct session *session, const struct session_peer *from, const uint8_t *bytes,
                      size_t size) {
    struct wire_header header;
    session_tick(session);
    /* Bytes that are not a packet say nothing about their sender: no listener, no sign of life. */
    if (!wire_open(bytes, size, &header)) {
        session->counts.malformed++;
        return;
    }
    const uint8_t *payload = bytes + WIRE_HEADER_SIZE;
    bool sealed = is_sealed(session, from->address, &header, bytes, size);
    enum wire_refusal refusal = session_check_datagram(session, from->address, &header, sealed);
    bool known = sealed || access_may(session->options.access, lockout_ipv4(from->address));
    bool reachable = known || session_has_client(session, from->address);
    if (known)
        session_note_alive(session, from->address);
    /* Also of a packet that is refused: a host without the right to move may watch, and gets the status
     * for it. */
    const bool acks = header.type == WIRE_STREAM_SEGMENTS && refusal != WIRE_REFUSAL_IO_MODULE;
    if (reachable)
        listen(session, from->address);
    else if (!acks && may_answer_stranger(session, size, WIRE_STATUS_SIZE))
        session_send_status(session, from->address);
    if (refusal == WIRE_REFUSAL_UNKNOWN_TYPE || refusal == WIRE_REFUSAL_MALFORMED) {
        session->counts.malformed++;
        return;
    }
    if (!acks || reachable || may_answer_stranger(session, size, WIRE_STREAM_ACK_SIZE))
        act(session, from, &header, payload, refusal, known);
    session->counts.datagrams++;
}

/* ---- TCP clients ---- */

/* What the owner's datagrams are proven by: its connection that was heard last. */
static bool is_owners_proof(const struct session *session, int place) {
    const struct session_client *client = &session->client[place];
    if (!session->owner.on || !client->authenticated ||
        !session_same(session->owner.address, client->address))
        return false;
    for (int i = 0; i < SESSION_CLIENTS; i++) {
        const struct session_client *other = &session->client[i];
        if (other->authenticated && session_same(other->address, client->address) &&
            other->heard_us > client->heard_us)
            return false;
    }
    return true;
}

/* Something ends with this connection: a stream, what outputs do, or that the owner is known. */
static bool is_needed(const struct session *session, int place) {
    const struct session_owner *owner = &session->owner;
    if ((session->stream.open && session->stream.client == place) || is_owners_proof(session, place))
        return true;
    return session_same(owner->address, session->client[place].address) &&
           (session_is_module(session) ? owner->on : session_runs_outputs(session));
}

int session_place(const struct session *session) {
    int oldest = -1;
    for (int i = 0; i < SESSION_CLIENTS; i++) {
        const struct session_client *client = &session->client[i];
        if (!client->used)
            return i;
        if (!is_needed(session, i) && session->now_us - client->heard_us >= CLIENT_IDLE_US &&
            (oldest < 0 || client->heard_us < session->client[oldest].heard_us))
            oldest = i;
    }
    return oldest;
}

void session_connect(struct session *session, int place, const uint8_t address[4]) {
    struct session_client *client = &session->client[place];
    session_tick(session);
    *client = (struct session_client){.used = true, .heard_us = session->now_us};
    memcpy(client->address, address, sizeof client->address);
    if (session->options.device != NULL)
        device_connected(session->options.device, (unsigned)place);
    /* The owner is back: nothing of it is given up (follow_gone()). */
    if (session_same(session->owner.address, address))
        session->owner.left = session->owner.lost = false;
}

void session_disconnect(struct session *session, int place, bool left) {
    struct session_client *client = &session->client[place];
    struct session_owner *owner = &session->owner;
    session_tick(session);
    client->used = client->authenticated = client->has_nonce = false;
    client->seal = (struct seal){0};
    if (session->stream.client == place)
        session->stream.client = -1;
    /* Only an end that the other side made counts. A place that we gave to someone else (session_place())
     * belonged to a host that may still send datagrams; for it the time-out of is_owner_gone() applies. */
    bool owned = owner->on && session_same(owner->address, client->address);
    owner->left |= left && owned && !session_has_client(session, client->address);
}

/* ---- time ---- */

static void forget_listeners(struct session *session) {
    for (unsigned i = 0; i < SESSION_LISTENERS; i++) {
        struct session_listener *listener = &session->listener[i];
        if (session->now_us - listener->heard_us >= LISTENER_US &&
            !session_has_client(session, listener->address))
            listener->used = false;
    }
}

static bool is_owner_silent(const struct session *session) {
    return session->now_us - session->owner.alive_us >= session->settings->host_timeout_ms * 1000ull;
}

/* A host with a connection may be silent, but not with a stream open: a program that hangs keeps its
 * connection. */
static bool is_owner_gone(const struct session *session) {
    const struct session_owner *owner = &session->owner;
    if (owner->lost)
        return true;
    if (session_has_client(session, owner->address))
        return session->stream.open && is_owner_silent(session);
    return owner->left || is_owner_silent(session);
}

/* Spindle or coolant are on because the owner said so. A job of the text side has its own. */
static bool drives_owner(const struct session *session) {
    const struct machine *machine = session->machine;
    return session_runs_outputs(session) && (machine_host(machine)->owns || !machine_host_has_job(machine));
}

/* Nothing of a host that is gone continues for ever; but what is queued is cut by a cutter that turns. What a
 * hold has stopped does not move hours later. */
static void follow_gone(struct session *session) {
    struct machine *machine = session->machine;
    /* Once: whoever resumes what was held answers for it. */
    if (!session->owner.lost) {
        session->owner.lost = true;
        stream_close(session, session->owner.left ? WIRE_REFUSAL_STREAM_CLOSED : WIRE_REFUSAL_SILENT);
        sender_lose_host(machine, session->owner.left);
    }
    /* A host that has ended its connection does not come back for what a hold keeps. One that is only
     * silent may: the network was gone, and its motion waits for `~`. */
    if (session->owner.left &&
        (machine_state(machine) == MACHINE_HOLD || machine_state(machine) == MACHINE_DOOR))
        machine_host_discard(machine);
    /* Called in each poll until nothing of the host runs any more: first its motion ends, then its outputs
     * go off. */
    if (!drives_owner(session) || !machine_is_standing(machine) ||
        !host_queue_is_empty(&machine_host(machine)->queue))
        return;
    /* In a hold they stop when $75 says so (machine/sender.c). */
    if (!session->owner.left && machine_state(machine) == MACHINE_HOLD &&
        !machine_outputs(machine)->suspended)
        return;
    session_switch_off(session);
}

/* What is executed is no silence: motion is the host's for `$77` behind its end. Whether its host is there is
 * asked as long as more follows; the last segment that was accepted is executed to its end, however long. */
static void follow_motion(struct session *session) {
    const struct machine *machine = session->machine;
    struct session_owner *owner = &session->owner;
    if (machine_state(machine) != MACHINE_RUN || !machine_host_has_segments(machine))
        return;
    owner->motion_us = session->now_us;
    if (machine_host_taken(machine) - machine_host_done(machine) <= 1 && !owner->lost)
        owner->alive_us = session->now_us;
}

/* A released key, or a host that hangs, stops it. */
static void follow_jog(struct session *session) {
    const struct host_jog *jog = &machine_host(session->machine)->jog;
    if ((jog->on || jog->waits) && session->now_us - session->jog_us >= JOG_US)
        machine_host_jog_stop(session->machine);
}

/* Motion goes back to the text side, and the machine to any host, when the owner is silent and done. */
static void follow_owner(struct session *session) {
    struct session_owner *owner = &session->owner;
    uint64_t timeout_us = session->settings->host_timeout_ms * 1000ull;
    bool streams = session->stream.open && session->stream.client >= 0;
    if (!owner->on)
        return;
    follow_motion(session);
    if (is_owner_gone(session))
        follow_gone(session);
    /* As long as its connection exists, an open stream keeps motion, however long the host pauses. */
    if (streams)
        return;
    /* Two steps: motion goes back as soon as the host has sent none for the time-out; the right to command
     * only when it has sent no command either, and nothing that it has switched on still runs. */
    bool idle = session->now_us - owner->motion_us >= timeout_us && machine_host_release(session->machine);
    if (!idle || session->now_us - owner->heard_us < timeout_us || drives_owner(session) ||
        (owner->taken && !is_owner_gone(session)))
        return;
    stream_close(session, WIRE_REFUSAL_STREAM_CLOSED);
    owner->on = owner->taken = false;
}

/* Segments that lay ready until the text side's job stood, and lead out of the travel from there. */
static void follow_late_refusals(struct session *session) {
    const struct machine_host *host = machine_host(session->machine);
    uint32_t count = host->late_refusals - session->late_refusals;
    if (count == 0)
        return;
    session->late_refusals = host->late_refusals;
    session->counts.refused_segments += count;
    session->counts.last_refusal = WIRE_REFUSAL_TRAVEL;
    /* The stream was answered "taken" for these when they were laid. Its next ack reports them as refused. */
    session->stream.refused = host->late_refused - session->stream.base;
    stream_close(session, WIRE_REFUSAL_TRAVEL);
}

static void follow_device(struct session *session) {
    bool at_rest = session_is_module(session) || machine_is_at_rest(session->machine);
    if (session->options.device != NULL)
        device_poll(session->options.device, session->now_us, at_rest);
}

void session_poll(struct session *session) {
    session_tick(session);
    forget_listeners(session);
    if (session_is_module(session)) {
        module_poll(session);
    } else {
        /* Refusals first: they close the stream with their reason, and stream_follow() would close it
         * without one. */
        follow_late_refusals(session);
        stream_follow(session);
        follow_jog(session);
        follow_owner(session);
    }
    session_report(session);
    follow_device(session);
}

uint32_t session_wait_us(const struct session *session) {
    uint32_t wait_us = session_report_wait_us(session);
    bool bounces = session_is_module(session) && !channels_are_quiet(session->options.channels);
    const struct device *device = session->options.device;
    if (device != NULL && device->on_trial && wait_us > TRIAL_US)
        wait_us = TRIAL_US;
    const uint32_t most_us = bounces ? BOUNCES_US : session->owner.on ? OWNER_US : UINT32_MAX;
    return wait_us < most_us ? wait_us : most_us;
}
