/* SPDX-License-Identifier: MIT
 * What is put aside and comes back: in check mode the offsets, in a parked hold the line of the job that is
 * under way. No machine is in both. [task] */
#ifndef WIFICNC_MACHINE_ASIDE_H
#define WIFICNC_MACHINE_ASIDE_H

#include "machine/interp.h"
#include "machine/lines.h"
#include "machine/task.h"

union machine_aside {
    struct gcode_offsets unchecked; /* interp_check() */
    struct {
        struct machine_task task;
        struct lines_aside lines;
        struct interp_aside interp;
    } job; /* park.c */
};

#endif
