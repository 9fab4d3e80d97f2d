/* SPDX-License-Identifier: MIT
 * Device mode 1: this board is an I/O expansion. [task, core 0] No motion: neither machine nor step timer are
 * started. Its channels are commanded by the binary protocol; next to it there is what every mode has, the
 * network with updates and a name. */
#ifndef WIFICNC_ESP32_IO_MODULE_H
#define WIFICNC_ESP32_IO_MODULE_H

#include "net_wire.h"
#include "store/nvs_store.h"

struct io_module {
    struct channels *channels;
    struct session *session;
    struct net_wire *wire;
    struct session_module device;
    bool has_wire; /* hosts are served */
    bool locked;   /* before an update locked the outputs */
};

/** [start, behind network_start()] Settings come from the storage; the channels are at work.
 * @param module  channels, session and wire are filled in @param store  lives as long
 * @param options, ops  as session_init_module() wants them */
void io_module_start(struct io_module *module, const struct nvs_store *store,
                     const struct session_options *options, const struct session_ops *ops);

/** Every ms. */
void io_module_round(struct io_module *module);

/** For updates: outputs are safe, and stay so until the end of it. */
void io_module_lock(struct io_module *module);
void io_module_unlock(struct io_module *module);

#endif
