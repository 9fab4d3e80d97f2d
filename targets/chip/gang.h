/* SPDX-License-Identifier: MIT
 * Which axis each motor belongs to. Motors 0 .. axis_count - 1 are the first ones of the axes; a second motor
 * of an axis has one of the numbers behind them, or is the first one of an axis that the machine does not
 * have, so that six motors, however they are shared out, need six of everything: pins, inputs, enable lines.
 * Pure. */
#ifndef WIFICNC_CHIP_GANG_H
#define WIFICNC_CHIP_GANG_H

#include "base/axis.h"
#include "hal/compiler.h"

#include <stdbool.h>
#include <stdint.h>

/** An axis number that is none. */
enum { NO_AXIS = 0xFF };

struct gang {
    axis_mask_t axes;           /* with a second motor */
    uint8_t axis[AXIS_COUNT];   /* of motor n: the axis that it moves; NO_AXIS: there is no such motor */
    uint8_t second[AXIS_COUNT]; /* of an axis of `axes`: the number of its second motor */
};

/** The board's axes, and behind them the second motors in the order of their axes. @param axes  with a second
 * motor; both together are AXIS_COUNT motors at most */
struct gang gang_of(unsigned axis_count, axis_mask_t axes);

/** The first motor of axis `from`, which is no axis any more, is the second one of `axis`. It keeps its
 * number, and so its pins and inputs. */
void gang_take(struct gang *gang, unsigned axis, unsigned from);

/** Bit n = motor n: the first motors of these axes, and the second ones of those. */
unsigned gang_motors(const struct gang *gang, axis_mask_t first, axis_mask_t second);

/** [any context] Of bits of motors those of the second ones, as bits of their axes. */
static HAL_INLINE axis_mask_t gang_seconds(const struct gang *gang, uint32_t motors) {
    unsigned axes = 0;
    for (unsigned ax = 0; gang->axes != 0 && ax < AXIS_COUNT; ax++)
        if ((gang->axes >> ax & 1) != 0)
            axes |= (motors >> gang->second[ax] & 1u) << ax;
    return (axis_mask_t)axes;
}

#endif
