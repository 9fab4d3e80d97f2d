/* SPDX-License-Identifier: MIT
 * Prints which outputs the board of pin_config.h has, and which are left when the spindle's enable and
 * the first digital outputs are taken off; then the pins of the board by the keys of the binary protocol, and
 * its other facts. */
#include "app/wired.h"
#include "app/device_keys.h"

#include <stdio.h>
#include <string.h>

/* The spindle's enable and the first two digital outputs. */
static bool off(void *ctx, const char *key, uint8_t *gpio) {
    (void)ctx;
    *gpio = 255;
    return strstr(key, "spn") != NULL || strstr(key, "p_mo") != NULL;
}

static void tell(void *ctx, const char *text) {
    (void)ctx;
    (void)text;
}

void network_join_stored(void) {}

int main(void) {
    struct nvs_store store = {.ops = NULL};
    struct pin_map map;
    pin_map_init(&map);
    const struct device *device = device_keys_create(&map, &store);
    printf("%u %u", wired_outputs(&map), wired_digital_outputs(&map));
    pin_map_move(&map, &(struct pin_moves){.read = off, .tell = tell});
    printf(" %u %u\n", wired_outputs(&map), wired_digital_outputs(&map));
    for (unsigned n = 0; n < DEVICE_PINS; n++)
        printf("%u ", device->wiring.pin[n]);
    printf("\n%u %u %u\n", device->wiring.estop_high, device->encoder_filter_ns, device->ethernet_host);
    return 0;
}
