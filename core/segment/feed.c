/* SPDX-License-Identifier: MIT */
#include "segment/feed.h"

#include "base/minmax.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#define SLICE_S       0.003f    /* aim for the duration of a slice */
#define WAIT_NS       20000000u /* of one slice of a dwell, or before a very slow step */
#define SAMPLE_MOST_S 0.02f     /* a host's slices are at most so long; a longer segment is a move */
#define CHANGE_MOST   1e9f      /* of a dwell */
#define GRADE_S       0.01f /* so much before and after a place tells how fast the host changes speed there */
#define GRADE_NS      ((uint64_t)(GRADE_S * 1e9f))
#define GRADE_MOST    (FEED_SIZE / 2u) /* segments that do */
#define OWN_MOST      0.8f             /* so much of the acceleration is left to the host */
#define OWN_LEGAL     1.2f /* of a host that keeps the limits, measured roughly; and of all together */
#define CHANGE_LEAP   0.4f /* so much of it is for the pace where the host is far beyond the limits */
#define PHASES        256u /* of a step */

void feed_init(struct feed *feed, struct ahead *ahead) {
    memset(feed, 0, sizeof *feed);
    feed->ahead = ahead;
}

void feed_set_limits(struct feed *feed, const struct feed_limits *limits) {
    feed->limits = *limits;
}

void feed_forget_ahead(struct feed *feed) {
    memset(feed->present, 0, sizeof feed->present);
}

void feed_clear(struct feed *feed) {
    feed->tail = feed->kept = feed->head;
    feed->queued_ns = 0;
    feed->pace_sq = 0.0f;
    feed->done = 0;
    feed->dwelt_ns = feed->waited_ns = 0.0;
    feed->hold = feed->hold_asked = feed->ran_dry = false;
    feed_forget_ahead(feed);
}

static struct feed_slot *slot_at(struct feed *feed, uint32_t number) {
    return &feed->slots[number & (FEED_SIZE - 1)];
}

static uint32_t size_of(int32_t steps) {
    return steps < 0 ? 0u - (uint32_t)steps : (uint32_t)steps;
}

/* ---- taking segments in ---- */

/* Without a duration: the mean of both speeds, which are squares x 1000. */
static double duration_from_speeds_ns(const struct feed_segment *segment, uint32_t dominant) {
    float begin = sqrtf((float)segment->entry_speed_sq * 1e-3f);
    float end = sqrtf((float)segment->exit_speed_sq * 1e-3f);
    return begin + end > 0.0f ? 2e9 * (double)dominant / (double)(begin + end) : 0.0;
}

/* Least time that the axes need; one step is forgiven, because a host rounds to whole steps. */
static double least_ns(const struct feed *feed, const struct feed_segment *segment, double asked_ns) {
    double least = 0.0;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        double steps = (double)size_of(segment->steps[ax]);
        double rate = (double)feed->limits.rate_steps_s[ax];
        if (steps > 0.0 && (steps - 1.0) * 1e9 > asked_ns * rate)
            least = steps * 1e9 / rate > least ? steps * 1e9 / rate : least;
    }
    return least;
}

static float speed(const struct feed_slot *slot, unsigned axis) {
    return (float)slot->steps[axis] * 1e9f / (float)slot->duration_ns;
}

