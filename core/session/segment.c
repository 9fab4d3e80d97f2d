/* SPDX-License-Identifier: MIT
 * A segment of the wire -> one for the host queue. */
#include "session/inner.h"

#include "wire/wire_gen.h"

#include <string.h>

/* A host may set these; all others are the planner's. They are passed on as they come. */
#define FROM_WIRE                                                                                            \
    (WIRE_SEGMENT_FLAG_RAPID | WIRE_SEGMENT_FLAG_LAST | WIRE_SEGMENT_FLAG_PROBE |                            \
     WIRE_SEGMENT_FLAG_EXACT_STOP)

_Static_assert((int)SEGMENT_RAPID == (int)WIRE_SEGMENT_FLAG_RAPID, "one definition: protocol/wmc3.toml");
_Static_assert((int)SEGMENT_LAST == (int)WIRE_SEGMENT_FLAG_LAST, "one definition: protocol/wmc3.toml");
_Static_assert((int)SEGMENT_PROBE == (int)WIRE_SEGMENT_FLAG_PROBE, "one definition: protocol/wmc3.toml");
_Static_assert((int)SEGMENT_EXACT_STOP == (int)WIRE_SEGMENT_FLAG_EXACT_STOP,
               "one definition: protocol/wmc3.toml");

struct host_queue_segment session_segment(const uint8_t *at) {
    struct wire_segment wire;
    wire_get_segment(at, &wire);
    struct host_queue_segment segment = {.duration_us = wire.duration_us,
                                         .entry_speed_sq = wire.entry_speed_sq,
                                         .exit_speed_sq = wire.exit_speed_sq,
                                         .id = wire.id,
                                         .flags = wire.flags & FROM_WIRE};
    memcpy(segment.steps, wire.steps, sizeof segment.steps);
    return segment;
}
