/* SPDX-License-Identifier: MIT
 * The channels of an I/O module on GPIO pins. [task] */
#ifndef WIFICNC_ESP32_LINES_H
#define WIFICNC_ESP32_LINES_H

#include "channels/channels.h"
#include "io/pin_map.h"
#include "store/nvs_store.h"

struct lines {
    struct channels_wiring wiring;
    const struct pin_map *map;     /* pins of the board that stay its own, such as the LED's */
    const struct nvs_store *store; /* ops NULL: nothing is kept */
};

/** No line is wired. @param map, store  live as long */
void lines_init(struct lines *lines, const struct pin_map *map, const struct nvs_store *store);

/** ctx is a struct lines. */
extern const struct channels_ops lines_ops;

#endif
