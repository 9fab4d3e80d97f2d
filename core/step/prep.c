/* SPDX-License-Identifier: MIT */
#include "step/prep.h"

#include "base/debug.h"
#include "base/minmax.h"
#include "step/prep_math.h"

#include <math.h>
#include <string.h>

/* A minor axis of a diagonal steps at the events of the dominant one, so it is late by up to half of their
 * interval: below this event rate they are doubled, up to 2^MAX_OVERSAMPLE times. So they are where intervals
 * come near the longest one of a span: a slow step by itself needs two spans. */
#define SMOOTH_EVENT_HZ 32000u
#define MAX_OVERSAMPLE  4u
#define SLOW_TICKS      (SPAN_MAX_INTERVAL_TICKS / 8u)
#define MAX_EVENTS      16383u

/* A rest after the last event of a segment that is shorter than this is left to the next segment. */
#define SHORT_REST_HZ 4000u

/* By how many eighths the speed may change in a span: 9/8, or more near to rest, in steps, because so few of
 * them come in such a span that less than a tenth of their interval is wrong. */
#define EIGHTHS      9u
#define NEAR_EIGHTHS 10u
#define NEAR_STEPS   128u
#define SLOW_EIGHTHS 12u
#define SLOW_STEPS   16u
#define FAR_EVENTS   1e6f

/* Where a laser follows the speed, a span changes its duty by this part or lasts this time, whichever makes
 * it longer. It has the mean, so it is wrong by half of the part. A long stop needs a hundred such spans, and
 * the pool must hold two of them. */
#define DUTY_PART    0.05f
#define DUTY_LEAST_S 0.0005f
#define DUTY_COARSE  4u /* so many times a part, in a stop for a late task */

/* Segments and spans, together, that one call cuts: the watchdog and the inputs are looked at in between. */
#define CUT_AT_ONCE 11u

/* So near to the middle between two events, in events, a place counts as the middle: it was rounded. */
#define TIE 0.125f

void prep_init(struct prep *prep, struct segment_queue *in, struct step *step,
               const struct prep_timing *timing) {
    memset(prep, 0, sizeof *prep);
    prep->in = in, prep->step = step, prep->timing = *timing;
    prep_reset(prep, (const int32_t[AXIS_COUNT]){0});
}

/* ---- spans and marks ---- */

static void give_back(struct prep *prep, struct span *span) {
    span->made = 0;
    span->after = prep->free;
    prep->free = span;
}

static void give_chain_back(struct prep *prep, struct span *span) {
    while (span != 0) {
        struct span *after = span->after;
        give_back(prep, span);
        span = after;
    }
}

static void keep_mark(struct prep *prep, uint32_t place) {
    struct span *span = prep->newest != 0 ? prep->newest : prep->base;
    prep->marks[place] = (struct prep_mark){.carry = prep->carry, .span = span, .made = span->made};
}

#define STORE(to, value) __atomic_store_n(&(to), (value), __ATOMIC_RELEASE)

/* Readers of the position may still look at what the span was before (step/position.c): who sees any of this
 * sees that the ISR has left it. */
static void fill_span(struct prep *prep, struct span *span, const struct span *from) {
    for (unsigned word = 0; word < SPAN_WORDS; word++) {
        STORE(span->phase[word], from->phase[word]);
        STORE(span->increment[word], from->increment[word]);
    }
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        STORE(span->position[ax], from->position[ax]);
    STORE(span->events, from->events);
    STORE(span->flags, from->flags);
    STORE(span->negative, from->negative);
    STORE(span->line, from->line);
    STORE(span->v_um_s, from->v_um_s);
    STORE(span->duty, from->duty);
    span->interval_q16 = from->interval_q16;
    span->delta_q16 = from->delta_q16;
    span->end_us = from->end_us;
    span->at = (span->at & 0xFFFFu) | (0u - from->events) << 16;
    span->after = 0;
    STORE(span->next, (struct span *)0);
    span->made = ++prep->made != 0 ? prep->made : ++prep->made;
}

