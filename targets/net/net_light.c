/* SPDX-License-Identifier: MIT */
#include "net_light.h"

#define RED    {NET_LIGHT_LEVEL, 0, 0}
#define YELLOW {NET_LIGHT_LEVEL, NET_LIGHT_LEVEL, 0}
#define GREEN  {0, NET_LIGHT_LEVEL, 0}
#define CYAN   {0, NET_LIGHT_LEVEL, NET_LIGHT_LEVEL}
#define BLUE   {0, 0, NET_LIGHT_LEVEL}
#define VIOLET {NET_LIGHT_LEVEL, 0, NET_LIGHT_LEVEL}

struct pattern {
    uint16_t on_ms, off_ms;
};

static const struct {
    const char *name;
    struct net_light_colour colour;
    struct pattern blink, plain;
} lights[] = {
#define LIGHT(name, colour, on_ms, off_ms, plain_on_ms, plain_off_ms, text)                                  \
    {#name, colour, {on_ms, off_ms}, {plain_on_ms, plain_off_ms}},
#include "net_light.def"
#undef LIGHT
};

enum net_light net_light_of(const struct net_light_facts *facts) {
    return facts->alarm        ? NET_LIGHT_ALARM
           : !facts->at_rest   ? NET_LIGHT_RUNNING
           : facts->controlled ? NET_LIGHT_READY
           : facts->joined     ? NET_LIGHT_JOINED
           : facts->joining    ? NET_LIGHT_JOINING
           : facts->own        ? NET_LIGHT_OWN_NETWORK
                               : NET_LIGHT_NO_NETWORK;
}

const char *net_light_name(enum net_light light) {
    return lights[light].name;
}

static bool is_on(struct pattern pattern, uint32_t now_ms) {
    return now_ms % (uint32_t)(pattern.on_ms + pattern.off_ms) < pattern.on_ms;
}

struct net_light_colour net_light_colour(enum net_light light, uint32_t now_ms) {
    static const struct net_light_colour dark = {0, 0, 0};
    return is_on(lights[light].blink, now_ms) ? lights[light].colour : dark;
}

bool net_light_is_on(enum net_light light, uint32_t now_ms) {
    return is_on(lights[light].plain, now_ms);
}
