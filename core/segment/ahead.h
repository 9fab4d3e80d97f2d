/* SPDX-License-Identifier: MIT
 * Keeps motion ahead of the step interrupt, always with a legal stop at its end. [task]
 *
 * Whatever plans segments (the emitter of the planner, the queue of a network host) is a source. From it come
 * batches (segment/queue.h): committed motion, then the stop after it along the same path. To make the stop,
 * the source keeps its state at the end of the committed part, is put into a stop, is asked for segments
 * until it rests, and takes the state back. When the step interrupt enters the stop after all, because some
 * task was late, the source takes the state that it had there, and motion continues from there, or from rest:
 * along the same path, because segments are differences of absolute places.
 *
 *        branch                 commit             end
 *     ---M-------M-------M-------M  s  s  M  s  s  R        M: mark, a state that the source has kept
 *     ^ now      '-> a new batch, when what was planned beyond this mark is to be changed
 *
 * How far ahead the source says: FULL where later moves cannot change anything, or FAR, if it can keep the
 * states; NEAR where they can (the planner brakes for the end of the path that it knows), because what is
 * published would have to be planned again; SOON what follows something that moves by itself. */
#ifndef WIFICNC_SEGMENT_AHEAD_H
#define WIFICNC_SEGMENT_AHEAD_H

#include "segment/queue.h"

/** Committed motion, us; more is published when half of it is left, or LEAST: each time a stop is made, which
 * costs as much as 30 ms of motion. FAR: as far as there are places for marks. LEAST: a task that is late by
 * 20 ms does not slow a job. Half of NEAR is as long as the slowest task of any board may sleep and be late,
 * twice (targets/chip/task_periods.h); of SOON: once. */
#define AHEAD_FAR_US   72000u
#define AHEAD_FULL_US  50000u
#define AHEAD_LEAST_US 22000u
#define AHEAD_NEAR_US  16000u
#define AHEAD_SOON_US  10000u
/** A batch that changes what is published branches off so far ahead, to arrive before the ISR does. */
#define AHEAD_BRANCH_US 3000u

enum ahead_owner { AHEAD_NOBODY, AHEAD_PLANNER, AHEAD_HOST };

/** A mark's state is taken back: */
enum ahead_return {
    AHEAD_UNDO,   /* what was made after it has not happened */
    AHEAD_STOPPED /* motion came by it in a stop that no one asked for */
};

enum ahead_stop {
    AHEAD_GO,  /* not at all */
    AHEAD_END, /* at the end of what is planned */
    AHEAD_STOP /* as soon as the limits allow */
};

struct ahead_source {
    /** The next segment; flags, steps, phases, duration, ramp, line, speed. @return false: none now */
    bool (*make)(void *ctx, struct segment *segment);
    /** At rest after what was made. */
    bool (*rests)(const void *ctx);
    /** How far ahead to publish: AHEAD_FAR_US or less. */
    uint32_t (*reach_us)(const void *ctx);
    /** Moves known so far; changes with each. */
    uint32_t (*news)(const void *ctx);
    /** How to come to rest on the path. @return false: AHEAD_END is not near */
    bool (*stop)(void *ctx, enum ahead_stop how);
    /** How much one call makes, so that others may work in between; UINT32_MAX: a whole batch. And how much
     * of that the newest segment was, above 0. */
    uint32_t (*portion)(const void *ctx);
    uint32_t (*work)(const void *ctx);
    /** Come to rest in a way that stop() has begun, in a state that was taken back; or AHEAD_GO, without an
     * end of it. Never for a source of whole batches. */
    void (*go_on)(void *ctx, enum ahead_stop how);
    /** Keep the state in this place (below QUEUE_MARKS), or take it back. */
    void (*save)(void *ctx, uint32_t place);
    void (*load)(void *ctx, uint32_t place, enum ahead_return why);
    /** The states in other places than from this one on are not needed any more. */
    void (*release)(void *ctx, uint32_t place);
};

/** What is made of a batch next. */
enum ahead_stage {
    AHEAD_NO_BATCH, /* nothing */
    AHEAD_COMMITS,
    AHEAD_ENDS, /* the stop, at the end of what is planned */
    AHEAD_STOPS /* the shortest one */
};

/** A batch that is being made, in portions. Between two of them the source is in the state of struct
 * ahead.commit, as if none was made. */
