/* SPDX-License-Identifier: MIT */
#include "net_websocket.h"

#include "net_sha1.h"

#include "input/text_byte.h"

#include <stdlib.h>
#include <string.h>

enum opcode { CONTINUATION, TEXT, BINARY, CLOSE = 8, PING = 9, PONG = 10 };
enum close_code { GOING_AWAY = 1001, PROTOCOL_ERROR = 1002, NOT_UTF8 = 1007 };

enum { FIN = 0x80, RESERVED = 0x70, OPCODE = 0x0F, IS_CONTROL = 0x08, MASKED = 0x80, LENGTH = 0x7F };
enum { LENGTH_16 = 126, LENGTH_64 = 127, MASK_SIZE = 4 };
enum { OUT_MAX = 1024 };
enum { REALTIME_FIRST = 0x80, REALTIME_LAST = 0xA1 }; /* real-time bytes beyond ASCII (core/input/rx.h) */

/* ---- the handshake ---- */

void net_websocket_accept(const char *key, char accept[NET_WEBSOCKET_ACCEPT_SIZE]) {
    static const char guid[] = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"; /* RFC 6455, 4.2.2 */
    static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    char text[NET_WEBSOCKET_KEY_SIZE + sizeof guid];
    uint8_t digest[NET_SHA1_SIZE + 1];
    memcpy(text, key, NET_WEBSOCKET_KEY_SIZE);
    memcpy(text + NET_WEBSOCKET_KEY_SIZE, guid, sizeof guid);
    net_sha1(text, sizeof text - 1, digest);
    digest[NET_SHA1_SIZE] = 0;
    for (unsigned i = 0; i < sizeof digest;
         i += 3) { /* base64; of the last group two bytes are the digest's */
        uint32_t group = (uint32_t)digest[i] << 16 | (uint32_t)digest[i + 1] << 8 | digest[i + 2];
        for (unsigned n = 0; n < 4; n++)
            *accept++ = letters[group >> (18 - 6 * n) & 0x3F];
    }
    accept[-1] = '=';
    *accept = '\0';
}

/* ---- pongs and the close, which go between the messages ---- */

static void put_reply(struct net_websocket *ws, enum opcode opcode, const uint8_t *payload, size_t size) {
    ws->reply[0] = (uint8_t)(FIN | opcode);
    ws->reply[1] = (uint8_t)size;
    memcpy(ws->reply + 2, payload, size);
    ws->reply_count = (uint8_t)(2 + size);
}

static void put_pong(struct net_websocket *ws, const uint8_t *payload, size_t size) {
    if (!ws->closing && ws->reply_sent == 0)
        put_reply(ws, PONG, payload,
                  size); /* else one is on its way, and not every ping need be answered (5.5.3) */
}

/* The first reason counts. */
static void begin_close(struct net_websocket *ws, const uint8_t *payload, size_t size) {
    if (ws->closing)
        return;
    ws->closing = true;
    memcpy(ws->close, payload, size);
    ws->close_count = (uint8_t)size;
    ws->close_waits = ws->reply_sent > 0;
    if (!ws->close_waits)
        put_reply(ws, CLOSE, payload, size);
}

static void fail(struct net_websocket *ws, enum close_code code) {
    const uint8_t payload[2] = {(uint8_t)(code >> 8), (uint8_t)code};
    begin_close(ws, payload, sizeof payload);
}

/* Between two messages only. @return false: it does not take more now, or has gone */
static bool send_reply(struct net_websocket *ws) {
    while (ws->reply_count > ws->reply_sent && ws->out_left == 0 && ws->out_head_sent == ws->out_head_count) {
        long sent = ws->inner.ops->write(&ws->inner, (const char *)ws->reply + ws->reply_sent,
                                         (size_t)(ws->reply_count - ws->reply_sent));
        if (sent <= 0)
            return false;
        ws->reply_sent = (uint8_t)(ws->reply_sent + sent);
        if (ws->reply_sent < ws->reply_count)
            continue;
        ws->reply_sent = ws->reply_count = 0;
        if (ws->close_waits)
            put_reply(ws, CLOSE, ws->close, ws->close_count);
        ws->close_waits = false;
    }
    return true;
}

/* ---- in ---- */

