/* SPDX-License-Identifier: MIT */
#include "segment/host_queue.h"

#include "base/minmax.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#define SAMPLE_MAX_S 0.02f /* a host's slices are at most this long; a longer segment is a move */
#define CHANGE_MAX   1e9f  /* of a dwell */
#define GRADE_S      0.01f /* so much before and after a place tells how fast the host changes speed there */
#define GRADE_NS     ((uint64_t)(GRADE_S * 1e9f))
#define GRADE_MAX    (HOST_QUEUE_SIZE / 2u) /* segments that do */
#define OWN_MAX      0.8f                   /* so much of the acceleration is left to the host */
#define OWN_LEGAL    1.2f /* of a host that keeps the limits, measured roughly; and of all together */
#define CHANGE_LEAP  0.4f /* so much of it is for the pace where the host is far beyond the limits */
#define PHASES       256u /* of a step */

const struct host_queue_pieces host_queue_usual = {.slice_s = 0.003f, .wait_ns = 20000000u};

void host_queue_init(struct host_queue *queue, struct ahead *ahead) {
    memset(queue, 0, sizeof *queue);
    queue->ahead = ahead;
}

void host_queue_set_duty(struct host_queue *queue, uint16_t duty) {
    if (queue->duty == duty)
        return;
    queue->duty = duty;
    if (queue->ahead->owner == AHEAD_HOST)
        ahead_change(queue->ahead);
}

void host_queue_set_limits(struct host_queue *queue, const struct host_queue_limits *limits) {
    queue->limits = *limits;
}

void host_queue_forget_ahead(struct host_queue *queue) {
    memset(queue->present, 0, sizeof queue->present);
}

void host_queue_clear(struct host_queue *queue) {
    if (queue->ahead->owner == AHEAD_HOST)
        ahead_abandon(queue->ahead);
    queue->tail = queue->kept = queue->named = queue->head;
    queue->queued_ns = 0;
    queue->pace_sq = 0.0f;
    queue->done = 0;
    queue->dwelt_ns = queue->waited_ns = 0.0;
    queue->hold = queue->hold_asked = queue->ran_dry = false;
    host_queue_forget_ahead(queue);
}

static struct host_queue_slot *slot_at(struct host_queue *queue, uint32_t number) {
    return &queue->slots[number & (HOST_QUEUE_SIZE - 1)];
}

static uint32_t size_of(int32_t steps) {
    return steps < 0 ? 0u - (uint32_t)steps : (uint32_t)steps;
}

/* ---- taking segments in ---- */

/* Without a duration: the mean of both speeds, which are squares x 1000. */
static double duration_from_speeds_ns(const struct host_queue_segment *segment, uint32_t dominant) {
    float begin = sqrtf((float)segment->entry_speed_sq * 1e-3f);
    float end = sqrtf((float)segment->exit_speed_sq * 1e-3f);
    return begin + end > 0.0f ? 2e9 * (double)dominant / (double)(begin + end) : 0.0;
}

/* Least time that the axes need; one step is forgiven, because a host rounds to whole steps. */
static double least_ns(const struct host_queue *queue, const struct host_queue_segment *segment,
                       double asked_ns) {
    double least = 0.0;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        double steps = (double)size_of(segment->steps[ax]);
        double rate = (double)queue->limits.rate_steps_s[ax];
        if (steps > 0.0 && (steps - 1.0) * 1e9 > asked_ns * rate)
            least = steps * 1e9 / rate > least ? steps * 1e9 / rate : least;
    }
    return least;
}

static float speed(const struct host_queue_slot *slot, unsigned axis) {
    return (float)slot->steps[axis] * 1e9f / (float)slot->duration_ns;
}