/* A span without events, which the ISR has left: only its position counts. */
static void put_stand(struct prep *prep, struct span *span) {
    struct span from = {.negative = prep->carry.last_negative};
    memcpy(from.position, prep->carry.position, sizeof from.position);
    fill_span(prep, span, &from);
    STORE(span->next, span);
}

void prep_reset(struct prep *prep, const int32_t position[AXIS_COUNT]) {
    struct span *pool = prep->step->pool;
    /* a reader may still look at the present span */
    struct span *stand = step_index(prep->step) == 0 ? &pool[1] : &pool[0];
    prep->free = 0;
    for (struct span *span = &pool[SPAN_POOL_SIZE]; span-- != pool;)
        if (span != stand)
            give_back(prep, span);
    prep->carry = (struct prep_carry){.last_negative = prep->carry.last_negative};
    memcpy(prep->carry.position, position, sizeof prep->carry.position);
    put_stand(prep, stand);
    prep->base = prep->oldest = stand;
    prep->first = prep->newest = 0;
    prep->cuts = false;
    keep_mark(prep, QUEUE_RESET_MARK);
    step_stand(prep->step, stand);
    prep->in->now_us = 0;
    if (segment_queue_is_pending(prep->in))
        segment_queue_answer(prep->in, QUEUE_PASSED);
}

/* ---- segments -> spans ---- */

/* What one axis does in a segment. */
struct travel {
    uint32_t steps;
    uint32_t travel; /* in 1/256 step */
    uint32_t phase;  /* at the start, 1/256 step past the last one */
};

/* Phase before the first event, and increment, so that exactly `steps` overflows come in the segment's events
 * (span.h). Rounding is corrected where it shows least: by the phase, and where that cannot, by the
 * increment.
 */
static void set_axis(struct prep *prep, unsigned axis, uint32_t steps, int32_t phase, uint32_t increment) {
    const int32_t one = SPAN_PHASE_ONE, events = (int32_t)prep->events;
    int32_t step = (int32_t)(increment < SPAN_PHASE_ONE ? increment : SPAN_PHASE_ONE);
    int32_t least = (int32_t)(steps << SPAN_PHASE_BITS), most = least + one - 1;
    phase = phase > 0 ? (phase < one ? phase : one - 1) : 0;
    int32_t total = phase + events * step;
    if (total < least) {
        int32_t beyond = least - total - (one - 1 - phase);
        step += beyond > 0 ? (beyond + events - 1) / events : 0;
        total = phase + events * step;
        phase += total < least ? least - total : 0;
    } else if (total > most) {
        int32_t beyond = total - most - phase;
        step -= beyond > 0 ? (beyond + events - 1) / events : 0;
        total = phase + events * step;
        phase -= total > most ? total - most : 0;
    }
    prep->phase[span_word(axis)] |= (uint32_t)phase << span_shift(axis);
    prep->increment[span_word(axis)] |= (uint32_t)step << span_shift(axis);
}

/* Power of two by which events are multiplied: of the speed alone, so that the events of a steady motion are
 * evenly spaced across segments. */
static unsigned oversample(const struct prep *prep, uint32_t travel, bool diagonal, uint32_t ticks) {
    unsigned shift = 0;
    uint32_t enough =
                 diagonal ? prep_scale(ticks, SMOOTH_EVENT_HZ, prep->timing.timer_hz) : ticks / SLOW_TICKS,
             needed = ticks / (SPAN_MAX_INTERVAL_TICKS / 2u);
    /* Twice the time that pulses need: the end of a ramp is twice as fast as its mean. */
    const uint64_t least = (uint64_t)prep->timing.min_interval_ticks * 2;
    while (travel << shift < (shift < MAX_OVERSAMPLE ? enough : needed) << 8 &&
           travel << (shift + 1) <= MAX_EVENTS << 8 &&
           least * (travel << (shift + 1)) <= (uint64_t)ticks << 8)
        shift++;
    return shift;
}

