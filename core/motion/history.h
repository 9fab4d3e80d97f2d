/* SPDX-License-Identifier: MIT
 * Where the path was: its newest samples, and what a shaper makes of them. [task]
 *
 * A record is a piece of the path's motion as a segment is: a way for each lane, a duration, and one ramp. So
 * the path is known at every instant, whatever the records' lengths, and delays need not be whole samples.
 *
 * One walk from the newest record back finds where it was at a shaper's delays, relative to where it is now.
 * Nothing else is kept: no running sums that could drift, and at a mark of segment/ahead.h no more than a
 * number. Everything is counted in whole 1/65536 steps, so the axes end exactly where the path does.
 *
 * Records are numbered. A batch may be refused, and then the one before it is still in force; so each has a
 * side of its own, with all records since the oldest mark that may be returned to. What is older is in main:
 *
 *     main   r r r r r r r
 *     side              '- m r m r r r m r r      in force: committed, and the stop after it
 *     other side        '- m r m r r r r m r r r  the batch that is being made, or waits for its answer */
#ifndef WIFICNC_MOTION_HISTORY_H
#define WIFICNC_MOTION_HISTORY_H

#include "config.h"
#include "motion/shaper.h"

/** 1 step in the history's units. */
#define HISTORY_STEP 65536

/** Records that a shaper may look at. */
#define HISTORY_WINDOW (HISTORY_SIZE * 11u / 16u)
/** Of a batch: a trunk, 50 ms of committed motion, and a stop. What does not fit is made later. */
#define HISTORY_SIDE 120u
/** Of what a batch branched off from: 50 ms of marks. In a stop that a late task has entered more is there,
 * but nothing returns to that: a window is enough. */
#define HISTORY_TRUNK 56u

struct history_record {
    int32_t way[SHAPER_LANES]; /* 1/HISTORY_STEP step; of the place: its units */
    uint32_t ns;
    int16_t ramp;   /* as segment.ramp */
    uint16_t piece; /* in path.pieces: what belongs to the motion in addition */
};

/** Where it was at a mark. */
struct history_place {
    int64_t in[SHAPER_LANES]; /* where the path is, 1/HISTORY_STEP step */
    uint32_t still_ns;        /* the path has rested for this time; 2^31: for ever */
    uint32_t count;           /* records up to here, modulo 2^32 */
    uint32_t batch;           /* of those that are not in main: */
    uint8_t side;
};

struct history_side {
    uint32_t base; /* the number before its first record */
    uint32_t batch;
    struct history_record records[HISTORY_SIDE];
};

struct history {
    struct history_place now;
    uint32_t main_count; /* records up to this one are in main */
    uint32_t kept;       /* ... and up to this one may be */
    uint32_t batch;      /* counts them */
    struct history_record main[HISTORY_SIZE];
    struct history_side sides[2];
};

/** The shaped motion at the end of the newest record. */
struct history_shape {
    int64_t out[SHAPER_LANES];
    float speed[CORE_AXES]; /* 1/HISTORY_STEP step per second */
    uint16_t piece;         /* of the record with most weight */
};

/** The path has rested here for ever: what was before does not count any more. */
void history_rest(struct history *history, const int64_t in[SHAPER_LANES]);

/** The path has come to `in` in this time, or rests there. history_has_room(). @param ramp  as segment.ramp
 *  @param side  0 or 1: that of the batch which is being made, not the one in force */
void history_push(struct history *history, const int64_t in[SHAPER_LANES], uint32_t ns, int16_t ramp,
                  uint16_t piece, uint8_t side);

/** Room for a sample. */
bool history_has_room(struct history *history, uint8_t side);

/** Continue from there. @param in_force  side of the batch in force */
void history_load(struct history *history, const struct history_place *place, uint8_t in_force);

/** No place before this one is needed any more. */
void history_release(struct history *history, const struct history_place *place);

/** The axes are not where the path is. */
static inline bool history_moves(const struct history *history, const struct shaper *shaper) {
    return history->now.still_ns < shaper->window_ns;
}

void history_shape(const struct history *history, const struct shaper *shaper, struct history_shape *shape);

/** The piece of the oldest record that counts at a place, which moves. */
uint16_t history_oldest_piece(const struct history *history, const struct history_place *place,
                              uint32_t window_ns);

#endif
