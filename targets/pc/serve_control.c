/* SPDX-License-Identifier: MIT */
#include "serve_control.h"

#include "hands.h"
#include "host.h"
#include "host_inner.h"
#include "net_hub.h"
#include "net_light.h"
#include "net_tcp.h"
#include "virtual.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Second motors, where they are elsewhere than the first. */
static int say_second(const struct host *host, const float steps_per_mm[AXIS_COUNT], char *answer, int at) {
    int32_t first[AXIS_COUNT], second[AXIS_COUNT];
    virtual_position(host, first);
    virtual_second_position(host, second);
    for (unsigned axis = 0; axis < AXIS_COUNT; axis++)
        if (second[axis] != first[axis])
            at += snprintf(answer + at, (size_t)(CONTROL_ANSWER_SIZE - at), " skew %c%.4f", "XYZABC"[axis],
                           (double)(second[axis] - first[axis]) / (double)steps_per_mm[axis]);
    return at;
}

static void say_state(const struct host *host, char answer[CONTROL_ANSWER_SIZE]) {
    int32_t steps[AXIS_COUNT];
    float steps_per_mm[AXIS_COUNT];
    struct virtual_outputs outputs;
    virtual_position(host, steps);
    virtual_outputs(host, &outputs);
    host_steps_per_mm(host, steps_per_mm);
    int at = snprintf(answer, CONTROL_ANSWER_SIZE, "position");
    for (unsigned axis = 0; axis < AXIS_COUNT; axis++)
        at += snprintf(answer + at, (size_t)(CONTROL_ANSWER_SIZE - at), "%c%.4f", axis == 0 ? ' ' : ',',
                       (double)steps[axis] / (double)steps_per_mm[axis]);
    at = say_second(host, steps_per_mm, answer, at);
    snprintf(answer + at, (size_t)(CONTROL_ANSWER_SIZE - at),
             " inputs 0x%05llx spindle %.0f coolant %u digital %u analog %g,%g,%g,%g\n",
             (unsigned long long)virtual_levels(host), (double)virtual_spindle_rpm(host),
             (unsigned)outputs.coolant, (unsigned)outputs.digital, (double)outputs.analog_pct[0],
             (double)outputs.analog_pct[1], (double)outputs.analog_pct[2], (double)outputs.analog_pct[3]);
}

static void say_counters(const struct host *host, char answer[CONTROL_ANSWER_SIZE]) {
    struct host_counters counters;
    host_counters(host, &counters);
    snprintf(answer, CONTROL_ANSWER_SIZE, "lines %llu blocks %llu starved %llu underruns %llu unmet %llu\n",
             (unsigned long long)counters.lines, (unsigned long long)counters.blocks,
             (unsigned long long)counters.lookahead_starved, (unsigned long long)counters.underruns,
             (unsigned long long)counters.plan_unmet);
}

/* The network is that of this computer. */
static void say_light(const struct host *host, const struct net_hub *hub, char answer[CONTROL_ANSWER_SIZE]) {
    const struct net_light_facts facts = {.alarm = machine_state(&host->machine) == MACHINE_ALARM,
                                          .at_rest = machine_is_at_rest(&host->machine),
                                          .controlled = hub->owner != NULL,
                                          .joined = true};
    snprintf(answer, CONTROL_ANSWER_SIZE, "light %s\n", net_light_name(net_light_of(&facts)));
}

/* Only blanks, or this one word. */
static bool says(const char *line, const char *word) {
    line += strspn(line, " \t\r\n");
    if (strncmp(line, word, strlen(word)) != 0)
        return false;
    line += strlen(word);
    return line[strspn(line, " \t\r\n")] == '\0';
}

#define SPEED_MAX 1e6

/* The number after the word `speed`. @return NULL and it is in force, or what is wrong */
static const char *set_speed(struct serve_clock *clock, const char *number, uint64_t done_ticks) {
    char *end;
    double speed = strtod(number, &end);
    if (!(clock->speed > 0.0))
        return "this controller runs as fast as it can, without a clock: start it with another --speed";
    if (end == number || end[strspn(end, " \t\r\n")] != '\0' || !(speed > 0.0 && speed <= SPEED_MAX))
        return "speed N, above 0 and up to 1000000: so many times real time";
    serve_clock_set_speed(clock, speed, done_ticks);
    return NULL;
}

