/* SPDX-License-Identifier: MIT
 * Where the path was: its newest samples, and what a shaper makes of them. [task]
 *
 * A record is a piece of the path's motion as a segment is: a way for each lane, a duration, and one ramp. So
 * the path is known at every instant, whatever the records' lengths, and delays need not be whole samples.
 *
 * What the axes still lack of the path is the sum over the records of each one's way times the part of it
 * that the shaper has not passed on yet. Nothing else is kept: no running sums that could drift, and at a
 * mark of segment/ahead.h no more than a number. Everything is counted in whole 1/65536 steps, so the axes
 * end exactly where the path does.
 *
 *     main    r r r r r r r r r r r         as published; branch: the stop after it, of which there are two,
 *                       '- r r r r          that in force and that of the batch which is being made */
#ifndef WIFICNC_MOTION_HISTORY_H
#define WIFICNC_MOTION_HISTORY_H

#include "config.h"
#include "motion/shaper.h"

/** 1 step in the history's units. */
#define HISTORY_STEP 65536

/** Records that a shaper may look at; the others are for what may have to be made again: 50 ms. */
#define HISTORY_WINDOW (HISTORY_SIZE * 3u / 8u)
/** Of a stop; what comes after that many makes the last one longer. */
#define HISTORY_STOP 96u

struct history_record {
    int32_t way[SHAPER_LANES]; /* 1/HISTORY_STEP step; of the place: its units */
    uint32_t ns;
    int16_t ramp;   /* as segment.ramp */
    uint16_t piece; /* in path.pieces: what belongs to the motion in addition */
};

/** Where it was at a mark. */
struct history_place {
    int64_t in[SHAPER_LANES]; /* where the path is, 1/HISTORY_STEP step */
    uint32_t still_ns;        /* the path rests for so long; 2^31: for ever */
    uint32_t count;           /* records of main, modulo 2^32 */
    uint8_t stop_count;       /* records of the stop after it */
    uint8_t side;             /* which of the two */
};

struct history {
    struct history_place now;
    struct history_record main[HISTORY_SIZE];
    struct history_record stops[2][HISTORY_STOP];
    bool stopping; /* records go there */
};

/** The shaped motion at the end of the newest record. */
struct history_shape {
    int64_t out[SHAPER_LANES];
    float speed[AXIS_COUNT]; /* 1/HISTORY_STEP step per second */
    uint16_t piece;          /* of the record with most weight */
};

/** The path has rested here for ever so long: what was before does not count any more. */
void history_rest(struct history *history, const int64_t in[SHAPER_LANES]);

/** The same, and nothing is taken back. */
void history_reset(struct history *history, const int64_t in[SHAPER_LANES]);

/** The path has come to `in` in this time, or rests there. @param ramp  as segment.ramp */
void history_push(struct history *history, const int64_t in[SHAPER_LANES], uint32_t ns, int16_t ramp,
                  uint16_t piece);

/** What follows is a stop that may be taken back. @param side  0 or 1 */
void history_branch(struct history *history, uint8_t side);

/** Continue from this place; one in a stop becomes part of what is committed. */
void history_load(struct history *history, const struct history_place *place);

/** The axes are not where the path is. */
static inline bool history_moves(const struct history *history, const struct shaper *shaper) {
    return history->now.still_ns < shaper->window_ns;
}

void history_shape(const struct history *history, const struct shaper *shaper, struct history_shape *shape);

/** The piece of the oldest record that counts at a place, which moves. */
uint16_t history_oldest_piece(const struct history *history, const struct history_place *place,
                              uint32_t window_ns);

#endif
