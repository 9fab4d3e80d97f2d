/* SPDX-License-Identifier: MIT */
#include "input/rx.h"

#include "input/line_reader.h" // LINE_GAP
#include "input/text_byte.h"

void rx_init(struct rx *rx) {
    rx->index = rx->override_index = (struct ring){0, 0};
    rx->realtime = rx->cancel_at = rx->lost_lines = 0;
    rx->flushes = rx->flushes_seen = 0;
    for (unsigned loss = 0; loss < RX_LOSSES; loss++)
        rx->gaps[loss] = 0;
    rx->gap_at = rx->index.head - 1;
    rx->lost_byte = rx->text_left = 0;
    rx->aside = RX_ASIDE_NONE;
}

static uint32_t realtime_bit(uint8_t byte) {
    switch (byte) {
    case '?':
        return REALTIME_STATUS;
    case '!':
        return REALTIME_HOLD;
    case '~':
        return REALTIME_RESUME;
    case 0x18:
        return REALTIME_RESET;
    case 0x84:
        return REALTIME_DOOR;
    case 0x85:
        return REALTIME_JOG_CANCEL;
    case 0x87:
        return REALTIME_FULL_STATUS;
    case 0xA3:
        return REALTIME_PARK;
    default: /* one more case is a jump by a table, which interrupts may not make */
        return byte == 0x8C ? REALTIME_AUTO_REPORT : 0;
    }
}

static void put_override(struct rx *rx, uint8_t byte) {
    if (ring_free(&rx->override_index, RX_OVERRIDES) == 0)
        return; /* 64 steps of an override together: it is at its end */
    rx->overrides[rx->override_index.head & (RX_OVERRIDES - 1)] = byte;
    ring_push(&rx->override_index);
}

/* Where the operator's bytes begin or end. @return bits that are left of it */
static uint32_t set_aside(struct rx *rx, uint32_t bits) {
    const enum rx_aside now = rx_aside(rx);
    if ((bits & REALTIME_PARK) != 0 && now == RX_ASIDE_ENDED)
        return (bits & ~(uint32_t)REALTIME_PARK) | REALTIME_PARK_LOST;
    if ((bits & REALTIME_PARK) != 0 && now == RX_ASIDE_NONE) {
        rx->aside_from = rx->index.head;
        __atomic_store_n(&rx->aside, RX_ASIDE_OPEN, __ATOMIC_RELEASE);
    } else if ((bits & REALTIME_RESUME) != 0 && now == RX_ASIDE_OPEN) {
        rx->aside_to = rx->index.head;
        __atomic_store_n(&rx->aside, RX_ASIDE_ENDED, __ATOMIC_RELEASE);
    }
    return bits;
}

void rx_close_aside(struct rx *rx) {
    (void)set_aside(rx, REALTIME_RESUME);
}

void rx_request(struct rx *rx, uint32_t bits) {
    bits = set_aside(rx, bits);
    /* Jogs up to this byte are those that the hold or cancel was meant for; a jog that is sent after it
     * runs. */
    if ((bits & (REALTIME_HOLD | REALTIME_JOG_CANCEL)) != 0)
        __atomic_store_n(&rx->cancel_at, rx->index.head, __ATOMIC_RELAXED); /* published below */
    if ((bits & (REALTIME_STOPS | REALTIME_PARK)) != 0) /* a resume that came before it counts no more */
        __atomic_fetch_and(&rx->realtime, ~(uint32_t)REALTIME_RESUME, __ATOMIC_RELAXED);
    if (bits != 0)
        __atomic_fetch_or(&rx->realtime, bits, __ATOMIC_RELEASE);
}

/* Whether take_out() takes a byte: a bit for each, from 0 on. */
static const uint32_t acts[8] = {0x01000000, 0x80000002, 0, 0x40000000, ~0u, ~0u, ~0u, ~0u};

static inline bool is_of_stream(uint8_t byte) {
    return (acts[byte >> 5] >> (byte & 31) & 1) == 0;
}

/* @return true when the byte was none of the stream. */
static bool take_out(struct rx *rx, uint8_t *of_stream) {
    if (!text_byte(&rx->text_left, of_stream))
        return true;
    const uint8_t byte = *of_stream;
    if (is_of_stream(byte))
        return false;
    uint32_t bit = realtime_bit(byte);
    rx_request(rx, bit);
    if (bit == 0 && ((byte >= RX_OVERRIDE_FIRST && byte <= RX_OVERRIDE_LAST) || byte == RX_OPTIONAL_STOP))
        put_override(rx, byte);
    return bit != 0 || byte >= 0x80;
}

