/* SPDX-License-Identifier: MIT
 * Least and greatest of two. Not fminf() and fmaxf(): those must mind NaN, so they are calls. [any] */
#ifndef WIFICNC_BASE_MINMAX_H
#define WIFICNC_BASE_MINMAX_H

static inline float min_f(float a, float b) {
    return a < b ? a : b;
}

static inline float max_f(float a, float b) {
    return a > b ? a : b;
}

#endif
