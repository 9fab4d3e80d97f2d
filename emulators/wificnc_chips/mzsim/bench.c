/* SPDX-License-Identifier: MIT
 * The machine at the pins: motors that count steps, limit switches and a probe that follow the motors'
 * places, and what must hold for every pulse. */
#include "chip.h"

#include <string.h>

#define NO_PIN     255u
#define SAME_EVENT 100u /* cycles (0.5 us) within which edges belong to one step event */

void bench_create(struct chip *chip) {
    struct bench *bench = &chip->bench;
    memset(bench->step_axis, 255, sizeof bench->step_axis);
    memset(bench->dir_axis, 255, sizeof bench->dir_axis);
    bench->probe = bench->setter = NO_PIN;
    bench->least = (struct mz_pulses){NEVER, NEVER, NEVER, NEVER};
    for (unsigned i = 0; i < MZ_AXES; i++)
        bench->axis[i].rose = bench->axis[i].fell = bench->axis[i].turned = NEVER;
}

static void shorten(uint64_t *least, uint64_t from, uint64_t now) {
    if (from != NEVER && now - from < *least)
        *least = now - from;
}

static void set_switch(struct chip *chip, unsigned pin, bool active, unsigned active_level) {
    if (pin < MZ_PIN_COUNT)
        mz_pin_drive(chip, pin, active == (active_level != 0));
}

static bool is_near(const struct chip *chip, unsigned axis) {
    const struct bench *bench = &chip->bench;
    const int64_t way = (int64_t)bench->axis[axis].position - bench->setter_at[axis];
    return way <= bench->setter_radius && -way <= bench->setter_radius;
}

static void follow_setter(struct chip *chip) {
    const struct bench *bench = &chip->bench;
    const bool low = bench->axis[2].position <= bench->setter_at[2];
    set_switch(chip, bench->setter, low && is_near(chip, 0) && is_near(chip, 1), 0);
}

static void follow(struct chip *chip, unsigned axis) {
    const struct bench_axis *at = &chip->bench.axis[axis];
    if (at->wire.has_low != 0)
        set_switch(chip, at->wire.min_switch, at->position <= at->wire.low, at->wire.min_active);
    if (at->wire.has_high != 0)
        set_switch(chip, at->wire.max_switch, at->position >= at->wire.high, at->wire.max_active);
    if (axis == 2)
        set_switch(chip, chip->bench.probe, at->position <= chip->bench.surface, 0);
    if (axis <= 2)
        follow_setter(chip);
}

static void note_step(struct chip *chip, unsigned axis, bool dir_high) {
    struct bench *bench = &chip->bench;
    struct mz_step *last = bench->count > 0 ? &bench->steps[bench->count - 1] : NULL;
    if (last == NULL || chip->cycles - last->cycle > SAME_EVENT * chip->speed ||
        (last->step >> axis & 1) != 0) {
        if (!chip_grow(&bench->steps, &bench->room, bench->count + 1, sizeof *bench->steps))
            return;
        last = &bench->steps[bench->count++];
        *last = (struct mz_step){.cycle = chip->cycles};
    }
    last->step = (uint8_t)(last->step | 1u << axis);
    last->dir = (uint8_t)(last->dir | (unsigned)dir_high << axis);
}

static void stepped(struct chip *chip, unsigned axis, bool level) {
    struct bench_axis *at = &chip->bench.axis[axis];
    struct mz_pulses *least = &chip->bench.least;
    bool dir_high = mz_pin_level(chip, at->wire.dir) != 0;
    if (!level) {
        shorten(&least->high, at->rose, chip->cycles);
        at->fell = chip->cycles;
        return;
    }
    shorten(&least->low, at->fell, chip->cycles);
    shorten(&least->setup, at->turned, chip->cycles);
    at->turned = NEVER;
    at->rose = chip->cycles;
    at->position += dir_high ? -1 : 1;
    note_step(chip, axis, dir_high);
    follow(chip, axis);
}

void bench_edge(struct chip *chip, unsigned pin, bool level) {
    unsigned step = chip->bench.step_axis[pin], dir = chip->bench.dir_axis[pin];
    if (step < MZ_AXES)
        stepped(chip, step, level);
    if (dir < MZ_AXES) {
        struct bench_axis *at = &chip->bench.axis[dir];
        shorten(&chip->bench.least.hold, at->rose, chip->cycles);
        at->turned = chip->cycles;
    }
}

void mz_axis_set(struct chip *chip, unsigned axis, const struct mz_axis *wire) {
    chip->bench.axis[axis].wire = *wire;
    if (wire->step < MZ_PIN_COUNT)
        chip->bench.step_axis[wire->step] = (uint8_t)axis;
    if (wire->dir < MZ_PIN_COUNT)
        chip->bench.dir_axis[wire->dir] = (uint8_t)axis;
    follow(chip, axis);
}

int32_t mz_axis_position(const struct chip *chip, unsigned axis) {
    return chip->bench.axis[axis].position;
}

void mz_axis_place(struct chip *chip, unsigned axis, int32_t steps) {
    chip->bench.axis[axis].position = steps;
    follow(chip, axis);
}

void mz_surface(struct chip *chip, unsigned pin, int32_t z_steps) {
    chip->bench.probe = (uint8_t)pin;
    chip->bench.surface = z_steps;
    follow(chip, 2);
}

void mz_toolsetter(struct chip *chip, unsigned pin, const int32_t at[3], int32_t radius) {
    struct bench *bench = &chip->bench;
    bench->setter = (uint8_t)pin;
    memcpy(bench->setter_at, at, sizeof bench->setter_at);
    bench->setter_radius = radius;
    follow_setter(chip);
}

size_t mz_steps(struct chip *chip, struct mz_step *out, size_t room) {
    struct bench *bench = &chip->bench;
    size_t count = bench->count < room ? bench->count : room;
    memcpy(out, bench->steps, count * sizeof *out);
    memmove(bench->steps, bench->steps + count, (bench->count - count) * sizeof *out);
    bench->count -= count;
    return count;
}

void mz_pulses(const struct chip *chip, struct mz_pulses *out) {
    *out = chip->bench.least;
}
