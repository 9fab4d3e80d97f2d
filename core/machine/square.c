/* SPDX-License-Identifier: MIT */
#include "machine/square.h"

#include "machine/axes.h"
#include "machine/inputs.h"
#include "machine/motors.h"
#include "machine/parts.h"
#include "machine/place.h"

/* How crooked a gantry may be: Grbl's part of the travel and its bounds. */
#define CROOKED_TRAVEL 0.05
#define CROOKED_MIN_MM 2.5
#define CROOKED_MAX_MM 25.0

static bool has(axis_mask_t mask, unsigned axis) {
    return (mask >> axis & 1) != 0;
}

/* Axes of this cycle with two motors and one switch. */
static axis_mask_t one_switch(const struct machine *machine) {
    return (axis_mask_t)(machine->homing.axes & inputs_ganged(machine) & ~inputs_squared(machine));
}

void square_begin(struct machine *machine) {
    struct homing *homing = &machine->homing;
    motors_release(machine);
    place_axis_steps(machine, homing->from);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        homing->motor[FIRST_MOTOR][ax] = homing->motor[SECOND_MOTOR][ax] = homing->from[ax];
        if (has(one_switch(machine), ax))
            homing->motor[SECOND_MOTOR][ax] += machine->motors.ahead[ax];
    }
}

void square_stand(struct machine *machine) {
    struct homing *homing = &machine->homing;
    int32_t now[AXIS_COUNT];
    place_axis_steps(machine, now);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        for (unsigned motor = 0; motor < MOTOR_COUNT; motor++)
            if (!has(machine->motors.held[motor], ax))
                homing->motor[motor][ax] += now[ax] - homing->from[ax];
        homing->from[ax] = now[ax];
    }
}

void square_search(struct machine *machine) {
    struct homing *homing = &machine->homing;
    struct machine_edges *edges = &machine->edges;
    motors_release(machine);
    homing->left = homing->axes;
    for (unsigned motor = 0; motor < MOTOR_COUNT; motor++) {
        place_axis_steps(machine, edges->mark[motor]); /* of one that closes just now */
        edges->latch[motor] = 0;
        edges->latched[motor] = 0;
        homing->found[motor] = 0;
    }
    /* Last: from here on the edge interrupts write mark, at and latched. */
    edges->latch[FIRST_MOTOR] = homing->axes;
    edges->latch[SECOND_MOTOR] = homing->axes & inputs_squared(machine);
    inputs_look(machine); /* one that is closed already counts from here */
    (void)square_take(machine);
}

bool square_has_news(const struct machine *machine) {
    const struct homing *homing = &machine->homing;
    const struct machine_edges *edges = &machine->edges;
    unsigned news = (edges->latched[FIRST_MOTOR] & ~(unsigned)homing->found[FIRST_MOTOR]) |
                    (edges->latched[SECOND_MOTOR] & ~(unsigned)homing->found[SECOND_MOTOR]);
    return (news & homing->axes) != 0;
}

bool square_take(struct machine *machine) {
    struct homing *homing = &machine->homing;
    struct machine_edges *edges = &machine->edges;
    bool news = square_has_news(machine);
    for (unsigned motor = 0; motor < MOTOR_COUNT; motor++) {
        axis_mask_t fresh = edges->latched[motor] & (axis_mask_t)~homing->found[motor];
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++) /* counters to the motor's own steps */
            if (has(fresh, ax))
                edges->at[motor][ax] += homing->motor[motor][ax] - homing->from[ax];
        homing->found[motor] |= fresh;
    }
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        if (has(one_switch(machine), ax))
            edges->at[SECOND_MOTOR][ax] = edges->at[FIRST_MOTOR][ax];
    square_stand(machine);
    unsigned squared = inputs_squared(machine), first = homing->found[FIRST_MOTOR];
    unsigned second = homing->found[SECOND_MOTOR];
    homing->left = (axis_mask_t)(homing->axes & ~(first & (second | ~squared)));
    unsigned half = (first ^ second) & homing->axes & squared;
    /* At rest, so that the motor that waits misses no step of a ramp. */
    motors_hold(machine, (axis_mask_t)(first & half), (axis_mask_t)(second & half));
    return news;
}

bool square_is_half(const struct machine *machine, unsigned axis) {
    const struct homing *homing = &machine->homing;
    return has((machine->motors.held[FIRST_MOTOR] | machine->motors.held[SECOND_MOTOR]) & homing->left, axis);
}

