/* SPDX-License-Identifier: MIT */
#include "serve.h"

#include "hands.h"
#include "host_bus.h"
#include "host_store.h"

#include "machine/guard.h"
#include "machine/parts.h"
#include "net_hub.h"
#include "net_pty.h"
#include "net_tcp.h"
#include "port.h"
#include "serve_claim.h"
#include "serve_clock.h"
#include "serve_control.h"
#include "serve_serial.h"
#include "serve_wire.h"
#include "store_memory.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A round is short, so that a `?` never waits long: it ends after this time, which is looked at after each go
 * of so many step events and lines. While a sender pours, a round is one small go for each piece that is
 * read: a `?` may lie behind all that. */
enum { ROUND_US = 500, EVENTS_A_GO = 5000, EVENTS_WHILE_POURED = 200 };

/* Longest sleeps, ms: in motion, step events are run in batches of this; at rest the pty is looked at; at
 * full speed this long without input means that none follows immediately. */
enum { MOVING_MS = 1, RESTING_MS = 25, NOTHING_FOLLOWS_MS = 2 };

enum { ASK_EVERY_MS = 50 }; /* observers' status requests */

/* With all places taken a newcomer waits this long before it is refused: places of those who have just left
 * are about to be free. */
enum { FULL_MS = 1000 };

enum { BANNER_AFTER_US = 1000000 }; /* of silence, once a pty was opened */

enum { ACCEPTS_A_ROUND = 16 }; /* a flood of connections leaves time for everything else */

enum {
    POLL_SIGNAL,
    POLL_PARENT,
    POLL_LISTENER,
    POLL_CLIENTS,
    POLL_CONTROL = POLL_CLIENTS + NET_CLIENTS,
    POLL_WIRE = POLL_CONTROL + CONTROL_POLLS,
    POLL_COUNT = POLL_WIRE + SERVE_WIRE_POLLS
};

_Static_assert((int)POLL_COUNT <= (int)PORT_POLLS_MAX, "port_poll() takes them all");

struct serve {
    struct serve_events events;
    struct host *host;
    struct store_memory memory; /* the settings, where no file keeps them */
    struct net_hub hub;
    struct access access;
    struct serve_clock clock;
    bool full_speed;
    bool input_follows; /* at full speed: more input may come immediately, so time stops while nothing is
                           due */
    bool busy;          /* the last round left something to do immediately */
    bool poured;        /* a client sends faster than this round has read */
    int listener, stop_fd[2];
    int claim;         /* of the file that keeps settings; -1: none */
    const char *store; /* that file; NULL: none */
    struct serve_control control;
    struct serve_wire wire;
    int bus;                 /* serial port of the spindle's drive; -1: none */
    bool has_pty, pty_waits; /* ... for a banner: a client of it has opened it */
    uint32_t pty_opened_us;
    struct net_pty pty;
    struct serve_pendant pendant;
    uint64_t asked_ns; /* when observers' requests were last passed on */
    uint64_t full_ns;  /* since when all places are taken; 0: they are not */
    uint64_t fed_ns;   /* when the controller last got a line */
    struct port_poll poll[POLL_COUNT];
};

static uint32_t clock_us(void) {
    return (uint32_t)(port_clock_ns() / 1000);
}

/* ---- the controller as the hub sees it ---- */

static size_t put(void *ctx, const char *bytes, size_t count) {
    struct serve *serve = ctx;
    return host_write(serve->host, bytes, count);
}

static size_t hear(void *ctx, char *bytes, size_t size) {
    struct serve *serve = ctx;
    return host_read(serve->host, bytes, size);
}

static void act(void *ctx) {
    struct serve *serve = ctx;
    host_act(serve->host);
}

/* cppcheck-suppress constParameterCallback ; the type of notice() is fixed */
static bool notice(void *ctx, unsigned number, char *text, size_t size) {
    const struct serve *serve = ctx;
    return host_notice(serve->host, number, text, size);
}

static void left(void *ctx, bool lines_wait) {
    struct serve *serve = ctx;
    host_sender_lost(serve->host, lines_wait);
}

/* cppcheck-suppress constParameterCallback ; the type of the entry is fixed */
static bool busy(void *ctx) {
    const struct serve *serve = ctx;
    return host_is_busy(serve->host);
}

/* cppcheck-suppress constParameterCallback ; the type of the entry is fixed */
static uint8_t presses(void *ctx) {
    const struct serve *serve = ctx;
    return guard_idle_starts(host_machine(serve->host));
}

