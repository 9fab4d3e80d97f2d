/* SPDX-License-Identifier: MIT */
#include "motion/hosted.h"

#include "motion/emit_stop.h"

#include <string.h>

#define LEAST_NS    200000u /* of a sample in which the axes come to rest */
#define PORTION     7u /* slices in a batch that one poll makes; a shaped segment counts as so many more */
#define SHAPED_WORK 3u

static const struct shaper exactly = {.window_ns = 0};

void hosted_init(struct hosted *hosted, struct emit *emit, struct host_queue *queue) {
    *hosted = (struct hosted){.emit = emit, .queue = queue, .axes.shaper = &exactly};
}

/* What is kept of a segment's number tells it: it is one up to that at tail. */
static uint32_t number_of(uint32_t tail, uint16_t low) {
    return tail - (uint16_t)(tail - low);
}

static uint8_t flags_of(const struct host_queue *queue, uint32_t number) {
    return queue->flags[number & (HOST_QUEUE_NAMES - 1)];
}

static bool is_shaped(const struct hosted *hosted) {
    return shaper_is_on(hosted->axes.shaper);
}

/* The axes follow where the path was: they are still under way when it has ended. */
static bool is_behind(const struct hosted *hosted) {
    return history_moves(&hosted->emit->history, hosted->axes.shaper);
}

/* What is to be made of the next segment. */
static const struct shaper *wanted(const struct hosted *hosted) {
    const struct plan *plan = hosted->emit->plan;
    bool probes = (flags_of(hosted->queue, hosted->queue->tail) & SEGMENT_PROBE) != 0;
    return plan->limits.shape_host && !probes ? &plan->shaper : &exactly;
}

/* The path rests, and something else is to be made of what follows: first the axes come to rest, too. */
static bool changes(const struct hosted *hosted) {
    const struct host_queue *queue = hosted->queue;
    return queue->pace_sq == 0.0f && !host_queue_is_empty(queue) && wanted(hosted) != hosted->axes.shaper;
}

/* At rest. Only ways count, so the place is any. */
static void choose(struct hosted *hosted) {
    int64_t at[SHAPER_LANES] = {0};
    hosted->axes.shaper = wanted(hosted);
    axes_rest(&hosted->axes, hosted->axes.steps);
    for (unsigned ax = 0; ax < CORE_AXES; ax++)
        at[ax] = axes_exactly_on(hosted->axes.steps[ax]);
    hosted->axes.v_mm_s = 0.0f;
    history_rest(&hosted->emit->history, at);
}

/* ---- a sample of the path ---- */

struct sample {
    int64_t at[SHAPER_LANES];
    uint32_t ns;  /* the path moved, or dwelt, for this time */
    int16_t ramp; /* as segment.ramp, where it is one slice */
    uint16_t low; /* of the number of its newest slice's segment, number_of() */
};

/* In the direction of an axis, a slice is `steps` and the difference of its phases. */
static void add_slice(struct hosted *hosted, struct sample *sample, const struct segment *slice) {
    const uint32_t number = host_queue_line_number(hosted->queue, slice->line);
    const struct host_queue_slot *slot = &hosted->queue->slots[number & (HOST_QUEUE_SIZE - 1)];
    for (unsigned ax = 0; ax < CORE_AXES; ax++) {
        int32_t steps = slice->steps[ax] < 0 ? -slice->steps[ax] : slice->steps[ax];
        int32_t way = (steps * 256 + slice->phase_end[ax] - slice->phase[ax]) * (HISTORY_STEP / 256);
        sample->at[ax] += slot->steps[ax] < 0 ? -way : way;
    }
    sample->ramp = sample->ns == 0 ? slice->ramp : 0;
    sample->ns += slice->duration_ns;
    sample->low = (uint16_t)number;
    hosted->work++;
}

/* The path continues for this time and a step at most, or until it rests. */
static void add_slices(struct hosted *hosted, struct sample *sample, uint32_t sample_ns) {
    while (sample->ns < sample_ns && !changes(hosted)) {
        struct segment slice = {.flags = 0};
        const struct host_queue_pieces pieces = {.slice_s = (float)(sample_ns - sample->ns) * 1e-9f,
                                                 .wait_ns = sample_ns / 2};
        if (!host_queue_make(hosted->queue, &pieces, &slice))
            return;
        add_slice(hosted, sample, &slice);
    }
}

