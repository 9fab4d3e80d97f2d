/* SPDX-License-Identifier: MIT
 * The simulated board as keys of the binary protocol: the pins of its board file, and a network that is only
 * stored. One thread, as the host. */
#ifndef WIFICNC_PC_HOST_DEVICE_H
#define WIFICNC_PC_HOST_DEVICE_H

#include "device/device.h"
#include "settings/store.h"

struct host;

/** As in the file. */
struct host_device_kept {
    struct device_wiring wiring;
    struct device_network network, before;
    uint32_t on_trial;
};

struct host_device {
    struct device device;
    struct device_board board;
    struct store store;
    struct host_device_kept kept;
    unsigned joined; /* how often the network was taken into use */
};

/** "PIN:LEGAL,..." of every pin, LEGAL in hex, then ";ESTOP_HIGH,ENCODER_FILTER_NS,ETHERNET_HOST".
 * @return false: it is something else */
bool host_device_parse(const char *text, struct device_board *board);

/** After the machine has started. */
void host_device_init(struct host_device *device, const struct host *host);

#endif
