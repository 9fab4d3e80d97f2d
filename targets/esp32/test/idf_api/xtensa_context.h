/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's xtensa_context.h, declared again: enough to compile against, checked against
 * the real one by tools/xtensa with IDF_PATH set. */
#pragma once

typedef struct {
    long exit, pc, ps, a0, a1;
} XtExcFrame;