static enum feed_result fill(struct feed *feed, struct feed_slot *slot, const struct feed_segment *segment) {
    *slot = (struct feed_slot){.id = segment->id, .flags = segment->flags, .change_most = CHANGE_MOST};
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        uint32_t steps = size_of(segment->steps[ax]);
        if (steps != 0 && ax >= feed->limits.axis_count)
            return FEED_NO_AXIS;
        slot->steps[ax] = segment->steps[ax];
        slot->dominant = steps > slot->dominant ? steps : slot->dominant;
    }
    double asked_ns = (double)segment->duration_us * 1e3;
    if (segment->duration_us == 0)
        asked_ns = duration_from_speeds_ns(segment, slot->dominant);
    if (!(asked_ns >= 1.0))
        return FEED_NO_TIMING;
    double needed_ns = least_ns(feed, segment, asked_ns);
    if (needed_ns > FEED_STRETCH_MOST * asked_ns)
        return FEED_TOO_FAST;
    feed->stretched += needed_ns > asked_ns ? 1 : 0;
    slot->duration_ns = (uint64_t)(needed_ns > asked_ns ? needed_ns : asked_ns);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        if (slot->steps[ax] != 0)
            slot->change_most =
                least_f(slot->change_most, feed->limits.accel_steps_s2[ax] / fabsf(speed(slot, ax)));
    slot->change = (1.0f - OWN_MOST) * slot->change_most;
    return FEED_OK;
}

bool feed_has(const struct feed *feed, uint32_t ahead) {
    uint32_t place = (feed->head + ahead) & (FEED_SIZE - 1);
    return (feed->present[place / 32] >> (place & 31) & 1) != 0;
}

uint32_t feed_laid(const struct feed *feed) {
    uint32_t count = 0;
    while (count < feed_free(feed) && feed_has(feed, count))
        count++;
    return count;
}

enum feed_result feed_lay(struct feed *feed, uint32_t ahead, const struct feed_segment *segment) {
    struct feed_slot slot;
    if (ahead >= feed_free(feed))
        return FEED_FULL;
    if (feed_has(feed, ahead))
        return FEED_OK;
    enum feed_result result = fill(feed, &slot, segment);
    uint32_t place = (feed->head + ahead) & (FEED_SIZE - 1);
    if (result != FEED_OK)
        return result;
    feed->slots[place] = slot;
    feed->present[place / 32] |= (uint32_t)1 << (place & 31);
    return FEED_OK;
}

const struct feed_slot *feed_next(const struct feed *feed) {
    return feed_has(feed, 0) ? &feed->slots[feed->head & (FEED_SIZE - 1)] : NULL;
}

/* ---- what the host's own acceleration leaves ---- */

/* Segments from a place on, forward or backward, until they tell something. */
struct stretch {
    int32_t steps[AXIS_COUNT];
    uint64_t ns;
    uint32_t count;
};

static struct stretch stretch_before(struct feed *feed, uint32_t number) {
    struct stretch stretch = {.ns = 0};
    uint32_t last = number - GRADE_MOST;
    while (number != feed->first && number != last && stretch.ns < GRADE_NS) {
        const struct feed_slot *slot = slot_at(feed, --number);
        stretch.ns += slot->duration_ns;
        stretch.count++;
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
            stretch.steps[ax] += slot->steps[ax];
    }
    return stretch;
}

/* @return false: too little has come, and more will */
static bool stretch_after(struct feed *feed, uint32_t number, struct stretch *stretch) {
    bool ends = false;
    *stretch = (struct stretch){.ns = 0};
    for (; number != feed->head && stretch->ns < GRADE_NS; number++) {
        const struct feed_slot *slot = slot_at(feed, number);
        stretch->ns += slot->duration_ns;
        ends = (slot->flags & SEGMENT_LAST) != 0;
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
            stretch->steps[ax] += slot->steps[ax];
    }
    return stretch->ns >= GRADE_NS || ends;
}

/* The host's part of the acceleration where two stretches meet; a step at the end of each is rounding. */
static float own_part(const struct feed *feed, const struct stretch *before, const struct stretch *after) {
    if (before->ns == 0 || after->ns == 0)
        return 0.0f;
    float before_s = (float)before->ns * 1e-9f, after_s = (float)after->ns * 1e-9f;
    float rounding = 1.0f / before_s + 1.0f / after_s, part = 0.0f;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        float by = fabsf((float)after->steps[ax] / after_s - (float)before->steps[ax] / before_s) - rounding;
        if (by > 0.0f)
            part = most_f(part, by / (0.5f * (before_s + after_s) * feed->limits.accel_steps_s2[ax]));
    }
    return part;
}