static bool store(struct rx *rx, uint8_t byte) {
    if (ring_free(&rx->index, RX_SIZE) == 0)
        return false;
    rx->bytes[rx->index.head & (RX_SIZE - 1)] = byte;
    ring_push(&rx->index);
    return true;
}

bool rx_put(struct rx *rx, uint8_t byte) {
    const uint8_t text_left = rx->text_left;
    if (take_out(rx, &byte) || store(rx, byte))
        return true;
    rx->text_left = text_left; /* the same byte comes again */
    return false;
}

/* Bytes of the stream, up to one that acts or the end of the room in one piece. */
static size_t store_run(struct rx *rx, const uint8_t *bytes, size_t count) {
    const uint32_t head = rx->index.head, from = head & (RX_SIZE - 1), room = rx_free(rx);
    size_t most = room < RX_SIZE - from ? room : RX_SIZE - from, run = 0;
    for (most = most < count ? most : count; run < most; run++) {
        const uint8_t byte = bytes[run];
        if (!is_of_stream(byte))
            break;
        rx->bytes[from + run] = byte;
    }
    if (run > 0)
        rx->text_left = 0;
    /* Once for the run, after its bytes: the reader sees none that is not written yet. */
    __atomic_store_n(&rx->index.head, head + (uint32_t)run, __ATOMIC_RELEASE);
    return run;
}

size_t rx_put_all(struct rx *rx, const uint8_t *bytes, size_t count) {
    size_t taken = 0;
    while ((taken += store_run(rx, bytes + taken, count - taken)) < count && rx_put(rx, bytes[taken]))
        taken++;
    return taken;
}

/* Back to normal between two lines, once all lost ones were answered. */
static bool may_go_on(const struct rx *rx) {
    return (rx->lost_byte == '\n' || rx->lost_byte == '\r') && rx_free(rx) == RX_SIZE &&
           __atomic_load_n(&rx->lost_lines, __ATOMIC_ACQUIRE) == 0;
}

/* The LF of a CR LF; the CR was lost, or it was the last to find room. */
static bool is_second_half(const struct rx *rx, uint8_t byte) {
    uint8_t before = rx->lost_byte != 0 ? rx->lost_byte : rx->bytes[(rx->index.head - 1) & (RX_SIZE - 1)];
    return before == '\r' && byte == '\n';
}

/* A loss from before the last rx_flush() is over. */
static void forget_loss(struct rx *rx) {
    uint32_t flushes = __atomic_load_n(&rx->flushes, __ATOMIC_ACQUIRE);
    if (flushes != rx->flushes_seen) {
        rx->lost_byte = 0;
        rx->gap_at = rx->index.head - 1;
    }
    rx->flushes_seen = flushes;
}

void rx_put_or_lose(struct rx *rx, uint8_t byte) {
    if (take_out(rx, &byte))
        return;
    forget_loss(rx);
    bool pair = is_second_half(rx, byte);
    if (rx->lost_byte == 0 || (!pair && may_go_on(rx))) {
        rx->lost_byte = 0;
        if (store(rx, byte))
            return;
    }
    /* 0 means that nothing is being lost. */
    rx->lost_byte = byte == 0 ? ' ' : byte;
    if (!pair && (byte == '\n' || byte == '\r'))
        __atomic_fetch_add(&rx->lost_lines, 1, __ATOMIC_RELEASE);
}

void rx_spoil(struct rx *rx) {
    forget_loss(rx);
    if (rx->lost_byte == 0 && rx->gap_at == rx->index.head)
        return; /* the line is spoiled already */
    if (rx->lost_byte == 0 && store(rx, LINE_GAP))
        rx->gap_at = rx->index.head;
    else
        rx->lost_byte = ' '; /* the next end of a line ends one that is lost */
}

void rx_count(struct rx *rx, enum rx_loss loss) {
    __atomic_fetch_add(&rx->gaps[loss], 1, __ATOMIC_RELAXED);
}

void rx_gap(struct rx *rx, enum rx_loss loss) {
    rx_count(rx, loss);
    rx_spoil(rx);
}

size_t rx_peek(const struct rx *rx, const uint8_t **bytes) {
    uint32_t held = ring_held(&rx->index);
    uint32_t from = rx->index.tail & (RX_SIZE - 1);
    *bytes = rx->bytes + from;
    return held < RX_SIZE - from ? held : RX_SIZE - from;
}

