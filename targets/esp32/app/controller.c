/* SPDX-License-Identifier: MIT */
#include "app/controller.h"

#include "hal/hal.h"
#include "input/rx.h"
#include "machine/guard.h"
#include "net_tcp.h"

#include <string.h>

#define ASK_EVERY_US 50000u /* observers' status requests */

/* FEEDS_A_ROUND: then other clients are read again, however many lines of the owner wait. ACCEPTS_A_ROUND: a
 * flood of connections leaves time for everything else. */
enum { FEEDS_A_ROUND = 4, ACCEPTS_A_ROUND = 8 };

/* ---- the machine as the hub sees it ---- */

static size_t put(void *ctx, const char *bytes, size_t count) {
    struct controller *controller = ctx;
    return rx_put_all(machine_rx(controller->machine), (const uint8_t *)bytes, count);
}

static void lost(void *ctx, long what) {
    struct controller *controller = ctx;
    rx_count(machine_rx(controller->machine), what == NET_LOST ? RX_OVERRUN : RX_UNFRAMED);
}

/* The mark needs room in the receive buffer. The hub can wait for it; a UART could not (rx_put_or_lose()). */
static bool spoil(void *ctx) {
    struct controller *controller = ctx;
    struct rx *rx = machine_rx(controller->machine);
    if (rx_free(rx) == 0)
        return false;
    rx_spoil(rx);
    return true;
}

static size_t hear(void *ctx, char *bytes, size_t size) {
    struct controller *controller = ctx;
    size_t count = controller->said_count < size ? controller->said_count : size;
    memcpy(bytes, controller->said, count);
    memmove(controller->said, controller->said + count, controller->said_count - count);
    controller->said_count -= count;
    return count;
}

static void act(void *ctx) {
    struct controller *controller = ctx;
    (void)machine_poll(controller->machine);
}

static void forget_event(void *ctx, const char *what, const char *who) {
    (void)ctx;
    (void)what;
    (void)who;
}

static void left(void *ctx, bool lines_wait) {
    const struct controller *controller = ctx;
    machine_sender_lost(controller->machine, lines_wait);
}

static bool busy(void *ctx) {
    const struct controller *controller = ctx;
    return machine_has_line(controller->machine) || !machine_is_at_rest(controller->machine);
}

static uint8_t presses(void *ctx) {
    const struct controller *controller = ctx;
    return guard_idle_starts(controller->machine);
}

static enum machine_reads reads(void *ctx) {
    const struct controller *controller = ctx;
    return machine_reads(controller->machine);
}

static enum machine_whose whose(void *ctx) {
    const struct controller *controller = ctx;
    return machine_whose(controller->machine);
}

static uint8_t stops(void *ctx) {
    const struct controller *controller = ctx;
    return machine_stops(controller->machine);
}

static bool jogs(void *ctx) {
    const struct controller *controller = ctx;
    return machine_state(controller->machine) == MACHINE_JOG;
}

static void stopped_by_other(void *ctx) {
    const struct controller *controller = ctx;
    machine_stopped_by_other(controller->machine);
}

static size_t room(void *ctx) {
    const struct controller *controller = ctx;
    return machine_line_room(controller->machine);
}

static uint32_t drop_unread(void *ctx) {
    const struct controller *controller = ctx;
    return machine_drop_unread(controller->machine);
}

static void pendant_left(void *ctx) {
    const struct controller *controller = ctx;
    machine_pendant_lost(controller->machine);
}

static void mpg(void *ctx, bool on) {
    const struct controller *controller = ctx;
    machine_set_mpg(controller->machine, on);
}

static bool notice(void *ctx, unsigned number, char *text, size_t size) {
    const struct controller *controller = ctx;
    return machine_notice(controller->machine, number, text, size);
}

static const char *key(void *ctx) {
    const struct controller *controller = ctx;
    return controller->key;
}

static bool page(void *ctx, char *text, size_t size) {
    const struct controller *controller = ctx;
    return controller->page != NULL && controller->page(text, size);
}

/* An answer longer than the buffer goes to the hub in pieces. */
static void say(void *ctx, const char *bytes, size_t count) {
    struct controller *controller = ctx;
    while (count > 0) {
        if (controller->said_count == CONTROLLER_SAID)
            net_hub_hear(&controller->hub);
        size_t room = CONTROLLER_SAID - controller->said_count;
        size_t piece = count < room ? count : room;
        memcpy(controller->said + controller->said_count, bytes, piece);
        controller->said_count += piece;
        bytes += piece;
        count -= piece;
    }
}

/* ---- start ---- */

void controller_init(struct controller *controller, struct machine *machine,
                     const struct net_hub_sizes *sizes) {
    static const struct net_hub_ops ops = {.put = put,
                                           .lost = lost,
                                           .spoil = spoil,
                                           .hear = hear,
                                           .act = act,
                                           .event = forget_event,
                                           .left = left,
                                           .notice = notice,
                                           .busy = busy,
                                           .presses = presses,
                                           .reads = reads,
                                           .pendant_left = pendant_left,
                                           .mpg = mpg,
                                           .whose = whose,
                                           .stops = stops,
                                           .jogs = jogs,
                                           .stopped_by_other = stopped_by_other,
                                           .room = room,
                                           .drop_unread = drop_unread,
                                           .page = page,
                                           .key = key};
    *controller = (struct controller){.machine = machine, .listener = -1};
    net_hub_init(&controller->hub, sizes, &ops, controller);
}