static enum host_queue_result fill(struct host_queue *queue, struct host_queue_slot *slot,
                                   const struct host_queue_segment *segment) {
    *slot = (struct host_queue_slot){.id = segment->id, .flags = segment->flags, .change_most = CHANGE_MAX};
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        uint32_t steps = size_of(segment->steps[ax]);
        if (steps != 0 && ax >= queue->limits.axis_count)
            return HOST_QUEUE_NO_AXIS;
        slot->steps[ax] = segment->steps[ax];
        slot->dominant = steps > slot->dominant ? steps : slot->dominant;
    }
    double asked_ns = (double)segment->duration_us * 1e3;
    if (segment->duration_us == 0)
        asked_ns = duration_from_speeds_ns(segment, slot->dominant);
    if (!(asked_ns >= 1.0))
        return HOST_QUEUE_NO_TIMING;
    double needed_ns = least_ns(queue, segment, asked_ns);
    if (needed_ns > HOST_QUEUE_STRETCH_MAX * asked_ns)
        return HOST_QUEUE_TOO_FAST;
    queue->stretched += needed_ns > asked_ns ? 1 : 0;
    slot->duration_ns = (uint64_t)(needed_ns > asked_ns ? needed_ns : asked_ns);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        if (slot->steps[ax] != 0)
            slot->change_most =
                min_f(slot->change_most, queue->limits.accel_steps_s2[ax] / fabsf(speed(slot, ax)));
    slot->change = (1.0f - OWN_MAX) * slot->change_most;
    return HOST_QUEUE_OK;
}

bool host_queue_has(const struct host_queue *queue, uint32_t ahead) {
    uint32_t place = (queue->head + ahead) & (HOST_QUEUE_SIZE - 1);
    return (queue->present[place / 32] >> (place & 31) & 1) != 0;
}

uint32_t host_queue_laid(const struct host_queue *queue) {
    uint32_t count = 0;
    while (count < host_queue_free(queue) && host_queue_has(queue, count))
        count++;
    return count;
}

enum host_queue_result host_queue_lay(struct host_queue *queue, uint32_t ahead,
                                      const struct host_queue_segment *segment) {
    struct host_queue_slot slot;
    if (ahead >= host_queue_free(queue))
        return HOST_QUEUE_FULL;
    /* A segment that a lossy network brings twice; the first one counts. */
    if (host_queue_has(queue, ahead))
        return HOST_QUEUE_OK;
    enum host_queue_result result = fill(queue, &slot, segment);
    uint32_t place = (queue->head + ahead) & (HOST_QUEUE_SIZE - 1);
    if (result != HOST_QUEUE_OK)
        return result;
    queue->slots[place] = slot;
    queue->present[place / 32] |= (uint32_t)1 << (place & 31);
    return HOST_QUEUE_OK;
}

const struct host_queue_slot *host_queue_next(const struct host_queue *queue) {
    return host_queue_has(queue, 0) ? &queue->slots[queue->head & (HOST_QUEUE_SIZE - 1)] : NULL;
}

/* ---- what the host's own acceleration leaves ---- */

/* Segments from a place on, forward or backward, until they tell something. */
struct stretch {
    int32_t steps[AXIS_COUNT];
    uint64_t ns;
    uint32_t count;
};

static struct stretch stretch_before(struct host_queue *queue, uint32_t number) {
    struct stretch stretch = {.ns = 0};
    uint32_t last = number - GRADE_MAX;
    while (number != queue->first && number != last && stretch.ns < GRADE_NS) {
        const struct host_queue_slot *slot = slot_at(queue, --number);
        stretch.ns += slot->duration_ns;
        stretch.count++;
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
            stretch.steps[ax] += slot->steps[ax];
    }
    return stretch;
}

/* @return false: too little has come, and more will */
static bool stretch_after(struct host_queue *queue, uint32_t number, struct stretch *stretch) {
    bool ends = false;
    *stretch = (struct stretch){.ns = 0};
    for (; number != queue->head && stretch->ns < GRADE_NS; number++) {
        const struct host_queue_slot *slot = slot_at(queue, number);
        stretch->ns += slot->duration_ns;
        ends = (slot->flags & SEGMENT_LAST) != 0;
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
            stretch->steps[ax] += slot->steps[ax];
    }
    return stretch->ns >= GRADE_NS || ends;
}

/* The host's part of the acceleration where two stretches meet; a step at the end of each is rounding. */
static float own_part(const struct host_queue *queue, const struct stretch *before,
                      const struct stretch *after) {
    if (before->ns == 0 || after->ns == 0)
        return 0.0f;
    float before_s = (float)before->ns * 1e-9f, after_s = (float)after->ns * 1e-9f;
    float rounding = 1.0f / before_s + 1.0f / after_s, part = 0.0f;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        float by = fabsf((float)after->steps[ax] / after_s - (float)before->steps[ax] / before_s) - rounding;
        if (by > 0.0f)
            part = max_f(part, by / (0.5f * (before_s + after_s) * queue->limits.accel_steps_s2[ax]));
    }
    return part;
}

