/* SPDX-License-Identifier: MIT
 * The host controller in real time: paced by the wall clock, on TCP and on a pty, for real senders.
 *
 * One thread, one loop around port_poll(). Virtual time is wall time times the speed; step events due up to
 * now are run in batches. With nothing to do it sleeps. */
#ifndef WIFICNC_PC_SERVE_H
#define WIFICNC_PC_SERVE_H

#include "host.h"
#include "serve_pendant.h"

/** What the server tells its surroundings. All strings are gone when the call returns. */
struct serve_events {
    /** The controller can be reached: kind "tcp", "wmc3" or "control", its address; "pty", its device;
     * "pendant", either. */
    void (*listens)(void *ctx, const char *kind, const char *where);
    /** A client was "connected", became "owner", "disconnected", ... */
    void (*client)(void *ctx, const char *what, const char *who);
    void *ctx;
};

/** What to serve. Strings must live as long as the server. */
struct serve_options {
    struct host_board board;
    double speed;             /* > 0; 0: as fast as the computer can */
    const char *tcp_host;     /* NULL: no TCP */
    const char *tcp_port;     /* "0": any free one */
    const char *control_port; /* of 127.0.0.1, see serve_control.h; NULL: no such door */
    const char *pty_link;     /* NULL: no pty */
    const char
        *wire_address; /* IPv4 of the binary protocol, its ports are fixed; NULL: none. Needs speed > 0 */
    bool io_module;    /* an I/O module, whatever the store says; then there is no text side */
    const char *key;   /* of network clients, by any protocol; "": access is open */
    const char *store; /* file that keeps settings; NULL: nothing is kept */
    const char *const *settings; /* lines like $110=5000, NULL-terminated; or NULL */
    const char
        *spindle_bus; /* serial port of a spindle drive; NULL: the virtual machine has one. Needs speed 1 */
    struct serve_pendant_options pendant; /* all NULL: no port for a pendant */
    const char *const *hands;             /* lines of hands.h after the settings, NULL-terminated; or NULL */
    int stop_fd[2];                       /* readable, or at its end: stop; -1: none */
    struct serve_events events;
};

/** Where a start failed. */
enum serve_stage {
    SERVE_MEMORY,
    SERVE_BOARD,
    SERVE_STORE,
    SERVE_SETTING,
    SERVE_HANDS,
    SERVE_TCP,
    SERVE_CONTROL,
    SERVE_PTY,
    SERVE_WIRE,
    SERVE_BUS,
    SERVE_PENDANT
};

struct serve_failure {
    enum serve_stage stage;
    int error;          /* the system's; of SERVE_SETTING error:N; of SERVE_TCP 0 = unknown host */
    const char *detail; /* of SERVE_SETTING the line; of SERVE_PTY why there is none, or NULL */
};

struct serve;

/** Start the controller and open its doors. @return NULL and *failure, nothing left open. */
struct serve *serve_create(const struct serve_options *options, struct serve_failure *failure);

/** Serve until stop_fd says so. @return 0, or the error of a wait that failed */
int serve_run(struct serve *serve);

void serve_destroy(struct serve *serve);

#endif
