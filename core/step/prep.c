/* SPDX-License-Identifier: MIT */
#include "step/prep.h"

#include "base/debug.h"

#include <math.h>
#include <string.h>

/* Below this event rate minor axes of a diagonal would jitter visibly: events are doubled up to
 * 2^MAX_OVERSAMPLE. */
#define SMOOTH_EVENT_HZ 8000u
#define MAX_OVERSAMPLE  4u
#define MAX_EVENTS      16383u

#define SPEED_RATIO_SQ (1.125f * 1.125f)

void prep_init(struct prep *prep, struct segment_ring *in, struct step *step,
               const struct prep_timing *timing) {
    *prep = (struct prep){.in = in, .step = step, .timing = *timing};
}

void prep_reset(struct prep *prep, const int32_t position[AXIS_COUNT]) {
    prep->loaded = false;
    prep->time_left_q16 = prep->tick_remainder = prep->waited_q16 = 0;
    memcpy(prep->position, position, sizeof prep->position);
}

bool prep_is_empty(const struct prep *prep) {
    return !prep->loaded && segment_ring_peek(prep->in) == 0;
}

/* Phase and increment of one axis so that it travels from its phase to its end phase at an even pace, and
 * exactly `steps` overflows come in `events` events (span.h): first the phase gives way, and where it cannot,
 * the increment. */
static void set_axis(struct prep *prep, unsigned axis, uint32_t steps, const struct segment *segment,
                     uint32_t events) {
    int32_t shift = (int32_t)segment->phase_end[axis] - (int32_t)segment->phase[axis];
    int32_t travel = (int32_t)(steps << SPAN_PHASE_BITS) + shift * (SPAN_PHASE_ONE / 256);
    uint32_t phase = segment->phase[axis] * (SPAN_PHASE_ONE / 256u);
    uint32_t increment = travel > 0 ? ((uint32_t)travel + events / 2) / events : 0;
    if (increment > SPAN_PHASE_ONE)
        increment = SPAN_PHASE_ONE;
    uint32_t least = steps << SPAN_PHASE_BITS, most = least + SPAN_PHASE_ONE - 1;
    uint32_t total = phase + events * increment;
    if (total < least) {
        increment += phase + (least - total) > SPAN_PHASE_ONE - 1 ? 1 : 0;
        total = phase + events * increment;
        phase += total < least ? least - total : 0;
    } else if (total > most) {
        increment -= phase < total - most ? 1 : 0;
        total = phase + events * increment;
        phase -= total > most ? total - most : 0;
    }
    prep->phase[span_word(axis)] |= phase << span_shift(axis);
    prep->increment[span_word(axis)] |= increment << span_shift(axis);
}

/* Power of two by which events are multiplied, so that the steps of minor axes lie evenly. */
static unsigned oversample(const struct prep *prep, uint32_t dominant, bool diagonal, uint64_t ticks) {
    unsigned shift = 0;
    if (!diagonal)
        return 0;
    uint64_t enough = ticks * SMOOTH_EVENT_HZ / prep->timing.timer_hz;
    while (shift < MAX_OVERSAMPLE && ((uint64_t)dominant << shift) < enough &&
           (dominant << (shift + 1)) <= MAX_EVENTS)
        shift++;
    return shift;
}

static void load_segment(struct prep *prep, const struct segment *segment) {
    uint32_t count[AXIS_COUNT], dominant = 0;
    prep->negative = prep->last_negative;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        int32_t steps = segment->steps[ax];
        axis_mask_t bit = (axis_mask_t)(1u << ax);
        count[ax] = (uint32_t)(steps < 0 ? -steps : steps);
        if (steps != 0)
            prep->negative = (axis_mask_t)(steps < 0 ? prep->negative | bit : prep->negative & ~bit);
        if (count[ax] > dominant)
            dominant = count[ax];
    }
    bool diagonal = false;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        diagonal |= (count[ax] != 0 && count[ax] != dominant) || segment->phase[ax] != segment->phase_end[ax];

    /* whole ticks, the rest carried: durations never drift */
    uint64_t scaled = (uint64_t)segment->duration_ns * prep->timing.timer_hz + prep->tick_remainder;
    uint64_t ticks = scaled / 1000000000u;
    prep->tick_remainder = scaled % 1000000000u;

    prep->events = dominant << oversample(prep, dominant, diagonal, ticks);
    prep->done = 0;
    prep->time_left_q16 += ticks << 16;
    memset(prep->phase, 0, sizeof prep->phase);
    memset(prep->increment, 0, sizeof prep->increment);
    for (unsigned ax = 0; ax < AXIS_COUNT && dominant > 0; ax++)
        set_axis(prep, ax, count[ax], segment, prep->events);

    float ramp = (float)segment->ramp * (1.0f / (float)SEGMENT_RAMP_ONE);
    float mean = ticks > 0 ? (float)prep->events / (float)ticks : 0.0f;
    prep->v = mean * (1.0f - ramp);
    prep->v_end = mean * (1.0f + ramp);
    prep->v_sq = prep->v * prep->v;
    prep->v_sq_slope =
        prep->events > 0 ? (prep->v_end * prep->v_end - prep->v_sq) / (float)prep->events : 0.0f;
    prep->flags = segment->flags;
    prep->line = segment->line;
    if (segment->ramp == -SEGMENT_RAMP_ONE || (segment->flags & (SEGMENT_LAST | SEGMENT_DWELL)) != 0)
        prep->flags |= SPAN_AT_REST;
    prep->loaded = true;
    DEBUG(DEBUG_STEP, "segment: id, events", segment->id, prep->events);
}

