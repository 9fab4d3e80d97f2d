/* SPDX-License-Identifier: MIT */
#include "virtual.h"

#include "hal/hal.h"

#include <string.h>

#define BIT(input) ((uint64_t)1 << (input))

/* Steps of the motors -> of the axes with switches. */
static void axes_of(const struct virtual_machine *machine, const int32_t motors[AXIS_COUNT],
                    int32_t axes[AXIS_COUNT]) {
    memcpy(axes, motors, AXIS_COUNT * sizeof axes[0]);
    if (!machine->core_xy)
        return;
    /* CoreXY: X = (A + B) / 2, Y = (A - B) / 2, rounded down, also below 0. */
    axes[AXIS_X] = (motors[0] + motors[1]) >> 1;
    axes[AXIS_Y] = (motors[0] - motors[1]) >> 1;
}

/* Limits and home switches that are hit where a motor of each axis is: as those of the first motors. */
static uint64_t switches_at(const struct virtual_machine *machine, const int32_t at[AXIS_COUNT],
                            axis_mask_t blind) {
    uint64_t hit = 0;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        if ((blind >> ax & 1) != 0)
            continue;
        if ((machine->has_low >> ax & 1) != 0 && at[ax] <= machine->low[ax])
            hit |= BIT(VIRTUAL_LIMIT_MIN + ax);
        if ((machine->has_high >> ax & 1) != 0 && at[ax] >= machine->high[ax])
            hit |= BIT(VIRTUAL_LIMIT_MAX + ax);
        if ((machine->has_home >> ax & 1) != 0 &&
            (at[ax] <= machine->home_low[ax] || at[ax] >= machine->home_high[ax]))
            hit |= BIT(VIRTUAL_HOME + ax);
    }
    return hit;
}

static uint64_t of_second_motors(const struct virtual_machine *machine) {
    static const uint8_t lines[][2] = {{VIRTUAL_LIMIT_MIN, VIRTUAL_SECOND_MIN},
                                       {VIRTUAL_LIMIT_MAX, VIRTUAL_SECOND_MAX},
                                       {VIRTUAL_HOME, VIRTUAL_SECOND_HOME}};
    uint64_t hit = switches_at(machine, machine->second, machine->blind[1]), levels = 0;
    for (unsigned i = 0; i < sizeof lines / sizeof lines[0]; i++)
        levels |= (hit >> lines[i][0] & machine->ganged) << lines[i][1];
    return levels;
}

static bool touches_setter(const struct virtual_machine *machine) {
    const int64_t radius = machine->setter_radius;
    const int64_t x = (int64_t)machine->position[AXIS_X] - machine->setter[AXIS_X];
    const int64_t y = (int64_t)machine->position[AXIS_Y] - machine->setter[AXIS_Y];
    return radius > 0 && machine->position[AXIS_Z] <= machine->setter[AXIS_Z] && x <= radius &&
           -x <= radius && y <= radius && -y <= radius;
}

bool virtual_update(struct virtual_machine *machine) {
    /* An input that was set by hand stays on, whatever the axes do. */
    uint64_t levels = machine->forced;
    int32_t at[AXIS_COUNT];
    axes_of(machine, machine->position, at);
    levels |= switches_at(machine, at, machine->blind[0]);
    if (machine->ganged != 0)
        levels |= of_second_motors(machine);
    if (machine->has_surface && machine->position[AXIS_Z] <= machine->surface)
        levels |= BIT(VIRTUAL_PROBE);
    if (touches_setter(machine))
        levels |= BIT(VIRTUAL_TOOLSETTER);
    bool changed = levels != machine->levels;
    machine->levels = levels;
    quadrature_take(&machine->dial, (unsigned)(levels >> VIRTUAL_DIAL_A & 1),
                    (unsigned)(levels >> VIRTUAL_DIAL_B & 1));
    return changed;
}

bool virtual_step(struct virtual_machine *machine, uint8_t step_mask, uint8_t dir_mask) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        int32_t step = (step_mask >> ax & 1) * (1 - 2 * (dir_mask >> ax & 1));
        machine->position[ax] += (machine->first_waits >> ax & 1) != 0 ? 0 : step;
        machine->second[ax] += (machine->second_waits >> ax & 1) != 0 ? 0 : step;
    }
    return virtual_update(machine);
}

/* The line that changes next when the wheel turns: A at 0 and 2 forwards, B backwards. */
static bool turn_dial(struct virtual_machine *machine, uint64_t now_ticks) {
    if (machine->dial_left == 0 || machine->dial_ticks > now_ticks)
        return false;
    const bool forwards = machine->dial_left > 0, even = machine->dial.phase % 2 == 0;
    machine->forced ^= BIT(forwards == even ? VIRTUAL_DIAL_A : VIRTUAL_DIAL_B);
    machine->dial_left -= forwards ? 1 : -1;
    machine->dial_ticks += machine->dial_each_ticks;
    return virtual_update(machine);
}

bool virtual_events(struct virtual_machine *machine, uint64_t now_ticks) {
    if (turn_dial(machine, now_ticks))
        return true;
    while (machine->event_count > 0 && machine->events[machine->event_count - 1].t_ticks <= now_ticks) {
        const struct virtual_event *event = &machine->events[--machine->event_count];
        uint64_t bit = BIT(event->input);
        machine->forced = event->active ? machine->forced | bit : machine->forced & ~bit;
        if (virtual_update(machine))
            return true; /* one change at a time: the controller sees each of them */
    }
    return false;
}

