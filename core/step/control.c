/* SPDX-License-Identifier: MIT
 * Start and stop of the step ISR. */
#include "step/load.h"

#include <string.h>

void step_init(struct step *step, struct hal_step *hal) {
    memset(step, 0, sizeof *step);
    step->hal = hal;
    for (uint32_t i = 0; i < SPAN_POOL_SIZE; i++)
        step->pool[i].at = i;
    /* As if the ISR had just left it: at rest, and no batch can be joined to it. */
    step->pool[0].next = &step->pool[0];
    step->span = &step->pool[0];
}

void step_start(struct step *step, struct span *span) {
    step->fraction_q16 = 0;
    uint32_t ticks = load_span(step, span);
    /* Before the timer: the first event may be only one interval away. */
    hal_step_direction(step->hal, span->negative);
    step->active = true;
    hal_step_timer_start(step->hal, ticks);
}

void step_halt(struct step *step) {
    step->halted = true;
    step->active = false; /* first: an ISR that comes in between does not start the timer again */
    hal_step_timer_stop(step->hal);
    if (step->beam != STEP_BEAM_NONE)
        hal_step_duty(step->hal, step->dark);
}

/* An ISR on another core may have looked at the rule before: what it writes then lasts until
 * step_tend_beam(). */
void step_set_beam(struct step *step, enum step_beam rule, uint16_t dark) {
    step->dark = dark;
    __atomic_store_n(&step->beam, (uint8_t)rule, __ATOMIC_RELEASE);
    if (rule == STEP_BEAM_DARK)
        hal_step_duty(step->hal, dark);
}

void step_tend_beam(struct step *step, uint16_t rest) {
    uint8_t rule = __atomic_load_n(&step->beam, __ATOMIC_ACQUIRE);
    if (rule == STEP_BEAM_DARK)
        hal_step_duty(step->hal, step->dark);
    else if (rule == STEP_BEAM_ALLOWED && !step->active)
        hal_step_duty(step->hal, rest);
}

bool step_only_waits(const struct step *step) {
    const struct span *span = step->span;
    if (span->next == span) /* it was left: nothing follows */
        return false;
    uint32_t any = 0;
    for (; span != 0; span = span->next)
        for (unsigned word = 0; word < SPAN_WORDS; word++)
            any |= span->increment[word];
    return any == 0;
}

void step_stand(struct step *step, struct span *span) {
    step->span = span;
    /* As the ISR does, and in its order: readers of the position may be in another task or interrupt. */
    __atomic_store_n(&step->spans_done, step->spans_done + 1, __ATOMIC_RELEASE);
    __atomic_store_n(&step->at, span->at, __ATOMIC_RELEASE);
    step->halted = false;
}
