/* SPDX-License-Identifier: MIT
 * Debug channels: compiled in by -DWIFICNC_DEBUG=DEBUG_MOTION|..., gone otherwise. The text is always
 * compiled, so it cannot rot, and costs nothing in a release: the condition is a constant 0. [task] Never in
 * the step ISR. */
#ifndef WIFICNC_BASE_DEBUG_H
#define WIFICNC_BASE_DEBUG_H

#include <stdint.h>

/** Channels; bits of WIFICNC_DEBUG. */
enum debug_channel {
    DEBUG_MACHINE = 0x01, /* lines and their answers */
    DEBUG_MOTION = 0x02,  /* blocks planned, segments emitted */
    DEBUG_STEP = 0x04,    /* segments cut into spans */
};

#ifndef WIFICNC_DEBUG
#define WIFICNC_DEBUG 0
#endif

/** Supplied by the target when any channel is on: one line, two numbers with their meaning in `what`. */
void hal_debug(enum debug_channel channel, const char *what, int32_t first, int32_t second);

#define DEBUG(channel, what, first, second)                                                                  \
    do {                                                                                                     \
        if (((WIFICNC_DEBUG) & (channel)) != 0)                                                              \
            hal_debug((channel), (what), (int32_t)(first), (int32_t)(second));                               \
    } while (0)

#endif