/* What is left for the pace. Beyond the limits the pace is so low that little of the host's part is there. */
static float left_part(float own) {
    if (own <= OWN_LEGAL)
        return 1.0f - min_f(own, OWN_MAX);
    return min_f(1.0f - OWN_MAX + 0.5f * (own - OWN_LEGAL), CHANGE_LEAP);
}

/* Where two segments meet, the speed of every axis jumps by no more than it could change in the time of one
 * of a host's slices, and two steps in a slice, because a host rounds to whole steps. One that jumps further
 * leaves room for the change of the pace. */
static float jump_sq(const struct host_queue *queue, const struct host_queue_slot *before,
                     const struct host_queue_slot *slot) {
    if (queue->limits.rests_to_probe && ((before->flags ^ slot->flags) & SEGMENT_PROBE) != 0)
        return 0.0f;
    float shorter_ns = min_f((float)before->duration_ns, (float)slot->duration_ns);
    float mean_s = 0.5e-9f * (float)(before->duration_ns + slot->duration_ns);
    float sample_s = min_f(mean_s, SAMPLE_MAX_S), quantum_s = min_f(shorter_ns * 1e-9f, SAMPLE_MAX_S);
    float least = 1.0f;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        float jump = fabsf(speed(slot, ax) - speed(before, ax)), rounding = 2.0f / quantum_s;
        float accel = queue->limits.accel_steps_s2[ax], allowed = accel * sample_s + rounding;
        if (jump <= allowed)
            continue;
        float part = OWN_LEGAL - left_part(OWN_LEGAL * jump / allowed);
        allowed = max_f(part * accel * sample_s, min_f(allowed, part * accel * GRADE_S));
        least = min_f(least, allowed / jump);
    }
    return least * least;
}

/* Slices shorter than a stretch show only together what the host does: at pace s the acceleration of the host
 * is s^2 of what it was. @return greatest s^2 at the begin of the segment at head */
static float steep_sq(struct host_queue *queue) {
    struct stretch after = stretch_before(queue, queue->head + 1);
    struct stretch before = stretch_before(queue, queue->head + 1 - after.count);
    float own = own_part(queue, &before, &after);
    return own > OWN_LEGAL ? (OWN_LEGAL - left_part(own)) / own : 1.0f;
}

/* Of all segments after which enough has come. c only grows, so what was promised is kept. */
static void grade(struct host_queue *queue) {
    for (; queue->graded != queue->head; queue->graded++) {
        struct host_queue_slot *slot = slot_at(queue, queue->graded);
        struct stretch before = stretch_before(queue, queue->graded + 1), after;
        if (!stretch_after(queue, queue->graded + 1, &after) && (slot->flags & SEGMENT_LAST) == 0)
            return;
        float own = own_part(queue, &before, &after);
        slot->change = min_f(left_part(own), left_part(queue->own)) * slot->change_most;
        queue->own = own;
    }
}

/* Where the queue was empty the host begins from rest. */
static void begin(struct host_queue *queue, struct host_queue_slot *slot) {
    queue->first = queue->graded = queue->head;
    queue->own = 0.0f;
    slot->jump_sq = 1.0f;
}

void host_queue_take(struct host_queue *queue) {
    uint32_t number = queue->head, place = number & (HOST_QUEUE_SIZE - 1);
    struct host_queue_slot *slot = slot_at(queue, number);
    if (host_queue_is_empty(queue))
        begin(queue, slot);
    else
        slot->jump_sq = min_f(jump_sq(queue, slot_at(queue, number - 1), slot), steep_sq(queue));
    queue->present[place / 32] &= ~((uint32_t)1 << (place & 31));
    /* Only now that more comes is it known that the end before was an underrun and not the end of the job. */
    queue->underruns += queue->ran_dry ? 1 : 0;
    queue->ran_dry = false;
    queue->queued_ns += slot->duration_ns;
    queue->ids[number & (HOST_QUEUE_NAMES - 1)] = slot->id;
    queue->flags[number & (HOST_QUEUE_NAMES - 1)] = slot->flags;
    queue->head++;
    uint32_t changed = queue->graded;
    grade(queue);
    /* From the newest segment, whose end must be rest, back to the oldest: entry(k) of host_queue.h. Once
     * a value does not change and no c before it has, nothing further back changes either. */
    for (float end_sq = 0.0f;; number--) {
        slot = slot_at(queue, number);
        float braked = end_sq + 2.0f * slot->change * (float)slot->duration_ns * 1e-9f;
        end_sq = min_f(slot->jump_sq, braked);
        bool same = end_sq == slot->entry_sq && number + 1 != queue->head;
        slot->entry_sq = end_sq;
        if ((same && (int32_t)(number - changed) < 0) || number == queue->tail)
            return;
    }
}