/* What is left for the pace. Beyond the limits the pace is so low that little of the host's part is there. */
static float left_part(float own) {
    if (own <= OWN_LEGAL)
        return 1.0f - least_f(own, OWN_MOST);
    return least_f(1.0f - OWN_MOST + 0.5f * (own - OWN_LEGAL), CHANGE_LEAP);
}

/* Where two segments meet, the speed of every axis jumps by no more than it could change in the time of one
 * of a host's slices, and two steps in a slice, because a host rounds to whole steps. One that jumps further
 * leaves room for the change of the pace. */
static float jump_sq(const struct feed *feed, const struct feed_slot *before, const struct feed_slot *slot) {
    float shorter_ns = least_f((float)before->duration_ns, (float)slot->duration_ns);
    float mean_s = 0.5e-9f * (float)(before->duration_ns + slot->duration_ns);
    float sample_s = least_f(mean_s, SAMPLE_MOST_S), quantum_s = least_f(shorter_ns * 1e-9f, SAMPLE_MOST_S);
    float least = 1.0f;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        float jump = fabsf(speed(slot, ax) - speed(before, ax)), rounding = 2.0f / quantum_s;
        float accel = feed->limits.accel_steps_s2[ax], allowed = accel * sample_s + rounding;
        if (jump <= allowed)
            continue;
        float part = OWN_LEGAL - left_part(OWN_LEGAL * jump / allowed);
        allowed = most_f(part * accel * sample_s, least_f(allowed, part * accel * GRADE_S));
        least = least_f(least, allowed / jump);
    }
    return least * least;
}

/* Slices shorter than a stretch show only together what the host does: at pace s the acceleration of the host
 * is s^2 of what it was. @return greatest s^2 at the begin of the segment at head */
static float steep_sq(struct feed *feed) {
    struct stretch after = stretch_before(feed, feed->head + 1);
    struct stretch before = stretch_before(feed, feed->head + 1 - after.count);
    float own = own_part(feed, &before, &after);
    return own > OWN_LEGAL ? (OWN_LEGAL - left_part(own)) / own : 1.0f;
}

/* Of all segments after which enough has come. c only grows, so what was promised is kept. */
static void grade(struct feed *feed) {
    for (; feed->graded != feed->head; feed->graded++) {
        struct feed_slot *slot = slot_at(feed, feed->graded);
        struct stretch before = stretch_before(feed, feed->graded + 1), after;
        if (!stretch_after(feed, feed->graded + 1, &after) && (slot->flags & SEGMENT_LAST) == 0)
            return;
        float own = own_part(feed, &before, &after);
        slot->change = least_f(left_part(own), left_part(feed->own)) * slot->change_most;
        feed->own = own;
    }
}

/* Where the queue was empty the host begins from rest. */
static void begin(struct feed *feed, struct feed_slot *slot) {
    feed->first = feed->graded = feed->head;
    feed->own = 0.0f;
    slot->jump_sq = 1.0f;
}

void feed_take(struct feed *feed) {
    uint32_t number = feed->head, place = number & (FEED_SIZE - 1);
    struct feed_slot *slot = slot_at(feed, number);
    if (feed_is_empty(feed))
        begin(feed, slot);
    else
        slot->jump_sq = least_f(jump_sq(feed, slot_at(feed, number - 1), slot), steep_sq(feed));
    feed->present[place / 32] &= ~((uint32_t)1 << (place & 31));
    feed->underruns += feed->ran_dry ? 1 : 0;
    feed->ran_dry = false;
    feed->queued_ns += slot->duration_ns;
    feed->head++;
    uint32_t changed = feed->graded;
    grade(feed);
    for (float end_sq = 0.0f;; number--) {
        slot = slot_at(feed, number);
        float braked = end_sq + 2.0f * slot->change * (float)slot->duration_ns * 1e-9f;
        end_sq = least_f(slot->jump_sq, braked);
        bool same = end_sq == slot->entry_sq && number + 1 != feed->head;
        slot->entry_sq = end_sq;
        if ((same && (int32_t)(number - changed) < 0) || number == feed->tail)
            return;
    }
}

