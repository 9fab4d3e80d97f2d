/* SPDX-License-Identifier: MIT
 * Pins and network in NVS (core/device). [task] Each under its own key, as `wificnc nvs` knows it.
 *
 * NVS keeps each key atomically, not several. Pins that change together first go into one blob, which the
 * next start finishes. Before a network changes, the one before goes into another blob: as long as that is
 * there, the network is on trial, whatever a power cut has left of it. */
#ifndef WIFICNC_ESP32_NVS_DEVICE_H
#define WIFICNC_ESP32_NVS_DEVICE_H

#include "device/device.h"
#include "store/nvs_store.h"

/** [start, before pins are read] A power cut came between: what was to be stored is known whole. */
void nvs_device_finish(const struct nvs_store *store);

/** On trial from the next start on. @param before  what returns if no one comes
 * @return false: the storage has failed, or there is none */
bool nvs_device_keep_wiring(const struct nvs_store *store, const struct device_wiring *wiring,
                            const struct device_wiring *before);

/** @param[out] before  of a network on trial @return it is on trial */
bool nvs_device_load_network(const struct nvs_store *store, struct device_network *network,
                             struct device_network *before);

/** As device_ops.keep_network. */
bool nvs_device_keep_network(const struct nvs_store *store, const struct device_network *network,
                             const struct device_network *before);

/** Someone at the machine has set another network: no trial. */
void nvs_device_end_trial(const struct nvs_store *store);

/** The storage's key of a pin. @param index  as in struct device_wiring @return NULL: it cannot be moved */
const char *nvs_device_pin_key(unsigned index);

/** Pins were changed over the network before this start, and are on trial. */
bool nvs_device_wiring_is_on_trial(const struct nvs_store *store);

/** The trial is over. @param stays  false: the pins before it are stored again, for the next start
 * @return false: the storage has failed */
bool nvs_device_end_wiring_trial(const struct nvs_store *store, bool stays);

#endif
