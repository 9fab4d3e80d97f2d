/* SPDX-License-Identifier: MIT
 * Receive buffer of one stream: real-time bytes are taken out immediately, the others wait for the line
 * reader.
 *
 * rx_put() may run in a receive interrupt or another task than the rest (base/ring.h). Every byte >= 0x80 is
 * removed from the stream: known ones act, unknown ones vanish, and a letter of UTF-8 becomes TEXT_LETTER
 * (input/text_byte.h).
 *
 * Bytes that find no room are either refused (rx_put: the sender waits, as TCP does) or lost (rx_put_or_lose:
 * a UART cannot wait). Lost lines are counted, so that each of them is still answered, in its place.
 *
 * Bytes that were lost or damaged on their way here (rx_gap) spoil the line that they belong to. */
#ifndef WIFICNC_INPUT_RX_H
#define WIFICNC_INPUT_RX_H

#include "base/ring.h"
#include "config.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** Real-time requests, collected as bits until the machine takes them. */
enum realtime {
    REALTIME_STATUS = 0x01,       /* ?    */
    REALTIME_HOLD = 0x02,         /* !    */
    REALTIME_RESUME = 0x04,       /* ~    */
    REALTIME_RESET = 0x08,        /* 0x18 */
    REALTIME_DOOR = 0x10,         /* 0x84 */
    REALTIME_JOG_CANCEL = 0x20,   /* 0x85 */
    REALTIME_FULL_STATUS = 0x40,  /* 0x87: grblHAL's */
    REALTIME_PARK = 0x80,         /* 0xA3: the byte with which senders acknowledge grblHAL's tool change */
    REALTIME_PARK_LOST = 0x100,   /* ... before the lines up to the last ~ were read: it marks nothing */
    REALTIME_AUTO_REPORT = 0x200, /* 0x8C: grblHAL's */
    REALTIME_REPORTS = REALTIME_STATUS | REALTIME_FULL_STATUS,
    REALTIME_STOPS = REALTIME_HOLD | REALTIME_RESET | REALTIME_DOOR | REALTIME_JOG_CANCEL,
};

/** Override bytes 0x90 .. 0xA1, and the one of M1's switch, are kept in order: two of them count twice. */
enum { RX_OVERRIDES = 64, RX_OVERRIDE_FIRST = 0x90, RX_OVERRIDE_LAST = 0xA1, RX_OPTIONAL_STOP = 0x88 };

/** Bytes between 0xA3 and the next ~ are the operator's: they are read first, and the bytes of the job before
 * them wait. */
enum rx_aside { RX_ASIDE_NONE, RX_ASIDE_OPEN, RX_ASIDE_ENDED };

/** What became of bytes on their way here. */
enum rx_loss {
    RX_OVERRUN,  /* an unknown number was lost, because no one took them in time */
    RX_UNFRAMED, /* one came without its stop bit: noise, a break, another baud rate */
    RX_LOSSES,
};

struct rx {
    struct ring index;
    struct ring override_index;
    uint32_t realtime;        /* enum realtime bits; atomic */
    uint32_t cancel_at;       /* bytes put when the newest ! or 0x85 came; atomic */
    uint32_t aside_from;      /* bytes put before the operator's next one; the producer sets it, then
                               * `aside`, and from then on it is the reader's */
    uint32_t aside_to;        /* ... and before the ~ that ended them */
    uint8_t aside;            /* enum rx_aside; atomic */
    uint32_t lost_lines;      /* ends of lines that found no room; atomic */
    uint32_t gaps[RX_LOSSES]; /* counted, wrap; atomic */
    uint32_t gap_at;          /* [isr] bytes put when the newest LINE_GAP was the last of them */
    uint32_t flushes;         /* rx_flush() was called, wraps; atomic */
    uint32_t flushes_seen;    /* [isr] of these, the ones that the losing end knows of */
    uint8_t text_left;        /* [isr] bytes of a letter of UTF-8 that still come */
    uint8_t lost_byte;        /* [isr] the newest byte that was lost, 0 = nothing is being lost */
    uint8_t overrides[RX_OVERRIDES];
    uint8_t bytes[RX_SIZE];
};

void rx_init(struct rx *rx);

/** [isr or task] Take one byte. @return false: the buffer is full, nothing was changed; the byte must come
 * again. */
