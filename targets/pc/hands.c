/* SPDX-License-Identifier: MIT */
#include "hands.h"

#include "host_inner.h"
#include "virtual.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WORDS_MAX = 2 + AXIS_COUNT, SOFT_RESET = 0x18, PRESSES_A_SECOND = 10 };

static const char axis_names[] = "xyzabc";

struct words {
    char text[HANDS_LINE_SIZE];
    char *word[WORDS_MAX];
    int count;
};

static void split(struct words *words, const char *line) {
    char *rest = NULL;
    snprintf(words->text, sizeof words->text, "%s", line);
    words->count = 0;
    for (char *word = strtok_r(words->text, " \t\r\n", &rest); word != NULL && words->count < WORDS_MAX;
         word = strtok_r(NULL, " \t\r\n", &rest))
        words->word[words->count++] = word;
}

static bool is(const char *word, const char *other) {
    return strcmp(word, other) == 0;
}

/* @return false: not a number, or too large for a step counter */
static bool read_steps(const struct host *host, unsigned axis, const char *word, int32_t *out) {
    float steps_per_mm[AXIS_COUNT];
    char *end;
    host_steps_per_mm(host, steps_per_mm);
    double steps = strtod(word, &end) * (double)steps_per_mm[axis];
    if (*word == '\0' || *end != '\0' || !(steps > -2e9 && steps < 2e9))
        return false;
    *out = (int32_t)(steps < 0.0 ? steps - 0.5 : steps + 0.5);
    return true;
}

/* ---- each reads its line: NULL, or what is wrong ---- */

static const char *read_input(const struct host *host, const struct words *words,
                              struct hands_action *action) {
    char name[HANDS_LINE_SIZE];
    bool apart = words->count > 1 && (is(words->word[0], "limit") || is(words->word[0], "home") ||
                                      is(words->word[0], "input")); /* "limit x" */
    int used = apart ? 2 : 1;
    (void)host;
    snprintf(name, sizeof name, "%s%s%s", words->word[0], apart ? "-" : "", apart ? words->word[1] : "");
    action->input = virtual_input_number(name);
    if (action->input < 0)
        return "no such command or input";
    bool button = action->input >= VIRTUAL_HOLD && action->input <= VIRTUAL_RESET;
    const char *level = words->count == used ? "on" : words->word[used];
    if (words->count > used + 1 || (!is(level, "on") && !is(level, "off")))
        return "an input is on or off";
    action->kind = words->count == used && button ? HANDS_PRESS : HANDS_INPUT;
    action->active = is(level, "on");
    return NULL;
}

static const char *read_travel(const struct host *host, const struct words *words,
                               struct hands_action *action) {
    const char *name =
        words->count > 1 && words->word[1][0] != '\0' ? strchr(axis_names, words->word[1][0]) : NULL;
    if (name == NULL || words->word[1][1] != '\0')
        return "which axis?";
    bool homing = is(words->word[0], "homing");
    action->axis = (unsigned)(name - axis_names);
    action->kind = HANDS_NO_TRAVEL;
    if (!homing && words->count == 3 && is(words->word[2], "off"))
        return NULL;
    action->kind = homing ? HANDS_HOMING : HANDS_TRAVEL;
    if (words->count != 4 || !read_steps(host, action->axis, words->word[2], &action->steps[0]) ||
        !read_steps(host, action->axis, words->word[3], &action->steps[1]) ||
        action->steps[0] >= action->steps[1])
        return homing ? "homing AXIS LOW HIGH, in mm" : "travel AXIS LOW HIGH, in mm";
    return NULL;
}

static const char *read_skew(const struct host *host, const struct words *words,
                             struct hands_action *action) {
    const char *name =
        words->count == 3 && strlen(words->word[1]) == 1 ? strchr(axis_names, words->word[1][0]) : NULL;
    action->kind = HANDS_SKEW;
    if (name == NULL)
        return "skew AXIS MM";
    action->axis = (unsigned)(name - axis_names);
    return read_steps(host, action->axis, words->word[2], &action->steps[0]) ? NULL : "skew AXIS MM";
}

