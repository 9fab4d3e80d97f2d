/* SPDX-License-Identifier: MIT */
#include "app/boot_guard.h"

#define MAGIC 0x57434E43u /* "WCNC" */

static void set(struct boot_guard *kept, uint32_t crashes) {
    *kept = (struct boot_guard){.magic = MAGIC, .crashes = crashes, .check = ~crashes};
}

bool boot_guard_begin(struct boot_guard *kept, enum boot_cause cause) {
    bool valid = kept->magic == MAGIC && kept->check == ~kept->crashes;
    uint32_t before = valid && cause != BOOT_POWER ? kept->crashes : 0;
    set(kept, cause == BOOT_CRASH && before < BOOT_CRASHES_ALLOWED ? before + 1 : before);
    return kept->crashes >= BOOT_CRASHES_ALLOWED;
}

void boot_guard_healthy(struct boot_guard *kept) {
    if (kept->crashes < BOOT_CRASHES_ALLOWED) /* what runs in safe mode is not all of the firmware */
        set(kept, 0);
}
