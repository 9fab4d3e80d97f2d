/* SPDX-License-Identifier: MIT
 * Motor drivers with registers: what settings and homing want of them, and what is wrong with them. What
 * that leads to is in driver_watch.h. [task] */
#ifndef WIFICNC_MACHINE_MOTOR_DRIVERS_H
#define WIFICNC_MACHINE_MOTOR_DRIVERS_H

#include "drivers/drivers.h"
#include "machine/actions.h"
#include "machine/machine.h"
#include "machine/trip.h"

/** The drivers, and what was reported of them. The target supplies it, zeroed but for `set`
 * (drivers_init()). */
struct machine_drivers {
    struct drivers set;
    uint16_t told[DRIVER_COUNT_MAX];    /* problems that were reported */
    uint16_t pending[DRIVER_COUNT_MAX]; /* ... those that will be, even if they are over by then */
    uint16_t acted[DRIVER_COUNT_MAX];   /* ... and those that have stopped motion */
    bool off_told;                      /* that drivers have no current yet */
    bool due;                           /* a problem is new: others may follow within `gather` */
    struct machine_timer gather;
    struct machine_timer recent; /* messages are counted ... */
    uint8_t messages;            /* ... in this time */
    bool stops;                  /* motion stops, and an alarm follows */
    struct machine_trip trip;
};

/** Send and receive; nothing is printed. @return true when something was done */
bool motor_drivers_talk(struct machine *machine);

/** At rest: a driver has not got all its registers yet, so motion does not begin. */
bool motor_drivers_holds(const struct machine *machine);

/** A driver with a current has a fault now, and $746 wants an alarm. */
bool motor_drivers_is_faulty(const struct machine *machine);

/** The sense resistor of the axis' driver allows this current. */
enum status motor_drivers_check_current(const struct machine *machine, unsigned axis, double current_ma);

/** These axes can be homed: their StallGuard, where $250 .. has one, can be trusted at $24 and $25. */
enum refusal motor_drivers_check_homing(struct machine *machine, axis_mask_t axes);

/** Report again what is wrong. */
void motor_drivers_tell_again(struct machine *machine);

/** Poll again after this time; UINT32_MAX: no need. */
uint32_t motor_drivers_wait_us(const struct machine *machine);

/** The same, but UINT32_MAX also where drivers are only looked at, or tried again. */
uint32_t motor_drivers_event_us(const struct machine *machine);

/* --- for driver_watch.c; there are drivers --- */

/** $746 */
enum { FAULT_MESSAGE, FAULT_HOLD, FAULT_ALARM };

/** What settings and homing want of them now. */
void motor_drivers_configure(struct machine *machine);

/** The axis whose settings are those of driver n; AXIS_COUNT: it has no motor. */
unsigned motor_drivers_axis(const struct machine *machine, unsigned n);

/** $140 .. of driver n is set. */
bool motor_drivers_have_current(const struct machine *machine, unsigned n);

/** What is wrong with driver n: enum driver_problem, added up; 0 where it has no motor. */
uint16_t motor_drivers_problems(const struct machine *machine, unsigned n);

/** Which of these problems are new: of the ways to be lost, none is while another one is known. */
uint16_t motor_drivers_fresh(uint16_t problems, uint16_t before);

/** Report what is new, when what has the same cause is there. @param now  do not wait for that
 *  @return true when something was printed */
bool motor_drivers_tell(struct machine *machine, bool now);

/** A message was printed. */
void motor_drivers_count_message(struct machine *machine);

/** There were so many lately that what comes and goes is not reported again for a while. */
bool motor_drivers_are_noisy(struct machine *machine);

#endif
