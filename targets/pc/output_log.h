/* SPDX-License-Identifier: MIT
 * [tests] Outputs of the virtual machine over time: every change with its moment, and the period at which the
 * pins follow the controller.
 *
 * The controller runs after every span on the PC, so its outputs follow the motion immediately. On a chip the
 * task that sets them comes round every few milliseconds. With a period the pins change at its multiples
 * only. */
#ifndef WIFICNC_PC_OUTPUT_LOG_H
#define WIFICNC_PC_OUTPUT_LOG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct host;

/** The pins from t_ticks on. */
struct output_change {
    uint64_t t_ticks;
    float rpm;
    uint16_t duty;
    int8_t direction; /* of the spindle: -1, 0, 1 */
    uint8_t coolant;  /* COOLANT_ bits */
};

struct output_log {
    struct output_change *changes; /* NULL: nothing is recorded */
    size_t count, size;
};

/** Record from now on; the first entry is what the pins are now. */
void host_record_outputs(struct host *host);

/** @return entries recorded so far; *changes points to them until the host runs on */
size_t host_output_changes(const struct host *host, const struct output_change **changes);

/** Spindle and coolant pins change only at multiples of this time; 0: immediately (power-on). */
void host_set_output_period(struct host *host, uint32_t period_us);

/* --- for host.c and host_hal.c --- */

struct hal;

/** The pins take what the controller has set last. */
void outputs_commit(struct hal *hal);

/** The step interrupt has set a laser's duty, and the pin does not show it yet. */
bool outputs_beam_differs(const struct hal *hal);

/** Show it. */
void outputs_follow_beam(struct hal *hal);

/** The period has come round: the pins follow. */
void outputs_follow(struct hal *hal);

/** When the pins follow next; UINT64_MAX: they are as set, and nothing moves them. @param moving  the
 * controller may set them again any time */
uint64_t outputs_next_ticks(const struct hal *hal, int moving);

void output_log_free(struct output_log *log);

#endif
