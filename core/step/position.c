/* SPDX-License-Identifier: MIT
 * Position in closed form from the span being stepped: no counter can ever differ from the pulses.
 *
 * The ISR shows what it does in one word, step.at: which span, and how many of its events are left. A reader
 * copies the span of that word and looks again. A span is written again only after the ISR has left it, and
 * then spans_done counts, before the ISR writes the next `at`. So:
 *
 *     spans_done = n, at = (span, left), [copy], spans_done = n, span still the same
 *
 * means that no span was left between both looks, and the copy is that of the span of `at`, whatever the ISR
 * does meanwhile and wherever it is interrupted: between any two of its stores the word is the span before
 * with nothing left, or the next one with all left, which are the same position. The reader never waits for
 * the ISR; it looks again only when the ISR has continued. */
#include "step/isr.h"

/* Acquire loads keep their order, so the second look comes after the span was read. */
#define LOAD(field) __atomic_load_n(&(field), __ATOMIC_ACQUIRE)

static void span_copy(const struct span *span, struct step_now *now, uint32_t phase[SPAN_WORDS]) {
    for (unsigned word = 0; word < SPAN_WORDS; word++) {
        phase[word] = LOAD(span->phase[word]);
        now->increment[word] = LOAD(span->increment[word]);
    }
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        now->position[ax] = LOAD(span->position[ax]);
    now->negative = LOAD(span->negative);
    now->flags = LOAD(span->flags);
    now->line = LOAD(span->line);
    now->v_um_s = LOAD(span->v_um_s);
    now->duty = LOAD(span->duty);
}

static void add_events(struct step_now *now, const uint32_t phase[SPAN_WORDS], uint32_t done) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        uint32_t begin = phase[span_word(ax)] >> span_shift(ax) & 0xFFFFu;
        uint32_t increment = now->increment[span_word(ax)] >> span_shift(ax) & 0xFFFFu;
        /* No overflow: done < 2^16 and increment <= 2^15, so the sum is below 2^32. */
        int32_t steps = (int32_t)((begin + done * increment) >> SPAN_PHASE_BITS);
        now->position[ax] += now->negative >> ax & 1 ? -steps : steps;
    }
}

void step_look(const struct step *step, struct step_now *now) {
    uint32_t phase[SPAN_WORDS], count, at, again, done;
    do {
        count = __atomic_load_n(&step->spans_done, __ATOMIC_ACQUIRE);
        at = __atomic_load_n(&step->at, __ATOMIC_ACQUIRE);
        const struct span *span = &step->pool[at & 0xFFFFu];
        span_copy(span, now, phase);
        now->left = span_left(at);
        done = LOAD(span->events) - now->left;
        again = LOAD(step->at);
    } while ((again & 0xFFFFu) != (at & 0xFFFFu) || LOAD(step->spans_done) != count);
    add_events(now, phase, done);
}

void step_position(const struct step *step, int32_t out[AXIS_COUNT]) {
    struct step_now now;
    step_look(step, &now);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        out[ax] = now.position[ax];
}

void step_probe_position(const struct step *step, int32_t out[AXIS_COUNT]) {
    struct step_now now;
    uint32_t phase[SPAN_WORDS];
    span_copy(&step->probe_span, &now, phase);
    add_events(&now, phase, step->probe_done);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        out[ax] = now.position[ax];
}
