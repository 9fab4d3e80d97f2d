/* SPDX-License-Identifier: MIT
 * The spindle of the virtual machine: its speed goes to what is commanded along a ramp, less what the work
 * takes, and its encoder counts the angle, which is the integral of that in closed form.
 *
 * Times are ticks of the board's timer; a change is never before the last one. One thread, as the host. */
#ifndef WIFICNC_PC_VIRTUAL_SPINDLE_H
#define WIFICNC_PC_VIRTUAL_SPINDLE_H

#include <stdbool.h>
#include <stdint.h>

struct virtual_spindle {
    double told_rpm;         /* signed: clockwise is positive */
    double ramp_rpm_s;       /* 0: immediately */
    double load;             /* part of the speed that the work takes; negative: it turns faster */
    uint32_t counts_per_rev; /* of the encoder, all edges; > 0 when it is read */
    /* when something changed last */
    double from_rpm, from_rev;
    uint64_t from_ticks;
    bool index_seen;
};

struct vspindle_encoder {
    int64_t counts;
    uint64_t edge_ticks; /* when that count began, or the last change if that was before */
    int64_t index_counts;
    bool index_seen;
};

/** Before anything of it is changed: what it did so far counts from here. */
void vspindle_note(struct virtual_spindle *spindle, uint64_t now_ticks, uint32_t timer_hz);

/** Signed speed at a time not before the last change. */
double vspindle_rpm(const struct virtual_spindle *spindle, uint64_t t_ticks, uint32_t timer_hz);

/** Revolutions since power-on, at a time not before the last change. */
double vspindle_angle(const struct virtual_spindle *spindle, uint64_t t_ticks, uint32_t timer_hz);

void vspindle_read(const struct virtual_spindle *spindle, uint64_t now_ticks, uint32_t timer_hz,
                   struct vspindle_encoder *out);

#endif