struct ahead_batch {
    uint8_t stage;        /* enum ahead_stage */
    uint8_t work;         /* place of the source's state between portions; QUEUE_MARKS: none yet */
    uint8_t commit;       /* place of the mark where the committed part ends ... */
    uint8_t commit_count; /* ... segments of it ... */
    uint32_t commit_us;   /* ... and its motion time */
    uint32_t left;        /* of this portion */
    uint32_t at_us;       /* motion time of what is made */
    uint32_t marked_us;   /* of its newest mark ... */
    uint32_t every_us;    /* ... and from there to the next one of a stop */
};

struct ahead {
    struct segment_queue *queue;
    enum ahead_owner owner;
    const struct ahead_source *source;
    void *ctx;
    uint32_t mark_us[QUEUE_MARKS]; /* motion time of marks; bit n of a set is place n: */
    uint32_t used, fresh, stops;   /* all, of the batch that is pending, in a stop that no one asked for */
    struct ahead_batch batch;      /* that is being made */
    uint32_t branch, commit;       /* places: where the newest batch begins; the state the source has now */
    uint32_t commit_before, end_us_before; /* of what is in force while a batch is pending */
    uint32_t end_us;                       /* of all that is published, its stop included */
    uint32_t full_us;                      /* AHEAD_FAR_US, or less while spans do not suffice */
    uint32_t news;                         /* of the source, when the newest batch was made */
    uint32_t next_us; /* motion time of the mark that is passed next, if that still counts */
    bool passed;
    bool pending;
    bool changed, changing; /* branch off: asked for, and done by the batch that is pending */
    bool soft;              /* the committed part ends where more moves may change what follows */
    bool spare;             /* spans did not suffice: the shortest stop, and then less motion */
    uint8_t coarser;        /* ... nor for that: segments of the shortest stop are 2^coarser times as long */
    bool crowded;           /* nor did they for the least of that, until motion time passes this: */
    uint32_t crowded_us;
    bool ends,
        ends_before; /* the stop is the end of what is planned; before, of what is in force meanwhile */
    bool open;       /* it must not be, because that end is about to change */
    uint8_t side;    /* 0 or 1: that of the batch in force, for a source that keeps them apart */
    bool noted;      /* that the step interrupt is in the stop */
    uint32_t late;   /* times motion slowed down because tasks were late */
};

/** No one's, at rest at time 0. */
void ahead_init(struct ahead *ahead, struct segment_queue *queue);

/** Motion was reset to a place (prep_reset()); the source's state was, too. */
void ahead_reset(struct ahead *ahead);

/** Take motion, to begin from rest. @return false: another owner's motion is not at rest yet */
bool ahead_claim(struct ahead *ahead, enum ahead_owner owner, const struct ahead_source *source, void *ctx);

/** What is published is to be planned again, as near to the pins as possible: hold, override, jog cancel. */
static inline void ahead_change(struct ahead *ahead) {
    ahead->changed = true;
}

/** The end of what is planned is about to change: the stop must not be that end. @return false: it is, and
 * motion is not at rest there; try again later */
bool ahead_open(struct ahead *ahead);

/** That has happened. */
static inline void ahead_close(struct ahead *ahead) {
    ahead->open = false;
}

/** A batch is half made: ahead_poll() makes more of it. */
static inline bool ahead_is_making(const struct ahead *ahead) {
    return ahead->batch.stage != AHEAD_NO_BATCH;
}

/** The batch that is half made, if one is, is not wanted: the plan that it follows is about to change. */
void ahead_abandon(struct ahead *ahead);

/** The newest batch has no answer yet: what was published before may stay in force. */
static inline bool ahead_is_pending(const struct ahead *ahead) {
    return ahead->pending && segment_queue_is_pending(ahead->queue);
}

/** Take the answer to the newest batch, if it is there. @return true when it was */
bool ahead_take_answer(struct ahead *ahead);

/** Take the answer, note what the step interrupt has done, publish more. @return true when anything changed.
 * Never blocks. */
bool ahead_poll(struct ahead *ahead);

/** Committed motion that is left, us; less than 0: the step interrupt is in the stop after it. */
int32_t ahead_left_us(const struct ahead *ahead);

/** Nothing is to be made, changed, answered or released yet: ahead_poll() would do nothing. */
bool ahead_has_enough(const struct ahead *ahead);

/** All motion that is published, us. */
uint32_t ahead_queued_us(const struct ahead *ahead);

#endif
