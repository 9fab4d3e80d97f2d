/* SPDX-License-Identifier: MIT
 * What ctypes cannot know: lets gcode_core.py prove that its structures are the C ones. */
#include "gcode/arc.h"
#include "gcode/block.h"
#include "gcode/cycle.h"
#include "gcode/gcode.h"
#include "gcode/spline.h"
#include "link/line_reader.h"

#include <stddef.h>

#define SIZE(name) const size_t size_of_##name = sizeof(struct name)

SIZE(arc);
SIZE(cycle);
SIZE(cycle_action);
SIZE(gcode_block);
SIZE(gcode_command);
SIZE(gcode_modal);
SIZE(gcode_move);
SIZE(gcode_state);
SIZE(line_reader);
SIZE(spline);
