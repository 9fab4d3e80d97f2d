/* SPDX-License-Identifier: MIT
 * The meaning of error:N in words. [any context] */
#ifndef WIFICNC_SIM_STATUS_TEXT_H
#define WIFICNC_SIM_STATUS_TEXT_H

#include "gcode/status.h"

/** Our words for an answer; "unknown status" for a number that is none. */
const char *status_text(enum status status);

#endif
