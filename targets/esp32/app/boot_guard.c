/* SPDX-License-Identifier: MIT */
#include "app/boot_guard.h"

#define MAGIC 0x57434E43u /* "WCNC" */

/* Memory that a reset does not clear holds anything after power-on; the mark and the complement show that
 * this is ours. */
static void set(struct boot_guard *kept, uint32_t crashes) {
    *kept = (struct boot_guard){.magic = MAGIC, .crashes = crashes, .check = ~crashes};
}

/* Once the limit is reached it stays so until a power cycle: safe mode must not end by another reset. */
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
