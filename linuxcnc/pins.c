/* SPDX-License-Identifier: MIT */
#include "pins.h"

#include <stddef.h>
#include <stdio.h>

struct pin_row {
    const char *format; /* of the name, with its number where there are several */
    size_t at;          /* of the first pointer, in struct joint_pins or struct pins */
    uint8_t type;
    uint8_t direction;
    uint8_t count;
};

#define JOINT_PIN(field, type, direction, name)                                                              \
    {"joint.%u." name, offsetof(struct joint_pins, field), PIN_##type, PIN_##direction, 1},
#define PIN(field, type, direction, name)
#define PIN_ROW(field, type, direction, name, count)
static const struct pin_row joint_rows[] = {
#include "pins.def"
};
#undef JOINT_PIN
#undef PIN
#undef PIN_ROW

#define JOINT_PIN(field, type, direction, name)
#define PIN(field, type, direction, name)                                                                    \
    {name, offsetof(struct pins, field), PIN_##type, PIN_##direction, 1},
#define PIN_ROW(field, type, direction, name, count)                                                         \
    {name, offsetof(struct pins, field), PIN_##type, PIN_##direction, count},
static const struct pin_row rows[] = {
#include "pins.def"
};
#undef JOINT_PIN
#undef PIN
#undef PIN_ROW

enum { JOINT_ROWS = sizeof joint_rows / sizeof *joint_rows, ROWS = sizeof rows / sizeof *rows };

static int make_row(const struct pin_row *row, unsigned number, void *at, pin_maker make, void *ctx) {
    char name[PIN_NAME_MAX];
    snprintf(name, sizeof name, row->format, number);
    return make(ctx, name, row->type, row->direction, at);
}

int pins_make(struct pins *pins, pin_maker make, void *ctx) {
    for (unsigned joint = 0; joint < pins->joints; joint++) {
        char *base = (char *)&pins->joint[joint];
        for (const struct pin_row *row = joint_rows; row < joint_rows + JOINT_ROWS; row++) {
            int wrong = make_row(row, joint, base + row->at, make, ctx);
            if (wrong != 0)
                return wrong;
        }
        *pins->joint[joint].scale = 1.0;
    }
    for (const struct pin_row *row = rows; row < rows + ROWS; row++) {
        for (unsigned number = 0; number < row->count; number++) {
            int wrong = make_row(row, number, (char *)pins + row->at + number * sizeof(void *), make, ctx);
            if (wrong != 0)
                return wrong;
        }
    }
    return 0;
}

double pins_scale(const struct pins *pins, unsigned joint) {
    double scale = *pins->joint[joint].scale;
    return scale == 0.0 ? 1.0 : scale;
}

void pins_show_position(const struct pins *pins, const int32_t steps[PIN_JOINTS]) {
    for (unsigned joint = 0; joint < pins->joints; joint++)
        *pins->joint[joint].position_fb = steps[joint] / pins_scale(pins, joint);
}
