/* SPDX-License-Identifier: MIT
 * Frames of a WebSocket. Whatever arrives, however it is cut, and however little the connection takes:
 *
 *   - the stream gets the bytes that a plain decoder of RFC 6455 finds in the whole of it, and ends where
 *     that one finds an end
 *   - what goes out is whole frames: one binary stream of what was written, pongs that repeat a ping, and at
 *     the end a close with the decoder's reason, behind which nothing comes
 *
 * The input: a byte of cuts, the cuts, and what comes from the connection. */
#include "fuzz.h"
#include "net_websocket.h"

#include <string.h>

enum { IN_MAX = 4096, OUT_MAX = 1 << 17, CHUNK = 256, GOOD = 0, BAD_FRAME = 1002, BAD_TEXT = 1007 };
enum { CONTINUATION, TEXT, BINARY, CLOSE = 8, PING, PONG };

static struct world {
    struct input input, cuts;
    uint8_t in[IN_MAX], out[OUT_MAX];
    size_t in_count, out_count, written;
    bool closed;
} world;

static size_t next_cut(void) {
    return input_left(&world.cuts) == 0 ? OUT_MAX : 1u + input_byte(&world.cuts) % 20u;
}

static size_t least(size_t a, size_t b) {
    return a < b ? a : b;
}

static long inner_read(const struct net_stream *stream, char *bytes, size_t size) {
    size_t count = least(least(input_left(&world.input), size), next_cut());
    (void)stream;
    memcpy(bytes, world.input.at, count);
    world.input.at += count;
    return (long)count;
}

static long inner_write(const struct net_stream *stream, const char *bytes, size_t count) {
    (void)stream;
    count = least(count, next_cut() - 1);
    CLAIM(world.out_count + count <= OUT_MAX, "it never ends");
    memcpy(world.out + world.out_count, bytes, count);
    world.out_count += count;
    return (long)count;
}

static void inner_close(const struct net_stream *stream) {
    (void)stream;
    world.closed = true;
}

/* ---- the plain decoder ---- */

struct frame {
    unsigned opcode;
    bool final;
    size_t head, size;
    uint8_t payload[IN_MAX];
};

struct decoded {
    uint8_t bytes[IN_MAX], pings[IN_MAX];
    size_t count, pings_count; /* each with its length before it */
    unsigned reason;           /* of the close that must be sent; 0: none */
    bool closes;               /* the client has said close */
    uint8_t tail[4];           /* of a text: a character that is not whole */
    unsigned message, tail_count;
};

/* @return false: it is not all there; *reason: it is none */
static bool read_frame(const uint8_t *at, size_t left, struct frame *frame, unsigned *reason,
                       unsigned message) {
    if (left >= 2 && (at[1] & 0x80) == 0)
        *reason = BAD_FRAME;
    if (left < 2 || *reason != GOOD)
        return false;
    unsigned length = at[1] & 0x7F, more = length == 126 ? 2 : length == 127 ? 8 : 0;
    uint64_t size = more == 0 ? length : 0;
    frame->head = 2 + more + 4;
    if (left < frame->head)
        return false;
    for (unsigned n = 0; n < more; n++)
        size = size << 8 | at[2 + n];
    frame->opcode = at[0] & 15;
    frame->final = (at[0] & 0x80) != 0;
    bool control = frame->opcode >= 8;
    bool begins = frame->opcode == TEXT || frame->opcode == BINARY;
    if ((at[0] & 0x70) != 0 || size >> 63 != 0 ||
        (control && (frame->opcode > PONG || !frame->final || size > 125)) ||
        (!control && frame->opcode > BINARY) || (begins && message != 0) ||
        (frame->opcode == CONTINUATION && message == 0)) {
        *reason = BAD_FRAME;
        return false;
    }
    frame->size = (size_t)(size < IN_MAX ? size : IN_MAX);
    size_t there = least(frame->size, left - frame->head);
    for (size_t n = 0; n < there; n++)
        frame->payload[n] = at[frame->head + n] ^ at[frame->head - 4 + n % 4];
    frame->size = there;
    return there == size;
}

/* @return how many bytes the character has; 0: none begins so */
static unsigned character_size(uint8_t lead) {
    return lead < 0x80 ? 1 : lead < 0xC0 ? 0 : lead < 0xE0 ? 2 : lead < 0xF0 ? 3 : lead < 0xF5 ? 4 : 0;
}

static void take_text(struct decoded *out, uint8_t byte) {
    static const uint32_t least_code[] = {0, 0, 0x80, 0x800, 0x10000};
    out->tail[out->tail_count++] = byte;
    unsigned size = character_size(out->tail[0]);
    if (size == 0 || (out->tail_count > 1 && (byte & 0xC0) != 0x80)) {
        out->reason = BAD_TEXT;
        return;
    }
    if (out->tail_count < size)
        return;
    uint32_t code = size == 1 ? byte : out->tail[0] & (0x7Fu >> size);
    for (unsigned n = 1; n < size; n++)
        code = code << 6 | (out->tail[n] & 0x3F);
    out->tail_count = 0;
    if (code < least_code[size] || code > 0x10FFFF || (code >= 0xD800 && code < 0xE000))
        out->reason = BAD_TEXT;
    else /* beyond the real-time bytes it is a letter: one byte, 0x7F */
        out->bytes[out->count++] = code <= 0xA1 ? (uint8_t)code : 0x7F;
}

static void take_control(struct decoded *out, const struct frame *frame) {
    if (frame->opcode == CLOSE)
        out->closes = true;
    if (frame->opcode != PING)
        return;
    out->pings[out->pings_count++] = (uint8_t)frame->size;
    memcpy(out->pings + out->pings_count, frame->payload, frame->size);
    out->pings_count += frame->size;
}

