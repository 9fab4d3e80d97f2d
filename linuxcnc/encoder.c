/* SPDX-License-Identifier: MIT */
#include "encoder.h"

#include <math.h>
#include <string.h>

static const double ANGLE_ONE = 65536.0; /* of a report: one turn */
static const double AHEAD_MAX_S = 0.1;   /* the position continues for this long without a report */
static const double STANDING_RPS = 0.01; /* slower has no direction */
static const double JUMP_MIN = 0.03,
                    JUMP_PART = 0.3;      /* turns; part of the way by the controller's own speed */
static const double AT_SPEED_PART = 0.05; /* of the commanded speed */
enum { SPINDLE_BACKWARDS = 2 };

double encoder_speed_rps(const struct encoder *encoder) {
    if (encoder->reports < 2)
        return 0.0;
    const struct encoder_report *first = &encoder->report[0], *last = &encoder->report[encoder->reports - 1];
    double seconds = last->at_s - first->at_s;
    double speed = seconds > 0.0 ? (last->turns - first->turns) / seconds : 0.0;
    return fabs(speed) > STANDING_RPS ? speed : 0.0;
}

/* Before its first index pulse the controller counts from anywhere. A jump that is not a motion is that
 * pulse.
 */
static void follow_index(struct encoder *encoder, double turns, double at_s,
                         const struct wire_status *status) {
    const struct encoder_report *last = &encoder->report[encoder->reports - 1];
    double expected = status->rpm / 60.0 * (at_s - last->at_s);
    encoder->turned += expected;
    if (fabs(fabs(turns - last->turns) - expected) <= JUMP_MIN + JUMP_PART * expected)
        return;
    double speed = encoder_speed_rps(encoder);
    bool back = speed != 0.0 ? speed < 0.0 : status->spindle == SPINDLE_BACKWARDS;
    double jump = turns - last->turns - (back ? -expected : expected);
    for (unsigned i = 0; i < encoder->reports; i++)
        encoder->report[i].turns += jump;
    encoder->armed_at += jump;
}

static void note_lag(struct encoder *encoder, double lag_s) {
    encoder->lag_s[encoder->lag_next] = lag_s;
    encoder->lag_next = (encoder->lag_next + 1) % ENCODER_LAGS;
    if (encoder->lags < ENCODER_LAGS)
        encoder->lags++;
}

void encoder_take(struct encoder *encoder, uint32_t device_us, double now_s,
                  const struct wire_status *status) {
    bool first = encoder->reports == 0;
    uint32_t ahead_us = first ? 0 : device_us - (uint32_t)encoder->time_us;
    if (!first && (ahead_us == 0 || ahead_us > INT32_MAX))
        return;
    encoder->time_us = first ? device_us : encoder->time_us + ahead_us;
    if (!first)
        encoder->whole += (int32_t)(status->spindle_turns - encoder->turns);
    encoder->turns = status->spindle_turns;
    double at_s = (double)encoder->time_us / 1e6;
    double turns = (double)encoder->whole + status->spindle_angle / ANGLE_ONE;
    if (!first)
        follow_index(encoder, turns, at_s, status);
    if (encoder->reports == ENCODER_REPORTS) {
        encoder->reports--;
        memmove(encoder->report, encoder->report + 1, encoder->reports * sizeof *encoder->report);
    }
    encoder->report[encoder->reports++] = (struct encoder_report){at_s, turns};
    note_lag(encoder, now_s - at_s);
}

/* Raw position: 0 at the index before the first report. */
static double turns_at(const struct encoder *encoder, double now_s) {
    if (encoder->reports == 0)
        return 0.0;
    const struct encoder_report *last = &encoder->report[encoder->reports - 1];
    double lag_s = encoder->lag_s[0];
    for (unsigned i = 1; i < encoder->lags; i++)
        lag_s = fmin(lag_s, encoder->lag_s[i]);
    double since_s = now_s - lag_s - last->at_s;
    return last->turns + encoder_speed_rps(encoder) * fmin(fmax(since_s, 0.0), AHEAD_MAX_S);
}

double encoder_update(struct encoder *encoder, double now_s, bool *index_enable) {
    double raw = turns_at(encoder, now_s);
    if (!*index_enable || !encoder->armed || encoder->turned < 1.0)
        encoder->armed_at = raw;
    encoder->armed = *index_enable;
    double passed = floor(raw) - floor(encoder->armed_at);
    if (encoder->armed && passed != 0.0 && encoder_speed_rps(encoder) != 0.0) {
        encoder->zero = passed > 0.0 ? floor(raw) : floor(raw) + 1.0;
        encoder->armed = *index_enable = false;
    }
    return raw - encoder->zero;
}

bool at_speed_update(struct at_speed *at, double now_s, const struct wire_io_control *said,
                     const struct wire_status *status, const struct encoder *encoder) {
    if (said->spindle != at->spindle || said->rpm != at->rpm) {
        at->spindle = said->spindle;
        at->rpm = said->rpm;
        at->since_s = now_s;
    }
    if (said->spindle == 0)
        return true;
    if (status->spindle != said->spindle)
        return false;
    if (encoder == NULL)
        return now_s - at->since_s >= at->run_up_s;
    double rps = encoder_speed_rps(encoder);
    return rps != 0.0 && fabs(fabs(rps) * 60.0 - said->rpm) <= AT_SPEED_PART * said->rpm;
}