/* @return how many bytes the head of a frame has, as far as its second byte tells */
static unsigned head_size(const struct net_websocket *ws) {
    unsigned length = ws->head_count < 2 ? 0 : ws->head[1] & LENGTH;
    return 2u + (length == LENGTH_16 ? 2 : length == LENGTH_64 ? 8 : 0) + MASK_SIZE;
}

static uint64_t payload_size(const struct net_websocket *ws) {
    unsigned length = ws->head[1] & LENGTH, bytes = length == LENGTH_16 ? 2 : length == LENGTH_64 ? 8 : 0;
    uint64_t size = bytes == 0 ? length : 0;
    for (unsigned i = 0; i < bytes; i++)
        size = size << 8 | ws->head[2 + i];
    return size;
}

static bool is_control(const struct net_websocket *ws) {
    return (ws->head[0] & IS_CONTROL) != 0;
}

/* RFC 6455, 5.2 to 5.5. */
static bool is_allowed(const struct net_websocket *ws) {
    unsigned opcode = ws->head[0] & OPCODE;
    if ((ws->head[0] & RESERVED) != 0 || ws->left >> 63 != 0)
        return false;
    if (is_control(ws))
        return opcode <= PONG && (ws->head[0] & FIN) != 0 && ws->left <= NET_WEBSOCKET_CONTROL_MAX;
    return opcode <= BINARY && (opcode == CONTINUATION) == (ws->message != 0);
}

static void end_control(struct net_websocket *ws) {
    unsigned opcode = ws->head[0] & OPCODE;
    if (opcode == PING)
        put_pong(ws, ws->control, ws->at);
    if (opcode == CLOSE)
        begin_close(ws, ws->control, ws->at < 2 ? 0 : 2);
}

static void end_frame(struct net_websocket *ws) {
    ws->head_count = 0;
    if (is_control(ws)) {
        end_control(ws);
        return;
    }
    if ((ws->head[0] & FIN) == 0)
        return;
    /* The message ends in the middle of a character. */
    if (ws->continuations > 0)
        fail(ws, NOT_UTF8);
    ws->message = 0;
}

static void begin_frame(struct net_websocket *ws) {
    unsigned opcode = ws->head[0] & OPCODE;
    ws->left = payload_size(ws);
    ws->at = 0;
    if (!is_allowed(ws)) {
        fail(ws, PROTOCOL_ERROR);
        return;
    }
    if (!is_control(ws) && opcode != CONTINUATION)
        ws->message = (uint8_t)opcode;
    if (ws->left == 0)
        end_frame(ws);
}

/* The first byte of a character. @return true: it is all of it */
static bool begin_character(struct net_websocket *ws, uint8_t lead) {
    static const uint32_t least[] = {0, 0x80, 0x800, 0x10000};
    unsigned more = lead < 0xC0 ? 0 : lead < 0xE0 ? 1 : lead < 0xF0 ? 2 : 3;
    if (lead >= 0x80 && (more == 0 || lead > 0xF4))
        fail(ws, NOT_UTF8);
    ws->continuations = (uint8_t)more;
    ws->character = lead & (0x3Fu >> more);
    ws->character_least = least[more];
    return lead < 0x80;
}

/* RFC 3629: the shortest form, no surrogates, nothing beyond U+10FFFF. */
static bool is_character(const struct net_websocket *ws) {
    return ws->character >= ws->character_least && ws->character <= 0x10FFFF && ws->character >> 11 != 0x1B;
}

/* A byte of a text message. Browsers can send real-time bytes from 0x80 on as characters U+0080 .. U+00A1;
 * any other character beyond ASCII is a letter (input/text_byte.h). @return true: *byte is one of the
 * stream's */
static bool take_text(struct net_websocket *ws, char *byte) {
    uint8_t code = (uint8_t)*byte;
    if (ws->continuations == 0)
        return begin_character(ws, code);
    ws->character = ws->character << 6 | (code & 0x3F);
    ws->continuations--;
    if ((code & 0xC0) != 0x80 || (ws->continuations == 0 && !is_character(ws))) {
        fail(ws, NOT_UTF8);
        return false;
    }
    const bool acts = ws->character >= REALTIME_FIRST && ws->character <= REALTIME_LAST;
    *byte = acts ? (char)ws->character : TEXT_LETTER;
    return ws->continuations == 0;
}

