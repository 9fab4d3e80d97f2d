/* SPDX-License-Identifier: MIT
 * What hands can do at the virtual machine, in words. The control door of `wificnc serve` and the events of
 * `wificnc sim --at` speak this one vocabulary.
 *
 *   INPUT on|off          door, estop, hold, start, reset, probe, toolsetter, limit-x, limit-max-y, home-x,
 *                         input-0 (M66), dial-x, dial-x10 (switches of the dial) ...;
 *                         also "limit x on", "input 0 on"
 *   INPUT                 hold, start, reset: pressed and let go; the others: on
 *   REALTIME              feed-hold, resume, soft-reset, safety-door, jog-cancel, spindle-stop, flood, mist;
 *                         feed 100|+10|-10|+1|-1, spindle the same, rapid 100|50|25
 *   travel AXIS LOW HIGH  limit switches, mm of true position; travel AXIS off: none
 *   homing AXIS LOW HIGH  home switch, likewise, where the board has one
 *   surface Z|off         what the probe touches, mm
 *   toolsetter X Y Z [R]  where the tool setter is touched: its middle, its top, how far around; mm
 *   place X [Y [Z ...]]   the machine is here now, mm
 *   skew AXIS MM          the second motor of this axis is so far beyond the first, mm
 *   analog N PERCENT      level of an analog input (M66)
 *   ramp RPM              spindle's change of speed in a second; 0: immediately
 *   load PERCENT          the work brakes the spindle by so much; negative: it turns faster
 *   encoder COUNTS        of the spindle's encoder in a revolution
 *   driver MOTOR FAULT    what is wrong with a driver with registers, x .. c2: supply, wire, noise, hot,
 *                         shut-down, short, open, undervoltage; ok: nothing
 *   dial DETENTS [RATE]   the dial is turned, so many detents a second (20)
 *
 * hands_read() only reads: a line that is wrong changes nothing. One thread, as the host. */
#ifndef WIFICNC_PC_HANDS_H
#define WIFICNC_PC_HANDS_H

#include "base/axis.h"

#include <stdbool.h>
#include <stdint.h>

struct host;

enum { HANDS_LINE_SIZE = 160 };

enum hands_kind {
    HANDS_INPUT,
    HANDS_PRESS,
    HANDS_REALTIME,
    HANDS_TRAVEL,
    HANDS_NO_TRAVEL,
    HANDS_HOMING,
    HANDS_SURFACE,
    HANDS_NO_SURFACE,
    HANDS_TOOLSETTER,
    HANDS_PLACE,
    HANDS_SKEW,
    HANDS_RAMP,
    HANDS_LOAD,
    HANDS_ENCODER,
    HANDS_ANALOG,
    HANDS_DRIVER,
    HANDS_DIAL,
};

/** One thing to do. */
struct hands_action {
    enum hands_kind kind;
    int input;                 /* HANDS_INPUT, HANDS_PRESS: enum virtual_input */
    bool active;               /* HANDS_INPUT */
    uint8_t byte;              /* HANDS_REALTIME */
    unsigned axis;             /* HANDS_TRAVEL, HANDS_NO_TRAVEL, HANDS_HOMING, HANDS_SKEW */
    int32_t steps[AXIS_COUNT]; /* HANDS_TRAVEL, HANDS_HOMING: low, high; HANDS_SURFACE: Z; HANDS_SKEW: by;
                                  HANDS_PLACE: all; HANDS_TOOLSETTER: X Y Z */
    int32_t radius_steps;      /* HANDS_TOOLSETTER */
    float rpm_s;               /* HANDS_RAMP */
    unsigned analog;           /* HANDS_ANALOG: which input */
    float percent;             /* HANDS_ANALOG, HANDS_LOAD */
    float per_s;               /* HANDS_DIAL: detents; how many is steps[0] */
    uint32_t counts;           /* HANDS_ENCODER */
    unsigned motor, faults;    /* HANDS_DRIVER: host_driver_set_faults() */
};

/** Understand a line; millimetres become steps by the controller's present $100.. .
 *  @return NULL and *action, or what is wrong with the line, and *action is undefined */
const char *hands_read(const struct host *host, const char *line, struct hands_action *action);

/** Do it now, before the controller's time continues. */
void hands_do(struct host *host, const struct hands_action *action);

/** It asks the controller for a reset. */
bool hands_resets(const struct hands_action *action);

#endif
