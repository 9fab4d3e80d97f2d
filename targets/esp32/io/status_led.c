/* SPDX-License-Identifier: MIT */
#include "io/status_led.h"

static bool phase(uint32_t now_ms, uint32_t half_ms) {
    return now_ms / half_ms % 2 == 0;
}

struct led_colour status_led_colour(enum led_state state, uint32_t now_ms) {
    static const struct led_colour dark = {0, 0, 0}, red = {LED_LEVEL, 0, 0}, green = {0, LED_LEVEL, 0},
                                   blue = {0, 0, LED_LEVEL}, yellow = {LED_LEVEL, LED_LEVEL, 0};
    switch (state) {
    case LED_READY:
        return blue;
    case LED_RUNNING:
        return green;
    case LED_ALARM:
        return phase(now_ms, LED_FAST_MS) ? yellow : dark;
    case LED_DISCONNECTED:
    default:
        return phase(now_ms, LED_SLOW_MS) ? red : dark;
    }
}

bool status_led_is_on(enum led_state state, uint32_t now_ms) {
    switch (state) {
    case LED_READY:
        return true;
    case LED_RUNNING:
        return phase(now_ms, LED_SLOW_MS);
    case LED_ALARM:
        return phase(now_ms, LED_FAST_MS);
    case LED_DISCONNECTED:
    default:
        return false;
    }
}