/* The axes' part of a segment. @return the axis whose steps are the events: the one with most of them */
static unsigned read_axes(struct prep *prep, const struct segment *segment, struct travel axes[AXIS_COUNT],
                          bool *diagonal) {
    unsigned dominant = 0, moving = 0;
    prep->negative = prep->carry.last_negative;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        int32_t steps = segment->steps[ax];
        struct travel *axis = &axes[ax];
        axis->steps = (uint32_t)(steps < 0 ? -steps : steps);
        if (steps == 0)
            continue;
        axis->phase = segment->phase[ax];
        axis->travel = axis->steps * 256u + segment->phase_end[ax] - axis->phase;
        axis_mask_t bit = (axis_mask_t)(1u << ax);
        prep->negative = (axis_mask_t)(steps < 0 ? prep->negative | bit : prep->negative & ~bit);
        moving++;
        const struct travel *most = &axes[dominant];
        if (axis->steps > most->steps || (axis->steps == most->steps && axis->travel > most->travel))
            dominant = ax;
    }
    *diagonal = moving > 1;
    return dominant;
}

static void load_motion(struct prep *prep, const struct segment *segment, uint32_t ticks) {
    struct travel axes[AXIS_COUNT];
    bool diagonal;
    unsigned dominant = read_axes(prep, segment, axes, &diagonal);
    memset(prep->phase, 0, sizeof prep->phase);
    memset(prep->increment, 0, sizeof prep->increment);
    prep->events = prep->done = 0;
    if (axes[dominant].steps == 0)
        return;
    unsigned shift = oversample(prep, axes[dominant].travel, diagonal, ticks);
    prep->carry.alone |= shift != prep->carry.shift;
    prep->carry.shift = (uint8_t)shift;
    prep->falls = segment->steps[dominant] < 0;
    uint32_t travel = axes[dominant].travel << shift; /* in 1/256 event, as all this */
    uint32_t past = axes[dominant].phase << shift & 255u;
    prep->events = (past + travel) >> 8;
    prep->first_event = (float)(256u - past) * (1.0f / 256.0f);
    float one = (float)SPAN_PHASE_ONE / (float)travel;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        if (axes[ax].steps == 0)
            continue;
        uint32_t increment = (uint32_t)((float)axes[ax].travel * one + 0.5f);
        int32_t phase =
            (int32_t)(axes[ax].phase * (SPAN_PHASE_ONE / 256u)) - (int32_t)(increment * past >> 8);
        if (ax != dominant) /* at the nearest event, not at the next one */
            phase += (int32_t)(increment >> 1);
        set_axis(prep, ax, axes[ax].steps, phase, increment);
    }
    float events = prep->way = (float)travel * (1.0f / 256.0f);
    float mean = ticks > 0 ? events / (float)ticks : 0.0f;
    float ramp = (float)segment->ramp * (1.0f / (float)SEGMENT_RAMP_ONE);
    prep->v = mean * (1.0f - ramp);
    prep->v_sq_slope = 4.0f * ramp * mean * mean / events; /* ((1 + r)^2 - (1 - r)^2) vm^2 over the way */
}

/* Into how many spans a segment is cut at least, for the laser: as a change of speed per span. */
static void set_duty(struct prep *prep, const uint16_t duty[2]) {
    float from = (float)duty[0], to = (float)duty[1];
    prep->duty[0] = duty[0];
    prep->duty[1] = duty[1];
    prep->dv_most = 0.0f;
    if (from == to || prep->events == 0)
        return;
    float time_s = (float)(prep->carry.duration_q16 >> 16) / (float)prep->timing.timer_hz;
    const uint32_t coarse = prep->cut + prep->in->tail >= prep->in->count ? DUTY_COARSE : 1u;
    float parts = fabsf(to - from) / (DUTY_PART * max_f(from, to));
    parts = max_f(min_f(parts, time_s / DUTY_LEAST_S) / (float)coarse, 1.0f);
    float v_sq = prep->v * prep->v, way = prep->v_sq_slope * (float)prep->events;
    prep->dv_most = fabsf(sqrtf(max_f(v_sq + way, 0.0f)) - prep->v) / parts;
}

