/* SPDX-License-Identifier: MIT
 * [tests] What must be true of a controller whatever it receives, checked in every test that drives one. A
 * check changes nothing.
 *
 *   counter   the position counter is the pulses that left the pins, and the shift of homing
 *   answers   every line gets one answer, in order; a reset drops those that wait
 *   state     no step in Alarm, Sleep, Check, or with the e-stop pressed; there, but in Check and in alarms
 *             that only lock, spindle and coolant are off
 *
 *   limits    no axis exceeds its rate, nor its acceleration by more than a fifth, in windows of 10 ms;
 *             unless motion was cut off (alarm, reset), follows the spindle, or comes from a network host
 *
 *   beam      with $32=1 the controller has power on only while a cut is executed, in Run or until a hold
 *             rests, or to aim in Idle
 *
 *   stops     behind a stop (! 0x84 0x85 0x18, a button, the door, whatever the controller counts as one) a
 * hold or door ends only by a reset, or by a ~, start button or packet that came after it
 *   rests     in the times of an ESP32 no task works for longer than it may without a rest (task_rest.h)
 *
 *   liveness  what moves or owes an answer gets further, or waits for something that has a name
 *
 * The first thing found is kept in words. */
#ifndef WIFICNC_SIM_MONITOR_H
#define WIFICNC_SIM_MONITOR_H

#include "host.h"

enum monitor_checks {
    MONITOR_COUNTER = 0x01,
    MONITOR_ANSWERS = 0x02,
    MONITOR_STATE = 0x04,
    MONITOR_LIMITS = 0x08,
    MONITOR_BEAM = 0x10,
    MONITOR_LIVENESS = 0x20,
    MONITOR_STOPS = 0x40,
};

struct monitor;

/** Watch from now on: before anything was sent, with the machine at rest. One monitor for a host.
 * @param checks  enum monitor_checks @return NULL: no memory */
struct monitor *monitor_create(struct host *host, uint32_t checks);

/** Before host_destroy(). */
void monitor_destroy(struct monitor *monitor);

/** @return NULL: nothing was found; or what, and when */
const char *monitor_found(struct monitor *monitor);

/** After whatever was: with all inputs released and stalls ended a reset leads to a banner, and then a ? is
 * answered within 100 ms. Changes the controller. @return as monitor_found() */
const char *monitor_end(struct monitor *monitor);

#endif
