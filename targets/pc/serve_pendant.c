/* SPDX-License-Identifier: MIT */
#include "serve_pendant.h"

#include "net_socket.h"
#include "net_tcp.h"
#include "serve_serial.h"

#include <stdio.h>

#define OPEN_AGAIN_US 1000000u

_Static_assert((int)NET_PTY_NAME_SIZE >= (int)NET_ADDRESS_SIZE, "an address fits");

void serve_pendant_init(struct serve_pendant *pendant) {
    *pendant = (struct serve_pendant){.listener = -1, .serial = -1};
}

/* ---- a serial port ---- */

static long serial_read(const struct net_stream *stream, char *bytes, size_t size) {
    const long count = serve_serial_take(stream->fd, bytes, size);
    return count < 0 ? NET_GONE : count;
}

static long serial_write(const struct net_stream *stream, const char *bytes, size_t count) {
    const long taken = serve_serial_give(stream->fd, bytes, count);
    return taken < 0 ? NET_GONE : taken;
}

static void serial_close(const struct net_stream *stream) {
    struct serve_pendant *pendant = stream->ctx;
    serve_serial_close(pendant->serial);
    pendant->serial = -1;
    pendant->attached = false;
}

static int open_serial(struct serve_pendant *pendant) {
    int error = 0;
    pendant->serial = serve_serial_open(pendant->options.serial, &error);
    if (pendant->serial < 0)
        return error;
    if (serve_serial_configure(pendant->serial, pendant->options.baud, 0))
        return 0;
    serve_serial_close(pendant->serial);
    pendant->serial = -1;
    return serve_serial_bad_format;
}

/* ---- the doors ---- */

int serve_pendant_open(struct serve_pendant *pendant, const struct serve_pendant_options *options,
                       char where[NET_PTY_NAME_SIZE], const char **detail) {
    int error = 0;
    pendant->options = *options;
    if (options->serial != NULL) {
        snprintf(where, NET_PTY_NAME_SIZE, "%s", options->serial);
        *detail = serve_serial_missing;
        return open_serial(pendant);
    }
    if (options->pty_link != NULL) {
        *detail = net_pty_missing;
        error = net_pty_open(&pendant->pty, options->pty_link);
        pendant->has_pty = error == 0;
        snprintf(where, NET_PTY_NAME_SIZE, "%s", pendant->pty.slave);
        return error;
    }
    pendant->listener = net_tcp_listen("127.0.0.1", options->tcp_port, where, &error);
    return pendant->listener >= 0 ? 0 : error;
}

static void let_in(const struct serve_pendant *pendant, struct net_hub *hub, struct net_stream *stream,
                   const char *name) {
    stream->pendant = pendant->options.kind;
    stream->local = true;
    stream->telnet = false;
    (void)net_hub_connect(hub, stream, name);
}

static void attach_serial(struct serve_pendant *pendant, struct net_hub *hub, uint32_t now_us) {
    static const struct net_stream_ops ops = {
        .read = serial_read, .write = serial_write, .close = serial_close};
    if (pendant->serial < 0 && now_us - pendant->tried_us >= OPEN_AGAIN_US) {
        pendant->tried_us = now_us;
        (void)open_serial(pendant);
    }
    if (pendant->serial < 0)
        return;
    pendant->attached = true;
    struct net_stream stream = {.ops = &ops, .ctx = pendant, .fd = pendant->serial};
    let_in(pendant, hub, &stream, "pendant");
}

void serve_pendant_accept(struct serve_pendant *pendant, struct net_hub *hub, uint32_t now_us) {
    struct net_stream stream;
    char name[NET_ADDRESS_SIZE];
    if (pendant->options.serial != NULL && !pendant->attached)
        attach_serial(pendant, hub, now_us);
    if (pendant->has_pty && net_pty_opened(&pendant->pty, &stream))
        let_in(pendant, hub, &stream, "pendant");
    if (pendant->listener >= 0 && net_tcp_accept(pendant->listener, &stream, name)) {
        net_tcp_keep_alive(&stream);
        let_in(pendant, hub, &stream, name);
    }
}

void serve_pendant_refuse(struct serve_pendant *pendant) {
    if (pendant->listener >= 0)
        net_socket_close(pendant->listener);
    pendant->listener = -1;
    if (pendant->has_pty)
        net_pty_unlink(&pendant->pty);
}

void serve_pendant_close(struct serve_pendant *pendant) {
    if (pendant->has_pty)
        net_pty_close(&pendant->pty);
    if (pendant->serial >= 0)
        serve_serial_close(pendant->serial);
}
