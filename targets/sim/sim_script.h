/* SPDX-License-Identifier: MIT
 * What happens at the machine during a simulated job, and when: hands.h on a clock of virtual time. */
#ifndef WIFICNC_SIM_SIM_SCRIPT_H
#define WIFICNC_SIM_SIM_SCRIPT_H

#include "hands.h"

#include <stddef.h>

enum { SCRIPT_EVENTS_MAX = 1000, SCRIPT_STATE_SIZE = 16 };

/** One event and what it found. */
struct script_event {
    double t_s;                         /* from the job's begin */
    int32_t done;                       /* 0: the job ended before it */
    char state[SCRIPT_STATE_SIZE];      /* of the controller right after it: "Hold:1" */
    char line[HANDS_LINE_SIZE];         /* in words */
    int32_t position_steps[AXIS_COUNT]; /* pulses on the pins by then */
};

struct script_item {
    struct script_event event;
    struct hands_action action;
};

struct sim_script {
    struct script_item *items; /* sorted by time; those of one time as they were given */
    size_t count, next;
    uint64_t begin_ticks;
    uint32_t timer_hz;
};

/** @return NULL, or what is wrong with it; then nothing was added. @param t_s  0 .. 1e6 */
const char *script_add(struct sim_script *script, const struct host *host, double t_s, const char *line);

/** The job begins now. */
void script_begin(struct sim_script *script, uint64_t now_ticks, uint32_t timer_hz);

/** Time of the next event, or UINT64_MAX. */
uint64_t script_next_ticks(const struct sim_script *script);

/** Do all that is due, one after the other. @return true: one of them asked for a reset */
bool script_perform(struct sim_script *script, struct host *host);

void script_free(struct sim_script *script);

#endif
