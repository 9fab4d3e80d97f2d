/* SPDX-License-Identifier: MIT
 * The hands at the virtual machine: a TCP door where lines press buttons, close switches and move the work
 * piece.
 *
 *   what hands.h knows     done immediately
 *   state                 where it is, which inputs are active, what the outputs say
 *
 *   pin N high|low|open   of an I/O module: what holds that line from outside
 *   pins                  of an I/O module: which pins are outputs, and their levels
 *
 *   speed N               virtual time passes N times as fast as the wall clock from now on
 *
 *   light                 what the status light of a board would show
 *
 *   counters              lines answered, blocks planned, times the look-ahead or the span ring ran dry
 *
 * Each line is answered by one line: `ok`, `error: why`, or what was asked for. */
#ifndef WIFICNC_PC_SERVE_CONTROL_H
#define WIFICNC_PC_SERVE_CONTROL_H

#include "hands.h"
#include "host_module.h"
#include "net_stream.h"
#include "port.h"
#include "serve_clock.h"

struct host;
struct net_hub;

enum {
    CONTROL_CLIENTS = 4,
    CONTROL_LINE_SIZE = HANDS_LINE_SIZE,
    CONTROL_POLLS = CONTROL_CLIENTS + 1,
    CONTROL_ANSWER_SIZE = 512
};

struct control_client {
    struct net_stream stream; /* .ops NULL: a free place */
    char line[CONTROL_LINE_SIZE];
    size_t size;
};

struct serve_control {
    int listener;               /* -1: no such door */
    struct host_module *module; /* NULL: it is none */
    const struct net_hub *hub;  /* of the clients */
    struct control_client client[CONTROL_CLIENTS];
};

/** What to wait for. */
void serve_control_fill_poll(const struct serve_control *control, struct port_poll polls[CONTROL_POLLS]);

/** Do what came. */
void serve_control_read(struct serve_control *control, const struct port_poll polls[CONTROL_POLLS],
                        struct host *host, struct serve_clock *clock);

void serve_control_close(struct serve_control *control);

#endif