uint64_t virtual_next_ticks(const struct virtual_machine *machine) {
    const uint64_t dial = machine->dial_left != 0 ? machine->dial_ticks : UINT64_MAX;
    const uint64_t event =
        machine->event_count > 0 ? machine->events[machine->event_count - 1].t_ticks : UINT64_MAX;
    return dial < event ? dial : event;
}

void virtual_read(const struct virtual_machine *machine, struct hal_inputs *inputs) {
    const uint64_t axes = (1u << AXIS_COUNT) - 1;
    uint64_t levels = machine->levels;
    /* A switch pulls its line low when it closes, as $5=0 expects. */
    const struct hal_switches switches = {
        .limit_min = (axis_mask_t)(~(levels >> VIRTUAL_LIMIT_MIN) & axes),
        .limit_max = (axis_mask_t)(~(levels >> VIRTUAL_LIMIT_MAX) & axes),
        .second_min = (axis_mask_t)(~(levels >> VIRTUAL_SECOND_MIN) & axes),
        .second_max = (axis_mask_t)(~(levels >> VIRTUAL_SECOND_MAX) & axes),
        .home = (axis_mask_t)(~(levels >> VIRTUAL_HOME) & axes),
        .second_home = (axis_mask_t)(~(levels >> VIRTUAL_SECOND_HOME) & axes),
    };
    *inputs = (struct hal_inputs){
        .switches = switches,
        .pins = switches,
        .probe = (levels & BIT(VIRTUAL_PROBE)) == 0,
        .toolsetter = (levels & BIT(VIRTUAL_TOOLSETTER)) == 0,
        .door = (levels & BIT(VIRTUAL_DOOR)) != 0,
        .hold = (levels & BIT(VIRTUAL_HOLD)) != 0,
        .start = (levels & BIT(VIRTUAL_START)) != 0,
        .reset = (levels & BIT(VIRTUAL_RESET)) != 0,
        .estop = (levels & BIT(VIRTUAL_ESTOP)) != 0 || machine->lock != HAL_LOCK_NONE,
        .lock = machine->lock,
        .digital = (uint8_t)(levels >> VIRTUAL_DIGITAL & ((1u << DIGITAL_INPUT_COUNT) - 1)),
    };
}

void virtual_command(struct virtual_machine *machine, const struct virtual_outputs *outputs,
                     uint64_t now_ticks, uint32_t timer_hz) {
    machine->outputs = *outputs;
    vspindle_note(&machine->spindle, now_ticks, timer_hz);
    machine->driven &= outputs->spindle_direction == 0;
    if (!machine->driven)
        machine->spindle.told_rpm = (double)outputs->spindle_direction * (double)outputs->spindle_rpm;
}

int virtual_input_number(const char *name) {
    static const char *const others[] = {"probe", "door", "estop", "hold", "start", "reset"};
    static const char axes[] = "xyzabc";
    static const struct {
        const char *name;
        int input;
    } dials[] = {{"dial-line-a", VIRTUAL_DIAL_A},
                 {"dial-line-b", VIRTUAL_DIAL_B},
                 {"dial-x10", VIRTUAL_DIAL_X10},
                 {"dial-x100", VIRTUAL_DIAL_X100}};
    static const struct {
        const char *prefix;
        int first;
    } limits[] = {{"limit-min-", VIRTUAL_LIMIT_MIN},
                  {"limit-max-", VIRTUAL_LIMIT_MAX},
                  {"limit-", VIRTUAL_LIMIT_MIN},
                  {"second-min-", VIRTUAL_SECOND_MIN},
                  {"second-max-", VIRTUAL_SECOND_MAX},
                  {"second-home-", VIRTUAL_SECOND_HOME},
                  {"home-", VIRTUAL_HOME},
                  {"dial-", VIRTUAL_DIAL_AXIS}};
    for (int i = 0; i < (int)(sizeof others / sizeof others[0]); i++)
        if (strcmp(name, others[i]) == 0)
            return VIRTUAL_PROBE + i;
    if (strcmp(name, "toolsetter") == 0)
        return VIRTUAL_TOOLSETTER;
    for (int i = 0; i < (int)(sizeof dials / sizeof dials[0]); i++)
        if (strcmp(name, dials[i].name) == 0)
            return dials[i].input;
    if (strncmp(name, "input-", 6) == 0 && name[6] >= '0' && name[6] < '0' + DIGITAL_INPUT_COUNT &&
        name[7] == '\0')
        return VIRTUAL_DIGITAL + (name[6] - '0');
    for (unsigned i = 0; i < sizeof limits / sizeof limits[0]; i++) {
        size_t length = strlen(limits[i].prefix);
        if (strncmp(name, limits[i].prefix, length) != 0 || name[length] == '\0' || name[length + 1] != '\0')
            continue;
        const char *axis = strchr(axes, name[length]);
        if (axis != NULL)
            return limits[i].first + (int)(axis - axes);
    }
    return -1;
}