static const char *read_surface(const struct host *host, const struct words *words,
                                struct hands_action *action) {
    action->kind = words->count == 2 && is(words->word[1], "off") ? HANDS_NO_SURFACE : HANDS_SURFACE;
    if (action->kind == HANDS_SURFACE &&
        (words->count != 2 || !read_steps(host, AXIS_Z, words->word[1], &action->steps[0])))
        return "surface Z, in mm, or off";
    return NULL;
}

static const char *read_toolsetter(const struct host *host, const struct words *words,
                                   struct hands_action *action) {
    static const char usage[] = "toolsetter X Y Z [RADIUS], in mm, or off";
    const bool places = words->count == 4 || words->count == 5;
    if (words->count < 3 && (words->count == 1 || is(words->word[1], "on") || is(words->word[1], "off")))
        return read_input(host, words, action);
    action->kind = HANDS_TOOLSETTER;
    bool good =
        places && read_steps(host, AXIS_X, words->count == 5 ? words->word[4] : "5", &action->radius_steps);
    for (unsigned axis = AXIS_X; good && axis <= AXIS_Z; axis++)
        good = read_steps(host, axis, words->word[1 + axis], &action->steps[axis]);
    return good && action->radius_steps > 0 ? NULL : usage;
}

static const char *read_place(const struct host *host, const struct words *words,
                              struct hands_action *action) {
    action->kind = HANDS_PLACE;
    /* Axes that the line does not name stay where they are. */
    virtual_position(host, action->steps);
    bool good = words->count >= 2 && words->count <= 1 + AXIS_COUNT;
    for (int i = 1; good && i < words->count; i++)
        good = read_steps(host, (unsigned)i - 1, words->word[i], &action->steps[i - 1]);
    return good ? NULL : "place X Y Z, in mm";
}

static const char *read_ramp(const struct host *host, const struct words *words,
                             struct hands_action *action) {
    char *end = NULL;
    double rpm_s = words->count == 2 ? strtod(words->word[1], &end) : -1.0;
    (void)host;
    if (end == NULL || *end != '\0' || !(rpm_s >= 0.0 && rpm_s < 1e9))
        return "ramp RPM, a second";
    action->kind = HANDS_RAMP;
    action->rpm_s = (float)rpm_s;
    return NULL;
}

/* @return false: the line is not a command and a number from least to most */
static bool read_number(const struct words *words, double least, double most, double *out) {
    char *end = NULL;
    *out = words->count == 2 ? strtod(words->word[1], &end) : 0.0;
    return end != NULL && end != words->word[1] && *end == '\0' && *out >= least && *out <= most;
}

static const char *read_load(const struct host *host, const struct words *words,
                             struct hands_action *action) {
    double percent;
    (void)host;
    action->kind = HANDS_LOAD;
    bool good = read_number(words, -100.0, 100.0, &percent);
    action->percent = (float)percent;
    return good ? NULL : "load PERCENT, -100 to 100";
}

static const char *read_encoder(const struct host *host, const struct words *words,
                                struct hands_action *action) {
    double counts;
    (void)host;
    action->kind = HANDS_ENCODER;
    bool good = read_number(words, 1.0, 65535.0, &counts);
    action->counts = good ? (uint32_t)counts : 0;
    return good ? NULL : "encoder COUNTS, 1 to 65535";
}

static const char *read_analog(const struct host *host, const struct words *words,
                               struct hands_action *action) {
    char *end = NULL;
    bool known = words->count == 3 && strlen(words->word[1]) == 1 && words->word[1][0] >= '0' &&
                 words->word[1][0] < '0' + ANALOG_COUNT;
    double percent = known ? strtod(words->word[2], &end) : -1.0;
    (void)host;
    if (end == NULL || *end != '\0' || !(percent >= 0.0 && percent <= 100.0))
        return "analog N PERCENT";
    action->kind = HANDS_ANALOG;
    action->analog = (unsigned)(words->word[1][0] - '0');
    action->percent = (float)percent;
    return NULL;
}