/* Where the path ends within the sample, it rests for what is left of it; and no longer than the axes need.
 * @return duration of the sample */
static uint32_t push(struct hosted *hosted, const struct sample *sample, uint32_t sample_ns) {
    struct emit *emit = hosted->emit;
    uint8_t side = emit->ahead->side ^ 1u;
    uint32_t rest_ns = sample->ns < sample_ns ? sample_ns - sample->ns : 0u;
    if (sample->ns > 0)
        history_push(&emit->history, sample->at, sample->ns, sample->ramp, sample->low, side);
    else {
        uint32_t left_ns = hosted->axes.shaper->window_ns - emit->history.now.still_ns;
        rest_ns = left_ns < rest_ns ? left_ns : rest_ns;
        rest_ns = rest_ns < LEAST_NS ? LEAST_NS : rest_ns;
    }
    if (rest_ns > 0)
        history_push(&emit->history, sample->at, rest_ns, 0, sample->low, side);
    return sample->ns + rest_ns;
}

/* Whose the motion is: a segment of as long ago as the axes are late. */
static void sign(const struct hosted *hosted, struct segment *segment, uint32_t number, bool moves) {
    const struct host_queue *queue = hosted->queue;
    const uint8_t flags = flags_of(queue, number);
    segment->id = queue->ids[number & (HOST_QUEUE_NAMES - 1)];
    segment->line = host_queue_line(number, segment->id);
    segment->flags = (uint8_t)(flags & ~(unsigned)SEGMENT_LAST);
    if (host_queue_is_empty(queue) && !is_behind(hosted))
        segment->flags |= SEGMENT_LAST;
    if (!moves) {
        segment->flags |= SEGMENT_DWELL;
        memset(segment->phase, SEGMENT_PHASE_HALF, sizeof segment->phase);
        memset(segment->phase_end, SEGMENT_PHASE_HALF, sizeof segment->phase_end);
    } else if ((flags & SEGMENT_CUT) != 0)
        segment->duty[0] = segment->duty[1] = queue->duty;
}

static void make_shaped(struct hosted *hosted, struct segment *segment) {
    struct emit *emit = hosted->emit;
    bool moves = is_behind(hosted);
    float sample_s = emit_stop_longer_s(emit, hosted->axes.v_mm_s, hosted->axes.shaper->sample_s);
    uint32_t sample_ns = (uint32_t)(sample_s * 1e9f);
    struct history_shape shape;
    struct sample sample = {.low = (uint16_t)hosted->queue->tail};
    memcpy(sample.at, emit->history.now.in, sizeof sample.at);
    add_slices(hosted, &sample, sample_ns);
    segment->duration_ns = push(hosted, &sample, sample_ns);
    history_shape(&emit->history, hosted->axes.shaper, &shape);
    moves = moves || is_behind(hosted);
    (void)axes_follow(&hosted->axes, segment, &shape, is_behind(hosted), &emit->plan->limits,
                      (float)segment->duration_ns * 1e-9f);
    sign(hosted, segment, number_of(hosted->queue->tail, moves ? shape.piece : sample.low), moves);
}

/* A stop that only a late task needs has longer slices, or a slow machine's would not fit into a batch. Speed
 * is known to the queue alone: they do not grow with it, only with their number. */
static bool make_exact(struct hosted *hosted, struct segment *segment) {
    struct host_queue_pieces pieces = host_queue_usual;
    pieces.slice_s = emit_stop_longer_s(hosted->emit, 0.0f, pieces.slice_s);
    return host_queue_make(hosted->queue, &pieces, segment);
}

/* ---- as a source of segments ---- */

