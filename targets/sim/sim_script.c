/* SPDX-License-Identifier: MIT */
#include "sim_script.h"

#include "host.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *script_add(struct sim_script *script, const struct host *host, double t_s, const char *line) {
    struct script_item item = {.event = {.t_s = t_s}};
    if (!(t_s >= 0.0 && t_s <= 1e6))
        return "a time is 0 to 1e6 s";
    if (script->count == SCRIPT_EVENTS_MAX)
        return "too many events";
    if (strlen(line) >= sizeof item.event.line)
        return "too long";
    const char *wrong = hands_read(host, line, &item.action);
    if (wrong != NULL)
        return wrong;
    struct script_item *grown = realloc(script->items, (script->count + 1) * sizeof *grown);
    if (grown == NULL)
        return "no memory";
    strcpy(item.event.line, line);
    script->items = grown;
    size_t at = script->count++;
    /* In the order of times; of those at one time the first added comes first. */
    for (; at > 0 && script->items[at - 1].event.t_s > t_s; at--)
        script->items[at] = script->items[at - 1];
    script->items[at] = item;
    return NULL;
}

void script_begin(struct sim_script *script, uint64_t now_ticks, uint32_t timer_hz) {
    script->begin_ticks = now_ticks;
    script->timer_hz = timer_hz;
}

uint64_t script_next_ticks(const struct sim_script *script) {
    if (script->next == script->count)
        return UINT64_MAX;
    return script->begin_ticks + (uint64_t)(script->items[script->next].event.t_s * script->timer_hz + 0.5);
}

bool script_perform(struct sim_script *script, struct host *host) {
    bool resets = false;
    while (script_next_ticks(script) <= host_time_ticks(host)) {
        const struct hands_action *action = &script->items[script->next].action;
        struct script_event *event = &script->items[script->next++].event;
        hands_do(host, action);
        host_run_paced(host, host_time_ticks(host), 1); /* the controller notices; no time passes */
        event->done = 1;
        snprintf(event->state, sizeof event->state, "%s", host_state(host));
        host_position_steps(host, event->position_steps);
        resets |= hands_resets(action);
    }
    return resets;
}

void script_free(struct sim_script *script) {
    free(script->items);
    *script = (struct sim_script){0};
}
