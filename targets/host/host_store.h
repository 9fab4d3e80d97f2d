/* SPDX-License-Identifier: MIT
 * struct hal_store in one file: { key | ~key | count (2 bytes) | bytes } after each other, replaced by an
 * atomic rename. */
#ifndef WIFICNC_HOST_STORE_H
#define WIFICNC_HOST_STORE_H

#include "hal/hal.h"

/** ctx is the file's path, a NUL-terminated string. A file that is not there is empty; one that cannot be
 * written makes save() return false. */
extern const struct hal_store host_store;

#endif