/* ---- slices ---- */

/* Steps of an axis done after k of the dominant's, and where it is then: |steps| k / dominant, rounded,
 * always from the beginning of the segment, so that nothing adds up and the last k has all of them. */
static uint32_t steps_after(const struct host_queue_slot *slot, unsigned axis, uint32_t k, uint8_t *phase) {
    uint64_t dominant = slot->dominant;
    uint64_t twice = 2 * (uint64_t)size_of(slot->steps[axis]) * k + dominant;
    uint64_t rest = twice % (2 * dominant);
    *phase = (uint8_t)(rest * PHASES / (2 * dominant));
    return (uint32_t)(twice / (2 * dominant));
}

/* A duration in whole nanoseconds, the fraction carried. */
static uint32_t whole_ns(struct host_queue *queue, double ns) {
    queue->time_ns += ns;
    uint32_t whole = queue->time_ns < 1.0 ? 0 : (uint32_t)queue->time_ns;
    queue->time_ns -= (double)whole;
    return whole < 1 ? 1 : whole;
}

static void make_wait(struct host_queue *queue, struct segment *segment, const struct host_queue_slot *slot,
                      double ns) {
    segment->duration_ns = whole_ns(queue, ns);
    segment->id = slot->id;
    segment->line = host_queue_line(queue->tail, slot->id);
    segment->flags = (uint8_t)(slot->flags | SEGMENT_DWELL);
    memset(segment->phase, SEGMENT_PHASE_HALF, sizeof segment->phase);
    memset(segment->phase_end, SEGMENT_PHASE_HALF, sizeof segment->phase_end);
}

static void make_steps(struct host_queue *queue, struct segment *segment, const struct host_queue_slot *slot,
                       uint32_t count, double ns, float pace_end) {
    segment->duration_ns = whole_ns(queue, ns);
    segment->id = slot->id;
    segment->line = host_queue_line(queue->tail, slot->id);
    float pace = sqrtf(queue->pace_sq), sum = pace + pace_end;
    if (sum > 0.0f)
        segment->ramp = (int16_t)((float)SEGMENT_RAMP_ONE * (pace_end - pace) / sum);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        uint32_t from = steps_after(slot, ax, queue->done, &segment->phase[ax]);
        uint32_t to = steps_after(slot, ax, queue->done + count, &segment->phase_end[ax]);
        int32_t way = (int32_t)(to - from); /* <= SEGMENT_MAX_STEPS */
        segment->steps[ax] = (int16_t)(slot->steps[ax] < 0 ? -way : way);
    }
    bool last = queue->tail + 1 == queue->head && queue->done + count == slot->dominant;
    segment->flags = (uint8_t)(slot->flags & ~(unsigned)SEGMENT_LAST);
    segment->flags = (uint8_t)(segment->flags | (last && pace_end == 0.0f ? SEGMENT_LAST : 0));
    if ((slot->flags & SEGMENT_CUT) != 0)
        segment->duty[0] = segment->duty[1] = queue->duty;
}

static void finish_segment(struct host_queue *queue, const struct host_queue_slot *slot) {
    queue->tail++;
    queue->done = 0;
    queue->dwelt_ns = queue->waited_ns = 0.0;
    queue->queued_ns -= slot->duration_ns;
    if (!host_queue_is_empty(queue))
        return;
    queue->pace_sq = 0.0f;
    queue->ran_dry = slot->dominant > 0 && (slot->flags & SEGMENT_LAST) == 0;
}