bool rx_put(struct rx *rx, uint8_t byte);

/** [isr or task] rx_put() for a buffer, at a fraction of its cost. @return bytes taken: fewer when it is full
 */
size_t rx_put_all(struct rx *rx, const uint8_t *bytes, size_t count);

/** [isr or task] Take one byte of a stream that cannot wait. Without room it is lost, and so is the rest of
 * its line and every line until the waiting ones are read; rx_take_lost() counts them. */
void rx_put_or_lose(struct rx *rx, uint8_t byte);

/** [isr or task, as rx_put] Bytes were lost before the next one. The line is not executed. If its end is
 * among them, the next line is part of it, and one answer is missing. */
void rx_gap(struct rx *rx, enum rx_loss loss);

/** [as rx_gap] Its two halves: count, and have the line refused that comes next or has begun. */
void rx_count(struct rx *rx, enum rx_loss loss);
void rx_spoil(struct rx *rx);

/** [task] Gaps since rx_init(). */
static inline uint32_t rx_gaps(const struct rx *rx, enum rx_loss loss) {
    return __atomic_load_n(&rx->gaps[loss], __ATOMIC_RELAXED);
}

/** [task] The waiting bytes in one piece, or the first piece of two. @return how many, 0 = none */
size_t rx_peek(const struct rx *rx, const uint8_t **bytes);

/** [task] The first line of the waiting bytes: its first `room` bytes, in one piece.
 *  @return bytes up to and including its end, LF or CR; 0: it is not there whole */
size_t rx_line(const struct rx *rx, uint8_t *begin, size_t room);

/** [task] The first `count` bytes of rx_peek() are read. */
void rx_drop(struct rx *rx, size_t count);

/** [task] Bytes put before the newest ! or 0x85, wraps. After rx_take_realtime() has brought it. */
static inline uint32_t rx_cancel_at(const struct rx *rx) {
    return __atomic_load_n(&rx->cancel_at, __ATOMIC_RELAXED);
}

/** [task] Bytes read so far, wraps. A byte read now was put before that when
 * (int32_t)(rx_cancel_at(rx) - rx_taken(rx)) > 0. */
static inline uint32_t rx_taken(const struct rx *rx) {
    return rx->index.tail;
}

/** [task] As rx_peek(), of the operator's bytes. */
size_t rx_peek_aside(const struct rx *rx, const uint8_t **bytes);

/** [task] The first `count` bytes of rx_peek_aside() are read: the job's waiting bytes move up to their
 * place. */
void rx_drop_aside(struct rx *rx, size_t count);

/** [task] The operator has bytes that can be read, or more may come: no ~ has ended them. */
static inline enum rx_aside rx_aside(const struct rx *rx) {
    return (enum rx_aside)__atomic_load_n(&rx->aside, __ATOMIC_ACQUIRE);
}

/** [task] As if ~ had come: no more bytes than these are the operator's. */
void rx_close_aside(struct rx *rx);

/** [task] No bytes are the operator's from now on; those not read are of the job's stream. */
static inline void rx_end_aside(struct rx *rx) {
    __atomic_store_n(&rx->aside, RX_ASIDE_NONE, __ATOMIC_RELEASE);
}

/** [task, and the producer's, too] The job's bytes that wait are dropped; the operator's stay.
 * @return ends of lines (LF) among them */
uint32_t rx_drop_job(struct rx *rx);

/** [task] A lost line. When no byte waits it is the next line: answer it, and forget a half line. */
bool rx_take_lost(struct rx *rx);

/** [task] Real-time requests since the last call. */
uint32_t rx_take_realtime(struct rx *rx);

/** [task] Forget what would start or change something and was not taken yet: ~, 0xA3 and overrides. */
void rx_withdraw(struct rx *rx);

/** [task] As if these real-time bytes had come now: buttons. A stop, or 0xA3, takes back a ~ that waits.
 *  @param bits  enum realtime */
void rx_request(struct rx *rx, uint32_t bits);

/** [task] The oldest override byte, or -1. */
int rx_take_override(struct rx *rx);

/** [task] Forget all waiting bytes and overrides, and that any were lost: the next byte begins a line. */
void rx_flush(struct rx *rx);

/** Bytes that can be put now. */
static inline uint32_t rx_free(const struct rx *rx) {
    return ring_free(&rx->index, RX_SIZE);
}

#endif
