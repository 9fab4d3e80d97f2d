/* SPDX-License-Identifier: MIT
 * The emitter's state at a mark: kept, taken back, given up. Behind motion/emit.h. [task] */
#ifndef WIFICNC_MOTION_EMIT_PLACE_H
#define WIFICNC_MOTION_EMIT_PLACE_H

#include "segment/ahead.h"

/* Of struct ahead_source; ctx: struct emit. */

void emit_save(void *ctx, uint32_t at);
void emit_load(void *ctx, uint32_t at, enum ahead_return why);
void emit_release(void *ctx, uint32_t at);

#endif
