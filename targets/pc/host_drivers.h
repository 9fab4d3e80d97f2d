/* SPDX-License-Identifier: MIT
 * The bus of motor drivers of the controller on a PC, in virtual time, and the drivers on it (virtual_tmc.h).
 * One thread, as the host. */
#ifndef WIFICNC_PC_HOST_DRIVERS_H
#define WIFICNC_PC_HOST_DRIVERS_H

#include "base/axis.h"
#include "drivers/drivers.h"
#include "machine/motors.h"
#include "virtual_tmc.h"

struct hal;
struct host;

enum { HOST_DRIVER_BYTES = 64 };

struct host_drivers {
    uint8_t count;
    struct driver_wire wire[DRIVER_COUNT_MAX];
    struct virtual_tmc chip[DRIVER_COUNT_MAX];
    uint8_t bytes[HOST_DRIVER_BYTES]; /* on their way to the controller */
    uint8_t byte_count;
    uint64_t ready_ticks; /* when the last of them is there */
};

/** A driver of a board: enum tmc_kind | address << 4 | select << 8 | chips of its chain << 12 | has DIAG
 * << 16 | mOhm << 17; no mOhm: as common modules. Of the first motors, then of the second ones. */
void host_drivers_init(struct host *host, const uint32_t driver[MOTOR_COUNT * AXIS_COUNT]);

/** What is wrong with the driver of a motor from now on: enum virtual_tmc_fault. Here and below a motor is
 * its axis, the second one of an axis AXIS_COUNT more.
 * @return false: it has no driver with registers */
bool host_driver_set_faults(struct host *host, unsigned motor, unsigned faults);

bool host_has_driver(const struct host *host, unsigned motor);

/** [tests] It is reset now, as by a short failure of its supply. */
bool host_driver_reset(struct host *host, unsigned motor);

/** [tests] It has this address now. */
bool host_driver_set_address(struct host *host, unsigned motor, unsigned address);

/** [tests] What is in a register, whether it can be read or not. */
uint32_t host_driver_register(const struct host *host, unsigned motor, unsigned reg);

/** [tests] Datagrams that the drivers have taken, all together. */
uint64_t host_driver_datagrams(const struct host *host);

/* --- for host.c --- */

/** When the answer is there; UINT64_MAX: none is on its way. */
uint64_t host_drivers_next_ticks(const struct hal *hal);

/** Motors have made steps. */
void host_drivers_step(struct hal *hal, uint8_t step_mask, uint8_t dir_mask, uint64_t t_ticks);

/** Axes whose end is seen by StallGuard alone, and that do not see it now: their first motors, their second
 * ones. */
void host_drivers_blind(const struct hal *hal, axis_mask_t blind[MOTOR_COUNT]);

#endif
