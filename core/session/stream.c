/* SPDX-License-Identifier: MIT
 * Streams: numbered segments that may be lost, doubled and come in any order on their way, and are executed
 * once each, in order. */
#include "session/inner.h"

#include "machine/owner.h"

_Static_assert((int)HOST_QUEUE_SIZE <= (int)WIRE_STREAM_WINDOW,
               "the ack has a bit for every place of the host queue");

/* Numbers of a stream begin at 0 and are those of the host queue less `base`, all modulo 2^32. A closed
 * stream keeps the number that it had then: the host queue counts on for others. */
static uint32_t next_of(const struct session *session) {
    const struct session_stream *stream = &session->stream;
    return stream->open ? machine_host_taken(session->machine) - stream->base : stream->next;
}

/* Segments of this stream that were executed to their end; what was dropped counts for none. */
static uint32_t done_of(const struct session *session) {
    const struct session_stream *stream = &session->stream;
    uint32_t done = machine_host_done(session->machine) - stream->base;
    bool dropped = machine_host(session->machine)->dropped != stream->dropped;
    if (dropped)
        return stream->done;
    if (done > UINT32_MAX / 2)
        return 0; /* what was queued before this stream still runs */
    /* After the end of a closed stream the queue executes segments of others. */
    return done - stream->next < UINT32_MAX / 2 && !stream->open ? stream->next : done;
}

void stream_close(struct session *session, enum wire_refusal refusal) {
    struct session_stream *stream = &session->stream;
    if (!stream->open)
        return;
    /* While it is still open: next_of() then counts from the host queue. */
    stream->next = next_of(session);
    stream->open = false;
    stream->refusal = (uint8_t)refusal;
    machine_host_forget_ahead(session->machine);
}

void stream_follow(struct session *session) {
    struct session_stream *stream = &session->stream;
    const struct machine_host *host = machine_host(session->machine);
    /* Once for each stream: `done` is UINT32_MAX until then (stream_open()). */
    if (stream->id == 0 || host->dropped == stream->dropped || stream->done != UINT32_MAX)
        return;
    stream->done = host->done_at_drop - stream->base;
    /* A stream that was closed before the drop may have been executed to its end, and others after it. */
    bool was_open = stream->open;
    stream_close(session, WIRE_REFUSAL_STREAM_CLOSED);
    if (!was_open && stream->done - stream->next < UINT32_MAX / 2)
        stream->done = stream->next;
}

enum wire_refusal stream_open(struct session *session, int place) {
    struct session_stream *stream = &session->stream;
    if (session_state(session) >= WIRE_STATE_ALARM)
        return WIRE_REFUSAL_LOCKED;
    if (owner_host_is_busy(session->machine))
        return WIRE_REFUSAL_BUSY;
    stream_close(session, WIRE_REFUSAL_STREAM_CLOSED);
    uint32_t step = 2 + ((uint32_t)session->now_us & 0xFFFE);        /* not what a late datagram says */
    *stream = (struct session_stream){.id = (stream->id + step) | 1, /* never 0 */
                                      .open = true,
                                      .client = (int8_t)place,
                                      .base = machine_host_taken(session->machine),
                                      .dropped = machine_host(session->machine)->dropped,
                                      .done = UINT32_MAX};
    session_own(session, session->client[place].address);
    session->owner.motion_us = session->now_us;
    return WIRE_REFUSAL_NONE;
}

static void take(struct session *session, uint32_t number, const uint8_t *at) {
    struct session_stream *stream = &session->stream;
    /* Numbers below next_of() become very large here, so that one comparison finds both too late and too
     * far. */
    uint32_t ahead = number - next_of(session), refused;
    if (ahead >=
        host_queue_free(&machine_host(session->machine)->queue)) /* has come already, or too far ahead */
        return;
    const struct host_queue_segment segment = session_segment(at);
    enum refusal refusal = machine_host_lay(session->machine, ahead, &segment, &refused);
    if (refusal == REFUSAL_NONE)
        return;
    stream->refused = refused - stream->base;
    session->counts.refused_segments++;
    session->counts.last_refusal = (uint8_t)session_refusal(refusal);
    /* What follows a refused segment would begin at a place that the machine does not reach. */
    stream_close(session, session_refusal(refusal));
}

static void send_ack(struct session *session, const struct session_peer *to, uint32_t id) {
    const struct session_stream *stream = &session->stream;
    const struct machine_host *host = machine_host(session->machine);
    uint8_t packet[WIRE_PACKET_MAX];
    /* Of another stream, one from before a restart for example, only that it is closed is known. */
    bool known = id == stream->id && id != 0;
    struct wire_stream_ack ack = {.stream = id,
                                  .refusal =
                                      known && stream->open ? WIRE_REFUSAL_NONE : WIRE_REFUSAL_STREAM_CLOSED,
                                  .state = session_state(session),
                                  .underruns = host->queue.underruns,
                                  .queued_us = (uint32_t)(host->queue.queued_ns / 1000),
                                  .homed = machine_homed(session->machine),
                                  .position_losses = machine_position_losses(session->machine)};
    if (known) {
        ack.next = next_of(session);
        ack.done = done_of(session);
        ack.refused = stream->refused;
        ack.refusal = stream->open ? (uint8_t)WIRE_REFUSAL_NONE : stream->refusal;
    }
    /* What its sender needs to send again only what is missing: a bit for each place after `next`. */
    if (known && stream->open) {
        ack.free = (uint16_t)host_queue_free(&host->queue);
        for (unsigned n = 0; n < ack.free; n++)
            if (host_queue_has(&host->queue, n))
                ack.taken[n / 8] |= (uint8_t)(1u << n % 8);
    }
    wire_put_stream_ack(packet + WIRE_HEADER_SIZE, &ack);
    session->ops->send(session->ctx, to, packet,
                       session_close(session, SEQUENCE_EVENT, packet, WIRE_STREAM_ACK, WIRE_STREAM_ACK_SIZE));
}

void stream_segments(struct session *session, const struct session_peer *from,
                     const struct wire_header *header, const uint8_t *payload, enum wire_refusal refusal) {
    const struct session_stream *stream = &session->stream;
    struct wire_stream_segments segments;
    wire_get_stream_segments(payload, &segments);
    if (!wire_has_segments(header, WIRE_STREAM_SEGMENTS_SIZE, segments.count, 0)) {
        session->counts.malformed++;
        return;
    }
    /* First: after a drop that session_poll() has not seen yet, these segments belong to a stream that is
     * over. */
    stream_follow(session);
    /* A late datagram of an older stream, or of one that has ended, neither takes ownership nor lays
     * anything. */
    bool own = refusal == WIRE_REFUSAL_NONE && segments.stream == stream->id && stream->open;
    if (own) {
        session_own(session, from->address);
        session->owner.motion_us = session->now_us;
    }
    for (uint32_t k = 0; own && stream->open && k < segments.count; k++)
        take(session, segments.first + k,
             payload + WIRE_STREAM_SEGMENTS_SIZE + (size_t)k * WIRE_SEGMENT_SIZE);
    send_ack(session, from, segments.stream);
}
