/* SPDX-License-Identifier: MIT
 * After a probe has touched: from where the machine is back to what LinuxCNC commands. Pure.
 *
 * Commands run ahead of the machine. When the probe touches, the controller stops it, and the command is
 * already somewhat behind the contact. That way must not be made up for: it lies inside the workpiece. So the
 * machine keeps its distance from the command. What the command moves back along that distance shortens it,
 * and the machine is at rest meanwhile; all else of the command's motion is followed. A retreat ends it. */
#ifndef WIFICNC_LINUXCNC_CLEARANCE_H
#define WIFICNC_LINUXCNC_CLEARANCE_H

#include <stdbool.h>

enum { CLEARANCE_JOINTS = 6 };

struct clearance {
    unsigned joints;
    double offset[CLEARANCE_JOINTS]; /* units: the machine less the command */
    double command[CLEARANCE_JOINTS];
    bool follows; /* `command` is set */
};

/** None yet. */
void clearance_clear(struct clearance *clearance, unsigned joints);
/** The machine is at `stands`, units, while it is commanded to be at `command`. */
void clearance_begin(struct clearance *clearance, const double *stands, const double *command);
/** The machine is there, and not where it was believed to; as long as it keeps a distance. */
void clearance_shift(struct clearance *clearance, const double *believed, const double *stands);
/** Where the machine shall be. */
void clearance_follow(struct clearance *clearance, const double *command, double *wanted);

#endif
