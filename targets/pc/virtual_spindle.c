/* SPDX-License-Identifier: MIT */
#include "virtual_spindle.h"

#include <math.h>

#define INDEX_REV  0.375 /* the index is not where power-on finds the spindle */
#define ROUNDING_S 1e-9

/* Since the last change: a ramp of `ramp_s`, with so many revolutions/s^2, then an even speed. */
struct course {
    double v0, accel, ramp_s, v1; /* revolutions/s */
};

static struct course course_of(const struct virtual_spindle *spindle) {
    double v0 = spindle->from_rpm / 60.0, v1 = spindle->told_rpm * (1.0 - spindle->load) / 60.0;
    double accel = spindle->ramp_rpm_s / 60.0;
    if (spindle->ramp_rpm_s <= 0.0)
        return (struct course){.v0 = v1, .v1 = v1};
    return (struct course){
        .v0 = v0, .accel = v1 < v0 ? -accel : accel, .ramp_s = fabs(v1 - v0) / accel, .v1 = v1};
}

static double seconds(const struct virtual_spindle *spindle, uint64_t t_ticks, uint32_t timer_hz) {
    return t_ticks > spindle->from_ticks ? (double)(t_ticks - spindle->from_ticks) / timer_hz : 0.0;
}

static double way_rev(const struct course *course, double t_s) {
    double ramp_s = t_s < course->ramp_s ? t_s : course->ramp_s;
    double ramp = course->v0 * ramp_s + 0.5 * course->accel * ramp_s * ramp_s;
    return ramp + course->v1 * (t_s - ramp_s);
}

double vspindle_rpm(const struct virtual_spindle *spindle, uint64_t t_ticks, uint32_t timer_hz) {
    struct course course = course_of(spindle);
    double t_s = seconds(spindle, t_ticks, timer_hz);
    return 60.0 * (t_s < course.ramp_s ? course.v0 + course.accel * t_s : course.v1);
}

double vspindle_angle(const struct virtual_spindle *spindle, uint64_t t_ticks, uint32_t timer_hz) {
    struct course course = course_of(spindle);
    return spindle->from_rev + way_rev(&course, seconds(spindle, t_ticks, timer_hz));
}

/* Latest time up to t_s at which the way was `rev`; negative: never since the last change. */
static double passed_s(const struct course *course, double rev, double t_s) {
    double at_ramp = way_rev(course, course->ramp_s), found = -1.0;
    if (course->v1 != 0.0) {
        double at_s = course->ramp_s + (rev - at_ramp) / course->v1;
        if (at_s >= course->ramp_s && at_s <= t_s + ROUNDING_S)
            return fmin(at_s, t_s);
    }
    /* In the ramp: v0 t + a t^2 / 2 = rev. */
    double square = course->v0 * course->v0 + 2.0 * course->accel * rev;
    if (course->accel == 0.0 || square < 0.0)
        return -1.0;
    for (int sign = -1; sign <= 1; sign += 2) {
        double at_s = (-course->v0 + sign * sqrt(square)) / course->accel;
        if (at_s >= 0.0 && at_s <= fmin(t_s, course->ramp_s) + ROUNDING_S && at_s > found)
            found = fmin(at_s, t_s);
    }
    return found;
}

void vspindle_read(const struct virtual_spindle *spindle, uint64_t now_ticks, uint32_t timer_hz,
                   struct vspindle_encoder *out) {
    struct course course = course_of(spindle);
    double t_s = seconds(spindle, now_ticks, timer_hz), angle = spindle->from_rev + way_rev(&course, t_s);
    double count = floor(angle * spindle->counts_per_rev);
    double low = passed_s(&course, count / spindle->counts_per_rev - spindle->from_rev, t_s);
    double high = passed_s(&course, (count + 1.0) / spindle->counts_per_rev - spindle->from_rev, t_s);
    double edge_s = fmax(fmax(low, high), 0.0), index = floor(angle - INDEX_REV);
    /* The newest edge is the later passage of either border of the present count: a spindle that turned
     * round has passed the same one twice. */
    out->counts = (int64_t)count;
    out->edge_ticks = spindle->from_ticks + (uint64_t)(edge_s * timer_hz);
    out->index_counts = (int64_t)floor((index + INDEX_REV) * spindle->counts_per_rev);
    out->index_seen = spindle->index_seen || index != floor(spindle->from_rev - INDEX_REV);
}

void vspindle_note(struct virtual_spindle *spindle, uint64_t now_ticks, uint32_t timer_hz) {
    double rpm = vspindle_rpm(spindle, now_ticks, timer_hz);
    double rev = vspindle_angle(spindle, now_ticks, timer_hz);
    spindle->index_seen |= floor(rev - INDEX_REV) != floor(spindle->from_rev - INDEX_REV);
    spindle->from_rev = rev;
    spindle->from_rpm = rpm;
    spindle->from_ticks = now_ticks;
}