/* Events of the next stretch: until the speed has changed by 9/8, and at most what the segment has left. */
static uint32_t stretch_events(const struct prep *prep) {
    uint32_t left = prep->events - prep->done;
    float slope = prep->v_sq_slope;
    float change =
        slope > 0.0f ? prep->v_sq * (SPEED_RATIO_SQ - 1.0f) : prep->v_sq * (1.0f / SPEED_RATIO_SQ - 1.0f);
    if (slope == 0.0f || change / slope >= (float)left)
        return left;
    float count = change / slope;
    return count < 1.0f ? 1u : (uint32_t)count;
}

static struct span *span_slot(struct prep *prep) {
    struct span_ring *ring = &prep->step->ring;
    if (ring_free(&ring->index, SPAN_RING_SIZE) == 0)
        return 0;
    struct span *span = &ring->slots[ring->index.head & (SPAN_RING_SIZE - 1)];
    memcpy(span->phase, prep->phase, sizeof span->phase);
    memcpy(span->position, prep->position, sizeof span->position);
    span->line = prep->line;
    span->flags = prep->flags;
    span->negative = prep->negative;
    prep->last_negative = prep->negative;
    return span;
}

/* Time without steps: `ticks` in events that no axis answers. */
static void push_wait(struct prep *prep, struct span *span, uint64_t ticks_q16, bool last) {
    uint32_t events = (uint32_t)(ticks_q16 / (SPAN_MAX_INTERVAL_TICKS << 16)) + 1;
    memset(span->increment, 0, sizeof span->increment);
    span->events = events;
    span->interval_q16 = (uint32_t)(ticks_q16 / events);
    span->delta_q16 = 0;
    span->flags |= last ? SPAN_LAST : 0;
    prep->time_left_q16 -= (uint64_t)span->interval_q16 * events;
    span->ticks = (uint32_t)((uint64_t)span->interval_q16 * events >> 16);
    prep->ticks_made += span->ticks;
    prep->waited_q16 += (uint64_t)span->interval_q16 * events;
    ring_push(&prep->step->ring.index);
}

/* Carry phases and position over the events of a span. */
static void advance(struct prep *prep, uint32_t events) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        unsigned word = span_word(ax), shift = span_shift(ax);
        uint32_t phase = prep->phase[word] >> shift & 0xFFFFu;
        uint32_t sum = phase + events * (prep->increment[word] >> shift & 0xFFFFu);
        int32_t steps = (int32_t)(sum >> SPAN_PHASE_BITS);
        prep->position[ax] += prep->negative >> ax & 1 ? -steps : steps;
        prep->phase[word] += ((sum & (SPAN_PHASE_ONE - 1)) - phase) << shift;
    }
    prep->done += events;
    prep->waited_q16 = 0;
    prep->v_sq += prep->v_sq_slope * (float)events;
    if (prep->v_sq < 0.0f)
        prep->v_sq = 0.0f;
    prep->v = prep->done == prep->events ? prep->v_end : sqrtf(prep->v_sq);
}

/* Intervals linear in the event count that take exactly time_q16 and half way the time of constant
 * acceleration: with vh the speed at half distance, the first half takes n/(va+vh) of 2n/(va+vb), so the
 * first interval is longer than the mean by the part c = 2 (vb-vh)/(va+vh), the last one shorter by the same.
 * @return true when that was too fast for the board and the intervals were made even or longer. */