/* cppcheck-suppress constParameterCallback ; the type of the entry is fixed */
static enum machine_reads reads(void *ctx) {
    const struct serve *serve = ctx;
    return host_reads(serve->host);
}

static enum machine_whose whose(void *ctx) {
    return machine_whose(host_machine(((struct serve *)ctx)->host));
}

static uint8_t stops(void *ctx) {
    return machine_stops(host_machine(((struct serve *)ctx)->host));
}

static bool jogs(void *ctx) {
    return machine_state(host_machine(((struct serve *)ctx)->host)) == MACHINE_JOG;
}

static void stopped_by_other(void *ctx) {
    host_stopped_by_other(((struct serve *)ctx)->host);
}

static size_t room(void *ctx) {
    return machine_line_room(host_machine(((struct serve *)ctx)->host));
}

static uint32_t drop_unread(void *ctx) {
    return host_drop_unread(((struct serve *)ctx)->host);
}

static void pendant_left(void *ctx) {
    struct serve *serve = ctx;
    host_pendant_lost(serve->host);
}

static void mpg(void *ctx, bool on) {
    struct serve *serve = ctx;
    host_set_mpg(serve->host, on);
}

static void event(void *ctx, const char *what, const char *who) {
    struct serve *serve = ctx;
    serve->events.client(serve->events.ctx, what, who);
}

/* ---- start ---- */

/* The controller's answer to a line: 0, N of error:N, -1 for none. */
static int setting_answer(struct host *host, const char *line) {
    char said[4096];
    host_write(host, line, strlen(line));
    host_write(host, "\n", 1);
    host_run(host, EVENTS_A_GO);
    size_t size = host_read(host, said, sizeof said - 1);
    said[size] = '\0';
    const char *error = strstr(said, "error:");
    if (error != NULL)
        return atoi(error + strlen("error:"));
    return strstr(said, "ok\r\n") != NULL ? 0 : -1;
}

static bool apply_settings(struct host *host, const char *const *lines, struct serve_failure *failure) {
    for (; lines != NULL && *lines != NULL; lines++) {
        int answer = setting_answer(host, *lines);
        if (answer != 0) {
            *failure = (struct serve_failure){SERVE_SETTING, answer, *lines};
            return false;
        }
    }
    return true;
}

static bool open_text(struct serve *serve, const struct serve_options *options,
                      struct serve_failure *failure) {
    char address[NET_ADDRESS_SIZE];
    if (options->tcp_host != NULL) {
        failure->stage = SERVE_TCP;
        serve->listener = net_tcp_listen(options->tcp_host, options->tcp_port, address, &failure->error);
        if (serve->listener < 0)
            return false;
        serve->events.listens(serve->events.ctx, "tcp", address);
    }
    if (options->pty_link != NULL) {
        failure->stage = SERVE_PTY;
        failure->detail = net_pty_missing;
        failure->error = net_pty_open(&serve->pty, options->pty_link);
        serve->has_pty = failure->error == 0;
        if (!serve->has_pty)
            return false;
        serve->events.listens(serve->events.ctx, "pty", serve->pty.slave);
    }
    return true;
}

static bool open_doors(struct serve *serve, const struct serve_options *options,
                       struct serve_failure *failure) {
    char address[NET_ADDRESS_SIZE];
    bool module =
        options->wire_address != NULL && serve_wire_choose(&serve->wire, serve->host, options->io_module);
    if (module)
        serve->control.module = &serve->wire.module;
    else if (!open_text(serve, options, failure))
        return false;
    if (options->control_port != NULL) {
        failure->stage = SERVE_CONTROL;
        serve->control.listener =
            net_tcp_listen("127.0.0.1", options->control_port, address, &failure->error);
        if (serve->control.listener < 0)
            return false;
        serve->events.listens(serve->events.ctx, "control", address);
    }
    if (options->wire_address != NULL) {
        failure->stage = SERVE_WIRE;
        failure->error = serve_wire_open(&serve->wire, serve->host, options->wire_address, &serve->access);
        if (failure->error != 0)
            return false;
        serve->events.listens(serve->events.ctx, "wmc3", options->wire_address);
    }
    return true;
}

static bool open_bus(struct serve *serve, const char *path, struct serve_failure *failure) {
    static const struct host_bus_line line = {
        .configure = serve_serial_configure, .write = serve_serial_write, .read = serve_serial_read};
    if (path == NULL)
        return true;
    failure->stage = SERVE_BUS;
    failure->detail = serve_serial_missing;
    serve->bus = serve_serial_open(path, &failure->error);
    if (serve->bus < 0)
        return false;
    failure->error = serve_serial_bad_format;
    return host_bus_use(serve->host, &line, serve->bus);
}

