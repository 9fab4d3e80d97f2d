/* SPDX-License-Identifier: MIT
 * One value per axis in one variable: lane n is axis n, lanes above CORE_AXES are 0. [any]
 *
 * GCC's and Clang's vector types: a formula reads as on paper, and a compiler with vector registers uses
 * them. A scalar in an expression with a vec counts for every lane. */
#ifndef WIFICNC_MOTION_VEC_H
#define WIFICNC_MOTION_VEC_H

#include "base/axis.h"
#include "base/minmax.h"
#include "hal/core_sizes.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

/* How a vec is passed depends on the machine's vector registers, so it never is: all of this is inlined. */
#define VEC_INLINE static inline __attribute__((always_inline))
#ifdef __GNUC__
#pragma GCC diagnostic ignored "-Wpsabi"
#endif

/** A chip without vector registers pays for each lane. */
#define VEC_LANES (CORE_AXES <= 4 ? 4 : 8)
_Static_assert(CORE_AXES >= 1 && CORE_AXES <= (int)AXIS_COUNT, "axes of the board (hal/core_sizes.h)");

/* Lanes that only wide vectors have; in others the first one takes their place. */
enum { VEC_WIDE = CORE_AXES > 4, VEC_FIFTH = VEC_WIDE ? 4 : 0, VEC_SIXTH = VEC_WIDE ? 5 : 0 };

/* Alignment of a float, so that a struct with one may live anywhere. */
typedef float vec __attribute__((vector_size(4 * VEC_LANES), aligned(4)));
/** A comparison's result: all bits of a lane set, or none. */
typedef int32_t vec_mask __attribute__((vector_size(4 * VEC_LANES), aligned(4)));

/** The others are 0. */
VEC_INLINE void vec_store(vec v, float a[AXIS_COUNT]) {
    a[0] = v[0], a[1] = v[1], a[2] = v[2], a[3] = v[3];
    a[4] = VEC_WIDE ? v[VEC_FIFTH] : 0.0f;
    a[5] = VEC_WIDE ? v[VEC_SIXTH] : 0.0f;
}

VEC_INLINE float vec_dot(vec a, vec b) {
    vec p = a * b;
    float sum = (p[0] + p[1]) + (p[2] + p[3]);
    return VEC_WIDE ? sum + (p[VEC_FIFTH] + p[VEC_SIXTH]) : sum;
}

VEC_INLINE float vec_length(vec a) {
    return sqrtf(vec_dot(a, a));
}

VEC_INLINE vec vec_abs(vec a) {
    return (vec)((vec_mask)a & INT32_MAX);
}

/** a where the mask is set, b elsewhere. */
VEC_INLINE vec vec_select(vec_mask mask, vec a, vec b) {
    return (vec)((mask & (vec_mask)a) | (~mask & (vec_mask)b));
}

/** Lanes in which a is less than b; both are finite. A comparison of wide vectors would be taken apart. */
VEC_INLINE vec_mask vec_is_less(vec a, vec b) {
    if (!CORE_VECTORS)
        return a < b;
    /* cppcheck-suppress shiftTooManyBitsSigned ; arithmetic in GCC and clang: each lane becomes its sign */
    return (vec_mask)(a - b) >> 31;
}

/** The smaller of each two lanes, and the greater. With vector registers the loops become an instruction. */
VEC_INLINE vec vec_lower(vec a, vec b) {
    if (!CORE_VECTORS)
        return vec_select(a < b, a, b);
    vec lower = a;
    for (unsigned lane = 0; lane < VEC_LANES; lane++)
        lower[lane] = a[lane] < b[lane] ? a[lane] : b[lane];
    return lower;
}
VEC_INLINE vec vec_higher(vec a, vec b) {
    if (!CORE_VECTORS)
        return vec_select(a > b, a, b);
    vec higher = a;
    for (unsigned lane = 0; lane < VEC_LANES; lane++)
        higher[lane] = a[lane] > b[lane] ? a[lane] : b[lane];
    return higher;
}

/** a with its sign turned round where b is negative. */
VEC_INLINE vec vec_turn_sign(vec a, vec b) {
    return (vec)((vec_mask)a ^ ((vec_mask)b & INT32_MIN));
}

/** Greatest and least lane of all axes. */
VEC_INLINE float vec_most(vec a) {
    float most = max_f(max_f(a[0], a[1]), max_f(a[2], a[3]));
    return VEC_WIDE ? max_f(most, max_f(a[VEC_FIFTH], a[VEC_SIXTH])) : most;
}
VEC_INLINE float vec_least(vec a) {
    float least = min_f(min_f(a[0], a[1]), min_f(a[2], a[3]));
    return VEC_WIDE ? min_f(least, min_f(a[VEC_FIFTH], a[VEC_SIXTH])) : least;
}

/** Greatest s so that s |a| is within the limits of every axis, given as 1/limit. At most 1e15: its square
 * still is a float. */
VEC_INLINE float vec_limit_along(vec a, vec inverse_limit) {
    float most = vec_most(vec_abs(a) * inverse_limit);
    return most > 1e-15f ? 1.0f / most : 1e15f;
}

#endif
