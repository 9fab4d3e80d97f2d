/* SPDX-License-Identifier: MIT
 * Parts of the ESP32's input and output that need no register: bouncing inputs, counters, tables of port
 * bits. */
#include "base/debounce.h"
#include "io/dial_counts.h"
#include "io/encoder_counts.h"
#include "step_pins.h"

#include <stdio.h>
#include <string.h>

enum { SWITCH = 3, BUTTON = 31 };

static unsigned failures;

static void check(bool good, const char *what) {
    if (!good) {
        printf("%s\n", what);
        failures++;
    }
}

static struct debounce make(void) {
    struct debounce debounce = {
        .time = {[SWITCH] = {.on_us = 0, .off_us = 5000}, [BUTTON] = {.on_us = 20000, .off_us = 20000}}};
    debounce_start(&debounce, 0);
    return debounce;
}

static void a_switch_is_on_at_its_first_edge_and_off_when_it_is_quiet(void) {
    struct debounce debounce = make();
    const uint32_t on = 1u << SWITCH;
    uint32_t t = UINT32_MAX - 2000; /* the clock wraps meanwhile */
    check(debounce_sample(&debounce, on, t) == on, "the first edge does not count");
    for (int bounce = 0; bounce < 10; bounce++) {
        check(debounce_sample(&debounce, 0, t += 300) == 0, "a bounce switches off");
        check(debounce_sample(&debounce, on, t += 300) == 0, "a bounce is news");
    }
    check(debounce.stable == on && debounce.glitches[SWITCH] == 10, "not 10 glitches");
    check(debounce_sample(&debounce, 0, t += 1) == 0, "off at once");
    check(debounce_sample(&debounce, 0, t + 4999) == 0, "off too early");
    check(debounce_sample(&debounce, 0, t + 5000) == on && debounce.stable == 0, "never off");
    check(debounce.glitches[SWITCH] == 10, "a true edge is a glitch");
}

static void a_button_must_be_held(void) {
    struct debounce debounce = make();
    const uint32_t on = 1u << BUTTON;
    check(debounce_sample(&debounce, on, 0) == 0, "on at once");
    check(debounce_sample(&debounce, 0, 100) == 0 && debounce.glitches[BUTTON] == 1, "noise is no glitch");
    check(debounce_sample(&debounce, on, 200) == 0, "on at once again");
    check(debounce_sample(&debounce, on, 20199) == 0, "on too early");
    check(debounce_sample(&debounce, on, 20200) == on, "never on");
}

static void inputs_do_not_disturb_each_other(void) {
    struct debounce debounce = make();
    const uint32_t on = 1u << SWITCH, held = 1u << BUTTON;
    (void)debounce_sample(&debounce, held, 0);
    for (uint32_t t = 100; t < 20000; t += 100)
        (void)debounce_sample(&debounce, t % 200 == 0 ? held : held | on, t);
    check((debounce_sample(&debounce, held | on, 20000) & held) != 0, "noise beside it keeps a button off");
}

static void tables_hold_every_combination_of_axes(void) {
    const uint8_t step[AXIS_COUNT] = {1, 2, 42, 41, 40, NO_PIN}, dir[AXIS_COUNT] = {3, 4, 38, 10, 31, 32};
    const struct gang gang = gang_of(AXIS_COUNT, 0);
    struct step_pins pins;
    check(step_pins_set(&pins, &gang, step, dir), "good pins are refused");
    for (unsigned axes = 0; axes < AXIS_MASKS; axes++) {
        uint64_t wanted_step = 0, wanted_dir = 0;
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
            wanted_step |= (axes >> ax & 1) != 0 && step[ax] != NO_PIN ? 1ull << step[ax] : 0;
            wanted_dir |= (axes >> ax & 1) != 0 ? 1ull << dir[ax] : 0;
        }
        check((pins.step[axes].bank[0] | (uint64_t)pins.step[axes].bank[1] << 32) == wanted_step,
              "step bits");
        check((pins.dir[axes].bank[0] | (uint64_t)pins.dir[axes].bank[1] << 32) == wanted_dir, "dir bits");
    }
}

static void a_pin_beyond_the_banks_changes_nothing(void) {
    const uint8_t good[AXIS_COUNT] = {1, 2, 3, 4, 5, 6}, bad[AXIS_COUNT] = {1, 2, 3, 4, 5, 64};
    struct step_pins pins, before;
    const struct gang gang = gang_of(AXIS_COUNT, 0);
    (void)step_pins_set(&pins, &gang, good, good);
    before = pins;
    check(!step_pins_set(&pins, &gang, bad, good) && !step_pins_set(&pins, &gang, good, bad),
          "pin 64 is taken");
    check(memcmp(&pins, &before, sizeof pins) == 0, "a refused map has changed the tables");
}

