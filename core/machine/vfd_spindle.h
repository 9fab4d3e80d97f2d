/* SPDX-License-Identifier: MIT
 * A spindle that is a drive on a bus ($395): settings, what outputs.c commands, and what the drive reports.
 * What happens when it does not answer is in vfd_watch.h. [task] */
#ifndef WIFICNC_MACHINE_VFD_SPINDLE_H
#define WIFICNC_MACHINE_VFD_SPINDLE_H

#include "machine/machine.h"
#include "machine/trip.h"
#include "spindle/vfd.h"

/** The drive, and what was reported of it. The target supplies it where it supplies a bus. */
struct machine_vfd {
    struct vfd drive;
    bool lost_told; /* that it does not answer */
    struct machine_trip trip;
};

/** The spindle is a drive, and the board has a bus. */
bool vfd_spindle_is_chosen(const struct machine *machine);

/** Settings of the drive have changed, or power-on: it is commanded to stop first. Nothing when they are the
 * same. */
void vfd_spindle_configure(struct machine *machine);

/** $374 .. that this number is one of. */
bool vfd_spindle_has_setting(uint16_t number);

/** @param rpm  with override and limits */
void vfd_spindle_command(struct machine *machine, int direction, float rpm);

/** Send and receive; nothing is printed and nothing else happens, so that a stop is commanded in any state.
 */
bool vfd_spindle_poll(struct machine *machine);

/** What was commanded is confirmed. */
bool vfd_spindle_is_confirmed(const struct machine *machine);

/** Real speed, signed. @return false: no drive is chosen, or it has not reported any */
bool vfd_spindle_measured_rpm(const struct machine *machine, float *rpm);

/** It reports its speed. */
bool vfd_spindle_can_measure(const struct machine *machine);

/** Current of its motor. @return false: it does not report that */
bool vfd_spindle_ampere(const struct machine *machine, float *ampere);

/** Poll again after this time; UINT32_MAX: no need. */
uint32_t vfd_spindle_wait_us(const struct machine *machine);

/** The same, but UINT32_MAX also where it is only looked whether the drive still answers. */
uint32_t vfd_spindle_event_us(const struct machine *machine);

#endif
