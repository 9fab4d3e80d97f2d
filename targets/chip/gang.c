/* SPDX-License-Identifier: MIT */
#include "gang.h"

struct gang gang_of(unsigned axis_count, axis_mask_t axes) {
    struct gang gang = {.axes = axes};
    unsigned motor = axis_count;
    for (unsigned n = 0; n < AXIS_COUNT; n++)
        gang.axis[n] = (uint8_t)(n < axis_count ? n : NO_AXIS);
    for (unsigned ax = 0; ax < axis_count; ax++) {
        if ((axes >> ax & 1) == 0)
            continue;
        gang.axis[motor] = (uint8_t)ax;
        gang.second[ax] = (uint8_t)motor++;
    }
    return gang;
}

void gang_take(struct gang *gang, unsigned axis, unsigned from) {
    gang->axes = (axis_mask_t)(gang->axes | 1u << axis);
    gang->axis[from] = (uint8_t)axis;
    gang->second[axis] = (uint8_t)from;
}

unsigned gang_motors(const struct gang *gang, axis_mask_t first, axis_mask_t second) {
    unsigned motors = 0;
    for (unsigned motor = 0; motor < AXIS_COUNT; motor++) {
        axis_mask_t axes = gang->axis[motor] == motor ? first : second;
        if (gang->axis[motor] != NO_AXIS && (axes >> gang->axis[motor] & 1) != 0)
            motors |= 1u << motor;
    }
    return motors;
}
