/* SPDX-License-Identifier: MIT */
#include "host_device.h"

#include "host_inner.h"

#include <inttypes.h>
#include <stdio.h>

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

void host_device_init(struct host_device *device, const struct host *host) {
    static const struct device_ops ops = {NULL, NULL, NULL};
    *device = (struct host_device){.board = host->device};
    device->device = (struct device){.ops = &ops,
                                     .ctx = device,
                                     .legal = device->board.legal,
                                     .encoder_filter_ns = device->board.encoder_filter_ns,
                                     .ethernet_host = device->board.ethernet_host,
                                     .wiring = device->board.wiring};
    device_begin(&device->device, false, 0);
}