static bool make(void *ctx, struct segment *segment) {
    struct hosted *hosted = ctx;
    struct emit *emit = hosted->emit;
    hosted->work = 1;
    emit->stop_samples++;
    if (!is_behind(hosted)) {
        if (host_queue_is_quiet(hosted->queue))
            return false;
        if (changes(hosted))
            choose(hosted);
    }
    if (!is_shaped(hosted))
        return make_exact(hosted, segment);
    if (!history_has_room(&emit->history, emit->ahead->side ^ 1u))
        return false;
    make_shaped(hosted, segment);
    return true;
}

static bool rests(const void *ctx) {
    const struct hosted *hosted = ctx;
    return host_queue_rests(hosted->queue) && !is_behind(hosted);
}

static uint32_t reach_us(const void *ctx) {
    const struct hosted *hosted = ctx;
    return host_queue_is_firm(hosted->queue) ? AHEAD_FULL_US : AHEAD_NEAR_US;
}

static uint32_t news(const void *ctx) {
    const struct hosted *hosted = ctx;
    return hosted->queue->head;
}

static void go_on(void *ctx, enum ahead_stop how) {
    struct hosted *hosted = ctx;
    hosted->emit->stop = how;
    host_queue_stop(hosted->queue, how == AHEAD_STOP);
}

static bool stop(void *ctx, enum ahead_stop how) {
    struct hosted *hosted = ctx;
    if (how == AHEAD_STOP)
        emit_stop_lengths(hosted->emit, hosted->axes.shaper, hosted->axes.v_mm_s,
                          host_queue_stop_s(hosted->queue));
    go_on(hosted, how);
    return how != AHEAD_END;
}

/* Slices are copied, which is cheap. */
static uint32_t portion(const void *ctx) {
    return is_shaped(ctx) ? PORTION : UINT32_MAX;
}

static uint32_t work(const void *ctx) {
    const struct hosted *hosted = ctx;
    return hosted->work + (is_shaped(hosted) ? SHAPED_WORK : 0u);
}

/* cppcheck-suppress constParameterCallback ; the type of ahead_source.save is fixed */
static void save(void *ctx, uint32_t at) {
    const struct hosted *hosted = ctx;
    struct hosted_place *place = &hosted->emit->places[at].hosted;
    host_queue_save(hosted->queue, &place->queue);
    place->axes = hosted->axes;
    place->history = hosted->emit->history.now;
}

static void load(void *ctx, uint32_t at, enum ahead_return why) {
    struct hosted *hosted = ctx;
    const struct hosted_place *place = &hosted->emit->places[at].hosted;
    (void)why;
    host_queue_load(hosted->queue, &place->queue);
    hosted->axes = place->axes;
    history_load(&hosted->emit->history, &place->history, hosted->emit->ahead->side);
}

/* The oldest segment that a place needs is that of its oldest sample, while those still count. */
static void release(void *ctx, uint32_t at) {
    struct hosted *hosted = ctx;
    struct history *history = &hosted->emit->history;
    const struct hosted_place *place = &hosted->emit->places[at].hosted;
    uint32_t oldest = place->queue.tail, window_ns = place->axes.shaper->window_ns;
    if (place->history.still_ns < window_ns)
        oldest = number_of(oldest, history_oldest_piece(history, &place->history, window_ns));
    host_queue_release(hosted->queue, place->queue.tail, oldest);
    history_release(history, &place->history);
}

/* Motion is the host's: nothing of it is behind. */
static void begin(struct hosted *hosted) {
    emit_lend(hosted->emit);
    hosted->axes = (struct axes){.shaper = &exactly};
    axes_rest(&hosted->axes, hosted->axes.steps);
    save(hosted, hosted->emit->ahead->commit);
}

bool hosted_poll(struct hosted *hosted) {
    static const struct ahead_source source = {.make = make,
                                               .rests = rests,
                                               .reach_us = reach_us,
                                               .news = news,
                                               .stop = stop,
                                               .portion = portion,
                                               .work = work,
                                               .go_on = go_on,
                                               .save = save,
                                               .load = load,
                                               .release = release};
    struct ahead *ahead = hosted->emit->ahead;
    if (ahead->owner != AHEAD_HOST) {
        if (host_queue_is_quiet(hosted->queue) || !ahead_claim(ahead, AHEAD_HOST, &source, hosted))
            return false;
        begin(hosted);
    }
    return ahead_poll(ahead);
}
