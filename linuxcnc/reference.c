/* SPDX-License-Identifier: MIT */
#include "reference.h"

#include <math.h>

static const double UPTIME_OFF_S = 1.0;     /* reports are late by less */
static const double UPTIME_OFF_PART = 1e-3; /* clocks differ by less */

void reference_begin(struct reference *reference, uint8_t homed) {
    *reference = (struct reference){.is_begun = true, .homed = homed, .lost = homed};
}

void reference_report(struct reference *reference, uint32_t uptime_ms, double now_s) {
    double went_s = 1e-3 * (int32_t)(uptime_ms - reference->uptime_ms);
    double passed_s = now_s - reference->uptime_s;
    if (reference->has_uptime && fabs(went_s - passed_s) > UPTIME_OFF_S + UPTIME_OFF_PART * passed_s) {
        reference->starts++;
        reference->is_known = false;
    }
    reference->has_uptime = true;
    reference->uptime_ms = uptime_ms;
    reference->uptime_s = now_s;
}

static struct reference_mark mark_of(const struct reference *reference, unsigned joint) {
    return (struct reference_mark){reference->starts, reference->losses,
                                   (reference->trusted >> joint & 1) != 0};
}

static bool is_right(const struct reference *reference, unsigned joint) {
    struct reference_mark now = mark_of(reference, joint), then = reference->mark[joint];
    if ((reference->by_switches >> joint & 1) != 0)
        return now.is_trusted;
    return now.starts == then.starts && now.losses == then.losses && now.is_trusted == then.is_trusted;
}

void reference_take(struct reference *reference, uint8_t trusted, uint8_t losses) {
    reference->trusted = trusted;
    reference->losses = losses;
    reference->is_known = true;
    for (unsigned joint = 0; joint < REFERENCE_JOINTS; joint++) {
        if ((reference->homed >> joint & 1) != 0 && !is_right(reference, joint))
            reference->lost |= (uint8_t)(1u << joint);
    }
}

void reference_forget(struct reference *reference) {
    reference->is_known = false;
}

void reference_note_switches(struct reference *reference, uint8_t joints) {
    reference->by_switches |= joints;
    reference->lost &= (uint8_t)~joints;
}

uint8_t reference_follow(struct reference *reference, uint8_t homed) {
    uint8_t new = (uint8_t)(homed & ~reference->homed);
    for (unsigned joint = 0; joint < REFERENCE_JOINTS; joint++) {
        if ((new >> joint & 1) != 0)
            reference->mark[joint] = mark_of(reference, joint);
    }
    if (!reference->is_known)
        reference->lost |= new;
    uint8_t gone = (uint8_t)(reference->homed & ~homed);
    reference->by_switches &= (uint8_t)~gone;
    reference->lost &= homed;
    reference->homed = homed;
    return reference->lost;
}