/* Where S changes next: a span begins with the last event of the one before, so with the event nearest to
 * that place. Places on a full step lie between two events; both ways along a row it is the lower one. */
static void find_change(struct prep *prep) {
    if (prep->power_left == 0)
        return;
    float at = (float)prep->power->at * (1.0f / 65536.0f) * prep->way - prep->first_event;
    at += prep->falls ? 1.5f + TIE : 1.5f - TIE;
    prep->power_events = at > 0.0f ? (uint32_t)at : 0u;
}

/* @return events until S changes, above 0; what has no event of its own is not shown */
static uint32_t events_to_change(struct prep *prep) {
    while (prep->power_left > 0 && prep->power_events <= prep->done) {
        set_duty(prep, prep->power->duty);
        prep->power = prep->power == &prep->start ? prep->listed : prep->power + 1;
        prep->power_left--;
        find_change(prep);
    }
    return prep->power_left > 0 ? prep->power_events - prep->done : UINT32_MAX;
}

static void load_duty(struct prep *prep, const struct segment *segment) {
    const struct segment_power *listed = &prep->in->power[segment->power_first];
    bool late = prep->carry.late && (segment->flags & SEGMENT_CUT) != 0;
    prep->power = prep->listed = listed;
    prep->power_left = segment->power_count;
    set_duty(prep, segment->duty);
    if (late) {
        prep->start = (struct segment_power){.duty = {segment->duty[0], segment->duty[1]}};
        set_duty(prep, (const uint16_t[2]){prep->carry.late_duty, prep->carry.late_duty});
        prep->power = &prep->start;
        prep->power_left++;
        prep->power_events = 1;
        return;
    }
    find_change(prep);
}

static void load_segment(struct prep *prep, const struct segment *segment) {
    /* whole ticks, the rest carried: durations never drift */
    uint64_t scaled = (uint64_t)segment->duration_ns * prep->timing.timer_hz + prep->carry.tick_remainder;
    uint32_t ticks = prep_divide_by_ns(scaled, &prep->carry.tick_remainder);
    prep->carry.spent_q16 -= prep->carry.duration_q16;
    prep->carry.duration_q16 = (int64_t)((uint64_t)ticks << 16);
    load_motion(prep, segment, ticks);
    load_duty(prep, segment);
    prep->flags = segment->flags;
    prep->line = segment->line;
    prep->end_us = segment->end_us;
    prep->v_um_s = (uint32_t)(segment->v_mm_s * 1e3f);
    bool last = prep->cut + 1 == prep->in->count;
    if (last || segment->ramp == -SEGMENT_RAMP_ONE || (segment->flags & (SEGMENT_LAST | SEGMENT_DWELL)) != 0)
        prep->flags |= SPAN_AT_REST;
    DEBUG(DEBUG_STEP, "segment: id, events", segment->id, prep->events);
}

/* Speed at a distance from the start of the segment, events per tick. */
static float speed_at(const struct prep *prep, float distance) {
    float v_sq = prep->v * prep->v + prep->v_sq_slope * distance;
    return sqrtf(v_sq > 0.0f ? v_sq : 0.0f);
}

/* Distance of the last event that was put into a span. */
static float distance_done(const struct prep *prep) {
    return prep->done > 0 ? prep->first_event + (float)(prep->done - 1) : 0.0f;
}

/* How much the square of the speed may change in a span that begins with this one. */
static float most_change(const struct prep *prep, float v_sq, float slope) {
    const uint32_t events = (uint32_t)min_f(v_sq / fabsf(slope), FAR_EVENTS); /* from rest */
    const uint32_t steps = events >> prep->carry.shift;
    const uint32_t eighths = steps < SLOW_STEPS ? SLOW_EIGHTHS : steps < NEAR_STEPS ? NEAR_EIGHTHS : EIGHTHS;
    const float ratio = (float)eighths * 0.125f, ratio_sq = ratio * ratio;
    return slope > 0.0f ? v_sq * (ratio_sq - 1.0f) : v_sq * (1.0f / ratio_sq - 1.0f);
}

