/* SPDX-License-Identifier: MIT */
#include "output_log.h"

#include "host_inner.h"

#include <stdlib.h>

static void record(struct hal *hal) {
    struct output_log *log = &hal->output_log;
    const struct virtual_outputs *pins = &hal->virtual_machine.outputs;
    if (log->changes == NULL)
        return;
    if (log->count == log->size) {
        struct output_change *changes = realloc(log->changes, 2 * log->size * sizeof *changes);
        if (changes == NULL)
            abort(); /* a record with holes would hide what it is there to show */
        log->changes = changes;
        log->size *= 2;
    }
    log->changes[log->count++] = (struct output_change){.t_ticks = hal->step.now_ticks,
                                                        .rpm = pins->spindle_rpm,
                                                        .duty = pins->spindle_duty,
                                                        .direction = (int8_t)pins->spindle_direction,
                                                        .coolant = pins->coolant};
}

void host_record_outputs(struct host *host) {
    struct output_log *log = &host->hal.output_log;
    output_log_free(log);
    *log = (struct output_log){.size = 1024};
    log->changes = malloc(log->size * sizeof *log->changes);
    if (log->changes == NULL)
        abort();
    record(&host->hal);
}

size_t host_output_changes(const struct host *host, const struct output_change **changes) {
    *changes = host->hal.output_log.changes;
    return host->hal.output_log.count;
}

void output_log_free(struct output_log *log) {
    free(log->changes);
    *log = (struct output_log){0};
}

void host_set_output_period(struct host *host, uint32_t period_us) {
    struct hal *hal = &host->hal;
    hal->output_period_ticks = (uint64_t)period_us * hal->timer_mhz_q8 >> 8;
    hal->outputs_due_ticks = hal->step.now_ticks;
    outputs_follow(hal);
}

static bool differ(const struct hal *hal) {
    const struct virtual_outputs *set = &hal->outputs_set, *pins = &hal->virtual_machine.outputs;
    return set->spindle_direction != pins->spindle_direction || set->spindle_rpm != pins->spindle_rpm ||
           set->spindle_duty != pins->spindle_duty || set->coolant != pins->coolant;
}

bool outputs_beam_differs(const struct hal *hal) {
    return hal->keeps_duty && hal->virtual_machine.outputs.spindle_duty != hal->step.duty;
}

/* With the step interrupt, whatever the period. */
void outputs_follow_beam(struct hal *hal) {
    hal->outputs_set.spindle_duty = hal->virtual_machine.outputs.spindle_duty = hal->step.duty;
    record(hal);
}

void outputs_commit(struct hal *hal) {
    if (!differ(hal))
        return;
    struct virtual_outputs pins = hal->virtual_machine.outputs;
    pins.spindle_direction = hal->outputs_set.spindle_direction;
    pins.spindle_rpm = hal->outputs_set.spindle_rpm;
    pins.spindle_duty = hal->outputs_set.spindle_duty;
    pins.coolant = hal->outputs_set.coolant;
    virtual_command(&hal->virtual_machine, &pins, hal->step.now_ticks, hal->timer_hz);
    record(hal);
}

void outputs_follow(struct hal *hal) {
    if (hal->output_period_ticks != 0) {
        if (hal->step.now_ticks < hal->outputs_due_ticks)
            return;
        hal->outputs_due_ticks =
            (hal->step.now_ticks / hal->output_period_ticks + 1) * hal->output_period_ticks;
    }
    outputs_commit(hal);
}

uint64_t outputs_next_ticks(const struct hal *hal, int moving) {
    return hal->output_period_ticks != 0 && (moving || differ(hal)) ? hal->outputs_due_ticks : UINT64_MAX;
}