/* ---- slices ---- */

/* Steps of an axis done after k of the dominant's, and where it stands then. */
static uint32_t steps_after(const struct feed_slot *slot, unsigned axis, uint32_t k, uint8_t *phase) {
    uint64_t dominant = slot->dominant;
    uint64_t twice = 2 * (uint64_t)size_of(slot->steps[axis]) * k + dominant;
    uint64_t rest = twice % (2 * dominant);
    *phase = (uint8_t)(rest * PHASES / (2 * dominant));
    return (uint32_t)(twice / (2 * dominant));
}

/* A duration in whole nanoseconds, the fraction carried. */
static uint32_t whole_ns(struct feed *feed, double ns) {
    feed->time_ns += ns;
    uint32_t whole = feed->time_ns < 1.0 ? 0 : (uint32_t)feed->time_ns;
    feed->time_ns -= (double)whole;
    return whole < 1 ? 1 : whole;
}

static void make_wait(struct feed *feed, struct segment *segment, const struct feed_slot *slot, double ns) {
    segment->duration_ns = whole_ns(feed, ns);
    segment->id = slot->id;
    segment->line = feed_line(feed->tail, slot->id);
    segment->flags = (uint8_t)(slot->flags | SEGMENT_DWELL);
    memset(segment->phase, SEGMENT_PHASE_HALF, sizeof segment->phase);
    memset(segment->phase_end, SEGMENT_PHASE_HALF, sizeof segment->phase_end);
}

static void make_steps(struct feed *feed, struct segment *segment, const struct feed_slot *slot,
                       uint32_t count, double ns, float pace_end) {
    segment->duration_ns = whole_ns(feed, ns);
    segment->id = slot->id;
    segment->line = feed_line(feed->tail, slot->id);
    float pace = sqrtf(feed->pace_sq), sum = pace + pace_end;
    if (sum > 0.0f)
        segment->ramp = (int16_t)((float)SEGMENT_RAMP_ONE * (pace_end - pace) / sum);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        uint32_t from = steps_after(slot, ax, feed->done, &segment->phase[ax]);
        uint32_t to = steps_after(slot, ax, feed->done + count, &segment->phase_end[ax]);
        int32_t way = (int32_t)(to - from); /* <= SEGMENT_MAX_STEPS */
        segment->steps[ax] = (int16_t)(slot->steps[ax] < 0 ? -way : way);
    }
    bool last = feed->tail + 1 == feed->head && feed->done + count == slot->dominant;
    segment->flags = (uint8_t)(slot->flags & ~(unsigned)SEGMENT_LAST);
    segment->flags = (uint8_t)(segment->flags | (last && pace_end == 0.0f ? SEGMENT_LAST : 0));
}

static void finish_segment(struct feed *feed, const struct feed_slot *slot) {
    feed->tail++;
    feed->done = 0;
    feed->dwelt_ns = feed->waited_ns = 0.0;
    feed->queued_ns -= slot->duration_ns;
    if (!feed_is_empty(feed))
        return;
    feed->pace_sq = 0.0f;
    feed->ran_dry = slot->dominant > 0 && (slot->flags & SEGMENT_LAST) == 0;
}

/* A dwell has no speed: the pace may change at once. */
static bool dwell_slice(struct feed *feed, struct segment *segment, const struct feed_slot *slot) {
    if (feed->hold) {
        feed->pace_sq = 0.0f;
        return false;
    }
    double left_ns = (double)slot->duration_ns - feed->dwelt_ns;
    double slice_ns = left_ns < 2.0 * WAIT_NS ? left_ns : WAIT_NS;
    make_wait(feed, segment, slot, slice_ns);
    feed->dwelt_ns += slice_ns;
    if (slice_ns < left_ns)
        return true;
    finish_segment(feed, slot);
    if (!feed_is_empty(feed))
        feed->pace_sq = slot_at(feed, feed->tail)->entry_sq;
    return true;
}

