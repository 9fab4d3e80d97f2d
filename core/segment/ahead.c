/* SPDX-License-Identifier: MIT */
#include "segment/ahead.h"

#include <stddef.h>

#define MARK_US      4000u  /* between marks of committed motion */
#define STOP_MARK_US 20000u /* from the beginning of a stop to its first mark; the next ones twice as far */
#define SPARE_MARKS  5u     /* places for the marks that must be, of this batch and the next one */
#define COMMIT_MAX   80u    /* segments; the others are for the stop */
#define COMMIT_POWER (QUEUE_POWER / 2u) /* changes of a laser's S: each becomes a span */
#define MIN_US       6000u              /* of committed motion, however few spans there are */
#define HURRY_US     1000               /* the committed part is continued if so much of it is left */
#define END_MAX_US   600000u            /* of the stop at the end of what is planned, and segments of it */
#define END_MAX      48u
#define REST_NS      100000u
#define COARSEST     10u
#define STOP_WORK    2u /* to end the committed part and to find how to stop, as work of a portion */

static uint32_t now_us(const struct ahead *ahead) {
    return segment_queue_now_us(ahead->queue);
}

static int32_t after_now_us(const struct ahead *ahead, uint32_t at_us) {
    return (int32_t)(at_us - now_us(ahead));
}

int32_t ahead_left_us(const struct ahead *ahead) {
    return after_now_us(ahead, ahead->mark_us[ahead->commit]);
}

uint32_t ahead_queued_us(const struct ahead *ahead) {
    int32_t left_us = after_now_us(ahead, ahead->end_us);
    return left_us > 0 ? (uint32_t)left_us : 0u;
}

void ahead_init(struct ahead *ahead, struct segment_queue *queue) {
    *ahead = (struct ahead){.queue = queue};
    ahead_reset(ahead);
}

/* ---- sets of marks ---- */

#define ALL_MARKS ((1u << QUEUE_MARKS) - 1u)

static uint32_t bit(uint32_t place) {
    return 1u << place;
}

/* Take a place out of a set, which is not empty. */
static uint32_t take_place(uint32_t *set) {
    uint32_t place = (uint32_t)__builtin_ctz(*set);
    *set &= *set - 1u;
    return place;
}

/* Motion time from mark to mark. */
static int32_t from_mark_us(const struct ahead *ahead, uint32_t from, uint32_t to) {
    return (int32_t)(ahead->mark_us[to] - ahead->mark_us[from]);
}

void ahead_reset(struct ahead *ahead) {
    ahead->used = bit(QUEUE_RESET_MARK);
    ahead->fresh = ahead->stops = 0;
    ahead->mark_us[QUEUE_RESET_MARK] = 0;
    ahead->branch = ahead->commit = QUEUE_RESET_MARK;
    ahead->end_us = 0;
    ahead->full_us = AHEAD_FAR_US;
    ahead->coarser = 0;
    ahead->pending = ahead->changed = ahead->changing = ahead->soft = ahead->passed = false;
    ahead->noted = ahead->spare = ahead->crowded = ahead->ends = ahead->open = false;
    ahead->batch.stage = AHEAD_NO_BATCH;
    ahead->owner = AHEAD_NOBODY;
    ahead->source = NULL;
}

static bool rests_at_commit(const struct ahead *ahead) {
    return ahead->end_us == ahead->mark_us[ahead->commit];
}

bool ahead_claim(struct ahead *ahead, enum ahead_owner owner, const struct ahead_source *source, void *ctx) {
    if (ahead->owner == owner)
        return true;
    if (segment_queue_is_pending(ahead->queue) || ahead->pending || ahead_is_making(ahead) ||
        !rests_at_commit(ahead))
        return false;
    /* Only the place at which the owner before has come to rest; its other marks have states of another
     * source. */
    ahead->used = bit(ahead->commit);
    ahead->owner = owner;
    ahead->source = source;
    ahead->ctx = ctx;
    ahead->changed = ahead->soft = ahead->passed = false;
    source->save(ctx, ahead->commit);
    return true;
}

