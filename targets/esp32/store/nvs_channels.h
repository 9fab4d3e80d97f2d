/* SPDX-License-Identifier: MIT
 * The configuration of an I/O module in NVS, each number under its own key (protocol/nvs.toml), so that
 * `wificnc nvs` knows them. [task] A power cut leaves all old or all new values, by the same way as
 * nvs_store.h. */
#ifndef WIFICNC_ESP32_NVS_CHANNELS_H
#define WIFICNC_ESP32_NVS_CHANNELS_H

#include "channels/channels.h"
#include "store/nvs_store.h"

/** Values that are stored and in their range; the others stay as they are. */
void nvs_channels_load(const struct nvs_store *store, struct channels *channels);

/** Keep what has changed. @return false: the storage has failed, or there is none */
bool nvs_channels_keep(const struct nvs_store *store, const struct channels_config *config);

#endif
