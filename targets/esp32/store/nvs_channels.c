/* SPDX-License-Identifier: MIT */
#include "store/nvs_channels.h"

#include "store/nvs_names.h"

static const char pending[] = "io_pending";

static const struct row {
    const char *key;
    uint8_t index, type; /* enum nvs_type */
} rows[] = {
#define ROW(key, index, bits) {key, index, (bits) == 16 ? NVS_U16 : NVS_U8},
    NVS_CHANNELS(ROW)};
enum { ROWS = sizeof rows / sizeof rows[0] };
_Static_assert((int)ROWS == (int)CHANNELS_VALUES, "every value has its key");

static bool is_kept(const struct nvs_store *store, const struct row *row, uint16_t value) {
    uint32_t kept;
    return store->ops->get(store->ctx, row->key, (enum nvs_type)row->type, &kept) && kept == value;
}

static unsigned changes(const struct nvs_store *store, const struct channels_config *config) {
    unsigned changed = 0;
    for (const struct row *row = rows; row < rows + ROWS; row++)
        changed += !is_kept(store, row, config->value[row->index]);
    return changed;
}

static bool put_all(const struct nvs_store *store, const struct channels_config *config) {
    for (const struct row *row = rows; row < rows + ROWS; row++) {
        uint16_t value = config->value[row->index];
        if (!is_kept(store, row, value) &&
            !store->ops->set(store->ctx, row->key, (enum nvs_type)row->type, value))
            return false;
    }
    return true;
}

/* A power cut came between: what was to be kept is known whole. */
static void finish_pending(const struct nvs_store *store) {
    struct channels_config config;
    if (store->ops->get_blob(store->ctx, pending, &config, sizeof config) == sizeof config &&
        put_all(store, &config))
        (void)store->ops->erase(store->ctx, pending);
}

void nvs_channels_load(const struct nvs_store *store, struct channels *channels) {
    uint32_t value;
    if (store->ops == NULL)
        return;
    finish_pending(store);
    for (const struct row *row = rows; row < rows + ROWS; row++)
        if (store->ops->get(store->ctx, row->key, (enum nvs_type)row->type, &value))
            (void)channels_set_value(channels, row->index, value);
}

/* NVS keeps one entry whole through a power cut. Several are written as one blob first, which the next
 * start finishes (finish_pending()). */
bool nvs_channels_keep(const struct nvs_store *store, const struct channels_config *config) {
    if (store->ops == NULL)
        return false;
    if (changes(store, config) <= 1)
        return put_all(store, config);
    return store->ops->set_blob(store->ctx, pending, config, sizeof *config) && put_all(store, config) &&
           store->ops->erase(store->ctx, pending);
}