size_t rx_line(const struct rx *rx, uint8_t *begin, size_t room) {
    const uint32_t held = ring_held(&rx->index);
    for (uint32_t at = 0; at < held; at++) {
        const uint8_t byte = rx->bytes[(rx->index.tail + at) & (RX_SIZE - 1)];
        if (at < room)
            begin[at] = byte;
        if (byte == '\n' || byte == '\r')
            return at + 1;
    }
    return 0;
}

void rx_drop(struct rx *rx, size_t count) {
    __atomic_store_n(&rx->index.tail, rx->index.tail + (uint32_t)count, __ATOMIC_RELEASE);
}

size_t rx_peek_aside(const struct rx *rx, const uint8_t **bytes) {
    /* In this order: bytes after a ~ that is not seen yet are not seen either. */
    const uint32_t head = __atomic_load_n(&rx->index.head, __ATOMIC_ACQUIRE);
    const enum rx_aside aside = rx_aside(rx);
    const uint32_t from = rx->aside_from & (RX_SIZE - 1);
    *bytes = rx->bytes + from;
    if (aside == RX_ASIDE_NONE)
        return 0;
    const uint32_t held = (aside == RX_ASIDE_ENDED ? rx->aside_to : head) - rx->aside_from;
    return held < RX_SIZE - from ? held : RX_SIZE - from;
}

void rx_drop_aside(struct rx *rx, size_t count) {
    const uint32_t tail = rx->index.tail, moves = (uint32_t)count;
    for (uint32_t at = rx->aside_from; at != tail; at--)
        rx->bytes[(at - 1 + moves) & (RX_SIZE - 1)] = rx->bytes[(at - 1) & (RX_SIZE - 1)];
    rx->aside_from += moves;
    rx_drop(rx, count);
}

static uint32_t line_ends(const struct rx *rx, uint32_t from, uint32_t to) {
    uint32_t ends = 0;
    for (uint32_t at = from; at != to; at++)
        ends += rx->bytes[at & (RX_SIZE - 1)] == '\n';
    return ends;
}

uint32_t rx_drop_job(struct rx *rx) {
    const enum rx_aside aside = rx_aside(rx);
    const uint32_t head = rx->index.head, to = aside == RX_ASIDE_NONE ? head : rx->aside_from;
    uint32_t ends = line_ends(rx, rx->index.tail, to);
    if (aside == RX_ASIDE_ENDED) {
        ends += line_ends(rx, rx->aside_to, head);
        __atomic_store_n(&rx->index.head, rx->aside_to, __ATOMIC_RELEASE);
    }
    __atomic_store_n(&rx->index.tail, to, __ATOMIC_RELEASE);
    return ends;
}

bool rx_take_lost(struct rx *rx) {
    if (__atomic_load_n(&rx->lost_lines, __ATOMIC_ACQUIRE) == 0)
        return false;
    __atomic_fetch_sub(&rx->lost_lines, 1, __ATOMIC_ACQ_REL);
    return true;
}

uint32_t rx_take_realtime(struct rx *rx) {
    return __atomic_exchange_n(&rx->realtime, 0, __ATOMIC_ACQUIRE);
}

void rx_withdraw(struct rx *rx) {
    const uint32_t bits = REALTIME_RESUME | REALTIME_PARK | REALTIME_PARK_LOST;
    __atomic_fetch_and(&rx->realtime, ~bits, __ATOMIC_ACQ_REL);
    __atomic_store_n(&rx->override_index.tail, rx->override_index.head, __ATOMIC_RELEASE);
}

int rx_take_override(struct rx *rx) {
    if (ring_held(&rx->override_index) == 0)
        return -1;
    uint8_t byte = rx->overrides[rx->override_index.tail & (RX_OVERRIDES - 1)];
    ring_pop(&rx->override_index);
    return byte;
}

void rx_flush(struct rx *rx) {
    /* The producer owns lost_byte and gap_at: it forgets them itself when it sees this count
     * (forget_loss()). */
    __atomic_fetch_add(&rx->flushes, 1, __ATOMIC_RELEASE);
    __atomic_store_n(&rx->index.tail, rx->index.head, __ATOMIC_RELEASE);
    __atomic_store_n(&rx->override_index.tail, rx->override_index.head, __ATOMIC_RELEASE);
    __atomic_store_n(&rx->lost_lines, 0, __ATOMIC_RELEASE);
    rx_end_aside(rx);
}
