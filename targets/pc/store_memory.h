/* SPDX-License-Identifier: MIT
 * struct hal_store in memory, for a controller that keeps nothing: it lasts from one start to the next. */
#ifndef WIFICNC_PC_STORE_MEMORY_H
#define WIFICNC_PC_STORE_MEMORY_H

#include "hal/hal.h"
#include "settings/store.h"

enum { STORE_MEMORY_KEYS = 16 };

/** All zero: nothing is stored. */
struct store_memory {
    size_t count[STORE_MEMORY_KEYS];
    uint8_t bytes[STORE_MEMORY_KEYS][STORE_BATCH_SIZE];
};

/** ctx is a struct store_memory. */
extern const struct hal_store store_memory;

#endif