static bool open_pendant(struct serve *serve, const struct serve_pendant_options *options,
                         struct serve_failure *failure) {
    char where[NET_PTY_NAME_SIZE];
    if (options->serial == NULL && options->pty_link == NULL && options->tcp_port == NULL)
        return true;
    failure->stage = SERVE_PENDANT;
    failure->error = serve_pendant_open(&serve->pendant, options, where, &failure->detail);
    if (failure->error != 0)
        return false;
    serve->events.listens(serve->events.ctx, "pendant", where);
    return true;
}

static bool claim_store(struct serve *serve, const char *path, struct serve_failure *failure) {
    if (path == NULL)
        return true;
    failure->stage = SERVE_STORE;
    serve->claim = serve_claim(path, &failure->error);
    return serve->claim >= 0;
}

static struct host *start_host(const struct serve *serve, const struct serve_options *options) {
    char banner[256];
    struct host *host = options->store != NULL
                            ? host_open(&options->board, options->store)
                            : host_open_stored(&options->board, &store_memory, &serve->memory);
    if (host == NULL)
        return NULL;
    host_run(host, EVENTS_A_GO);
    while (host_read(host, banner, sizeof banner) == sizeof banner) {
        /* no one is there yet to hear it */
    }
    return host;
}

static struct host *make_host(const struct serve *serve, const struct serve_options *options,
                              struct serve_failure *failure) {
    failure->stage = SERVE_BOARD;
    struct host *host = start_host(serve, options);
    if (host == NULL || options->settings == NULL || *options->settings == NULL)
        return host;
    const bool applied = apply_settings(host, options->settings, failure);
    /* Damaged data is not written over, so these settings would be lost; and the machine is locked already.
     */
    if (applied && host_store_is_damaged(host))
        return host;
    host_destroy(host);
    /* Power-on with these settings stored: with $22=1 the machine begins locked, and $79 counts. */
    return applied ? start_host(serve, options) : NULL;
}

/* @return false: a line is wrong */
static bool use_hands(struct host *host, const char *const *lines, struct serve_failure *failure) {
    for (; lines != NULL && *lines != NULL; lines++) {
        struct hands_action action;
        if (hands_read(host, *lines, &action) != NULL) {
            *failure = (struct serve_failure){SERVE_HANDS, EINVAL, *lines};
            return false;
        }
        hands_do(host, &action);
    }
    return true;
}

static void init_access(struct access *access, const char *key, const char *store) {
    uint8_t salt[ACCESS_SALT];
    port_random(salt, sizeof salt);
    access_init(access, key, key[0] == '\0', salt, clock_us());
    if (store == NULL)
        return;
    uint64_t stored[ACCESS_STORED];
    const size_t size = host_store.load(store, HOST_STORE_TRUST, stored, sizeof stored);
    access_restore(access, stored, (unsigned)(size / sizeof stored[0]));
}

static void keep_trust(struct serve *serve) {
    uint64_t stored[ACCESS_STORED];
    if (!serve->access.changed || serve->store == NULL)
        return;
    serve->access.changed = false;
    const struct hal_store_value value = {.key = HOST_STORE_TRUST,
                                          .bytes = stored,
                                          .count = access_stored(&serve->access, stored) * sizeof stored[0]};
    if (host_store.save(serve->store, &value, 1) != HAL_STORE_DONE)
        net_hub_tell(&serve->hub, "Cannot store the trusted addresses");
}