/* A dwell has no speed: the pace may change immediately. */
static bool dwell_slice(struct host_queue *queue, struct segment *segment, const struct host_queue_slot *slot,
                        uint32_t wait_ns) {
    if (queue->hold) {
        queue->pace_sq = 0.0f;
        return false;
    }
    double left_ns = (double)slot->duration_ns - queue->dwelt_ns;
    double slice_ns = left_ns < 2.0 * wait_ns ? left_ns : wait_ns;
    make_wait(queue, segment, slot, slice_ns);
    queue->dwelt_ns += slice_ns;
    if (slice_ns < left_ns)
        return true;
    finish_segment(queue, slot);
    if (!host_queue_is_empty(queue))
        queue->pace_sq = slot_at(queue, queue->tail)->entry_sq;
    return true;
}

/* Greatest s^2 at the end of the segment at tail. */
static float end_sq(struct host_queue *queue) {
    return queue->tail + 1 == queue->head ? 0.0f : slot_at(queue, queue->tail + 1)->entry_sq;
}

/* Segment time that the next slice covers, s: what takes slice_s; no further than to where speeding up meets
 * braking, so that a slice speeds up or slows down. */
static float slice_length_s(const struct host_queue *queue, float slice_s, float change, float left_s,
                            float end) {
    float pace = sqrtf(queue->pace_sq);
    float gain = 0.5f * change * slice_s * slice_s;
    if (queue->hold)
        return pace * slice_s - min_f(gain, 0.5f * pace * slice_s);
    float length = min_f(pace * slice_s + gain, slice_s);
    /* pace^2 + 2 c x = end + 2 c (left - x) */
    float meet = 0.5f * (left_s + (end - queue->pace_sq) / (2.0f * change));
    return meet > 0.0f ? min_f(length, meet) : length;
}

/* Time of a stretch of x seconds of segment time: up to a peak as high as it goes, even there, down. */
static float stretch_s(float from_sq, float to_sq, float x, float change) {
    float from = sqrtf(from_sq), to = sqrtf(to_sq);
    /* Up for x1 and down for x - x1: peak^2 = from^2 + 2 c x1 = to^2 + 2 c (x - x1). In real time the pace
     * changes by c per second. */
    float peak_sq = 0.5f * (from_sq + to_sq) + change * x;
    if (peak_sq < 1.0f)
        return (2.0f * sqrtf(peak_sq) - from - to) / change;
    float ramps = (2.0f - from_sq - to_sq) / (2.0f * change);
    return (2.0f - from - to) / change + (x - ramps);
}

/* s^2 after x seconds of segment time. */
static float pace_after(const struct host_queue *queue, float change, float x, float left_s, float end) {
    float brake = end + 2.0f * change * (left_s - x);
    float by = 2.0f * change * x;
    float after = queue->hold ? queue->pace_sq - by : queue->pace_sq + by;
    after = min_f(min_f(after, brake), 1.0f);
    return after > 0.0f ? after : 0.0f;
}

/* A hold whose way is less than a step ends here. */
static bool stands_now(const struct host_queue *queue, float change, float step_s) {
    return queue->hold && queue->pace_sq <= 2.0f * change * step_s;
}

static bool move_slice(struct host_queue *queue, struct segment *segment, const struct host_queue_slot *slot,
                       const struct host_queue_pieces *pieces) {
    double step_ns = (double)slot->duration_ns / (double)slot->dominant;
    float step_s = (float)(step_ns * 1e-9), end = end_sq(queue);
    uint32_t left = slot->dominant - queue->done;
    float left_s = (float)left * step_s;
    if (stands_now(queue, slot->change, step_s)) {
        queue->pace_sq = 0.0f;
        return false;
    }
    float wanted = slice_length_s(queue, pieces->slice_s, slot->change, left_s, end) / step_s;
    uint32_t most = left < SEGMENT_MAX_STEPS ? left : SEGMENT_MAX_STEPS;
    uint32_t count = wanted >= (float)most ? most : wanted < 1.0f ? 1u : (uint32_t)wanted;
    double x_ns = step_ns * (double)count;
    float after_sq = pace_after(queue, slot->change, (float)count * step_s, left_s, end);
    double ns = x_ns;
    if (queue->pace_sq < 1.0f || after_sq < 1.0f)
        ns = 1e9 * (double)stretch_s(queue->pace_sq, after_sq, (float)count * step_s, slot->change);
    /* A step that takes long waits in slices, so that a hold or a stop is not late by the whole of it. */
    if (count == 1 && ns - queue->waited_ns > 2.0 * pieces->wait_ns) {
        make_wait(queue, segment, slot, pieces->wait_ns);
        queue->waited_ns += pieces->wait_ns;
        return true;
    }
    make_steps(queue, segment, slot, count, ns > queue->waited_ns ? ns - queue->waited_ns : 0.0,
               sqrtf(after_sq));
    queue->waited_ns = 0.0;
    queue->pace_sq = after_sq;
    queue->done += count;
    if (queue->done == slot->dominant)
        finish_segment(queue, slot);
    return true;
}