/* Motors 0 to 2 are X, Y and Z, 3 and 4 the second ones of X and Z. */
static void second_motors_are_in_the_bits_of_their_axes(void) {
    const uint8_t step[AXIS_COUNT] = {1, 2, 42, 41, 40, NO_PIN}, dir[AXIS_COUNT] = {3, 4, 38, 10, 31, 32};
    const axis_mask_t all = (1u << 3) - 1;
    const struct gang gang = gang_of(3, 1u << AXIS_X | 1u << AXIS_Z);
    struct step_pins pins;
    check(gang_seconds(&gang, 1u << 3) == 1u << AXIS_X && gang_seconds(&gang, 1u << 4) == 1u << AXIS_Z &&
              gang_seconds(&gang, 7) == 0,
          "inputs of second motors");
    check(step_pins_set(&pins, &gang, step, dir), "good pins are refused");
    for (unsigned first = 0; first <= all; first++)
        for (unsigned second = 0; second <= all; second++) {
            step_pins_hold(&pins, &gang, step, (axis_mask_t)first, (axis_mask_t)second);
            for (unsigned axes = 0; axes < AXIS_MASKS; axes++) {
                const unsigned a = axes & ~first, b = axes & ~second;
                const uint64_t wanted = (uint64_t)(a & 1) << 1 | (uint64_t)(a >> 1 & 1) << 2 |
                                        (uint64_t)(a >> 2 & 1) << 42 | (uint64_t)(b & 1) << 41 |
                                        (uint64_t)(b >> 2 & 1) << 40;
                check((pins.step[axes].bank[0] | (uint64_t)pins.step[axes].bank[1] << 32) == wanted,
                      "step bits of held motors");
            }
        }
    check((pins.dir[4].bank[0] | (uint64_t)pins.dir[4].bank[1] << 32) == (1ull << 38 | 1ull << 31),
          "direction bits of both motors");
}

/* The hardware starts at 0 again at either limit; the true count continues. */
static void an_encoder_is_counted_across_the_limits_of_the_hardware(void) {
    static const int32_t ways[] = {1, 7, 15999, -1, -7, -15999, 9000, -12345};
    int32_t truth = 0, counted = 0;
    int raw = 0;
    for (unsigned n = 0; n < 4000; n++) {
        int32_t way = ways[n / 50 % (sizeof ways / sizeof ways[0])], left = way;
        int before = raw;
        for (; left != 0; left -= left > 0 ? 1 : -1) {
            raw += left > 0 ? 1 : -1;
            raw = raw == ENCODER_LIMIT || raw == -ENCODER_LIMIT ? 0 : raw;
        }
        truth += way;
        counted += encoder_change(before, raw);
    }
    check(counted == truth, "counts are lost");
}

/* A wheel of 400 counts that turns either way: the counter wraps, reads come at any time, and the index comes
 * on at every 400th count going up, and a count next to it going down. */
static void the_index_is_where_the_counter_was(void) {
    struct encoder_counts counts = {.raw = 0};
    int32_t truth = 0, newest = 0;
    uint32_t word = 0, now_us = 0;
    int raw = 0;
    bool seen = false;
    for (unsigned n = 0; n < 300000; n++) {
        int way = n / 70000 % 2 == 0 ? 1 : -1;
        raw += way;
        raw = raw == ENCODER_LIMIT || raw == -ENCODER_LIMIT ? 0 : raw;
        truth += way;
        if ((truth - (way < 0 ? 1 : 0)) % 400 == 77) {
            word = encoder_index_word(word, raw);
            newest = truth;
            seen = true;
        }
        if (n % 37 == 0) {
            encoder_counts_take(&counts, raw, word, ++now_us);
            check(counts.state.counts == truth && counts.state.edge_us == now_us, "counts");
            check(counts.state.index_seen == seen, "an index out of nothing");
            check(!seen || counts.state.index_counts == newest, "the index is elsewhere");
        }
    }
    check(seen && newest % 400 != 0, "no index");
    encoder_counts_take(&counts, raw, word, ++now_us);
    encoder_counts_take(&counts, raw, word, ++now_us);
    check(counts.state.edge_us < now_us, "an edge out of nothing");
}

/* The counter has what the wheel made. An edge after the reading of the counter is no slip; noise that the
 * counter counts, or an edge that it misses, is one. */
static void a_dial_counts_and_finds_what_no_wheel_makes(void) {
    struct dial_counts counts;
    int32_t truth = 0;
    int raw = 0;
    dial_counts_begin(&counts, 2);
    for (unsigned n = 0; n < 200000; n++) {
        const int way = n / 50000 % 2 == 0 ? 1 : -1;
        raw += way;
        raw = raw == ENCODER_LIMIT || raw == -ENCODER_LIMIT ? 0 : raw;
        truth += way;
        const bool late = n % 5 == 0; /* the lines are an edge further already */
        if (n % 3 == 0)
            dial_counts_take(&counts, raw, (uint8_t)((2 + truth + (late ? way : 0)) & 3));
    }
    dial_counts_take(&counts, raw, (uint8_t)((2 + truth) & 3));
    check(counts.counts == truth && counts.slips == 0, "a turning dial slips");
    for (unsigned n = 0; n < 3; n++)
        dial_counts_take(&counts, raw, (uint8_t)((2 + truth + 1) & 3)); /* an edge was missed */
    check(counts.slips == 1 && counts.counts == truth, "a missed edge is not found once");
    for (unsigned n = 0; n < 3; n++)
        dial_counts_take(&counts, raw + 1, (uint8_t)((2 + truth + 1) & 3)); /* noise was counted */
    check(counts.slips == 2, "counted noise is not found once");
}

int main(void) {
    a_dial_counts_and_finds_what_no_wheel_makes();
    the_index_is_where_the_counter_was();
    an_encoder_is_counted_across_the_limits_of_the_hardware();
    a_switch_is_on_at_its_first_edge_and_off_when_it_is_quiet();
    a_button_must_be_held();
    inputs_do_not_disturb_each_other();
    tables_hold_every_combination_of_axes();
    second_motors_are_in_the_bits_of_their_axes();
    a_pin_beyond_the_banks_changes_nothing();
    printf("%u failures\n", failures);
    return failures == 0 ? 0 : 1;
}
