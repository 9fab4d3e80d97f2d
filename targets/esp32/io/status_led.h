/* SPDX-License-Identifier: MIT
 * What the status LED shows. [task] Pure: no clock, no pin.
 *
 *   state                      WS2812               plain LED
 *   no one is connected        red, slow blink      off
 *   connected, at rest         blue                 on
 *   connected, running         green                slow blink
 *   alarm, e-stop, safe mode   yellow, fast blink   fast blink */
#ifndef WIFICNC_ESP32_STATUS_LED_H
#define WIFICNC_ESP32_STATUS_LED_H

#include <stdbool.h>
#include <stdint.h>

enum { LED_SLOW_MS = 500, LED_FAST_MS = 125, LED_LEVEL = 20 }; /* half a period; of 255: it must not dazzle */

enum led_state { LED_DISCONNECTED, LED_READY, LED_RUNNING, LED_ALARM };

struct led_colour {
    uint8_t red, green, blue;
};

/** @param now_ms  wraps */
struct led_colour status_led_colour(enum led_state state, uint32_t now_ms);
bool status_led_is_on(enum led_state state, uint32_t now_ms);

#endif
