/* SPDX-License-Identifier: MIT
 * A device of the binary protocol, without sockets: packets in, packets out. [task of machine_poll()]
 *
 *   datagram -> session_datagram() -> machine/host.h        -> ops.send: status, acks, events
 *   message  -> session_request()  -> settings, streams ... -> its one reply
 *
 * The target owns sockets and framing; here are the rules: who may move, what is a duplicate, who gets the
 * status, what is refused and why. docs/protocol.md is what hosts see. Whatever arrives takes bounded time.
 * IPv4: the protocol's reports have no room for more. */
#ifndef WIFICNC_SESSION_SESSION_H
#define WIFICNC_SESSION_SESSION_H

#include "access/access.h"
#include "channels/channels.h"
#include "device/device.h"
#include "machine/host.h"
#include "settings/store.h"
#include "wire/packet.h"
#include "wire/seal.h"

enum { SESSION_CLIENTS = WIRE_CLIENTS_MAX, SESSION_LISTENERS = WIRE_LISTENERS_MAX, SESSION_RECENT = 32 };

/** An address and port, IPv4; port in host order. */
struct session_peer {
    uint8_t address[4];
    uint16_t port;
};

struct session_ops {
    /** Send a datagram from the device's UDP port. May be lost. */
    void (*send)(void *ctx, const struct session_peer *to, const uint8_t *packet, size_t size);
    /** Unpredictable bytes. NULL: there is no authentication, so only hosts of trusted addresses move. */
    void (*random)(void *ctx, uint8_t *bytes, size_t count);
};

/** Given by the target. Strings live as long as the session. */
struct session_options {
    const char *name;          /* up to 31 characters */
    struct access *access;     /* who may move; the target polls it */
    uint32_t version;          /* major<<24 | minor<<16 | patch */
    uint16_t status_port;      /* WIRE_STATUS_PORT; tests have others */
    struct channels *channels; /* configuration of an I/O module; NULL: this target can be none */
    struct device *device;     /* its pins and network; NULL: it says nothing of them */
};

/** What an I/O module has instead of a machine. */
struct session_module {
    const struct hal *hal;    /* its clock */
    struct settings settings; /* the status interval; the others wait for a motion controller */
    struct store store;       /* where they are kept */
    uint8_t axis_count;       /* of the board */
};

/** A TCP connection. */
struct session_client {
    bool used, authenticated, has_nonce;
    bool waits; /* a proof waits for its turn */
    uint8_t address[4];
    uint8_t nonce[SEAL_NONCE];
    struct seal seal; /* of its datagrams */
    uint64_t heard_us;
    uint32_t tried_us; /* access->clock_us when the proof came that waits */
};

/** A host that gets the status. */
struct session_listener {
    bool used;
    uint8_t closed; /* bit 0: its port of reports cannot be reached, bit 1: nor that of a module's */
    uint8_t address[4];
    uint64_t heard_us;
};

/** The host that commands; there is one at a time. When it has ceased to (!on) and no one else has commanded
 * since, its numbers continue: a network that was gone for longer is a gap, too. */
struct session_owner {
    bool on, sequence_known;
    bool left;      /* its last connection has ended at its own end */
    bool lost;      /* it is gone, and its motion was dealt with as $74 says */
    bool taken;     /* by request: it commands as long as it is there, also without a command */
    bool ends_fast; /* its newest motion cannot end at rest */
    uint8_t stride; /* numbers from one motion to the next, where none was missing */
    uint8_t steady; /* how often that was the same */
    uint8_t address[4];
    uint64_t heard_us;        /* something that needs it to be the owner */
    uint64_t alive_us;        /* anything */
    uint64_t motion_us;       /* motion */
    uint32_t sequence;        /* the newest */
    uint32_t motion_sequence; /* of its newest motion; 0: none */
    uint32_t skipped;         /* numbers that are missing since then */
    uint64_t numbered_us;     /* when that came */
    uint64_t seen;            /* bit n: the one n before it has come, or was before the first */
};

/** Orders whose newest is remembered, so that what it has overtaken does nothing. */
enum {
    SESSION_ORDER_JOG,
    SESSION_ORDER_JOG_STOP,
    SESSION_ORDER_HOLD,
    SESSION_ORDER_ESTOP,
    SESSION_ORDER_OUTPUTS,
    SESSION_ORDERS
};
struct session_order {
    uint8_t address[4]; /* of its sender; 0.0.0.0: there was none */
    uint32_t sequence, timestamp_us;
};