struct serve *serve_create(const struct serve_options *options, struct serve_failure *failure) {
    static const struct net_hub_ops ops = {.put = put,
                                           .hear = hear,
                                           .act = act,
                                           .event = event,
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
                                           .drop_unread = drop_unread};
    /* Real-time bytes act when they are read: room for what a sender pours without counting. */
    static const struct net_hub_sizes sizes = {
        .clients = NET_CLIENTS, .in = 16 << 20, .out = 256 * 1024, .left = 32 << 20};
    *failure = (struct serve_failure){.stage = SERVE_MEMORY, .error = ENOMEM};
    struct serve *serve = calloc(1, sizeof *serve);
    if (serve == NULL)
        return NULL;
    serve->events = options->events;
    serve->full_speed = !(options->speed > 0.0);
    memcpy(serve->stop_fd, options->stop_fd, sizeof serve->stop_fd);
    serve_pendant_init(&serve->pendant);
    serve->listener = serve->control.listener = serve->claim = serve->bus = -1;
    net_hub_init(&serve->hub, &sizes, &ops, serve);
    serve->store = options->store;
    serve->hub.access = &serve->access;
    serve->control.hub = &serve->hub;
    /* Before the file is read: two programs with one storage would overwrite each other's settings, and one
     * that is no file may never be read. */
    if (claim_store(serve, options->store, failure)) {
        init_access(&serve->access, options->key, options->store);
        serve->host = make_host(serve, options, failure);
    }
    if (serve->host == NULL || !open_bus(serve, options->spindle_bus, failure) ||
        !open_pendant(serve, &options->pendant, failure) ||
        !use_hands(serve->host, options->hands, failure) || !open_doors(serve, options, failure)) {
        serve_destroy(serve);
        return NULL;
    }
    uint32_t start_id;
    port_random((uint8_t *)&start_id, sizeof start_id);
    host_set_start(serve->host, start_id | 1u);
    serve_clock_start(&serve->clock, options->speed, options->board.timer_hz, host_time_ticks(serve->host));
    return serve;
}

void serve_destroy(struct serve *serve) {
    if (serve == NULL)
        return;
    if (serve->listener >= 0)
        net_socket_close(serve->listener);
    if (serve->has_pty)
        /* The name first, so that no one opens a pty that is about to end; the pty itself when the hub has
         * let go of it. */
        net_pty_unlink(&serve->pty);
    serve_pendant_refuse(&serve->pendant);
    serve_control_close(&serve->control);
    serve_wire_close(&serve->wire);
    net_hub_close(&serve->hub);
    if (serve->has_pty)
        net_pty_close(&serve->pty);
    serve_pendant_close(&serve->pendant);
    host_destroy(serve->host);
    if (serve->bus >= 0)
        serve_serial_close(serve->bus);
    serve_release(serve->claim);
    free(serve);
}

/* ---- one round ---- */

/* A newcomer can be let in, or must be refused. */
static bool accepts(const struct serve *serve) {
    return serve->full_ns == 0 || port_clock_ns() - serve->full_ns > FULL_MS * 1000000ull;
}

static void note_fullness(struct serve *serve) {
    if (!net_hub_is_full(&serve->hub))
        serve->full_ns = 0;
    else if (serve->full_ns == 0)
        serve->full_ns = port_clock_ns();
}

static uint64_t events_a_go(const struct serve *serve) {
    return serve->poured ? EVENTS_WHILE_POURED : EVENTS_A_GO;
}

/* Time up to now, by the wall clock. */
static void run_paced(struct serve *serve) {
    uint64_t now = serve_clock_ticks(&serve->clock, host_time_ticks(serve->host));
    serve->busy = host_run_paced(serve->host, now, events_a_go(serve)) == HOST_BUDGET;
}

/* More lines may come immediately. */
static bool input_follows(const struct serve *serve) {
    return port_clock_ns() - serve->fed_ns < NOTHING_FOLLOWS_MS * 1000000ull;
}

/* Time as far as it goes. While more input may come immediately, a look-ahead that is not full holds it. */
static void run_unpaced(struct serve *serve) {
    host_input_follows(serve->host, input_follows(serve));
    enum host_wait wait = host_run(serve->host, events_a_go(serve));
    serve->busy = wait == HOST_BUDGET;
}

static void run(struct serve *serve) {
    if (serve->full_speed)
        run_unpaced(serve);
    else
        run_paced(serve);
    net_hub_hear(&serve->hub);
}

/* @return false: no more lines, or no room for them */
static bool feed(struct serve *serve) {
    if (!net_hub_feed(&serve->hub))
        return false;
    serve->fed_ns = port_clock_ns();
    run(serve);
    return true;
}

static void work(struct serve *serve) {
    const uint64_t end_ns = port_clock_ns() + (serve->poured ? 0 : ROUND_US * 1000u);
    bool fed;
    run(serve);
    do
        fed = feed(serve);
    while (fed && port_clock_ns() < end_ns);
    serve->busy |= fed;
    net_hub_flush(&serve->hub);
    note_fullness(serve);
}

/* ---- waiting ---- */

static int wait_ms(const struct serve *serve) {
    if (serve->busy)
        return 0;
    if (serve->full_speed && input_follows(serve))
        return NOTHING_FOLLOWS_MS;
    int ms = host_next_ticks(serve->host) == UINT64_MAX ? RESTING_MS : MOVING_MS;
    uint32_t wire_us = serve_wire_wait_us(&serve->wire);
    /* The session counts virtual time, which passes `speed` times as fast as the wall clock. */
    double wire_ms = wire_us == UINT32_MAX ? ms : (double)wire_us * 1e-3 / serve->clock.speed;
    return wire_ms < ms ? (int)wire_ms : ms;
}

