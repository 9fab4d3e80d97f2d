/* SPDX-License-Identifier: MIT */
#include "machine/switches.h"

#include "machine/parts.h"

static struct switch_lines lines_both(struct switch_lines a, struct switch_lines b) {
    return (struct switch_lines){.limits = a.limits & b.limits, .homes = a.homes & b.homes};
}

static struct switch_lines lines_either(struct switch_lines a, struct switch_lines b) {
    return (struct switch_lines){.limits = a.limits | b.limits, .homes = a.homes | b.homes};
}

static struct switch_lines lines_without(struct switch_lines a, struct switch_lines b) {
    return (struct switch_lines){.limits = a.limits & ~b.limits, .homes = a.homes & ~b.homes};
}

/* One bit each, 1 = closed whatever the polarity, so that all switches are debounced by a few word
 * operations. */
struct switch_lines switch_lines_of(const struct hal_switches *levels, bool active_high) {
    const uint32_t axes = (1u << AXIS_COUNT) - 1, flip = active_high ? 0 : axes * 0x01010101u;
    return (struct switch_lines){
        .limits = (levels->limit_min | (uint32_t)levels->limit_max << 8 | (uint32_t)levels->second_min << 16 |
                   (uint32_t)levels->second_max << 24) ^
                  flip,
        .homes = (levels->home | (uint32_t)levels->second_home << 8) ^ (flip & 0xFFFFu),
    };
}

void switches_begin(struct switches *switches, struct switch_lines stable) {
    *switches = (struct switches){.closed = stable};
}

struct switch_lines switches_edge(struct switches *switches, struct switch_lines stable,
                                  struct switch_lines pins, bool filters) {
    if (!filters) {
        switches->closed = stable;
        switches->waiting = switches->due = (struct switch_lines){0, 0};
        return switches->waiting;
    }
    /* Only closing waits for the filter time: interference must not stop a job. Where a line has closed is
     * marked by the caller at its edge (`fresh`), because homing measures from there. */
    switches->closed = lines_both(switches->closed, lines_either(stable, pins));
    struct switch_lines waiting = lines_without(pins, switches->closed);
    struct switch_lines fresh = lines_without(waiting, switches->waiting);
    switches->waiting = waiting;
    switches->due = lines_both(switches->due, waiting); /* one that was open in between begins again */
    return fresh;
}

struct switch_lines switches_time(struct switches *switches) {
    const struct switch_lines closed = switches->due;
    switches->timed = false;
    switches->closed = lines_either(switches->closed, closed);
    switches->waiting = lines_without(switches->waiting, closed);
    switches->due = (struct switch_lines){0, 0};
    return closed;
}

bool switches_start_timer(struct switches *switches) {
    if (switches->timed || (switches->waiting.limits | switches->waiting.homes) == 0)
        return false;
    switches->timed = true;
    switches->due = switches->waiting;
    return true;
}