/* A byte of a payload. @return true: *byte is one of the stream's */
static bool take_payload(struct net_websocket *ws, char *byte) {
    const uint8_t *mask = ws->head + head_size(ws) - MASK_SIZE;
    *byte = (char)(*byte ^ mask[ws->at % MASK_SIZE]);
    bool is_data = !is_control(ws);
    if (!is_data)
        ws->control[ws->at] = (uint8_t)*byte;
    else if (ws->message == TEXT)
        is_data = take_text(ws, byte);
    ws->at++;
    if (--ws->left == 0)
        end_frame(ws);
    return is_data;
}

/* Head or payload. @return true: *byte is one of the stream's */
static bool take(struct net_websocket *ws, char *byte) {
    if (ws->head_count == head_size(ws) && ws->left > 0)
        return take_payload(ws, byte);
    ws->head[ws->head_count++ % sizeof ws->head] = (uint8_t)*byte;
    if (ws->head_count == 2 && (*byte & MASKED) == 0)
        fail(ws, PROTOCOL_ERROR); /* a browser's frames are masked (5.1) */
    else if (ws->head_count == head_size(ws))
        begin_frame(ws);
    return false;
}

static long ws_read(const struct net_stream *stream, char *bytes, size_t size) {
    struct net_websocket *ws = stream->ctx;
    size_t kept = 0;
    if (ws->closing)
        return send_reply(ws) ? NET_GONE : 0;
    long count = ws->inner.ops->read(&ws->inner, bytes, size);
    if (count < 0)
        return NET_GONE; /* without a close frame: no one is there to hear answers */
    for (long i = 0; i < count && !ws->closing; i++)
        if (take(ws, &bytes[i]))
            bytes[kept++] = bytes[i];
    (void)send_reply(ws);
    return (long)kept;
}

/* ---- out ---- */

/* A frame of as much as the caller has, unmasked as a server's are. What is announced must follow: later
 * calls fill the frame (out_left) before they begin another one. */
static void announce(struct net_websocket *ws, size_t count) {
    ws->out_left = (uint16_t)(count < OUT_MAX ? count : OUT_MAX);
    ws->out_head[0] = FIN | BINARY;
    ws->out_head[1] = (uint8_t)(ws->out_left < LENGTH_16 ? ws->out_left : LENGTH_16);
    ws->out_head[2] = (uint8_t)(ws->out_left >> 8);
    ws->out_head[3] = (uint8_t)ws->out_left;
    ws->out_head_count = ws->out_left < LENGTH_16 ? 2 : 4;
    ws->out_head_sent = 0;
}

/* The rest of the head and the payload behind it in one piece: two would be two packets. */
static long ws_write(const struct net_stream *stream, const char *bytes, size_t count) {
    struct net_websocket *ws = stream->ctx;
    char piece[sizeof ws->out_head + OUT_MAX];
    if (!send_reply(ws) || ws->closing || count == 0)
        return 0;
    if (ws->out_left == 0)
        announce(ws, count);
    size_t head = (size_t)(ws->out_head_count - ws->out_head_sent);
    size_t payload = count < ws->out_left ? count : ws->out_left;
    memcpy(piece, ws->out_head + ws->out_head_sent, head);
    memcpy(piece + head, bytes, payload);
    long sent = ws->inner.ops->write(&ws->inner, piece, head + payload);
    if (sent < 0)
        return sent;
    size_t of_head = (size_t)sent < head ? (size_t)sent : head;
    ws->out_head_sent = (uint8_t)(ws->out_head_sent + of_head);
    ws->out_left = (uint16_t)(ws->out_left - ((size_t)sent - of_head));
    return (long)((size_t)sent - of_head);
}

static void ws_close(const struct net_stream *stream) {
    struct net_websocket *ws = stream->ctx;
    if (!ws->closing)
        fail(ws, GOING_AWAY);
    (void)send_reply(ws);
    ws->inner.ops->close(&ws->inner);
    free(ws);
}

void net_websocket_open(struct net_websocket *websocket, const struct net_stream *inner,
                        struct net_stream *stream) {
    static const struct net_stream_ops ops = {.read = ws_read, .write = ws_write, .close = ws_close};
    *websocket = (struct net_websocket){.inner = *inner};
    *stream = (struct net_stream){
        .ops = &ops, .ctx = websocket, .fd = inner->fd, .peer = inner->peer, .host = inner->host};
}