bool host_queue_make(struct host_queue *queue, const struct host_queue_pieces *pieces,
                     struct segment *segment) {
    if (host_queue_is_quiet(queue))
        return false;
    const struct host_queue_slot *slot = slot_at(queue, queue->tail);
    return slot->dominant == 0 ? dwell_slice(queue, segment, slot, pieces->wait_ns)
                               : move_slice(queue, segment, slot, pieces);
}

/* ---- for a source of segments ---- */

bool host_queue_rests(const struct host_queue *queue) {
    const struct host_queue_slot *slot = &queue->slots[queue->tail & (HOST_QUEUE_SIZE - 1)];
    return queue->pace_sq == 0.0f || host_queue_is_empty(queue) || slot->dominant == 0;
}

/* The end of the queue is further than twice the way to a stop, or it is the end. */
bool host_queue_is_firm(const struct host_queue *queue) {
    if (host_queue_is_empty(queue))
        return true;
    const struct host_queue_slot *slot = &queue->slots[queue->tail & (HOST_QUEUE_SIZE - 1)];
    const struct host_queue_slot *newest = &queue->slots[(queue->head - 1) & (HOST_QUEUE_SIZE - 1)];
    if (queue->hold || (newest->flags & SEGMENT_LAST) != 0)
        return slot->dominant > 0 || queue->hold;
    float part = slot->dominant > 0 ? (float)queue->done / (float)slot->dominant : 0.0f;
    float left_s = ((float)queue->queued_ns - part * (float)slot->duration_ns) * 1e-9f;
    /* The way to a stop is s^2 / (2 c) of segment time. */
    return slot->dominant > 0 && left_s * slot->change > queue->pace_sq;
}

/* s changes by c per second. */
float host_queue_stop_s(const struct host_queue *queue) {
    if (host_queue_is_empty(queue))
        return 0.0f;
    return sqrtf(queue->pace_sq) / queue->slots[queue->tail & (HOST_QUEUE_SIZE - 1)].change;
}

void host_queue_save(const struct host_queue *queue, struct host_queue_place *place) {
    *place = (struct host_queue_place){.tail = queue->tail,
                                       .done = queue->done,
                                       .pace_sq = queue->pace_sq,
                                       .ran_dry = queue->ran_dry,
                                       .dwelt_ns = queue->dwelt_ns,
                                       .waited_ns = queue->waited_ns,
                                       .time_ns = queue->time_ns,
                                       .queued_ns = queue->queued_ns,
                                       .head = queue->head};
}

void host_queue_load(struct host_queue *queue, const struct host_queue_place *place) {
    queue->tail = place->tail;
    queue->done = place->done;
    queue->pace_sq = place->pace_sq;
    queue->dwelt_ns = place->dwelt_ns;
    queue->waited_ns = place->waited_ns;
    queue->time_ns = place->time_ns;
    queue->queued_ns = place->queued_ns;
    /* What was taken after the mark was kept stays taken: head does not go back. */
    for (uint32_t number = place->head; number != queue->head; number++)
        queue->queued_ns += slot_at(queue, number)->duration_ns;
    queue->ran_dry = place->ran_dry && host_queue_is_empty(queue);
}

void host_queue_release(struct host_queue *queue, uint32_t kept, uint32_t named) {
    if ((int32_t)(kept - queue->kept) > 0)
        queue->kept = kept;
    if ((int32_t)(named - queue->named) > 0)
        queue->named = named;
}

void host_queue_hold(struct host_queue *queue, bool on) {
    if (queue->hold_asked == on)
        return;
    queue->hold = queue->hold_asked = on;
    if (queue->ahead->owner == AHEAD_HOST)
        ahead_change(queue->ahead);
}