static const char *read_driver(const struct host *host, const struct words *words,
                               struct hands_action *action) {
    static const struct {
        const char *name;
        unsigned faults;
    } faults[] = {{"ok", 0},
                  {"supply", VIRTUAL_TMC_NO_SUPPLY},
                  {"wire", VIRTUAL_TMC_UNWIRED},
                  {"noise", VIRTUAL_TMC_NOISE},
                  {"hot", VIRTUAL_TMC_HOT},
                  {"shut-down", VIRTUAL_TMC_SHUT_DOWN},
                  {"short", VIRTUAL_TMC_SHORT},
                  {"open", VIRTUAL_TMC_OPEN},
                  {"undervoltage", VIRTUAL_TMC_UNDERVOLTAGE}};
    static const char usage[] =
        "driver MOTOR ok|supply|wire|noise|hot|shut-down|short|open|undervoltage, MOTOR x, y2 ..";
    const char *motor = words->count == 3 ? words->word[1] : "";
    const char *name = motor[0] != '\0' ? strchr(axis_names, motor[0]) : NULL;
    const bool second = name != NULL && is(motor + 1, "2");
    if (name == NULL || (motor[1] != '\0' && !second))
        return usage;
    action->kind = HANDS_DRIVER;
    action->motor = (unsigned)(name - axis_names) + (second ? (unsigned)AXIS_COUNT : 0u);
    if (!host_has_driver(host, action->motor))
        return "this motor has no driver with registers";
    for (size_t i = 0; i < sizeof faults / sizeof faults[0]; i++) {
        if (!is(words->word[2], faults[i].name))
            continue;
        action->faults = faults[i].faults;
        return NULL;
    }
    return usage;
}

static const char *read_dial(const struct host *host, const struct words *words,
                             struct hands_action *action) {
    static const char usage[] = "dial DETENTS [A SECOND], such as dial +5";
    char *end = NULL;
    (void)host;
    action->kind = HANDS_DIAL;
    action->per_s = 20.0f;
    if (words->count < 2 || words->count > 3)
        return usage;
    const double detents = strtod(words->word[1], &end);
    if (*end != '\0' || !(detents >= -100000.0 && detents <= 100000.0) || detents != (int32_t)detents)
        return usage;
    action->steps[0] = (int32_t)detents;
    if (words->count == 2)
        return NULL;
    const double rate = strtod(words->word[2], &end);
    action->per_s = (float)rate;
    return *end == '\0' && rate >= 0.01 && rate <= 10000.0 ? NULL : usage;
}

/* Real-time bytes by name: Grbl 1.1's numbers. @return false: none of them */
static bool read_realtime(const struct words *words, struct hands_action *action) {
    static const struct {
        const char *name, *value;
        uint8_t byte;
    } table[] = {
        {"feed-hold", NULL, '!'},     {"resume", NULL, '~'},      {"soft-reset", NULL, SOFT_RESET},
        {"safety-door", NULL, 0x84},  {"jog-cancel", NULL, 0x85}, {"feed", "100", 0x90},
        {"feed", "+10", 0x91},        {"feed", "-10", 0x92},      {"feed", "+1", 0x93},
        {"feed", "-1", 0x94},         {"rapid", "100", 0x95},     {"rapid", "50", 0x96},
        {"rapid", "25", 0x97},        {"spindle", "100", 0x99},   {"spindle", "+10", 0x9A},
        {"spindle", "-10", 0x9B},     {"spindle", "+1", 0x9C},    {"spindle", "-1", 0x9D},
        {"spindle-stop", NULL, 0x9E}, {"flood", NULL, 0xA0},      {"mist", NULL, 0xA1},
    };
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
        bool value = table[i].value != NULL;
        if (words->count != 1 + value || !is(words->word[0], table[i].name) ||
            (value && !is(words->word[1], table[i].value)))
            continue;
        action->kind = HANDS_REALTIME;
        action->byte = table[i].byte;
        return true;
    }
    return false;
}

