/* SPDX-License-Identifier: MIT */
#include "control.h"

#include "wire/bytes.h"

#include <string.h>

/* Reply of each request, and how long it is at least. Commands are answered by an ack. */
static const struct reply {
    uint8_t request, reply, size;
} replies[] = {
    {WIRE_HANDSHAKE, WIRE_HANDSHAKE_RESPONSE, WIRE_HANDSHAKE_RESPONSE_SIZE},
    {WIRE_CONFIG_GET, WIRE_CONFIG_VALUE, WIRE_CONFIG_VALUE_SIZE},
    {WIRE_PING, WIRE_PONG, WIRE_PONG_SIZE},
    {WIRE_STREAM_OPEN, WIRE_STREAM_OPENED, WIRE_STREAM_OPENED_SIZE},
    {WIRE_STATISTICS, WIRE_STATISTICS_RESPONSE, WIRE_STATISTICS_RESPONSE_SIZE},
    {WIRE_PROBE_LAST, WIRE_PROBE_RESULT, WIRE_PROBE_RESULT_SIZE},
    {WIRE_CHALLENGE, WIRE_CHALLENGE_RESPONSE, WIRE_CHALLENGE_RESPONSE_SIZE},
    {WIRE_AUTHENTICATE, WIRE_AUTHENTICATED, WIRE_AUTHENTICATED_SIZE},
};

static struct reply reply_of(uint8_t request) {
    for (size_t i = 0; i < sizeof replies / sizeof *replies; i++) {
        if (replies[i].request == request)
            return replies[i];
    }
    return (struct reply){request, WIRE_ACK, WIRE_ACK_SIZE};
}

size_t control_pack(struct control *control, uint8_t *packet, uint8_t type, const void *payload, size_t size,
                    double now_s) {
    if (size > 0)
        memcpy(packet + WIRE_HEADER_SIZE, payload, size);
    return wire_close(packet, type, size, ++control->sequence, (uint32_t)(uint64_t)(1e6 * now_s));
}

size_t control_ask(struct control *control, uint8_t *message, uint8_t type, const void *payload, size_t size,
                   double now_s) {
    if (control->waiting == CONTROL_WAITING)
        return 0;
    size_t packet = control_pack(control, message + CONTROL_SIZE_BYTES, type, payload, size, now_s);
    put_u16(message, (uint16_t)packet);
    unsigned at = (control->first + control->waiting) % CONTROL_WAITING;
    control->request[at] = (struct control_request){control->sequence, type, now_s};
    control->waiting++;
    return CONTROL_SIZE_BYTES + packet;
}

/* Move bytes into the message that comes in, until it has `wanted` of them. */
static bool gather(struct control *control, const uint8_t **bytes, size_t *count, size_t wanted) {
    size_t missing = wanted - control->received;
    size_t some = *count < missing ? *count : missing;
    memcpy(control->bytes + control->received, *bytes, some);
    control->received += some;
    *bytes += some;
    *count -= some;
    return some == missing;
}

static bool is_answer(const struct control_answer *answer) {
    struct reply reply = reply_of(answer->request);
    if (answer->type == WIRE_REFUSED)
        return answer->header.length >= WIRE_REFUSED_SIZE;
    return answer->type == reply.reply && answer->header.length >= reply.size;
}

enum control_heard control_hear(struct control *control, const uint8_t **bytes, size_t *count,
                                struct control_answer *answer) {
    if (control->received < CONTROL_SIZE_BYTES && !gather(control, bytes, count, CONTROL_SIZE_BYTES))
        return CONTROL_MORE;
    size_t size = get_u16(control->bytes);
    if (size > WIRE_PACKET_MAX)
        return CONTROL_NONSENSE;
    if (!gather(control, bytes, count, CONTROL_SIZE_BYTES + size))
        return CONTROL_MORE;
    control->received = 0;
    if (control->waiting == 0 || !wire_open(control->bytes + CONTROL_SIZE_BYTES, size, &answer->header))
        return CONTROL_NONSENSE;
    answer->request = control->request[control->first].type;
    answer->type = answer->header.type;
    answer->payload = control->bytes + CONTROL_SIZE_BYTES + WIRE_HEADER_SIZE;
    control->first = (control->first + 1) % CONTROL_WAITING;
    control->waiting--;
    return is_answer(answer) ? CONTROL_ANSWER : CONTROL_NONSENSE;
}

double control_silence_s(const struct control *control, double now_s) {
    return control->waiting == 0 ? 0.0 : now_s - control->request[control->first].asked_s;
}
