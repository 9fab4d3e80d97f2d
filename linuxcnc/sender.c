/* SPDX-License-Identifier: MIT */
#include "sender.h"

#include <math.h>

static const double RESEND_S = 0.03; /* a segment that was not acknowledged in this time is sent again */
static const double ASK_S = 0.02;    /* nothing to send: ask how far it is */

void sender_begin(struct sender *sender, uint32_t stream, uint32_t capacity) {
    *sender = (struct sender){.stream = stream, .limit = capacity, .last_s = -INFINITY};
}

static uint32_t greater(uint32_t a, uint32_t b) {
    return a > b ? a : b;
}

static struct sender_place *place_of(struct sender *sender, uint32_t number) {
    return &sender->place[number % SENDER_SIZE];
}

bool sender_put(struct sender *sender, const struct wire_segment *segment) {
    if (sender->end - sender->next >= SENDER_SIZE)
        return false;
    *place_of(sender, sender->end) = (struct sender_place){.segment = *segment, .sent_s = -INFINITY};
    sender->end++;
    return true;
}

static bool is_due(struct sender *sender, uint32_t number, double now_s) {
    const struct sender_place *place = place_of(sender, number);
    return number < sender->end && number < sender->limit && !place->taken &&
           now_s - place->sent_s >= RESEND_S;
}

size_t sender_poll(struct sender *sender, double now_s, uint8_t payload[SENDER_PAYLOAD_MAX]) {
    uint32_t end = sender->limit < sender->end ? sender->limit : sender->end;
    uint32_t first = sender->next;
    while (first < end && !is_due(sender, first, now_s))
        first++;
    struct wire_stream_segments head = {.stream = sender->stream,
                                        .first = first < end ? first : sender->next};
    uint8_t *at = payload + WIRE_STREAM_SEGMENTS_SIZE;
    for (; head.count < WIRE_MOTION_SEGMENTS_MAX && is_due(sender, first, now_s); first++) {
        struct sender_place *place = place_of(sender, first);
        wire_put_segment(at, &place->segment);
        at += WIRE_SEGMENT_SIZE;
        place->sent_s = now_s;
        head.count++;
    }
    if (head.count == 0 && (sender_is_executed(sender) || now_s - sender->last_s < ASK_S))
        return 0;
    sender->posted = greater(sender->posted, first);
    wire_put_stream_segments(payload, &head);
    sender->last_s = now_s;
    sender->sent++;
    return (size_t)(at - payload);
}

bool sender_take(struct sender *sender, const struct wire_stream_ack *ack) {
    if (ack->stream != sender->stream || ack->next > sender->posted || ack->done > ack->next)
        return false;
    sender->next = greater(sender->next, ack->next);
    sender->done = greater(sender->done, ack->done);
    sender->underruns = greater(sender->underruns, ack->underruns);
    sender->limit = greater(sender->limit, ack->next + ack->free);
    for (uint32_t bit = 0; bit < WIRE_STREAM_WINDOW; bit++) {
        uint32_t number = ack->next + bit;
        if ((ack->taken[bit / 8] >> bit % 8 & 1) != 0 && number >= sender->next && number < sender->posted)
            place_of(sender, number)->taken = true;
    }
    return true;
}
