/* SPDX-License-Identifier: MIT */
#include "store_memory.h"

#include <string.h>

static size_t load(const void *ctx, uint8_t key, void *bytes, size_t size) {
    const struct store_memory *memory = ctx;
    if (key >= STORE_MEMORY_KEYS)
        return 0;
    const size_t count = memory->count[key] < size ? memory->count[key] : size;
    memcpy(bytes, memory->bytes[key], count);
    return count;
}

static enum hal_store_state save(const void *ctx, const struct hal_store_value *values, size_t count) {
    struct store_memory *memory = (struct store_memory *)(uintptr_t)ctx; /* ctx of a store is const */
    for (size_t i = 0; i < count; i++)
        if (values[i].key >= STORE_MEMORY_KEYS || values[i].count > sizeof memory->bytes[0])
            return HAL_STORE_FAILED;
    for (size_t i = 0; i < count; i++) {
        memory->count[values[i].key] = values[i].count;
        memcpy(memory->bytes[values[i].key], values[i].bytes, values[i].count);
    }
    return HAL_STORE_DONE;
}

/* Nothing in it is ever damaged. */
static enum hal_store_state set_aside(const void *ctx) {
    (void)ctx;
    return HAL_STORE_DONE;
}

const struct hal_store store_memory = {.load = load, .save = save, .set_aside = set_aside};