static void decode(const uint8_t *at, size_t left, struct decoded *out) {
    static struct frame frame;
    bool whole = true;
    while (whole && !out->closes && out->reason == GOOD) {
        frame = (struct frame){.size = 0};
        whole = read_frame(at, left, &frame, &out->reason, out->message);
        bool data = frame.opcode < 8;
        if (frame.head == 0 || out->reason != GOOD || left < frame.head || (!whole && !data))
            return;
        if (frame.opcode == TEXT || frame.opcode == BINARY)
            out->message = frame.opcode;
        for (size_t n = 0; data && n < frame.size && out->reason == GOOD; n++) {
            if (out->message == TEXT)
                take_text(out, frame.payload[n]);
            else
                out->bytes[out->count++] = frame.payload[n];
        }
        if (!whole || out->reason != GOOD)
            return;
        if (!data)
            take_control(out, &frame);
        else if (frame.final) {
            out->reason = out->tail_count > 0 ? BAD_TEXT : GOOD;
            out->message = 0;
        }
        at += frame.head + frame.size;
        left -= frame.head + frame.size;
    }
}

/* ---- what goes out ---- */

static bool is_ping(const struct decoded *in, const uint8_t *payload, size_t size) {
    for (size_t at = 0; at < in->pings_count; at += 1u + in->pings[at])
        if (in->pings[at] == size && memcmp(in->pings + at + 1, payload, size) == 0)
            return true;
    return false;
}

/* The stream that is written counts upwards. */
static uint8_t written_at(size_t n) {
    return (uint8_t)(n * 7 + n / 256);
}

static void check_out(const struct decoded *in) {
    size_t sent = 0;
    unsigned reason = 0;
    bool closed = false;
    for (size_t at = 0; at < world.out_count;) {
        const uint8_t *frame = world.out + at;
        size_t left = world.out_count - at, head = left >= 2 && frame[1] == 126 ? 4 : 2;
        CLAIM(left >= head && (frame[1] & 0x80) == 0 && (frame[0] & 0xF0) == 0x80, "%zu: no frame", at);
        size_t size = head == 4 ? (size_t)frame[2] << 8 | frame[3] : frame[1];
        const uint8_t *payload = frame + head;
        unsigned opcode = frame[0] & 15;
        CLAIM(head + size <= left && !closed, "%zu: cut, or behind the close", at);
        CLAIM(opcode == BINARY || opcode == PONG || opcode == CLOSE, "%zu: opcode %u", at, opcode);
        for (size_t n = 0; opcode == BINARY && n < size; n++)
            CLAIM(payload[n] == written_at(sent++), "%zu: another byte", at + n);
        CLAIM(opcode != PONG || is_ping(in, payload, size), "%zu: a pong of no ping", at);
        closed = opcode == CLOSE;
        if (closed && size >= 2)
            reason = (unsigned)payload[0] << 8 | payload[1];
        at += head + size;
    }
    CLAIM(sent == world.written, "%zu bytes, not %zu", sent, world.written);
    CLAIM(closed == (in->closes || in->reason != GOOD), "the close");
    CLAIM(in->reason == GOOD || reason == in->reason, "closed for %u, not %u", reason, in->reason);
}

/* ---- */

/* A piece of the stream is written to its end, as the hub does. */
static bool write_piece(const struct net_stream *stream, size_t size) {
    char bytes[64];
    for (size_t n = 0; n < size; n++)
        bytes[n] = (char)written_at(world.written + n);
    for (size_t at = 0, tries = 0; at < size;) {
        long took = stream->ops->write(stream, bytes + at, size - at);
        CLAIM(took >= 0 && (size_t)took <= size - at, "%ld of %zu", took, size - at);
        at += (size_t)took;
        world.written += (size_t)took;
        if (++tries > 2000)
            return at == 0; /* it closes */
    }
    return true;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static const struct net_stream_ops ops = {inner_read, inner_write, inner_close};
    static struct decoded wanted;
    static uint8_t got[IN_MAX];
    const struct net_stream inner = {.ops = &ops};
    struct net_stream stream;
    size_t count = 0, rests = 0;
    bool ended = false;
    if (size < 2 || size > IN_MAX)
        return 0;
    size_t cuts = data[0] < size - 1 ? data[0] : 0;
    world = (struct world){.cuts = {data + 1, data + 1 + cuts}, .input = {data + 1 + cuts, data + size}};
    wanted = (struct decoded){.count = 0};
    decode(world.input.at, input_left(&world.input), &wanted);
    struct net_websocket *websocket = malloc(sizeof *websocket);
    if (websocket == NULL)
        abort();
    net_websocket_open(websocket, &inner, &stream);
    while (!ended && rests < 400) {
        char bytes[CHUNK];
        long taken = stream.ops->read(&stream, bytes, sizeof bytes);
        ended = taken == NET_GONE;
        CLAIM(taken >= 0 || ended, "read says %ld", taken);
        for (long n = 0; n < taken; n++)
            got[count++] = (uint8_t)bytes[n];
        rests += input_left(&world.input) == 0;
        if ((data[0] & 1) != 0 && !ended && !websocket->closing)
            CLAIM(write_piece(&stream, 1u + count % sizeof "a line of sixty bytes"), "a piece was cut");
    }
    CLAIM(ended == (wanted.closes || wanted.reason != GOOD), "it %s", ended ? "ends" : "goes on");
    CLAIM(count == wanted.count && memcmp(got, wanted.bytes, count) == 0, "%zu bytes, not %zu", count,
          wanted.count);
    check_out(&wanted);
    stream.ops->close(&stream);
    CLAIM(world.closed, "it stays open");
    return 0;
}
