/* SPDX-License-Identifier: MIT
 * The text of PRINT and DEBUG comments, with values in place of parameters. [task] Pure. */
#ifndef WIFICNC_MACHINE_COMMENT_H
#define WIFICNC_MACHINE_COMMENT_H

#include "gcode/readings.h"
#include "input/text.h"

/** Print such a text. A parameter that has no value, or none that is known, is printed as ######. */
void comment_print(const struct text_out *out, const struct param_context *context, const char *text);

#endif