void controller_set(struct controller *controller, const struct controller_options *options) {
    controller->key = options->key;
    controller->page = options->page;
    controller->hub.access = &controller->access;
}

struct text_out controller_out(struct controller *controller) {
    return (struct text_out){.write = say, .ctx = controller};
}

/* A port's stream with our own close(), which notes that the hub has let it go. */
static long port_read(const struct net_stream *stream, char *bytes, size_t size) {
    const struct controller_port *port = stream->ctx;
    return port->stream.ops->read(&port->stream, bytes, size);
}

static long port_write(const struct net_stream *stream, const char *bytes, size_t count) {
    const struct controller_port *port = stream->ctx;
    return port->stream.ops->write(&port->stream, bytes, count);
}

/* A serial port stays: let_in() attaches it again in the next round, as a new client. */
static void port_close(const struct net_stream *stream) {
    struct controller_port *port = stream->ctx;
    port->attached = false;
}

static void attach(struct controller *controller, struct controller_port *port) {
    static const struct net_stream_ops ops = {.read = port_read, .write = port_write, .close = port_close};
    const struct net_stream stream = {
        .ops = &ops, .ctx = port, .fd = -1, .local = true, .pendant = port->stream.pendant};
    if (port->stream.ops == NULL || port->attached)
        return;
    port->attached = true; /* unless it is refused, and so closed */
    (void)net_hub_connect(&controller->hub, &stream, port->name);
}

void controller_add_port(struct controller *controller, const struct net_stream *stream, const char *name) {
    struct controller_port *port = controller->port;
    while (port < controller->port + CONTROLLER_PORTS && port->stream.ops != NULL)
        port++;
    if (port == controller->port + CONTROLLER_PORTS)
        return;
    *port = (struct controller_port){.stream = *stream, .name = name};
    attach(controller, port);
}

bool controller_listen(struct controller *controller, const char *host, const char *port, int *error) {
    char address[NET_ADDRESS_SIZE];
    controller->listener = net_tcp_listen(host, port, address, error);
    return controller->listener >= 0;
}

bool controller_serve_wire(struct controller *controller, const struct session_options *options,
                           const struct session_ops *ops, int *error) {
    session_init(&controller->session, controller->machine, options, ops, &controller->wire);
    *error = net_wire_open(&controller->wire, "0.0.0.0", &controller->session);
    controller->has_wire = *error == 0;
    return controller->has_wire;
}

const char *controller_why_busy(const struct controller *controller) {
    const struct machine *machine = controller->machine;
    const struct net_hub *hub = &controller->hub;
    const enum machine_state state = machine_state(machine);
    const bool idle = state == MACHINE_IDLE || state == MACHINE_ALARM || state == MACHINE_SLEEP;
    const bool waits =
        hub->inside > 0 || hub->left.count > 0 || (hub->owner != NULL && hub->owner->whole > 0);
    return machine_is_at_rest(machine) && idle && !waits && !machine_has_line(machine)
               ? NULL
               : "a job is running or held: let it end, or reset the controller";
}

bool controller_is_reached(const struct controller *controller) {
    const struct net_hub *hub = &controller->hub;
    bool reached = controller->has_wire && controller->session.owner.on;
    for (size_t i = 0; i < NET_CLIENTS; i++) {
        const struct net_client *client = &hub->client[i];
        reached |= client->stream.ops != NULL && !client->stream.local && !client->locked;
    }
    return reached;
}

/* ---- a round ---- */

static void let_in(struct controller *controller) {
    struct net_stream stream;
    char name[NET_ADDRESS_SIZE];
    for (int i = 0; i < ACCEPTS_A_ROUND && controller->listener >= 0; i++) {
        if (!net_tcp_accept(controller->listener, &stream, name))
            break;
        net_tcp_keep_alive(&stream);
        (void)net_hub_connect(&controller->hub, &stream, name);
    }
    for (size_t i = 0; i < CONTROLLER_PORTS; i++)
        attach(controller, &controller->port[i]);
}

static void read_clients(struct net_hub *hub) {
    for (size_t i = 0; i < NET_CLIENTS; i++)
        if (net_hub_wants_read(hub, &hub->client[i]))
            net_hub_read(hub, &hub->client[i]);
}

static void ask_sometimes(struct controller *controller) {
    uint32_t now_us = hal_time_us(machine_hal(controller->machine));
    if (now_us - controller->asked_us < ASK_EVERY_US)
        return;
    controller->asked_us = now_us;
    net_hub_ask(&controller->hub);
}

bool controller_round(struct controller *controller) {
    bool any = false;
    access_poll(&controller->access, hal_time_us(machine_hal(controller->machine)));
    net_hub_tick(&controller->hub, hal_time_us(machine_hal(controller->machine)));
    let_in(controller);
    read_clients(&controller->hub);
    ask_sometimes(controller);
    if (controller->has_wire)
        net_wire_round(&controller->wire);
    for (int i = 0; i < FEEDS_A_ROUND; i++) {
        bool more = net_hub_feed(&controller->hub);
        more |= machine_poll(controller->machine);
        net_hub_hear(&controller->hub);
        any |= more;
        if (!more)
            break;
    }
    /* After machine_poll(): what the session reports has just happened (session.h). */
    if (controller->has_wire)
        session_poll(&controller->session);
    net_hub_flush(&controller->hub);
    return any;
}
