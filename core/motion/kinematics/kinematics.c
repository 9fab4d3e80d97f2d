/* SPDX-License-Identifier: MIT
 * What all kinds of machines share. */
#include "motion/kinematics/kinematics.h"

#include <math.h>
#include <stddef.h>

#define ROUNDING_MM 1e-9 /* of a place on the edge of what can be reached */

void kinematics_init(struct kinematics *kinematics, enum kinematics_kind kind, const float arm_mm[2],
                     const float travel_mm[2]) {
    static const struct kinematics_ops *const ops[KINEMATICS_COUNT] = {
#define KIND(NAME, name) [KINEMATICS_##NAME] = &kinematics_##name,
        KINEMATICS_KINDS(KIND)
#undef KIND
    };
    *kinematics = (struct kinematics){.ops = ops[kind], .coupled = ops[kind]->coupled};
    if (kinematics->ops->bend_mm != NULL)
        kinematics->curved = 1u << AXIS_X | 1u << AXIS_Y;
    for (unsigned i = 0; i < 2; i++) {
        kinematics->arm_mm[i] = (double)arm_mm[i];
        kinematics->travel_mm[i] = (double)travel_mm[i];
    }
}

/* Least distance of a straight way from the centre. */
static double nearest_mm(const double from_mm[AXIS_COUNT], const double to_mm[AXIS_COUNT]) {
    double x = from_mm[AXIS_X], y = from_mm[AXIS_Y];
    double dx = to_mm[AXIS_X] - x, dy = to_mm[AXIS_Y] - y, square = dx * dx + dy * dy;
    double part = square > 0.0 ? -(x * dx + y * dy) / square : 0.0;
    part = part < 0.0 ? 0.0 : part > 1.0 ? 1.0 : part;
    x += part * dx;
    y += part * dy;
    return sqrt(x * x + y * y);
}

static double radius_mm(const double at_mm[AXIS_COUNT]) {
    return sqrt(at_mm[AXIS_X] * at_mm[AXIS_X] + at_mm[AXIS_Y] * at_mm[AXIS_Y]);
}

bool kinematics_reaches(const struct kinematics *kinematics, const double from_mm[AXIS_COUNT],
                        const double to_mm[AXIS_COUNT]) {
    double least_mm, most_mm;
    if (kinematics->ops->reach_mm == NULL)
        return true;
    kinematics->ops->reach_mm(kinematics, &least_mm, &most_mm);
    return nearest_mm(from_mm, to_mm) >= least_mm - ROUNDING_MM && radius_mm(to_mm) <= most_mm + ROUNDING_MM;
}

double kinematics_end(const struct kinematics *kinematics, unsigned axis, bool positive, double travel) {
    bool counts_up = (kinematics->curved >> axis & 1) != 0;
    if (counts_up)
        return positive ? travel : 0.0;
    return positive ? 0.0 : -travel;
}
