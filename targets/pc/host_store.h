/* SPDX-License-Identifier: MIT
 * struct hal_store in one file: { key | ~key | count (2 bytes) | bytes } after each other, the last of them a
 * list of the keys; replaced by an atomic rename. A damaged file is copied to FILE.damaged when its damage is
 * acknowledged. */
#ifndef WIFICNC_PC_STORE_H
#define WIFICNC_PC_STORE_H

#include "hal/hal.h"

/** Keys are 0 .. 15. */
enum {
    HOST_STORE_KEYS = 16,
    HOST_STORE_TRUST = 15
}; /* HOST_STORE_TRUST: addresses that are trusted for ever */

/** ctx is the file's path, a NUL-terminated string. A file that is not there is empty; one that cannot be
 * written makes save() return false. */
extern const struct hal_store host_store;

#endif