/* Greatest s^2 at the end of the segment at tail. */
static float end_sq(struct feed *feed) {
    return feed->tail + 1 == feed->head ? 0.0f : slot_at(feed, feed->tail + 1)->entry_sq;
}

/* Segment time that the next slice covers, s: what takes SLICE_S; no further than to where speeding up meets
 * braking, so that a slice speeds up or slows down. */
static float slice_length_s(const struct feed *feed, float change, float left_s, float end) {
    float pace = sqrtf(feed->pace_sq);
    float gain = 0.5f * change * SLICE_S * SLICE_S;
    if (feed->hold)
        return pace * SLICE_S - least_f(gain, 0.5f * pace * SLICE_S);
    float length = least_f(pace * SLICE_S + gain, SLICE_S);
    float meet = 0.5f * (left_s + (end - feed->pace_sq) / (2.0f * change));
    return meet > 0.0f ? least_f(length, meet) : length;
}

/* Time of a stretch of x seconds of segment time: up to a peak as high as it goes, even there, down. */
static float stretch_s(float from_sq, float to_sq, float x, float change) {
    float from = sqrtf(from_sq), to = sqrtf(to_sq);
    float peak_sq = 0.5f * (from_sq + to_sq) + change * x;
    if (peak_sq < 1.0f)
        return (2.0f * sqrtf(peak_sq) - from - to) / change;
    float ramps = (2.0f - from_sq - to_sq) / (2.0f * change);
    return (2.0f - from - to) / change + (x - ramps);
}

/* s^2 after x seconds of segment time. */
static float pace_after(const struct feed *feed, float change, float x, float left_s, float end) {
    float brake = end + 2.0f * change * (left_s - x);
    float by = 2.0f * change * x;
    float after = feed->hold ? feed->pace_sq - by : feed->pace_sq + by;
    after = least_f(least_f(after, brake), 1.0f);
    return after > 0.0f ? after : 0.0f;
}

/* A hold whose way is less than a step ends here. */
static bool stands_now(const struct feed *feed, float change, float step_s) {
    return feed->hold && feed->pace_sq <= 2.0f * change * step_s;
}

static bool move_slice(struct feed *feed, struct segment *segment, const struct feed_slot *slot) {
    double step_ns = (double)slot->duration_ns / (double)slot->dominant;
    float step_s = (float)(step_ns * 1e-9), end = end_sq(feed);
    uint32_t left = slot->dominant - feed->done;
    float left_s = (float)left * step_s;
    if (stands_now(feed, slot->change, step_s)) {
        feed->pace_sq = 0.0f;
        return false;
    }
    float wanted = slice_length_s(feed, slot->change, left_s, end) / step_s;
    uint32_t most = left < SEGMENT_MAX_STEPS ? left : SEGMENT_MAX_STEPS;
    uint32_t count = wanted >= (float)most ? most : wanted < 1.0f ? 1u : (uint32_t)wanted;
    double x_ns = step_ns * (double)count;
    float after_sq = pace_after(feed, slot->change, (float)count * step_s, left_s, end);
    double ns = x_ns;
    if (feed->pace_sq < 1.0f || after_sq < 1.0f)
        ns = 1e9 * (double)stretch_s(feed->pace_sq, after_sq, (float)count * step_s, slot->change);
    if (count == 1 && ns - feed->waited_ns > 2.0 * WAIT_NS) {
        make_wait(feed, segment, slot, WAIT_NS);
        feed->waited_ns += WAIT_NS;
        return true;
    }
    make_steps(feed, segment, slot, count, ns > feed->waited_ns ? ns - feed->waited_ns : 0.0,
               sqrtf(after_sq));
    feed->waited_ns = 0.0;
    feed->pace_sq = after_sq;
    feed->done += count;
    if (feed->done == slot->dominant)
        finish_segment(feed, slot);
    return true;
}

