/* SPDX-License-Identifier: MIT
 * Where the spindle is between two status reports, as LinuxCNC's encoder pins want it; and whether it has its
 * speed. Pure: times are s of any clock that never goes back. */
#ifndef WIFICNC_LINUXCNC_ENCODER_H
#define WIFICNC_LINUXCNC_ENCODER_H

#include "wire/wire_gen.h"

#include <stdbool.h>

enum {
    ENCODER_REPORTS = 8, /* over which the speed is the mean */
    ENCODER_LAGS = 200,  /* reports among which the fastest one says what the clocks differ by */
};

/** Reports of an angle, each with the controller's time, become a position in turns at any time. Whole
 * numbers of the position lie at the index, also after index-enable, which sets it to 0 there. */
struct encoder {
    struct encoder_report {
        double at_s; /* the controller's clock */
        double turns;
    } report[ENCODER_REPORTS]; /* oldest first */
    unsigned reports;
    double lag_s[ENCODER_LAGS];
    unsigned lags, lag_next;
    uint64_t time_us; /* of the newest report, without the wrap of its 32 bits */
    double turned;    /* since the first report: after a turn the index is known */
    uint32_t turns;   /* of the newest report */
    int64_t whole;    /* ... since the first one */
    double zero;      /* whole turns */
    bool armed;       /* index-enable was true when last looked at ... */
    double armed_at;  /* ... and the position this */
};

/** A report. Late ones are left out. @param device_us  the controller's clock, wraps */
void encoder_take(struct encoder *encoder, uint32_t device_us, double now_s,
                  const struct wire_status *status);
/** Turns per second, negative when it turns back. */
double encoder_speed_rps(const struct encoder *encoder);
/** As LinuxCNC's encoders have it: while *index_enable is true, the next index sets the position to 0 and
 * makes it false.
 *  @return position, turns */
double encoder_update(struct encoder *encoder, double now_s, bool *index_enable);

/** spindle.N.at-speed. */
struct at_speed {
    double run_up_s; /* of a spindle without an encoder, after a change */
    uint8_t spindle; /* as commanded: 0 off, 1 clockwise, 2 counter-clockwise */
    uint16_t rpm;
    double since_s;
};

/** @param said     what was commanded
 *  @param encoder  NULL: none exists */
bool at_speed_update(struct at_speed *at, double now_s, const struct wire_io_control *said,
                     const struct wire_status *status, const struct encoder *encoder);

#endif
