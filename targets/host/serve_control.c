/* SPDX-License-Identifier: MIT */
#include "serve_control.h"

#include "host.h"
#include "net_tcp.h"
#include "virtual.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { WORDS_MAX = 2 + AXIS_COUNT };

static const char axis_names[] = "xyzabc";

struct words {
    char text[CONTROL_LINE_SIZE];
    char *word[WORDS_MAX];
    int count;
};

static void split(struct words *words, const char *line) {
    char *rest = NULL;
    snprintf(words->text, sizeof words->text, "%s", line);
    words->count = 0;
    for (char *word = strtok_r(words->text, " \t\r\n", &rest); word != NULL && words->count < WORDS_MAX;
         word = strtok_r(NULL, " \t\r\n", &rest))
        words->word[words->count++] = word;
}

static bool is(const char *word, const char *other) {
    return strcmp(word, other) == 0;
}

/* @return false: no number that steps can hold */
static bool read_steps(const struct host *host, unsigned axis, const char *word, int32_t *out) {
    float steps_per_mm[AXIS_COUNT];
    char *end;
    host_steps_per_mm(host, steps_per_mm);
    double steps = strtod(word, &end) * (double)steps_per_mm[axis];
    if (*word == '\0' || *end != '\0' || !(steps > -2e9 && steps < 2e9))
        return false;
    *out = (int32_t)(steps < 0.0 ? steps - 0.5 : steps + 0.5);
    return true;
}

/* ---- commands: NULL, or what is wrong ---- */

static const char *set_input(struct host *host, const struct words *words) {
    int input = virtual_input_number(words->word[0]);
    if (input < 0)
        return "no such command or input";
    if (words->count != 2 || (!is(words->word[1], "on") && !is(words->word[1], "off")))
        return "an input is on or off";
    virtual_set(host, input, is(words->word[1], "on"));
    return NULL;
}

static const char *set_travel(struct host *host, const struct words *words) {
    const char *name =
        words->count > 1 && words->word[1][0] != '\0' ? strchr(axis_names, words->word[1][0]) : NULL;
    int32_t low, high;
    if (name == NULL || words->word[1][1] != '\0')
        return "which axis?";
    unsigned axis = (unsigned)(name - axis_names);
    if (words->count == 3 && is(words->word[2], "off")) {
        virtual_no_travel(host, axis);
        return NULL;
    }
    if (words->count != 4 || !read_steps(host, axis, words->word[2], &low) ||
        !read_steps(host, axis, words->word[3], &high) || low >= high)
        return "travel AXIS LOW HIGH, in mm";
    virtual_travel(host, axis, low, high);
    return NULL;
}

static const char *set_surface(struct host *host, const struct words *words) {
    int32_t steps;
    if (words->count == 2 && is(words->word[1], "off"))
        virtual_no_surface(host);
    else if (words->count == 2 && read_steps(host, AXIS_Z, words->word[1], &steps))
        virtual_surface(host, steps);
    else
        return "surface Z, in mm, or off";
    return NULL;
}

static const char *set_place(struct host *host, const struct words *words) {
    int32_t steps[AXIS_COUNT];
    virtual_position(host, steps);
    if (words->count < 2)
        return "place X Y Z, in mm";
    for (int i = 1; i < words->count; i++)
        if (i > AXIS_COUNT || !read_steps(host, (unsigned)i - 1, words->word[i], &steps[i - 1]))
            return "place X Y Z, in mm";
    virtual_place(host, steps);
    return NULL;
}

static const char *set_ramp(struct host *host, const struct words *words) {
    char *end = NULL;
    double rpm_s = words->count == 2 ? strtod(words->word[1], &end) : -1.0;
    if (end == NULL || *end != '\0' || !(rpm_s >= 0.0 && rpm_s < 1e9))
        return "ramp RPM, a second";
    virtual_spindle_ramp(host, (float)rpm_s);
    return NULL;
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
    snprintf(answer + at, (size_t)(CONTROL_ANSWER_SIZE - at), " inputs 0x%05lx spindle %.0f coolant %u\n",
             (unsigned long)virtual_levels(host), (double)virtual_spindle_rpm(host),
             (unsigned)outputs.coolant);
}

void serve_control_line(struct host *host, const char *line, char answer[CONTROL_ANSWER_SIZE]) {
    static const struct {
        const char *name;
        const char *(*run)(struct host *host, const struct words *words);
    } commands[] = {
        {"travel", set_travel}, {"surface", set_surface}, {"place", set_place}, {"ramp", set_ramp}};
    struct words words;
    const char *(*run)(struct host *, const struct words *) = set_input;
    split(&words, line);
    if (words.count == 0) {
        strcpy(answer, "ok\n");
        return;
    }
    if (words.count == 1 && is(words.word[0], "state")) {
        say_state(host, answer);
        return;
    }
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++)
        if (is(words.word[0], commands[i].name))
            run = commands[i].run;
    const char *wrong = run(host, &words);
    snprintf(answer, CONTROL_ANSWER_SIZE, wrong == NULL ? "ok\n" : "error: %s\n", wrong);
}

/* ---- connections ---- */

static void drop(struct control_client *client) {
    client->stream.ops->close(&client->stream);
    *client = (struct control_client){0};
}

/* An answer that does not fit into the connection ends it: nobody reads there. */
static void take(struct control_client *client, char byte, struct host *host) {
    char answer[CONTROL_ANSWER_SIZE];
    if (byte != '\n') {
        if (client->size < CONTROL_LINE_SIZE - 1)
            client->line[client->size++] = byte;
        return;
    }
    client->line[client->size] = '\0';
    client->size = 0;
    serve_control_line(host, client->line, answer);
    if (client->stream.ops->write(&client->stream, answer, strlen(answer)) != (long)strlen(answer))
        drop(client);
}

static void read_client(struct control_client *client, struct host *host) {
    char bytes[512];
    long count = client->stream.ops->read(&client->stream, bytes, sizeof bytes);
    if (count < 0)
        drop(client);
    for (long i = 0; i < count && client->stream.ops != NULL; i++)
        take(client, bytes[i], host);
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

void serve_control_fill_poll(const struct serve_control *control, struct pollfd polls[CONTROL_POLLS]) {
    polls[CONTROL_CLIENTS] = (struct pollfd){.fd = control->listener, .events = POLLIN};
    for (size_t i = 0; i < CONTROL_CLIENTS; i++) {
        const struct net_stream *stream = &control->client[i].stream;
        polls[i] = (struct pollfd){.fd = stream->ops != NULL ? stream->fd : -1, .events = POLLIN};
    }
}

void serve_control_read(struct serve_control *control, const struct pollfd polls[CONTROL_POLLS],
                        struct host *host) {
    for (size_t i = 0; i < CONTROL_CLIENTS; i++)
        if (polls[i].revents != 0 && control->client[i].stream.ops != NULL)
            read_client(&control->client[i], host);
    if (polls[CONTROL_CLIENTS].revents != 0)
        accept_one(control);
}

void serve_control_close(struct serve_control *control) {
    for (size_t i = 0; i < CONTROL_CLIENTS; i++)
        if (control->client[i].stream.ops != NULL)
            drop(&control->client[i]);
    if (control->listener >= 0)
        close(control->listener);
}
