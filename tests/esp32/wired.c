/* SPDX-License-Identifier: MIT
 * Prints which outputs the board of pin_config.h has, and which are left when the spindle's enable is taken
 * off. */
#include "app/wired.h"

#include <stdio.h>
#include <string.h>

static bool spindle_off(void *ctx, const char *key, uint8_t *gpio) {
    (void)ctx;
    *gpio = 255;
    return strstr(key, "spn") != NULL;
}

static void tell(void *ctx, const char *text) {
    (void)ctx;
    (void)text;
}

int main(void) {
    struct pin_map map;
    pin_map_init(&map);
    printf("%u", wired_outputs(&map));
    pin_map_move(&map, &(struct pin_moves){.read = spindle_off, .tell = tell});
    printf(" %u\n", wired_outputs(&map));
    return 0;
}
