/* SPDX-License-Identifier: MIT
 * Counts of two lines a quarter of a period apart. Pure; where hardware does not count, at each edge. */
#ifndef WIFICNC_BASE_QUADRATURE_H
#define WIFICNC_BASE_QUADRATURE_H

#include <stdint.h>

struct quadrature {
    uint8_t phase;  /* 0 .. 3 */
    int32_t counts; /* edges, signed: up while A is before B; wraps */
    uint32_t slips; /* both lines had changed: it is not known which way; wraps */
};

/** Place within a period, 0 .. 3, from the levels of A and B. */
static inline uint8_t quadrature_phase(unsigned a, unsigned b) {
    return (uint8_t)((a ^ b) | b << 1);
}

/** The lines have these levels now, 0 or 1 each. */
static inline void quadrature_take(struct quadrature *quadrature, unsigned a, unsigned b) {
    const uint8_t phase = quadrature_phase(a, b);
    switch ((phase - quadrature->phase) & 3) {
    case 1:
        quadrature->counts = (int32_t)((uint32_t)quadrature->counts + 1u);
        break;
    case 2:
        quadrature->slips++;
        break;
    case 3:
        quadrature->counts = (int32_t)((uint32_t)quadrature->counts - 1u);
        break;
    default:
        break;
    }
    quadrature->phase = phase;
}

#endif
