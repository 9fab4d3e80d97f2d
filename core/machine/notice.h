/* SPDX-License-Identifier: MIT
 * For a client that connects later: why the machine is locked, held or commanded by someone else.
 * The messages of that moment are gone, and a status report has the state without its cause. [task] */
#ifndef WIFICNC_MACHINE_NOTICE_H
#define WIFICNC_MACHINE_NOTICE_H

#include "machine/machine.h"

enum { NOTICE_SIZE = 192 };

/** All of machine_notice(), each as a [MSG:]. */
void notice_report(struct machine *machine);

#endif
