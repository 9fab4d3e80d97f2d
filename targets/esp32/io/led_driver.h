/* SPDX-License-Identifier: MIT
 * The status LED itself: a WS2812 timed by RMT, or a plain LED. [task] */
#ifndef WIFICNC_ESP32_LED_DRIVER_H
#define WIFICNC_ESP32_LED_DRIVER_H

#include "io/pin_map.h"
#include "net_light.h"

/** @return false: the board has none, or RMT did not start; led_driver_show() does nothing then */
bool led_driver_init(const struct pin_wire *wire);

/** Every 50 ms or so. @param now_ms  wraps */
void led_driver_show(enum net_light light, uint32_t now_ms);

#endif
