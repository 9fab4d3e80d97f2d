/* SPDX-License-Identifier: MIT
 * One value per axis in one variable: lane n is axis n, lanes above AXIS_COUNT are 0. [any]
 *
 * GCC's and Clang's vector types: a formula reads as on paper, and a compiler with vector registers uses
 * them. A scalar in an expression with a vec counts for every lane. */
#ifndef WIFICNC_MOTION_VEC_H
#define WIFICNC_MOTION_VEC_H

#include "base/axis.h"
#include "base/minmax.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

/* How a vec is passed depends on the machine's vector registers, so it never is: all of this is inlined. */
#define VEC_INLINE static inline __attribute__((always_inline))
#ifdef __GNUC__
#pragma GCC diagnostic ignored "-Wpsabi"
#endif

#define VEC_LANES 8
_Static_assert((int)AXIS_COUNT <= VEC_LANES, "an axis is a lane");

/* Alignment of a float, so that a struct with one may live anywhere. */
typedef float vec __attribute__((vector_size(4 * VEC_LANES), aligned(4)));
/** A comparison's result: all bits of a lane set, or none. */
typedef int32_t vec_mask __attribute__((vector_size(4 * VEC_LANES), aligned(4)));

VEC_INLINE void vec_store(vec v, float a[AXIS_COUNT]) {
    a[0] = v[0], a[1] = v[1], a[2] = v[2], a[3] = v[3], a[4] = v[4], a[5] = v[5];
}

VEC_INLINE float vec_dot(vec a, vec b) {
    vec p = a * b;
    return (p[0] + p[1]) + (p[2] + p[3]) + (p[4] + p[5]);
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

/** The smaller of each two lanes, and the greater. */
VEC_INLINE vec vec_lower(vec a, vec b) {
    return vec_select(a < b, a, b);
}
VEC_INLINE vec vec_higher(vec a, vec b) {
    return vec_select(a > b, a, b);
}

/** a with its sign turned round where b is negative. */
VEC_INLINE vec vec_turn_sign(vec a, vec b) {
    return (vec)((vec_mask)a ^ ((vec_mask)b & INT32_MIN));
}

/** Greatest and least lane of all axes. */
VEC_INLINE float vec_most(vec a) {
    return max_f(max_f(max_f(a[0], a[1]), max_f(a[2], a[3])), max_f(a[4], a[5]));
}
VEC_INLINE float vec_least(vec a) {
    return min_f(min_f(min_f(a[0], a[1]), min_f(a[2], a[3])), min_f(a[4], a[5]));
}

/** Greatest s so that s |a| is within the limits of every axis, given as 1/limit. At most 1e15: its square
 * still is a float. */
VEC_INLINE float vec_limit_along(vec a, vec inverse_limit) {
    float most = vec_most(vec_abs(a) * inverse_limit);
    return most > 1e-15f ? 1.0f / most : 1e15f;
}

#endif