double square_crooked_mm(const struct settings *settings, unsigned axis) {
    const double most_mm = CROOKED_TRAVEL * (double)settings->max_travel_mm[axis];
    return most_mm < CROOKED_MIN_MM ? CROOKED_MIN_MM : most_mm > CROOKED_MAX_MM ? CROOKED_MAX_MM : most_mm;
}

double square_reach_mm(const struct machine *machine, unsigned axis) {
    const struct settings *settings = &machine->settings;
    const struct homing *homing = &machine->homing;
    const double most_mm = square_crooked_mm(settings, axis);
    /* How far the motor that still looks is ahead of the one that waits. */
    int32_t ahead = homing->motor[SECOND_MOTOR][axis] - homing->motor[FIRST_MOTOR][axis];
    if (has(machine->motors.held[SECOND_MOTOR], axis))
        ahead = -ahead;
    double gone_mm = (double)ahead / (double)settings->steps_per_mm[axis] * axes_direction(machine, axis);
    return gone_mm < most_mm ? most_mm - gone_mm : 0.0;
}

float square_pull_off_mm(const struct settings *settings, unsigned motor, unsigned axis) {
    const float own_mm = settings->second_pull_off_mm[axis];
    return motor == SECOND_MOTOR && own_mm > 0.0f ? own_mm : settings->homing_pull_off_mm;
}

/* Signed way of a motor to its pull-off before its switch. */
static int32_t way_back(const struct machine *machine, unsigned motor, unsigned axis) {
    const struct settings *settings = &machine->settings;
    double pull_off_steps =
        (double)square_pull_off_mm(settings, motor, axis) * (double)settings->steps_per_mm[axis] + 0.5;
    int32_t pull_off =
        axes_direction(machine, axis) > 0.0 ? -(int32_t)pull_off_steps : (int32_t)pull_off_steps;
    return machine->edges.at[motor][axis] + pull_off - machine->homing.motor[motor][axis];
}

void square_level(struct machine *machine, int32_t steps[AXIS_COUNT]) {
    axis_mask_t ganged = machine->homing.axes & inputs_ganged(machine);
    unsigned wait[MOTOR_COUNT] = {0, 0};
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        steps[ax] = 0;
        if (!has(ganged, ax))
            continue;
        int32_t first = way_back(machine, FIRST_MOTOR, ax), second = way_back(machine, SECOND_MOTOR, ax);
        bool second_goes = axes_direction(machine, ax) > 0.0 ? second < first : second > first;
        /* The difference of both ways: after it both are equally far from their pull-off
         * (square_back_off()). */
        steps[ax] = second_goes ? second - first : first - second;
        wait[second_goes ? FIRST_MOTOR : SECOND_MOTOR] |= 1u << ax;
    }
    motors_hold(machine, (axis_mask_t)wait[FIRST_MOTOR], (axis_mask_t)wait[SECOND_MOTOR]);
}

void square_back_off(struct machine *machine, int32_t steps[AXIS_COUNT]) {
    motors_release(machine);
    machine->edges.latch[FIRST_MOTOR] = machine->edges.latch[SECOND_MOTOR] = 0;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        steps[ax] = has(machine->homing.axes, ax) ? way_back(machine, FIRST_MOTOR, ax) : 0;
}

/* @param zero  own steps of the motors that are equally far */
static void keep_ahead(struct machine *machine, unsigned ax, int32_t zero) {
    const struct homing *homing = &machine->homing;
    motors_keep_ahead(machine, ax, homing->motor[SECOND_MOTOR][ax] - homing->motor[FIRST_MOTOR][ax] - zero);
}

void square_end(struct machine *machine) {
    const axis_mask_t ganged = machine->homing.axes & inputs_ganged(machine);
    const struct machine_edges *edges = &machine->edges;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        if (has(ganged, ax))
            keep_ahead(machine, ax, edges->at[SECOND_MOTOR][ax] - edges->at[FIRST_MOTOR][ax]);
}

void square_cut_off(struct machine *machine) {
    const axis_mask_t axes = one_switch(machine);
    if (machine->life.state != MACHINE_HOME || axes == 0)
        return;
    square_stand(machine);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        if (has(axes, ax))
            keep_ahead(machine, ax, 0);
}
