/* SPDX-License-Identifier: MIT
 * The text of PRINT and DEBUG comments, with values in place of parameters. [task] Pure. */
#ifndef WIFICNC_MACHINE_COMMENT_H
#define WIFICNC_MACHINE_COMMENT_H

#include "gcode/readings.h"
#include "input/text.h"

/** Print such a text. A parameter without a value is printed as ######; one whose value only the machine has
 * (context->unknown) stays. */
void comment_print(const struct text_out *out, const struct param_context *context, const char *text);

#endif
