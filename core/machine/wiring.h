/* SPDX-License-Identifier: MIT
 * What the board's outputs and inputs allow (machine_board): codes and settings that need one which is not
 * there are refused. [task] The table of boards is in docs/boards.md. */
#ifndef WIFICNC_MACHINE_WIRING_H
#define WIFICNC_MACHINE_WIRING_H

#include "gcode/status.h"

#include <stdbool.h>
#include <stdint.h>

struct machine;

/** Power-on, before wiring_fit(): a machine with fewer axes than its board ($79), or whose last drivers are
 * second motors ($210 ..), with which the axis of a driver and those after it are gone. */
void wiring_take_axes(struct machine *machine);

/** Settings have changed: tell the G-code side which codes are possible. */
void wiring_apply(struct machine *machine);

/** @return STATUS_OK, or why this board cannot have the setting */
enum status wiring_check(const struct machine *machine, uint16_t number, double value);

/** Power-on: settings stored by firmware for another board go back to off, with a message. */
void wiring_fit(struct machine *machine);

/** M7 or M8 of the present line are taken without their output ($91): say so, once in a job. */
void wiring_report_coolant(struct machine *machine);

#endif