/* ---- marks ---- */

/* @return so many of them are free, or more */
static bool has_places(const struct ahead *ahead, uint32_t count) {
    uint32_t free = ~ahead->used & ALL_MARKS;
    for (; count > 1 && free != 0; count--)
        (void)take_place(&free);
    return free != 0;
}

/* The segment made last ends in a mark, of the state that the source has now; if it does already, in that
 * one: the motion side keeps one mark of a segment. @return its place; QUEUE_MARKS: there is none for one
 * that need not be */
static uint32_t put_mark(struct ahead *ahead, uint32_t at_us, bool must, bool stops) {
    struct segment *segment = &ahead->queue->slots[ahead->queue->count - 1];
    uint32_t free = ~ahead->used & ALL_MARKS;
    if (segment->mark == 0 && !has_places(ahead, must ? 1u : SPARE_MARKS + 1u))
        return QUEUE_MARKS;
    uint32_t place = segment->mark != 0 ? segment->mark - 1u : take_place(&free);
    ahead->mark_us[place] = at_us;
    ahead->used |= bit(place);
    ahead->fresh |= bit(place);
    ahead->stops = stops ? ahead->stops | bit(place) : ahead->stops & ~bit(place);
    segment->mark = (uint8_t)(place + 1); /* 0 is a segment without a mark */
    ahead->source->save(ahead->ctx, place);
    return place;
}

/* The first mark in force that is this far ahead, or else the last one of all. */
static uint32_t mark_ahead(const struct ahead *ahead, int32_t ahead_us) {
    uint32_t best = QUEUE_MARKS, last = ahead->commit;
    for (uint32_t left = ahead->used; left != 0;) {
        uint32_t place = take_place(&left);
        if (from_mark_us(ahead, last, place) > 0)
            last = place;
        if (after_now_us(ahead, ahead->mark_us[place]) >= ahead_us &&
            (best == QUEUE_MARKS || from_mark_us(ahead, place, best) > 0))
            best = place;
    }
    return best < QUEUE_MARKS ? best : last;
}

/* Those that the step interrupt has passed; what only they needed is released. */
static void forget_passed(struct ahead *ahead) {
    const uint32_t now = now_us(ahead);
    uint32_t oldest = ahead->commit;
    int32_t next_us = INT32_MAX, oldest_us = (int32_t)(ahead->mark_us[oldest] - now);
    ahead->passed = true;
    for (uint32_t left = ahead->used; left != 0;) {
        uint32_t place = take_place(&left);
        int32_t left_us = (int32_t)(ahead->mark_us[place] - now);
        if (left_us >= next_us && left_us >= oldest_us) /* most of them */
            continue;
        bool stays = place == ahead->commit || ahead->mark_us[place] == ahead->end_us;
        if (left_us < 0 && !stays) {
            ahead->used &= ~bit(place);
            continue;
        }
        if (!stays && left_us < next_us)
            next_us = left_us;
        if (left_us < oldest_us) {
            oldest = place;
            oldest_us = left_us;
        }
    }
    ahead->next_us = now + (uint32_t)next_us;
    ahead->source->release(ahead->ctx, oldest);
}

/* ---- answers ---- */

/* The marks of a batch that will not be in force. */
static void forget_fresh(struct ahead *ahead) {
    ahead->passed = false;
    ahead->used &= ~ahead->fresh;
    ahead->fresh = 0;
}