/* Events of the next stretch: until the speed has changed by that, and at most what the segment has left. */
static uint32_t stretch_events(const struct prep *prep) {
    uint32_t left = prep->events - prep->done;
    float slope = prep->v_sq_slope, from = distance_done(prep);
    float v_sq = prep->v * prep->v + slope * from;
    if (slope == 0.0f)
        return left;
    float change = most_change(prep, v_sq, slope);
    if (prep->dv_most > 0.0f) {
        float v = sqrtf(max_f(v_sq, 0.0f)),
              to = slope > 0.0f ? v + prep->dv_most : max_f(v - prep->dv_most, 0.0f);
        change = slope > 0.0f ? min_f(change, to * to - v_sq) : max_f(change, to * to - v_sq);
    }
    float to_last = prep->first_event + (float)(prep->events - 1) - from;
    if (change / slope >= to_last)
        return left;
    float count = from + change / slope - prep->first_event - (float)prep->done + 1.0f;
    return count < 1.0f ? 1u : (uint32_t)count;
}

/* What all spans of a segment have in common. */
static struct span new_span(struct prep *prep) {
    struct span span = {.line = prep->line,
                        .flags = prep->flags,
                        .negative = prep->negative,
                        .end_us = prep->end_us,
                        .v_um_s = prep->v_um_s};
    memcpy(span.phase, prep->phase, sizeof span.phase);
    memcpy(span.position, prep->carry.position, sizeof span.position);
    prep->carry.last_negative = prep->negative;
    return span;
}

/* Append to the batch's chain; prep->free is not NULL. */
static void append(struct prep *prep, const struct span *from) {
    struct span *span = prep->free;
    prep->free = span->after;
    fill_span(prep, span, from);
    if (prep->newest == 0) {
        prep->first = span;
    } else {
        prep->newest->after = span;
        __atomic_store_n(&prep->newest->next, span, __ATOMIC_RELEASE);
    }
    prep->newest = span;
}

static uint16_t register_for(const struct prep *prep, uint32_t power) {
    return duty_to_register(&prep->timing.pwm, duty_for_power(&prep->timing.curve, power));
}

/* In counts of the PWM, at the middle of the next ticks of the segment: its duty is linear in time. */
static uint16_t span_duty(const struct prep *prep, uint64_t ticks_q16) {
    if (prep->duty[0] == prep->duty[1])
        return register_for(prep, prep->duty[0]);
    float from = (float)prep->duty[0], to = (float)prep->duty[1];
    float middle_q16 = (float)prep->carry.spent_q16 + 0.5f * (float)ticks_q16;
    float part = middle_q16 / (float)prep->carry.duration_q16;
    float duty = from + (to - from) * min_f(max_f(part, 0.0f), 1.0f);
    return register_for(prep, (uint32_t)duty);
}

/* Time without steps, in events that no axis answers. */
static void push_wait(struct prep *prep, uint64_t ticks_q16) {
    struct span span = new_span(prep);
    span.duty = span_duty(prep, ticks_q16);
    span.events = (uint32_t)(ticks_q16 / (SPAN_MAX_INTERVAL_TICKS << 16)) + 1;
    span.interval_q16 = (uint32_t)(ticks_q16 / span.events);
    prep->carry.spent_q16 += (int64_t)((uint64_t)span.interval_q16 * span.events);
    prep->carry.alone = true;
    append(prep, &span);
}

/* Carry phases and position over the events of a span. */
static void advance(struct prep *prep, uint32_t events) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        unsigned word = span_word(ax), shift = span_shift(ax);
        uint32_t increment = prep->increment[word] >> shift & 0xFFFFu;
        if (increment == 0)
            continue;
        uint32_t phase = prep->phase[word] >> shift & 0xFFFFu, sum = phase + events * increment;
        int32_t steps = (int32_t)(sum >> SPAN_PHASE_BITS);
        prep->carry.position[ax] += prep->negative >> ax & 1 ? -steps : steps;
        prep->phase[word] += ((sum & (SPAN_PHASE_ONE - 1)) - phase) << shift;
    }
    prep->done += events;
}

