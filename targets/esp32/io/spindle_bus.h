/* SPDX-License-Identifier: MIT
 * RS-485 for a spindle drive: one UART, which enables the driver of the bus (RTS is DE) by itself from before
 * the first start bit until the last stop bit has left, and does not receive meanwhile. [task] */
#ifndef WIFICNC_ESP32_SPINDLE_BUS_H
#define WIFICNC_ESP32_SPINDLE_BUS_H

#include <stdint.h>

struct hal_bus;
struct machine_vfd;

/** UART and pins of the board file; de: 255 = the transceiver switches by itself. */
struct spindle_bus_wire {
    uint8_t uart, tx, rx, de;
};

/** [start] @return NULL: the UART or its memory cannot be had */
const struct hal_bus *spindle_bus_init(const struct spindle_bus_wire *wire);

/** [start] Memory of the drive's state, from the heap: boards without a bus have none. @return NULL: none
 * left */
struct machine_vfd *spindle_bus_drive(void);

#endif