/* The newest batch does not count: what was in force before it still is. */
static void withdraw(struct ahead *ahead, enum queue_answer answer) {
    forget_fresh(ahead);
    ahead->commit = ahead->commit_before;
    ahead->end_us = ahead->end_us_before;
    ahead->ends = ahead->ends_before;
    /* What was to be changed still is: it was only this batch that would have done it. */
    ahead->changed = ahead->changed || ahead->changing;
    ahead->source->load(ahead->ctx, ahead->commit, AHEAD_UNDO);
    /* Spans do not suffice: first the long stop is given up (`spare`), and only then motion is published
     * less far ahead. */
    ahead->crowded = answer == QUEUE_LARGE && ahead->spare && ahead->full_us <= MIN_US;
    ahead->crowded_us = now_us(ahead);
    if (answer == QUEUE_LARGE && ahead->spare && ahead->full_us > MIN_US)
        ahead->full_us /= 2;
    ahead->spare = ahead->spare || answer == QUEUE_LARGE;
    /* Nothing will come back: the same stop would be refused for ever. */
    if (ahead->crowded && ahead_queued_us(ahead) == 0 && ahead->coarser < COARSEST)
        ahead->coarser++;
}

/* The marks before it after its branch do not count any more. */
static void take(struct ahead *ahead) {
    ahead->passed = false;
    for (uint32_t left = ahead->used & ~ahead->fresh & ~bit(ahead->branch); left != 0;) {
        uint32_t place = take_place(&left);
        if (from_mark_us(ahead, ahead->branch, place) >= 0)
            ahead->used &= ~bit(place);
    }
    ahead->fresh = 0;
    ahead->side ^= 1u;
    ahead->noted = ahead->spare = ahead->crowded = false;
    /* Back in small steps, so that it does not become too large again with the next batch. */
    if (ahead->full_us < AHEAD_FAR_US)
        ahead->full_us += MIN_US;
    else
        ahead->coarser = 0;
}

/* ---- batches ---- */

static struct segment *next_slot(struct ahead *ahead) {
    struct segment *segment = &ahead->queue->slots[ahead->queue->count];
    *segment = (struct segment){.flags = 0};
    return segment;
}

static void spend(struct ahead_batch *batch, uint32_t work) {
    batch->left = work < batch->left ? batch->left - work : 0u;
}

/* @return false: nothing comes now */
static bool put_segment(struct ahead *ahead) {
    struct ahead_batch *batch = &ahead->batch;
    struct segment *segment = next_slot(ahead);
    if (!ahead->source->make(ahead->ctx, segment))
        return false;
    batch->at_us += (segment->duration_ns + 999u) / 1000u;
    segment->end_us = batch->at_us;
    ahead->queue->count++;
    spend(batch, ahead->source->work(ahead->ctx));
    return true;
}

/* @return false: the portion is over */
static bool put_committed(struct ahead *ahead) {
    struct ahead_batch *batch = &ahead->batch;
    ahead->soft = false;
    while (ahead->queue->count < COMMIT_MAX && ahead->queue->power_count < COMMIT_POWER &&
           after_now_us(ahead, batch->at_us) < (int32_t)ahead->full_us) {
        uint32_t reach_us = ahead->source->reach_us(ahead->ctx);
        if (after_now_us(ahead, batch->at_us) >= (int32_t)reach_us) {
            ahead->soft = reach_us < AHEAD_FULL_US;
            break;
        }
        if (batch->left == 0)
            return false;
        if (!put_segment(ahead))
            break;
        if (batch->at_us - batch->marked_us >= MARK_US &&
            put_mark(ahead, batch->at_us, false, false) < QUEUE_MARKS)
            batch->marked_us = batch->at_us;
    }
    return true;
}

/* The source rests. Where it does so at the branch and something is published after that, a rest takes its
 * place: a batch without segments would leave it in force. */
static void put_rest(struct ahead *ahead) {
    if (ahead->queue->count > 0 || ahead->batch.at_us == ahead->end_us)
        return;
    struct segment *segment = next_slot(ahead);
    segment->duration_ns = REST_NS;
    segment->flags = SEGMENT_DWELL | SEGMENT_LAST;
    ahead->batch.at_us += REST_NS / 1000u;
    segment->end_us = ahead->batch.at_us;
    ahead->queue->count++;
}