static void fill_poll(struct serve *serve) {
    serve_control_fill_poll(&serve->control, &serve->poll[POLL_CONTROL]);
    serve_wire_fill_poll(&serve->wire, &serve->poll[POLL_WIRE]);
    serve->poll[POLL_SIGNAL] = (struct port_poll){.fd = serve->stop_fd[0], .wanted = PORT_READ};
    serve->poll[POLL_PARENT] = (struct port_poll){.fd = serve->stop_fd[1], .wanted = PORT_READ};
    serve->poll[POLL_LISTENER] =
        (struct port_poll){.fd = accepts(serve) ? serve->listener : -1, .wanted = PORT_READ};
    for (size_t i = 0; i < NET_CLIENTS; i++) {
        const struct net_client *client = &serve->hub.client[i];
        short wanted = net_hub_wants_read(&serve->hub, client) ? PORT_READ : 0;
        if (net_hub_wants_write(client))
            wanted |= PORT_WRITE;
        int fd = client->stream.ops != NULL ? client->stream.fd : -1;
        serve->poll[POLL_CLIENTS + i] = (struct port_poll){.fd = fd, .wanted = wanted};
    }
}

static void accept_all(struct serve *serve) {
    struct net_stream stream;
    if ((serve->poll[POLL_LISTENER].found & PORT_READ) != 0) {
        char name[NET_ADDRESS_SIZE];
        for (int i = 0; i < ACCEPTS_A_ROUND && accepts(serve); i++) {
            if (!net_tcp_accept(serve->listener, &stream, name))
                break;
            net_tcp_keep_alive(&stream);
            net_hub_connect(&serve->hub, &stream, name);
            note_fullness(serve);
        }
    }
    if (serve->has_pty && net_pty_opened(&serve->pty, &stream)) {
        serve->pty_opened_us = clock_us();
        serve->pty_waits = net_hub_connect(&serve->hub, &stream, "pty");
    }
    serve_pendant_accept(&serve->pendant, &serve->hub, clock_us());
}

/* A serial port resets many boards when it is opened, and senders that wait for the banner say nothing before
 * it. One that has spoken would take it for a reset. */
static void greet_pty(struct serve *serve) {
    if (!serve->pty_waits || clock_us() - serve->pty_opened_us < BANNER_AFTER_US)
        return;
    serve->pty_waits = false;
    for (size_t i = 0; i < NET_CLIENTS; i++) {
        const struct net_client *client = &serve->hub.client[i];
        if (client->stream.ops != NULL && client->stream.ctx == &serve->pty && !client->spoke)
            (void)client->stream.ops->write(&client->stream, MACHINE_BANNER, sizeof MACHINE_BANNER - 1);
    }
}

static void read_clients(struct serve *serve) {
    serve->poured = false;
    for (size_t i = 0; i < NET_CLIENTS; i++) {
        short found = serve->poll[POLL_CLIENTS + i].found;
        if ((found & PORT_READ) != 0)
            serve->poured |= net_hub_read(&serve->hub, &serve->hub.client[i]);
        else if ((found & PORT_LOST) != 0)
            net_hub_lost(&serve->hub.client[i]);
    }
}

static void ask_sometimes(struct serve *serve) {
    uint64_t now_ns = port_clock_ns();
    if (now_ns - serve->asked_ns < ASK_EVERY_MS * 1000000ull)
        return;
    serve->asked_ns = now_ns;
    net_hub_ask(&serve->hub);
}

int serve_run(struct serve *serve) {
    for (;;) {
        fill_poll(serve);
        int error;
        if (port_poll(serve->poll, POLL_COUNT, wait_ms(serve), &error) < 0)
            return error;
        if (serve->poll[POLL_SIGNAL].found != 0 || serve->poll[POLL_PARENT].found != 0)
            return 0;
        access_poll(&serve->access, clock_us());
        keep_trust(serve);
        net_hub_tick(&serve->hub, clock_us());
        read_clients(serve);
        serve_control_read(&serve->control, &serve->poll[POLL_CONTROL], serve->host, &serve->clock);
        serve_wire_read(&serve->wire);
        accept_all(serve);
        greet_pty(serve);
        ask_sometimes(serve);
        work(serve);
        serve_wire_poll(&serve->wire);
    }
}