/* Time of the next `events` events, and the speed at the last of them. */
static uint64_t stretch_time_q16(const struct prep *prep, uint32_t events, float *v_after) {
    float distance = prep->first_event + (float)(prep->done + events - 1);
    *v_after = speed_at(prep, distance);
    float time_q16 = 65536.0f * 2.0f * distance / (prep->v + *v_after);
    int64_t at_q16 =
        time_q16 < (float)prep->carry.duration_q16 ? (int64_t)time_q16 : prep->carry.duration_q16;
    return at_q16 > prep->carry.spent_q16 ? (uint64_t)(at_q16 - prep->carry.spent_q16) : 0;
}

/* Earliest time of the next event after the one before: pulse times, and direction set-up where a line
 * changes, before the first event only. */
static uint64_t least_interval_q16(const struct prep *prep, axis_mask_t negative_before) {
    uint32_t ticks = prep->timing.min_interval_ticks;
    if (prep->negative != negative_before)
        ticks += prep->timing.dir_setup_ticks;
    return (uint64_t)ticks << 16;
}

/* After the last event: rest for what is left, or let the next segment's first event come so much later. A
 * long rest is waited here, all but a bit. A coming to rest without an event of its own gets one, however
 * short: so a batch has a span at its end. @return false: no span is free */
static bool end_segment(struct prep *prep) {
    int64_t left_q16 = prep->carry.duration_q16 - prep->carry.spent_q16;
    bool at_rest = (prep->flags & SPAN_AT_REST) != 0; /* what begins there begins with its own duty */
    prep->carry.late = !at_rest && prep->power_left > 0 && prep->power_events > prep->events;
    prep->carry.late_duty = prep->duty[1];
    int64_t least_q16 = (int64_t)prep->timing.min_interval_ticks << 16;
    if (at_rest && prep->events == 0 && left_q16 < least_q16)
        left_q16 = least_q16;
    int64_t keep_q16 = at_rest ? 0 : 2 * least_q16;
    int64_t long_q16 = at_rest ? 65536 : (int64_t)(prep->timing.timer_hz / SHORT_REST_HZ) << 16;
    if (left_q16 - keep_q16 >= long_q16) {
        if (prep->free == 0)
            return false;
        push_wait(prep, (uint64_t)(left_q16 - keep_q16));
    }
    return true;
}

/* The next stretch of the segment; a span is free. */
static void push_stretch(struct prep *prep) {
    axis_mask_t negative_before = prep->carry.last_negative;
    uint32_t to_change = events_to_change(prep);
    uint32_t events = prep->carry.alone ? 1u : stretch_events(prep);
    events = events < to_change ? events : to_change;
    float v_before = speed_at(prep, distance_done(prep)), v_after;
    uint64_t time_q16 = stretch_time_q16(prep, events, &v_after);
    const uint64_t least_q16 = least_interval_q16(prep, negative_before);
    const bool turns = prep->negative != negative_before && time_q16 < least_q16 * events;
    if (events > 1 && (turns || prep_is_slow(time_q16, events))) {
        events = 1;
        time_q16 = stretch_time_q16(prep, events, &v_after);
    }
    if (prep_is_slow(time_q16, events)) {
        push_wait(prep, time_q16 - ((uint64_t)SPAN_MAX_INTERVAL_TICKS << 15));
        return;
    }
    struct span span = new_span(prep);
    prep->clamped += prep_shape_span(&span, events, time_q16, v_before, v_after, least_q16);
    memcpy(span.increment, prep->increment, sizeof span.increment);
    span.duty = span_duty(prep, time_q16);
    prep->carry.spent_q16 += (int64_t)span.interval_q16 * events +
                             (int64_t)span.delta_q16 * (int64_t)((uint64_t)events * (events - 1) / 2);
    prep->carry.alone = false;
    append(prep, &span);
    advance(prep, events);
}