/* Segments until the source rests, no longer than this and no more of them in the batch.
 * @return false: the portion is over; *rests: it does not fit, if this is false */
static bool put_until_rest(struct ahead *ahead, uint32_t most_us, uint32_t most_count, bool *rests) {
    const struct ahead_source *source = ahead->source;
    struct ahead_batch *batch = &ahead->batch;
    while (!source->rests(ahead->ctx) && ahead->queue->count < most_count &&
           batch->at_us - batch->commit_us < most_us) {
        if (batch->left == 0)
            return false;
        if (!put_segment(ahead))
            break;
        if (batch->at_us - batch->marked_us < batch->every_us || source->rests(ahead->ctx))
            continue;
        (void)put_mark(ahead, batch->at_us, false, true);
        batch->marked_us = batch->at_us;
        batch->every_us *= 2;
    }
    *rests = source->rests(ahead->ctx);
    if (*rests)
        put_rest(ahead);
    if (*rests && batch->at_us != batch->commit_us)
        (void)put_mark(ahead, batch->at_us, true, true);
    return true;
}

static void drop_stop(struct ahead *ahead) {
    ahead->used &= ~(ahead->fresh & ahead->stops);
    ahead->fresh &= ahead->used;
    ahead->queue->count = ahead->batch.commit_count;
}

/* The stop after the committed part begins. @return false: there is no such stop */
static bool begin_stop(struct ahead *ahead, enum ahead_stop how) {
    struct ahead_batch *batch = &ahead->batch;
    batch->stage = how == AHEAD_END ? AHEAD_ENDS : AHEAD_STOPS;
    batch->at_us = batch->marked_us = batch->commit_us;
    batch->every_us = STOP_MARK_US;
    return ahead->source->stop(ahead->ctx, how);
}

/* The state that the source has now is that at the end of the committed part. When nothing was committed,
 * that is the branch; if it lies in a stop, its state was that of a source that stops, and now is of one that
 * continues. */
static uint32_t commit_mark(struct ahead *ahead, uint32_t at_us) {
    if (ahead->queue->count > 0)
        return put_mark(ahead, at_us, true, false);
    ahead->source->save(ahead->ctx, ahead->branch);
    ahead->passed = false;
    return ahead->branch;
}

/* A batch from the branch, where the source's state is. */
static void begin_batch(struct ahead *ahead) {
    struct segment_queue *queue = ahead->queue;
    struct ahead_batch *batch = &ahead->batch;
    ahead->news = ahead->source->news(ahead->ctx);
    ahead->changing = ahead->changed;
    ahead->changed = false;
    queue->count = queue->power_count = 0;
    queue->from = ahead->branch;
    batch->stage = AHEAD_COMMITS;
    batch->at_us = batch->marked_us = ahead->mark_us[ahead->branch];
    batch->work = QUEUE_MARKS;
}

/* The committed part is made. @return false: it ends at rest, and there is no stop to be made */
static bool end_committed(struct ahead *ahead) {
    struct ahead_batch *batch = &ahead->batch;
    bool rests = ahead->source->rests(ahead->ctx);
    if (rests)
        put_rest(ahead);
    /* Before the stop is made, which moves the source on. */
    batch->commit = (uint8_t)commit_mark(ahead, batch->at_us);
    batch->commit_us = batch->at_us;
    batch->commit_count = (uint8_t)ahead->queue->count;
    spend(batch, STOP_WORK);
    return !rests;
}

/* The source is in the state at the end of the committed part. @return false: it does not fit, and nothing
 * has happened */