/* ---- as a source of segments ---- */

static bool make(void *ctx, struct segment *segment) {
    struct feed *feed = ctx;
    if (feed_is_quiet(feed))
        return false;
    const struct feed_slot *slot = slot_at(feed, feed->tail);
    return slot->dominant == 0 ? dwell_slice(feed, segment, slot) : move_slice(feed, segment, slot);
}

static bool rests(const void *ctx) {
    const struct feed *feed = ctx;
    const struct feed_slot *slot = &feed->slots[feed->tail & (FEED_SIZE - 1)];
    return feed->pace_sq == 0.0f || feed_is_empty(feed) || slot->dominant == 0;
}

/* The end of the queue is further than twice the way to a stop, or it is the end. */
static bool is_firm(const struct feed *feed) {
    if (feed_is_empty(feed))
        return true;
    const struct feed_slot *slot = &feed->slots[feed->tail & (FEED_SIZE - 1)];
    const struct feed_slot *newest = &feed->slots[(feed->head - 1) & (FEED_SIZE - 1)];
    if (feed->hold || (newest->flags & SEGMENT_LAST) != 0)
        return slot->dominant > 0 || feed->hold;
    float part = slot->dominant > 0 ? (float)feed->done / (float)slot->dominant : 0.0f;
    float left_s = ((float)feed->queued_ns - part * (float)slot->duration_ns) * 1e-9f;
    return slot->dominant > 0 && left_s * slot->change > feed->pace_sq;
}

static uint32_t reach_us(const void *ctx) {
    return is_firm(ctx) ? AHEAD_FULL_US : AHEAD_NEAR_US;
}

static uint32_t news(const void *ctx) {
    const struct feed *feed = ctx;
    return feed->head;
}

static bool stop(void *ctx, enum ahead_stop how) {
    struct feed *feed = ctx;
    feed->hold = how == AHEAD_STOP || feed->hold_asked;
    return how != AHEAD_END;
}

static void save(void *ctx, uint32_t at) {
    struct feed *feed = ctx;
    feed->places[at] = (struct feed_place){.tail = feed->tail,
                                           .done = feed->done,
                                           .pace_sq = feed->pace_sq,
                                           .ran_dry = feed->ran_dry,
                                           .dwelt_ns = feed->dwelt_ns,
                                           .waited_ns = feed->waited_ns,
                                           .time_ns = feed->time_ns,
                                           .queued_ns = feed->queued_ns,
                                           .head = feed->head};
}

static void load(void *ctx, uint32_t at, enum ahead_return why) {
    struct feed *feed = ctx;
    const struct feed_place *place = &feed->places[at];
    (void)why;
    feed->tail = place->tail;
    feed->done = place->done;
    feed->pace_sq = place->pace_sq;
    feed->dwelt_ns = place->dwelt_ns;
    feed->waited_ns = place->waited_ns;
    feed->time_ns = place->time_ns;
    feed->queued_ns = place->queued_ns;
    for (uint32_t number = place->head; number != feed->head; number++)
        feed->queued_ns += slot_at(feed, number)->duration_ns;
    feed->ran_dry = place->ran_dry && feed_is_empty(feed);
}

static void release(void *ctx, uint32_t at) {
    struct feed *feed = ctx;
    feed->kept = feed->places[at].tail;
}

void feed_hold(struct feed *feed, bool on) {
    if (feed->hold_asked == on)
        return;
    feed->hold = feed->hold_asked = on;
    if (feed->ahead->owner == AHEAD_HOST)
        ahead_change(feed->ahead);
}

bool feed_poll(struct feed *feed) {
    static const struct ahead_source source = {make, rests, reach_us, news, stop, save, load, release};
    if (feed->ahead->owner != AHEAD_HOST && feed_is_quiet(feed))
        return false;
    return ahead_claim(feed->ahead, AHEAD_HOST, &source, feed) && ahead_poll(feed->ahead);
}
