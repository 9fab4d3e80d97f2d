/* SPDX-License-Identifier: MIT
 * Parking ($42): Z goes up before spindle and coolant stop. */
#include "machine/retract.h"

#include "machine/host_motion.h"
#include "machine/park.h"
#include "machine/parts.h"
#include "machine/place.h"
#include "machine/preempt.h"
#include "machine/report.h"

#define S_PER_MIN 60.0

/* A remote host's motion is not ours, and the operator's tool is where the operator wants it. */
static bool is_asked(const struct machine *machine) {
    const bool door = machine->life.state == MACHINE_DOOR;
    const uint8_t mode = machine->settings.parking;
    if (mode == RETRACT_NEVER || (!door && mode != RETRACT_IN_HOLD))
        return false;
    return !machine->park.open && !machine->park.tool && !machine->host.owns &&
           machine->host.job.step != HOST_JOB_BRAKES && park_refuse_stage(machine) == NULL;
}

static const char *refuse(const struct machine *machine) {
    if (machine->drive.joints.kinematics.curved != 0)
        return "Not parked: only straight axes can be moved ($80)";
    return (machine_homed(machine) >> AXIS_Z & 1) == 0 ? "Not parked: Z is not homed" : NULL;
}

bool retract_begin(struct machine *machine) {
    const struct settings *settings = &machine->settings;
    int32_t from[AXIS_COUNT], to[AXIS_COUNT];
    double tool_mm[AXIS_COUNT];
    if (!is_asked(machine) || machine->board.axis_count <= AXIS_Z)
        return false;
    const char *why = refuse(machine);
    if (why != NULL) {
        report_message(machine, why);
        return false;
    }
    machine_position(machine, from);
    place_tool_mm(machine, from, tool_mm);
    const double up_mm = -(double)settings->parking_target_mm - tool_mm[AXIS_Z];
    if (up_mm <= 0.0)
        return false;
    tool_mm[AXIS_Z] += up_mm;
    park_steps_at(machine, tool_mm, from, to);
    preempt_park(machine);
    struct host_queue_segment leg = {.flags = SEGMENT_RAPID | SEGMENT_LAST};
    leg.steps[AXIS_Z] = to[AXIS_Z] - from[AXIS_Z];
    const double rate = (double)machine->host.queue.limits.rate_steps_s[AXIS_Z];
    const double asked_s = up_mm * S_PER_MIN / (double)settings->parking_feed_mm_min;
    const double least_s = (double)leg.steps[AXIS_Z] / rate;
    leg.duration_us = (uint32_t)(1e6 * (asked_s > least_s ? asked_s : least_s)) + 1;
    return host_move_self(machine, &leg);
}