static bool publish(struct ahead *ahead, bool fits) {
    struct ahead_batch *batch = &ahead->batch;
    ahead->commit_before = ahead->commit;
    ahead->end_us_before = ahead->end_us;
    ahead->ends_before = ahead->ends;
    ahead->commit = batch->commit;
    ahead->end_us = batch->at_us;
    ahead->ends = fits && batch->stage == AHEAD_ENDS;
    ahead->queue->tail = batch->stage == AHEAD_STOPS ? ahead->queue->count - batch->commit_count : 0;
    batch->stage = AHEAD_NO_BATCH;
    if (!fits) {
        withdraw(ahead, QUEUE_LARGE);
        return false;
    }
    ahead->pending = ahead->queue->count > 0;
    if (ahead->pending)
        segment_queue_publish(ahead->queue);
    return true;
}

/* The stop after the committed part: the end of what is planned, if that is near, or the shortest one.
 * @return false: the portion is over */
static bool put_stop(struct ahead *ahead, bool *fits) {
    const struct ahead_source *source = ahead->source;
    struct ahead_batch *batch = &ahead->batch;
    if (batch->stage == AHEAD_ENDS) {
        if (!put_until_rest(ahead, END_MAX_US, batch->commit_count + END_MAX, fits))
            return false;
        if (!*fits) {
            drop_stop(ahead);
            source->load(ahead->ctx, batch->commit, AHEAD_UNDO);
            (void)begin_stop(ahead, AHEAD_STOP);
        }
    }
    if (batch->stage == AHEAD_STOPS && !put_until_rest(ahead, UINT32_MAX, SEGMENT_QUEUE_SIZE, fits))
        return false;
    (void)source->stop(ahead->ctx, AHEAD_GO);
    source->load(ahead->ctx, batch->commit, AHEAD_UNDO);
    return true;
}

/* As much of the batch as this portion may have. @return false: more is to be made */
static bool make_portion(struct ahead *ahead, bool *fits) {
    struct ahead_batch *batch = &ahead->batch;
    if (batch->stage == AHEAD_COMMITS) {
        if (!put_committed(ahead))
            return false;
        *fits = true;
        if (!end_committed(ahead))
            return true;
        bool ends = !ahead->spare && !ahead->open && begin_stop(ahead, AHEAD_END);
        if (!ends) {
            ahead->source->load(ahead->ctx, batch->commit, AHEAD_UNDO);
            (void)begin_stop(ahead, AHEAD_STOP);
        }
    }
    return put_stop(ahead, fits);
}

static enum ahead_stop stop_of(uint8_t stage) {
    return stage == AHEAD_ENDS ? AHEAD_END : stage == AHEAD_STOPS ? AHEAD_STOP : AHEAD_GO;
}

/* Until the next portion the source is where it was before the batch. @return false: there is no place to
 * keep its state */
static bool pause_batch(struct ahead *ahead) {
    uint32_t free = ~ahead->used & ALL_MARKS;
    if (free == 0)
        return false;
    uint32_t place = take_place(&free);
    ahead->batch.work = (uint8_t)place;
    ahead->source->save(ahead->ctx, place);
    ahead->source->go_on(ahead->ctx, AHEAD_GO);
    ahead->source->load(ahead->ctx, ahead->commit, AHEAD_UNDO);
    return true;
}

/* @return something was done */
static bool carry_on(struct ahead *ahead) {
    struct ahead_batch *batch = &ahead->batch;
    bool fits = false;
    batch->left = ahead->source->portion(ahead->ctx);
    if (batch->work < QUEUE_MARKS) {
        ahead->source->load(ahead->ctx, batch->work, AHEAD_UNDO);
        ahead->source->go_on(ahead->ctx, stop_of(batch->stage));
        batch->work = QUEUE_MARKS;
    }
    while (!make_portion(ahead, &fits)) {
        if (pause_batch(ahead))
            return true;
        batch->left = UINT32_MAX;
    }
    bool returns = ahead->branch != ahead->commit; /* which may be all: the stop was the end of the job */
    return publish(ahead, fits) && (returns || ahead->pending);
}

void ahead_abandon(struct ahead *ahead) {
    if (!ahead_is_making(ahead))
        return;
    forget_fresh(ahead);
    ahead->changed = ahead->changed || ahead->changing;
    ahead->batch.stage = AHEAD_NO_BATCH;
}

