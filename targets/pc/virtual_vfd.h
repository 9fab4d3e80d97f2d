/* SPDX-License-Identifier: MIT
 * The spindle drive of the virtual machine: whichever $395 names, at $460. It turns the virtual spindle, so
 * that its ramp, its load and its encoder are those of hands.h. */
#ifndef WIFICNC_PC_VIRTUAL_VFD_H
#define WIFICNC_PC_VIRTUAL_VFD_H

#include <stddef.h>
#include <stdint.h>

struct hal;

/** A request of the controller. @param end_ticks  when its last bit leaves */
void virtual_vfd_hear(struct hal *hal, uint64_t end_ticks, const uint8_t *bytes, size_t count);

#endif