struct session_stream {
    uint32_t id;         /* 0: there was none */
    bool open;           /* takes segments */
    int8_t client;       /* whose connection keeps it, -1: that is gone */
    uint32_t base;       /* machine_host_taken() of its segment 0 */
    uint32_t dropped;    /* machine_host.dropped when it was opened */
    uint32_t next, done; /* when it was closed */
    uint32_t refused;
    uint8_t refusal;
};

/** A motion datagram, to know it again. */
struct session_mark {
    uint32_t sequence, timestamp_us;
    uint16_t checksum, length;
};

struct session {
    struct machine *machine;       /* NULL: an I/O module */
    struct session_module *module; /* NULL: a motion controller */
    const struct hal *hal;
    const struct settings *settings;
    const struct session_ops *ops;
    void *ctx;
    struct session_options options;
    uint64_t now_us; /* does not wrap */
    uint32_t clock_us;
    uint64_t status_us;   /* of the last round of reports */
    uint64_t stranger_us; /* an address that has proven nothing gets no report before that */
    uint64_t due_us;      /* the next one; however late one is, the others keep their pace */
    uint32_t sequence[3]; /* status, events and acks, replies */
    struct session_listener listener[SESSION_LISTENERS];
    struct session_client client[SESSION_CLIENTS];
    struct session_owner owner;
    uint64_t jog_us; /* when its host has asked for the jog the last time */
    struct session_stream stream;
    struct session_order order[SESSION_ORDERS];
    struct session_mark recent[SESSION_RECENT];
    uint32_t recents;
    struct wire_statistics_response counts;
    struct wire_io_control outputs;     /* as last commanded */
    axis_mask_t homing;                 /* home_complete is due for these */
    uint32_t probes_done;               /* probe results sent so far */
    uint32_t late_refusals;             /* machine_host.late_refusals counted so far */
    int32_t position_steps[AXIS_COUNT]; /* of the last report: the rate */
};

/** `machine` is running; both live as long as the session. */
void session_init(struct session *session, struct machine *machine, const struct session_options *options,
                  const struct session_ops *ops, void *ctx);

/** As session_init(), of an I/O module: it moves nothing, hosts command options->channels, which are at work.
 * @param module  lives as long as the session */
void session_init_module(struct session *session, struct session_module *module,
                         const struct session_options *options, const struct session_ops *ops, void *ctx);

/** Call it after every machine_poll(), of a module every ms: channels, reports, events, time-outs. */
void session_poll(struct session *session);

/** Call session_poll() after this many us at the latest. @return UINT32_MAX: no need */
uint32_t session_wait_us(const struct session *session);

/** What came on the UDP port. */
void session_datagram(struct session *session, const struct session_peer *from, const uint8_t *bytes,
                      size_t size);

/** The system of this address has answered that a datagram did not reach a program (ICMP). It gets no more
 * reports until it sends something; but as anyone can forge that answer, not so the owner, and who is logged
 * in. */
void session_unreachable(struct session *session, const struct session_peer *at);

/** Where a new TCP client may go: a free place, or that of one that was silent for 30 s (but not one that
 * keeps a stream, a spindle, coolant or a module's outputs), whose connection the caller then ends with
 * session_disconnect() first. @return 0 .. SESSION_CLIENTS - 1, or -1: none */
int session_place(const struct session *session);

void session_connect(struct session *session, int place, const uint8_t address[4]);

/** @param left  the other end has gone, not we. With its last connection the owner is gone: its jog ends,
 * its queued motion is dealt with as $74 says, and when nothing of it moves any more the spindle and coolant
 * that it has switched on go off */
void session_disconnect(struct session *session, int place, bool left);

/** Whether this message must wait, because it is a proof whose turn has not come (base/lockout.h). Ask again
 * every 100 ms or so, and give it to session_request() then: SESSION_CLIENTS * LOCKOUT_LONGEST_S later at
 * the latest. */
bool session_must_wait(struct session *session, int place, const uint8_t *message, size_t size);

/** A message from a TCP client, without its length, that need not wait. @param[out] reply  room for
 * WIRE_PACKET_MAX
 *  @return size of the reply; 0: none exists */
size_t session_request(struct session *session, int place, const uint8_t *message, size_t size,
                       uint8_t *reply);

#endif
