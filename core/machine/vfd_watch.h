/* SPDX-License-Identifier: MIT
 * A spindle drive that does not answer: one message with the cause; and if the spindle may turn, motion stops
 * and ALARM_VFD follows. The drive is commanded to stop meanwhile (spindle/vfd.h). [task] */
#ifndef WIFICNC_MACHINE_VFD_WATCH_H
#define WIFICNC_MACHINE_VFD_WATCH_H

#include <stdbool.h>

struct machine;

/** Not in the quiet time after an alarm. @return true when something was done */
bool vfd_watch_poll(struct machine *machine);

#endif