/* The step interrupt has entered the stop: motion continues from a mark in it. It does not matter where
 * motion would have braked anyway, for want of more moves. */
static void note_late(struct ahead *ahead) {
    if (!ahead->noted && (!ahead->soft || ahead->source->news(ahead->ctx) != ahead->news))
        ahead->late++;
    ahead->noted = true;
}

/* Where to change what is published: not so late that the motion side cannot do it in time. A stop is left no
 * earlier than it must be. */
static uint32_t choose_branch(const struct ahead *ahead) {
    uint32_t place = mark_ahead(ahead, (int32_t)AHEAD_BRANCH_US);
    return (ahead->stops & bit(place)) != 0 && ahead_left_us(ahead) >= HURRY_US ? ahead->commit : place;
}

bool ahead_open(struct ahead *ahead) {
    if (!ahead->ends || !ahead->open) /* the batch that opens it is made, however often this is asked */
        ahead_abandon(ahead);
    if (!ahead->ends)
        return true;
    ahead->changed = ahead->changed || !ahead->open;
    ahead->open = true;
    return false;
}

bool ahead_take_answer(struct ahead *ahead) {
    if (!ahead->pending || segment_queue_is_pending(ahead->queue))
        return false;
    ahead->pending = false;
    if (ahead->queue->answer == QUEUE_TAKEN)
        take(ahead);
    else
        withdraw(ahead, ahead->queue->answer);
    return true;
}

/* Spans come back as motion is executed: until some have, the same batch would be refused again. */
static bool is_crowded(const struct ahead *ahead) {
    return ahead->crowded && now_us(ahead) == ahead->crowded_us && ahead_queued_us(ahead) > 0;
}

bool ahead_has_enough(const struct ahead *ahead) {
    const uint32_t now = now_us(ahead);
    bool waits = ahead->changed || ahead->pending || ahead_is_making(ahead) || !ahead->passed;
    return !waits && (int32_t)(ahead->next_us - now) >= 0 &&
           (int32_t)(ahead->mark_us[ahead->commit] - now) >= (int32_t)AHEAD_LEAST_US;
}

bool ahead_poll(struct ahead *ahead) {
    if (ahead->source == NULL || segment_queue_is_pending(ahead->queue))
        return false;
    bool answered = ahead_take_answer(ahead);
    if (ahead->changed)
        ahead_abandon(ahead);
    if (ahead_is_making(ahead))
        return carry_on(ahead);
    /* After the answer: a batch that was refused has brought the marks before it back into force. */
    if (!ahead->passed || after_now_us(ahead, ahead->next_us) < 0)
        forget_passed(ahead);
    int32_t left_us = ahead_left_us(ahead);
    if (left_us >= (int32_t)AHEAD_LEAST_US && !ahead->changed)
        return answered; /* without a look at the source, which costs more than all before */
    bool stops = left_us < 0 && !rests_at_commit(ahead);
    uint32_t reach_us = ahead->source->reach_us(ahead->ctx);
    uint32_t most_us = reach_us < ahead->full_us ? reach_us : ahead->full_us;
    uint32_t least_us = most_us / 2 < AHEAD_LEAST_US ? most_us / 2 : AHEAD_LEAST_US;
    if ((!stops && !ahead->changed && left_us >= (int32_t)least_us) || is_crowded(ahead))
        return answered;
    if (stops)
        note_late(ahead);
    ahead->branch = stops || ahead->changed ? choose_branch(ahead) : ahead->commit;
    ahead->source->save(ahead->ctx, ahead->commit);
    if (ahead->branch != ahead->commit)
        ahead->source->load(ahead->ctx, ahead->branch,
                            (ahead->stops & bit(ahead->branch)) != 0 ? AHEAD_STOPPED : AHEAD_UNDO);
    begin_batch(ahead);
    return carry_on(ahead) || answered;
}
