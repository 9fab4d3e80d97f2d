/* SPDX-License-Identifier: MIT
 * The pins of the HAL component as pointers into HAL's memory, and the list of them. LinuxCNC's threads read
 * and write that memory at any time: every access is a single load or store. */
#ifndef WIFICNC_LINUXCNC_PINS_H
#define WIFICNC_LINUXCNC_PINS_H

#include <stdbool.h>
#include <stdint.h>

enum { PIN_JOINTS = 6, PIN_OUTPUTS = 5, PIN_INPUTS = 4, PIN_NAME_MAX = 48 };

enum pin_type { PIN_BIT, PIN_FLOAT, PIN_U32 };
enum pin_direction { PIN_IN, PIN_OUT, PIN_IO };

/** As hal_bit_t, hal_float_t and hal_u32_t are. */
typedef volatile bool *pin_BIT;
typedef volatile double *pin_FLOAT;
typedef volatile uint32_t *pin_U32;

#define JOINT_PIN(field, type, direction, name) pin_##type field;
#define PIN(field, type, direction, name)
#define PIN_ROW(field, type, direction, name, count)
struct joint_pins {
#include "pins.def"
};
#undef JOINT_PIN
#undef PIN
#undef PIN_ROW

#define JOINT_PIN(field, type, direction, name)
#define PIN(field, type, direction, name)            pin_##type field;
#define PIN_ROW(field, type, direction, name, count) pin_##type field[count];
struct pins {
    unsigned joints; /* 1 .. PIN_JOINTS */
    struct joint_pins joint[PIN_JOINTS];
#include "pins.def"
};
#undef JOINT_PIN
#undef PIN
#undef PIN_ROW

/** Make one pin. @param name  without that of the component
 *  @param[out] at  where its pointer goes
 *  @return 0, or what went wrong */
typedef int (*pin_maker)(void *ctx, const char *name, enum pin_type type, enum pin_direction direction,
                         void **at);

/** Make all of them, and set each scale to 1. @param pins  with `joints` set
 *  @return 0, or the first answer of `make` that was not */
int pins_make(struct pins *pins, pin_maker make, void *ctx);

/** Steps per unit of a joint; 1 where LinuxCNC has left it 0. May be no number: LinuxCNC's to set. */
double pins_scale(const struct pins *pins, unsigned joint);

/** position-fb of all joints. */
void pins_show_position(const struct pins *pins, const int32_t steps[PIN_JOINTS]);

#endif
