/* SPDX-License-Identifier: MIT
 * Whether LinuxCNC's homed joints still mean what they meant: the controller's counters may have begun again
 * at power-on, or motors may have lost steps. Pure. What is known here outlives connections.
 *
 * A joint that the controller has homed to its switch is right as long as the controller trusts that axis. A
 * joint that was homed where it stood is right as long as nothing at all has happened to the counters. A
 * joint that was homed while no one watched may be anything. */
#ifndef WIFICNC_LINUXCNC_REFERENCE_H
#define WIFICNC_LINUXCNC_REFERENCE_H

#include <stdbool.h>
#include <stdint.h>

enum { REFERENCE_JOINTS = 6 };

/** What happened to the counters of a controller. */
struct reference_mark {
    uint32_t starts; /* that were seen */
    uint8_t losses;  /* as the controller counts them */
    bool is_trusted; /* it has homed this axis, and not lost it since */
};

struct reference {
    bool is_begun;
    bool has_uptime;
    uint32_t uptime_ms; /* of the newest report ... */
    double uptime_s;    /* ... and when that came */
    bool is_known;      /* `trusted` and `losses` are of now */
    uint32_t starts;
    uint8_t losses, trusted;
    uint8_t homed;       /* joints, as LinuxCNC said last */
    uint8_t by_switches; /* of them those that the controller has homed to its switches */
    uint8_t lost;        /* homed joints whose position is no longer right */
    struct reference_mark mark[REFERENCE_JOINTS]; /* when they were homed */
};

/** The program starts. @param homed  mask of joints that LinuxCNC says are homed */
void reference_begin(struct reference *reference, uint8_t homed);
/** A report: how long the controller has run. */
void reference_report(struct reference *reference, uint32_t uptime_ms, double now_s);
/** What it says about its counters. */
void reference_take(struct reference *reference, uint8_t trusted, uint8_t losses);
/** That may have changed: it is to be asked. */
void reference_forget(struct reference *reference);
/** The controller has homed these joints to its switches; LinuxCNC is about to say so. */
void reference_note_switches(struct reference *reference, uint8_t joints);
/** What LinuxCNC says. @return mask of joints that it must not take for homed any more */
uint8_t reference_follow(struct reference *reference, uint8_t homed);

#endif
