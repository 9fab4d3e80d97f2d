/* SPDX-License-Identifier: MIT
 * Which outputs the board has, from its pin map. */
#ifndef WIFICNC_ESP32_WIRED_H
#define WIFICNC_ESP32_WIRED_H

#include "io/pin_map.h"

/** @return BOARD_OUTPUT_ bits of machine/machine.h, as the pins are now: a signal may have been moved or
 * taken off at run time */
uint8_t wired_outputs(const struct pin_map *map);

/** @return digital outputs of M62 .. M65 up to the last one that has a pin */
uint8_t wired_digital_outputs(const struct pin_map *map);

#endif
