/* SPDX-License-Identifier: MIT
 * A request by TCP and what answers it: a row for each, from protocol/wmc3.toml. [task] */
#ifndef WIFICNC_SESSION_REQUEST_H
#define WIFICNC_SESSION_REQUEST_H

#include "session/inner.h"

/** A request under way. */
struct request {
    struct session *session;
    struct session_client *client;
    int place;
    struct wire_header header;
    const uint8_t *payload;
    enum wire_refusal refusal; /* of session_check_request() */
    uint8_t *reply;
};

#include "session/requests_gen.h"

/** One of the two: ack or the refusal, or a reply of its own. */
struct request_handler {
    uint8_t type; /* enum wire_type */
    enum wire_refusal (*execute)(const struct request *request);
    size_t (*answer)(const struct request *request);
};

extern const struct request_handler request_handlers[];
extern const size_t request_handler_count;

/** Any command that may also come by UDP. */
enum wire_refusal request_command(const struct request *request);

/** Where the payload of the reply goes. */
static inline uint8_t *request_body(const struct request *request) {
    return request->reply + WIRE_HEADER_SIZE;
}

/** The reply, whose payload is in place. @return its size */
static inline size_t request_reply(const struct request *request, enum wire_type type, size_t payload_size) {
    return session_close(request->session, SEQUENCE_REPLY, request->reply, type, payload_size);
}

#endif
