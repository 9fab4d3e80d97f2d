/* SPDX-License-Identifier: MIT
 * Properties of the core that hold on every processor: run on this computer, by `pio test -e native`, and as
 * Xtensa code in an emulator. Only <stdio.h> is needed around it. */
#include "base/pow.h"
#include "base/ring.h"
#include "base/trig.h"
#include "gcode/number.h"
#include "input/line_reader.h"
#include "settings/store.h"

#include <stdio.h>
#include <string.h>

static unsigned failures;

static void check(bool good, const char *what) {
    if (!good) {
        printf("%s\n", what);
        failures++;
    }
}

/* Pythagoras, symmetry and the inverse, at angles that no table holds. */
static void sine_and_cosine_agree_with_geometry(void) {
    for (int n = -4000; n <= 4000; n++) {
        double angle_rad = 0.001 * n, sine, cosine, mirrored_sine, mirrored_cosine;
        trig_sincos(angle_rad, &sine, &cosine);
        trig_sincos(-angle_rad, &mirrored_sine, &mirrored_cosine);
        double one = sine * sine + cosine * cosine;
        check(one > 1 - 1e-15 && one < 1 + 1e-15, "sin^2 + cos^2 is not 1");
        check(mirrored_sine == -sine && mirrored_cosine == cosine, "sine is not odd, or cosine not even");
        double back_rad = trig_atan2(sine, cosine);
        if (angle_rad > -3.14 && angle_rad < 3.14)
            check(back_rad > angle_rad - 2e-15 && back_rad < angle_rad + 2e-15, "atan2 does not lead back");
    }
}

static void a_power_is_its_product(void) {
    double product = 1.0;
    for (int exponent = 0; exponent <= 30; exponent++, product *= 3.0)
        check(power_raise(3.0, exponent) == product, "3^n is not the product of n threes");
    double e = power_exp(power_ln(12345.678));
    check(e > 12345.678 * (1 - 1e-14) && e < 12345.678 * (1 + 1e-14), "exp does not undo ln");
}

static void a_ring_knows_what_it_holds_when_its_indices_wrap(void) {
    struct ring ring = {.head = UINT32_MAX - 1, .tail = UINT32_MAX - 1};
    for (uint32_t held = 0; held < 4; held++, ring_push(&ring))
        check(ring_held(&ring) == held && ring_free(&ring, 4) == 4 - held, "a ring counts wrong");
    for (uint32_t held = 4; held > 0; held--, ring_pop(&ring))
        check(ring_held(&ring) == held && ring_free(&ring, 4) == 4 - held, "a ring counts wrong");
}

static void decimals_are_read_to_the_nearest_double(void) {
    static const struct {
        const char *text;
        double value;
    } rows[] = {{"0.1", 0.1}, {"-12.375", -12.375}, {"+.5", 0.5}, {"100000", 1e5}, {"0.000001", 1e-6}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        double value = 0;
        const char *end = number_read(rows[i].text, &value);
        check(end == rows[i].text + strlen(rows[i].text) && value == rows[i].value, rows[i].text);
    }
    double untouched = 7;
    check(number_read("-", &untouched) == NULL && untouched == 7, "a sign alone is a number");
}

static void a_line_loses_blanks_and_comments(void) {
    static const char text[] = "g1 (away) x1.5 ; rest\r\n";
    struct line_reader reader;
    unsigned lines = 0;
    line_reader_reset(&reader);
    for (const char *at = text; *at != '\0'; at++)
        if (line_reader_put(&reader, (uint8_t)*at) == LINE_READY) {
            lines++;
            check(strcmp(reader.text, "G1X1.5") == 0, "a line is not filtered");
        }
    check(lines == 1, "CR LF is not one end of a line");
}

/* Every single damaged bit is noticed. */
static void a_damaged_image_of_settings_is_refused(void) {
    const struct store_pair pairs[] = {{100, 80.0F}, {110, 5000.0F}, {132, 200.5F}};
    struct store_pair back[SETTINGS_COUNT];
    uint8_t image[STORE_IMAGE_MAX];
    size_t size = store_pack(image, pairs, 3);
    check(store_unpack(image, size, back) == 3 && back[2].value == 200.5F, "packed is not unpacked");
    for (size_t bit = 0; bit < 8 * size; bit++) {
        image[bit / 8] ^= (uint8_t)(1u << bit % 8);
        check(store_unpack(image, size, back) == 0, "a damaged image is taken");
        image[bit / 8] ^= (uint8_t)(1u << bit % 8);
    }
}

int main(void) {
    sine_and_cosine_agree_with_geometry();
    a_power_is_its_product();
    a_ring_knows_what_it_holds_when_its_indices_wrap();
    decimals_are_read_to_the_nearest_double();
    a_line_loses_blanks_and_comments();
    a_damaged_image_of_settings_is_refused();
    printf("%u failures\n", failures);
    return failures == 0 ? 0 : 1;
}
