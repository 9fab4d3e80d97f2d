/* SPDX-License-Identifier: MIT */
#include "serve_wire.h"

#include "base/version.h"
#include "host_inner.h"

static void system_random(void *ctx, uint8_t *bytes, size_t count) {
    (void)ctx;
    port_random(bytes, count);
}

bool serve_wire_choose(struct serve_wire *wire, struct host *host, bool force) {
    host_module_init(&wire->module, host);
    host_device_init(&wire->device, host);
    wire->is_module = force || channels_are_chosen(&wire->module.channels);
    if (wire->is_module)
        host_module_start(&wire->module);
    return wire->is_module;
}

int serve_wire_open(struct serve_wire *wire, struct host *host, const char *address, struct access *access) {
    static const struct session_ops ops = {.send = net_wire_send, .random = system_random};
    const struct session_options options = {.name = "WiFiCNC",
                                            .access = access,
                                            .version = VERSION_WORD,
                                            .status_port = WIRE_STATUS_PORT,
                                            .channels = &wire->module.channels,
                                            .device = &wire->device.device};
    if (wire->is_module)
        session_init_module(&wire->session, &wire->module.device, &options, &ops, &wire->net);
    else
        session_init(&wire->session, &host->machine, &options, &ops, &wire->net);
    int error = net_wire_open(&wire->net, address, &wire->session);
    wire->open = error == 0;
    return error;
}

void serve_wire_close(struct serve_wire *wire) {
    if (wire->open)
        net_wire_close(&wire->net);
    wire->open = false;
}

void serve_wire_fill_poll(const struct serve_wire *wire, struct port_poll polls[SERVE_WIRE_POLLS]) {
    const struct net_wire *net = &wire->net;
    polls[0] = (struct port_poll){.fd = wire->open ? net->udp : -1, .wanted = PORT_READ};
    polls[1] = (struct port_poll){.fd = wire->open ? net->listener : -1, .wanted = PORT_READ};
    for (size_t i = 0; i < SESSION_CLIENTS; i++) {
        const struct net_wire_client *client = &net->client[i];
        bool there = wire->open && client->stream.ops != NULL;
        short wanted = net_wire_wants_read(client) ? PORT_READ : 0;
        /* Replies that wait: the round writes them as soon as the socket takes more. */
        if (client->out_count > 0)
            wanted |= PORT_WRITE;
        polls[2 + i] = (struct port_poll){.fd = there ? client->stream.fd : -1, .wanted = wanted};
    }
}

void serve_wire_read(struct serve_wire *wire) {
    if (wire->open)
        net_wire_round(&wire->net);
}

void serve_wire_poll(struct serve_wire *wire) {
    if (wire->open)
        session_poll(&wire->session);
}

uint32_t serve_wire_wait_us(const struct serve_wire *wire) {
    return wire->open ? session_wait_us(&wire->session) : UINT32_MAX;
}
