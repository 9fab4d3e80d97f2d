/* SPDX-License-Identifier: MIT
 * What the machine's limits and the tolerance mean for a plan. Behind motion/motion.h. [task] */
#ifndef WIFICNC_MOTION_FIT_H
#define WIFICNC_MOTION_FIT_H

#include "motion/planner.h"

/** New limits. Only while plan_is_empty(). */
void plan_set_limits(struct plan *plan, const struct motion_limits *limits);

#endif
