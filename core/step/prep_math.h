/* SPDX-License-Identifier: MIT
 * Arithmetic of prep (step/prep.h): divisions, and the intervals of a span. [motion side]
 *
 * The chips divide words in hardware and longer numbers in a loop of hundreds of instructions. The divisions
 * here take an estimate and correct it, so the results are those of a division. */
#ifndef WIFICNC_STEP_PREP_MATH_H
#define WIFICNC_STEP_PREP_MATH_H

#include "base/minmax.h"
#include "step/span.h"

#include <math.h>
#include <stdbool.h>

#define PREP_NS_PER_S 1000000000u

/** n / 1e9; *rest: what is left. @param n  below 2^61 */
static inline uint32_t prep_divide_by_ns(uint64_t n, uint64_t *rest) {
    uint32_t most = (uint32_t)(n >> 29);                         /* 2^29/1e9 is 2305843009/2^32: */
    uint32_t q = (uint32_t)((uint64_t)most * 2305843009u >> 32); /* at most 2 too small */
    for (*rest = n - (uint64_t)q * PREP_NS_PER_S; *rest >= PREP_NS_PER_S; *rest -= PREP_NS_PER_S)
        q++;
    return q;
}

/** n / d, below 2^32. @param n  below 2^48 @param d  1 .. 16383 */
static inline uint32_t prep_divide(uint64_t n, uint32_t d) {
    float about = (float)(uint32_t)(n >> 16) * 65536.0f / (float)d;
    uint32_t q = (uint32_t)min_f(about, 4294967040.0f);
    int32_t rest = (int32_t)(n - (uint64_t)q * d), more = rest / (int32_t)d;
    more -= rest % (int32_t)d < 0;
    return q + (uint32_t)more;
}

/** a b / d. @param a  below 2^32 @param b  and what comes out below 2^20 */
static inline uint32_t prep_scale(uint32_t a, uint32_t b, uint32_t d) {
    uint64_t product = (uint64_t)a * b;
    uint32_t q = (uint32_t)((float)a * ((float)b / (float)d));
    q -= q > 0 && (uint64_t)q * d > product;
    q += (uint64_t)(q + 1u) * d <= product;
    return q;
}

/** Their mean interval is too long for a span. */
static inline bool prep_is_slow(uint64_t time_q16, uint32_t events) {
    return time_q16 >= (((uint64_t)SPAN_MAX_INTERVAL_TICKS << 16) + 1u) * events;
}

/** Intervals linear in the event count that take exactly time_q16 and half way the time of constant
 * acceleration: with vh the speed at half distance, the first half takes n/(va+vh) of 2n/(va+vb), so the
 * first interval is longer than the mean by the part c = 2 (vb-vh)/(va+vh), the last one shorter by the same.
 * @return true when that was too fast for the board and the intervals were made even or longer. */
static inline bool prep_shape_span(struct span *span, uint32_t events, uint64_t time_q16, float va, float vb,
                                   uint64_t least_q16) {
    span->delta_q16 = 0;
    if (events > 1) {
        float vh = sqrtf(0.5f * (va * va + vb * vb));
        float c = va + vh > 0.0f ? 2.0f * (vb - vh) / (va + vh) : 0.0f;
        span->delta_q16 = (int32_t)(-2.0f * c * (float)time_q16 / ((float)events * (float)events));
    }
    int64_t ramp_q16 = (int64_t)span->delta_q16 * (int64_t)((uint64_t)events * (events - 1) / 2);
    span->interval_q16 = prep_divide(time_q16 - (uint64_t)ramp_q16, events);
    span->events = events;
    int64_t last_q16 = (int64_t)span->interval_q16 + (int64_t)span->delta_q16 * (int64_t)(events - 1);
    if (span->interval_q16 >= least_q16 && last_q16 >= (int64_t)least_q16)
        return false;
    uint64_t mean_q16 = time_q16 / events;
    span->delta_q16 = 0;
    span->interval_q16 = (uint32_t)(mean_q16 > least_q16 ? mean_q16 : least_q16);
    return true;
}

#endif
