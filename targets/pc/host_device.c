/* SPDX-License-Identifier: MIT */
#include "host_device.h"

#include "host_inner.h"
#include "host_store.h"
#include "settings/store.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

enum { KEY_DEVICE = HOST_STORE_KEYS - 2, DEVICE_VERSION = 1 };

bool host_device_parse(const char *text, struct device_board *board) {
    int used = 0;
    for (unsigned n = 0; n < DEVICE_PINS; n++, text += used)
        if (sscanf(text, "%" SCNu8 ":%" SCNx64 "%*[,;]%n", &board->wiring.pin[n], &board->legal[n], &used) !=
            2)
            return false;
    return sscanf(text, "%" SCNu8 ",%" SCNu16 ",%" SCNu8 "%n", &board->wiring.estop_high,
                  &board->encoder_filter_ns, &board->ethernet_host, &used) == 3 &&
           text[used] == '\0';
}

/* ---- the file ---- */

static bool keep(struct host_device *device, const struct host_device_kept *kept) {
    if (!store_save(&device->store, KEY_DEVICE, DEVICE_VERSION, kept, sizeof *kept))
        return false;
    device->kept = *kept;
    return true;
}

/* No one can be locked out of a simulator: nothing is on trial. */
static bool keep_wiring(void *ctx, const struct device_wiring *wiring, const struct device_wiring *before) {
    (void)before;
    struct host_device *device = ctx;
    struct host_device_kept kept = device->kept;
    kept.wiring = *wiring;
    return keep(device, &kept);
}

static bool keep_network(void *ctx, const struct device_network *network,
                         const struct device_network *before) {
    struct host_device *device = ctx;
    struct host_device_kept kept = device->kept;
    kept.network = *network;
    kept.on_trial = before != NULL;
    if (before != NULL)
        kept.before = *before;
    return keep(device, &kept);
}

static void join(void *ctx) {
    struct host_device *device = ctx;
    device->joined++;
}

/* ---- start ---- */

void host_device_init(struct host_device *device, const struct host *host) {
    static const struct device_ops ops = {
        .keep_wiring = keep_wiring, .keep_network = keep_network, .join = join};
    const struct machine_board *board = &host->machine.board;
    struct host_device_kept kept;
    memset(device, 0, sizeof *device);
    device->board = host->device;
    device->store = (struct store){.ops = board->store, .ctx = board->store_ctx};
    device->kept.wiring = device->board.wiring;
    device->device = (struct device){.ops = &ops,
                                     .ctx = device,
                                     .legal = device->board.legal,
                                     .encoder_filter_ns = device->board.encoder_filter_ns,
                                     .ethernet_host = device->board.ethernet_host,
                                     .wiring = device->board.wiring};
    bool found = store_load(&device->store, KEY_DEVICE, DEVICE_VERSION, &kept, sizeof kept) == STORE_FOUND;
    if (found) {
        device->kept = kept;
        (void)device_take_wiring(&device->device, &kept.wiring);
        device->device.network = kept.network;
        device->device.before = kept.before;
    }
    device_begin(&device->device, found && kept.on_trial != 0, 0);
}
