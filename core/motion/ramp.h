/* SPDX-License-Identifier: MIT
 * Limited jerk on a straight way: which acceleration is next. [task] Pure. Derived in docs/motion.md, 9.
 *
 * The axes follow a mean of the path over mean_s, so their jerk is the change of the path's acceleration in
 * that time, divided by it. In bends and next to them any acceleration up to `near` may follow any other. On
 * the rest of a straight way there is more, up to `accel`, but only after mean_s of at least `calm` in the
 * same sense, and before mean_s of it:
 *
 *       accel        .-----.
 *       near     .---'     |
 *       calm     |         '----.
 *       0  ------'              |
 *       -near                   '----.       .---- bend
 *       -accel     mean_s   mean_s   '-------'
 *
 * Nothing is begun that this could not end in time: after each sample there is still the braking that begins
 * there and meets the plan. */
#ifndef WIFICNC_MOTION_RAMP_H
#define WIFICNC_MOTION_RAMP_H

#include <stdbool.h>

/** What is left of a straight way: from here, mm, (mm/s)^2, mm/s^2. */
struct ramp_way {
    float slow_mm;  /* from there on `accel` may be used ... */
    float brake_mm; /* ... and up to here; below slow_mm: nowhere */
    float end_mm;
    float end_y;             /* the plan's */
    float limit_y;           /* of all of it */
    float accel, near, calm; /* accel > near >= calm > 0 */
    float mean_s;
};

/** How the acceleration was of late, s. Up to mean_s: it has been `calm` or more for this time. Above mean_s:
 * `accel` is or was used, and for the rest of the time it must be `calm` or more. < 0: the same for braking.
 */
typedef float ramp_state;

/** What has come of it after this time at this acceleration. */
ramp_state ramp_after(const struct ramp_way *way, ramp_state state, float accel, float time_s);

/** As much of this time as the same accelerations are possible in. */
float ramp_time_s(const struct ramp_way *way, ramp_state state, float time_s);

/** The greatest acceleration for the next time_s after which the plan can still be met.
 *  @param v  present speed @param *late  becomes whether there is none, nor time to brake harder */
float ramp_choose(const struct ramp_way *way, ramp_state state, float v, float time_s, bool *late);

/** The one that leads to a stop soonest. */
float ramp_stop(const struct ramp_way *way, ramp_state state, float v, float time_s);

/** From here to where other accelerations are possible, or to the end. */
float ramp_way_mm(const struct ramp_way *way);

/** The plan's y at a place ahead: from there the end's can be reached. */
float ramp_plan_y(const struct ramp_way *way, float at_mm);

/** Whether that is needed: the rest is not just next to a bend. */
static inline bool ramp_is_needed(const struct ramp_way *way, ramp_state state) {
    bool far = way->slow_mm < way->brake_mm && way->brake_mm > 0.0f;
    return far || state > way->mean_s || state < -way->mean_s;
}

#endif
