/* SPDX-License-Identifier: MIT
 * The port of a pendant (net_hub_pendant.c): a serial port of this computer, a pty, or TCP of this computer
 * for a pendant that is a program. */
#ifndef WIFICNC_PC_SERVE_PENDANT_H
#define WIFICNC_PC_SERVE_PENDANT_H

#include "net_hub.h"
#include "net_pty.h"

struct serve_pendant_options {
    const char *serial;   /* NULL: no serial port */
    const char *pty_link; /* NULL: no pty */
    const char *tcp_port; /* of 127.0.0.1, "0": any free one; NULL: no TCP */
    uint32_t baud;        /* of the serial port */
    uint8_t kind;         /* enum net_pendant */
};

struct serve_pendant {
    struct serve_pendant_options options;
    struct net_pty pty;
    bool has_pty;
    int listener; /* -1: none */
    int serial;   /* -1: none, or it is gone */
    bool attached;
    uint32_t tried_us; /* when the serial port was last opened, or could not be */
};

/** Before serve_pendant_open(). */
void serve_pendant_init(struct serve_pendant *pendant);

/** @param[out] where  the address of TCP, or the device @return 0, or the system's error; *detail may say
 * more
 */
int serve_pendant_open(struct serve_pendant *pendant, const struct serve_pendant_options *options,
                       char where[NET_PTY_NAME_SIZE], const char **detail);

/** Let in who has come; a serial port that was unplugged is opened again. */
void serve_pendant_accept(struct serve_pendant *pendant, struct net_hub *hub, uint32_t now_us);

/** Before the hub is closed: no one shall come any more. */
void serve_pendant_refuse(struct serve_pendant *pendant);

/** After it. */
void serve_pendant_close(struct serve_pendant *pendant);

#endif