enum cut { CUT_DONE, CUT_LATER, CUT_LARGE };

/* Cut the loaded segment. @param left  spans that may be made now @return LARGE: no span is free */
static enum cut cut_segment(struct prep *prep, uint32_t *left) {
    while (prep->done < prep->events) {
        if (*left == 0)
            return CUT_LATER;
        if (prep->free == 0)
            return CUT_LARGE;
        push_stretch(prep);
        --*left;
    }
    return end_segment(prep) ? CUT_DONE : CUT_LARGE;
}

/* ---- batches ---- */

/* @return true when the ISR has left any */
static bool reclaim(struct prep *prep) {
    const struct span *current = &prep->step->pool[step_index(prep->step)];
    bool any = prep->oldest != current;
    while (prep->oldest != current) {
        struct span *left = prep->oldest;
        prep->oldest = left->after;
        prep->segments += prep->oldest->end_us != left->end_us;
        give_back(prep, left);
    }
    __atomic_store_n(&prep->in->now_us, current->end_us, __ATOMIC_RELAXED);
    return any;
}

/* The mark that the batch continues at. @return false: the ISR has left its span, and it is free */
static bool mark_is_there(const struct prep *prep) {
    const struct prep_mark *mark = &prep->marks[prep->in->from];
    return mark->span->made == mark->made;
}

static void begin_batch(struct prep *prep) {
    const struct prep_mark *mark = &prep->marks[prep->in->from];
    prep->carry = mark->carry;
    prep->base = mark->span;
    prep->first = prep->newest = 0;
    prep->cut = 0;
    prep->cuts = true;
    prep->loaded = false;
}

static void answer(struct prep *prep, enum queue_answer given) {
    if (prep->cuts && given != QUEUE_TAKEN)
        give_chain_back(prep, prep->first);
    prep->cuts = false;
    segment_queue_answer(prep->in, given);
}

/* The whole chain is there: swap it in, or start it from rest. @return false: the ISR has continued */
static bool join(struct prep *prep) {
    struct span *base = prep->base, *old = base->after, *expected = old;
    if (__atomic_compare_exchange_n(&base->next, &expected, prep->first, false, __ATOMIC_ACQ_REL,
                                    __ATOMIC_ACQUIRE)) {
        base->after = prep->first;
        give_chain_back(prep, old);
        return true;
    }
    if (old != 0 || prep->step->active)
        return false;
    base->after = prep->first;
    step_start(prep->step, prep->first);
    return true;
}

/* Some of the batch; when all of it is cut, it is joined. */
static void cut_batch(struct prep *prep) {
    const struct segment_queue *in = prep->in;
    uint32_t left = CUT_AT_ONCE;
    for (; prep->cut < in->count; prep->cut++, prep->loaded = false) {
        const struct segment *segment = &in->slots[prep->cut];
        if (left == 0)
            return;
        if (!prep->loaded)
            load_segment(prep, segment), left--;
        prep->loaded = true;
        enum cut cut = cut_segment(prep, &left);
        if (cut == CUT_LATER)
            return;
        if (cut == CUT_LARGE) {
            answer(prep, QUEUE_LARGE);
            return;
        }
        if (segment->mark != 0)
            keep_mark(prep, segment->mark - 1u);
    }
    answer(prep, join(prep) ? QUEUE_TAKEN : QUEUE_PASSED);
}

void prep_tend_beam(const struct prep *prep) {
    if (prep->step->beam == STEP_BEAM_NONE)
        return;
    uint32_t duty = __atomic_load_n(&prep->rest_duty, __ATOMIC_RELAXED);
    step_tend_beam(prep->step, register_for(prep, duty));
}

bool prep_poll(struct prep *prep) {
    if (prep->step->halted)
        return false;
    bool any = reclaim(prep);
    if (!segment_queue_is_pending(prep->in))
        return any;
    if (!mark_is_there(prep)) {
        answer(prep, QUEUE_PASSED);
        return true;
    }
    if (!prep->cuts)
        begin_batch(prep);
    cut_batch(prep);
    return true;
}