static const char *do_line(struct host *host, struct serve_clock *clock, const char *line) {
    struct hands_action action;
    line += strspn(line, " \t\r\n");
    if (strncmp(line, "speed", 5) == 0 && (line[5] == '\0' || strchr(" \t\r\n", line[5]) != NULL))
        return set_speed(clock, line + 5, host_time_ticks(host));
    const char *wrong = hands_read(host, line, &action);
    if (wrong == NULL)
        hands_do(host, &action);
    return wrong;
}

/* One command. @param[out] answer  one line with its end */
static void obey(const struct serve_control *control, struct host *host, struct serve_clock *clock,
                 const char *line, char answer[CONTROL_ANSWER_SIZE]) {
    if (says(line, "state")) {
        say_state(host, answer);
        return;
    }
    if (says(line, "light")) {
        say_light(host, control->hub, answer);
        return;
    }
    if (says(line, "counters")) {
        say_counters(host, answer);
        return;
    }
    const char *wrong = says(line, "") ? NULL : do_line(host, clock, line);
    snprintf(answer, CONTROL_ANSWER_SIZE, wrong == NULL ? "ok\n" : "error: %s\n", wrong);
}

/* ---- connections ---- */

static void drop(struct control_client *client) {
    client->stream.ops->close(&client->stream);
    *client = (struct control_client){0};
}

/* An answer that does not fit into the connection ends it: no one reads there. */
static void take(const struct serve_control *control, struct control_client *client, char byte,
                 struct host *host, struct serve_clock *clock) {
    char answer[CONTROL_ANSWER_SIZE];
    if (byte != '\n') {
        if (client->size < CONTROL_LINE_SIZE - 1)
            client->line[client->size++] = byte;
        return;
    }
    client->line[client->size] = '\0';
    client->size = 0;
    if (control->module == NULL || !host_module_line(control->module, client->line, answer, sizeof answer))
        obey(control, host, clock, client->line, answer);
    if (client->stream.ops->write(&client->stream, answer, strlen(answer)) != (long)strlen(answer))
        drop(client);
}

static void read_client(const struct serve_control *control, struct control_client *client, struct host *host,
                        struct serve_clock *clock) {
    char bytes[512];
    long count = client->stream.ops->read(&client->stream, bytes, sizeof bytes);
    if (count < 0)
        drop(client);
    for (long i = 0; i < count && client->stream.ops != NULL; i++)
        take(control, client, bytes[i], host, clock);
}

static void accept_one(struct serve_control *control) {
    char name[NET_ADDRESS_SIZE];
    struct net_stream stream;
    if (!net_tcp_accept(control->listener, &stream, name))
        return;
    for (size_t i = 0; i < CONTROL_CLIENTS; i++) {
        if (control->client[i].stream.ops == NULL) {
            control->client[i] = (struct control_client){.stream = stream};
            return;
        }
    }
    stream.ops->close(&stream);
}

void serve_control_fill_poll(const struct serve_control *control, struct port_poll polls[CONTROL_POLLS]) {
    polls[CONTROL_CLIENTS] = (struct port_poll){.fd = control->listener, .wanted = PORT_READ};
    for (size_t i = 0; i < CONTROL_CLIENTS; i++) {
        const struct net_stream *stream = &control->client[i].stream;
        polls[i] = (struct port_poll){.fd = stream->ops != NULL ? stream->fd : -1, .wanted = PORT_READ};
    }
}

void serve_control_read(struct serve_control *control, const struct port_poll polls[CONTROL_POLLS],
                        struct host *host, struct serve_clock *clock) {
    for (size_t i = 0; i < CONTROL_CLIENTS; i++)
        if (polls[i].found != 0 && control->client[i].stream.ops != NULL)
            read_client(control, &control->client[i], host, clock);
    if (polls[CONTROL_CLIENTS].found != 0)
        accept_one(control);
}

void serve_control_close(struct serve_control *control) {
    for (size_t i = 0; i < CONTROL_CLIENTS; i++)
        if (control->client[i].stream.ops != NULL)
            drop(&control->client[i]);
    if (control->listener >= 0)
        net_socket_close(control->listener);
}
