/* SPDX-License-Identifier: MIT */
#include "gcode/spline.h"

#include <math.h>   // sqrt ceil: exact
#include <string.h> // memcpy

#define TOLERANCE_MIN_MM 1e-6

static double second_difference(const double a[2], const double b[2], const double c[2]) {
    const double x = a[0] - 2.0 * b[0] + c[0], y = a[1] - 2.0 * b[1] + c[1];
    return sqrt(x * x + y * y);
}

void spline_begin(struct spline *spline, const double start_mm[AXIS_COUNT], const struct gcode_move *move,
                  double tolerance_mm) {
    double (*point)[2] = spline->point_mm;
    double first, last, bend;

    for (unsigned axis = 0; axis < 2; axis++) {
        point[0][axis] = start_mm[axis];
        point[1][axis] = move->control_mm[0][axis];
        point[2][axis] = move->control_mm[1][axis];
        point[3][axis] = move->target_mm[axis];
    }
    memcpy(spline->target_mm, move->target_mm, sizeof spline->target_mm);
    first = second_difference(point[0], point[1], point[2]);
    last = second_difference(point[1], point[2], point[3]);
    /* |q''| of a cubic is at most this; a chord over 1/n of it is at most |q''| / (8 n^2) off the curve. */
    bend = 6.0 * (first > last ? first : last);
    if (tolerance_mm < TOLERANCE_MIN_MM)
        tolerance_mm = TOLERANCE_MIN_MM;
    spline->chords = 1u + (uint32_t)ceil(sqrt(bend / (8.0 * tolerance_mm)));
    spline->done = 0;
}

/* Within the four numbers, where the curve is too but for its last bit: that must not end a program at the
 * end of the travel. */
static double inside(double value, const double (*point)[2], unsigned axis) {
    double low = point[0][axis], high = low;

    for (unsigned n = 1; n < 4; n++) {
        low = point[n][axis] < low ? point[n][axis] : low;
        high = point[n][axis] > high ? point[n][axis] : high;
    }
    return value < low ? low : value > high ? high : value;
}

bool spline_next(struct spline *spline, double point_mm[AXIS_COUNT]) {
    const double (*point)[2] = (const double (*)[2])spline->point_mm;

    if (spline->done >= spline->chords)
        return false;
    spline->done++;
    memcpy(point_mm, spline->target_mm, sizeof spline->target_mm);
    if (spline->done == spline->chords)
        return true;
    const double t = (double)spline->done / spline->chords, s = 1.0 - t;
    for (unsigned axis = 0; axis < 2; axis++) { /* Bernstein's form */
        const double sum = s * s * s * point[0][axis] + 3.0 * s * s * t * point[1][axis] +
                           3.0 * s * t * t * point[2][axis] + t * t * t * point[3][axis];
        point_mm[axis] = inside(sum, point, axis);
    }
    return true;
}
