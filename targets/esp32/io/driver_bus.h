/* SPDX-License-Identifier: MIT
 * The bus of motor drivers with registers: one UART, whose TX reaches their single wire through a resistor,
 * or an SPI controller with a select line for each chain or driver. [task] */
#ifndef WIFICNC_ESP32_DRIVER_BUS_H
#define WIFICNC_ESP32_DRIVER_BUS_H

#include "drivers/drivers.h"

struct machine_drivers;

/** UART or SPI controller and pins of the board file; 255: no such pin. */
struct driver_bus_wire {
    uint8_t number; /* of the UART or SPI controller */
    bool uart;
    uint8_t tx, rx;
    uint8_t mosi, miso, sclk;
    uint8_t select_count;
    uint8_t select[DRIVER_COUNT_MAX];
};

/** [start] @return NULL: the controller or its memory cannot be had */
const struct hal_driver_bus *driver_bus_init(const struct driver_bus_wire *wire);

/** [start] Memory of the drivers' state, from the heap: boards with plain drivers have none.
 * @return NULL: none left */
struct machine_drivers *driver_bus_drivers(void);

#endif