const char *hands_read(const struct host *host, const char *line, struct hands_action *action) {
    static const struct {
        const char *name;
        const char *(*read)(const struct host *host, const struct words *words, struct hands_action *action);
    } commands[] = {{"travel", read_travel}, {"surface", read_surface},
                    {"place", read_place},   {"ramp", read_ramp},
                    {"skew", read_skew},     {"analog", read_analog},
                    {"load", read_load},     {"encoder", read_encoder},
                    {"homing", read_travel}, {"toolsetter", read_toolsetter},
                    {"driver", read_driver}, {"dial", read_dial}};
    struct words words;
    *action = (struct hands_action){0};
    split(&words, line);
    if (words.count == 0)
        return "nothing to do";
    if (read_realtime(&words, action))
        return NULL;
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++)
        if (is(words.word[0], commands[i].name))
            return commands[i].read(host, &words, action);
    return read_input(host, &words, action);
}

/* However rarely the controller looks, it sees the button down before it is up again. */
static void press(struct host *host, int input) {
    const uint64_t up_ticks = host_time_ticks(host) + host->hal.timer_hz / PRESSES_A_SECOND;
    virtual_set(host, input, false); /* a press that is not over yet */
    virtual_set(host, input, true);
    host_run_paced(host, host_time_ticks(host), 1);
    if (!virtual_at(host, up_ticks, input, false))
        virtual_set(host, input, false);
}

void hands_do(struct host *host, const struct hands_action *action) {
    const char byte = (char)action->byte;
    switch (action->kind) {
    case HANDS_INPUT:
        virtual_set(host, action->input, action->active);
        return;
    case HANDS_PRESS:
        press(host, action->input);
        return;
    case HANDS_REALTIME:
        host_write(host, &byte, 1);
        return;
    case HANDS_TRAVEL:
        virtual_travel(host, action->axis, action->steps[0], action->steps[1]);
        return;
    case HANDS_HOMING:
        virtual_home(host, action->axis, action->steps[0], action->steps[1]);
        return;
    case HANDS_NO_TRAVEL:
        virtual_no_travel(host, action->axis);
        return;
    case HANDS_SURFACE:
        virtual_surface(host, action->steps[0]);
        return;
    case HANDS_NO_SURFACE:
        virtual_no_surface(host);
        return;
    case HANDS_TOOLSETTER:
        virtual_toolsetter(host, action->steps, action->radius_steps);
        return;
    case HANDS_PLACE:
        virtual_place(host, action->steps);
        return;
    case HANDS_SKEW:
        virtual_skew(host, action->axis, action->steps[0]);
        return;
    case HANDS_ANALOG:
        virtual_analog(host, action->analog, action->percent);
        return;
    case HANDS_LOAD:
        virtual_spindle_load(host, action->percent);
        return;
    case HANDS_ENCODER:
        virtual_spindle_encoder(host, action->counts);
        return;
    case HANDS_DRIVER:
        (void)host_driver_set_faults(host, action->motor, action->faults);
        return;
    case HANDS_DIAL:
        virtual_dial(host, action->steps[0], (double)action->per_s);
        return;
    case HANDS_RAMP:
        virtual_spindle_ramp(host, action->rpm_s);
        return;
    }
}

bool hands_resets(const struct hands_action *action) {
    bool button = action->kind == HANDS_PRESS || (action->kind == HANDS_INPUT && action->active);
    return (button && action->input == VIRTUAL_RESET) ||
           (action->kind == HANDS_REALTIME && action->byte == SOFT_RESET);
}