static bool shape_span(struct span *span, uint32_t events, uint64_t time_q16, float va, float vb,
                       uint64_t least_q16) {
    span->delta_q16 = 0;
    if (events > 1) {
        float vh = sqrtf(0.5f * (va * va + vb * vb));
        float c = va + vh > 0.0f ? 2.0f * (vb - vh) / (va + vh) : 0.0f;
        span->delta_q16 = (int32_t)(-2.0f * c * (float)time_q16 / ((float)events * (float)events));
    }
    int64_t ramp_q16 = (int64_t)span->delta_q16 * (int64_t)((uint64_t)events * (events - 1) / 2);
    span->interval_q16 = (uint32_t)(((int64_t)time_q16 - ramp_q16) / events);
    span->events = events;
    int64_t last_q16 = (int64_t)span->interval_q16 + (int64_t)span->delta_q16 * (int64_t)(events - 1);
    if (span->interval_q16 >= least_q16 && last_q16 >= (int64_t)least_q16)
        return false;
    uint64_t mean_q16 = time_q16 / events;
    span->delta_q16 = 0;
    span->interval_q16 = (uint32_t)(mean_q16 > least_q16 ? mean_q16 : least_q16);
    return true;
}

/* Time of the next `events` events, and the speed after them. */
static uint64_t stretch_time_q16(const struct prep *prep, uint32_t events, float *v_after) {
    if (prep->done + events == prep->events) {
        *v_after = prep->v_end;
        return prep->time_left_q16;
    }
    float v_sq = prep->v_sq + prep->v_sq_slope * (float)events;
    *v_after = sqrtf(v_sq > 0.0f ? v_sq : 0.0f);
    float time_q16 = 65536.0f * 2.0f * (float)events / (prep->v + *v_after);
    if (!(time_q16 < (float)(prep->time_left_q16 + prep->waited_q16)))
        return prep->time_left_q16;
    uint64_t whole_q16 = (uint64_t)time_q16;
    return whole_q16 > prep->waited_q16 ? whole_q16 - prep->waited_q16 : 0;
}

/* Earliest time of the next event after the one before: pulse times, and direction set-up where a line
 * changes. */
static uint64_t least_interval_q16(const struct prep *prep, axis_mask_t negative_before) {
    uint32_t ticks = prep->timing.min_interval_ticks;
    if (prep->negative != negative_before)
        ticks += prep->timing.dir_setup_ticks;
    return (uint64_t)ticks << 16;
}

/* One span of the loaded segment into the ring. @return false: no slot free. */
static bool push_span(struct prep *prep) {
    axis_mask_t negative_before = prep->last_negative;
    struct span *span = span_slot(prep);
    if (span == 0)
        return false;
    if (prep->events == 0) {
        push_wait(prep, span, prep->time_left_q16, true);
        prep->loaded = false;
        return true;
    }
    uint32_t events = stretch_events(prep);
    float v_after;
    uint64_t time_q16 = stretch_time_q16(prep, events, &v_after);
    if (time_q16 / events > (uint64_t)SPAN_MAX_INTERVAL_TICKS << 16 && events > 1) {
        events = 1;
        time_q16 = stretch_time_q16(prep, events, &v_after);
    }
    if (time_q16 / events > (uint64_t)SPAN_MAX_INTERVAL_TICKS << 16) {
        push_wait(prep, span, time_q16 - ((uint64_t)SPAN_MAX_INTERVAL_TICKS << 15), false);
        return true;
    }
    prep->clamped +=
        shape_span(span, events, time_q16, prep->v, v_after, least_interval_q16(prep, negative_before));
    memcpy(span->increment, prep->increment, sizeof span->increment);
    uint64_t used_q16 = (uint64_t)((int64_t)span->interval_q16 * events +
                                   (int64_t)span->delta_q16 * (int64_t)((uint64_t)events * (events - 1) / 2));
    prep->time_left_q16 = used_q16 < prep->time_left_q16 ? prep->time_left_q16 - used_q16 : 0;
    span->ticks = (uint32_t)(used_q16 >> 16);
    prep->ticks_made += span->ticks;
    advance(prep, events);
    prep->loaded = prep->done != prep->events;
    if (!prep->loaded)
        span->flags |= SPAN_LAST;
    ring_push(&prep->step->ring.index);
    return true;
}

bool prep_poll(struct prep *prep) {
    bool made = false;
    uint32_t ahead_ticks = (uint32_t)((uint64_t)prep->timing.timer_hz * PREP_AHEAD_US / 1000000u);
    while (ring_held(&prep->step->ring.index) < 2 ||
           prep->ticks_made - prep->step->ticks_done < ahead_ticks) {
        if (!prep->loaded) {
            const struct segment *segment = segment_ring_peek(prep->in);
            if (segment == 0)
                break;
            load_segment(prep, segment);
            segment_ring_pop(prep->in);
        }
        if (!push_span(prep))
            break;
        made = true;
    }
    step_start(prep->step);
    return made;
}
