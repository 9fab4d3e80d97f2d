/* SPDX-License-Identifier: MIT
 * What the files of core/session share. [task] */
#ifndef WIFICNC_SESSION_INNER_H
#define WIFICNC_SESSION_INNER_H

#include "machine/actions.h"
#include "machine/host.h"
#include "machine/outputs.h"
#include "machine/sender.h"
#include "session/session.h"

/** A number that is lower by more than this is that of a host that has started again. */
enum { SEQUENCE_JUMP = 1000 };

/** $78. */
enum { GAP_IS_IGNORED, GAP_IN_MOTION, GAP_IS_A_LOSS };

/** Whether a motion datagram cannot begin, or end, at rest. */
struct session_pace {
    bool begins_fast, ends_fast;
};

/** Sequence counters. */
enum { SEQUENCE_STATUS, SEQUENCE_EVENT, SEQUENCE_REPLY };

static inline bool session_same(const uint8_t a[4], const uint8_t b[4]) {
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2] && a[3] == b[3];
}

static inline bool session_is_module(const struct session *session) {
    return session->module != NULL;
}

/** This host gets the status: not where none of the ports that it is sent to can be reached. */
static inline bool session_reports_to(const struct session *session,
                                      const struct session_listener *listener) {
    const uint8_t ports = session_is_module(session) ? 3 : 1;
    return listener->used && (listener->closed & ports) != ports;
}

/* hosts.c */
/** Advance now_us by the HAL's clock. */
void session_tick(struct session *session);
/** @return size of the packet whose payload is in place */
size_t session_close(struct session *session, unsigned counter, uint8_t *packet, enum wire_type type,
                     size_t payload_size);
uint8_t session_state(const struct session *session);
/** Until the next round of status reports. @return UINT32_MAX: no host gets them */
uint32_t session_report_wait_us(const struct session *session);
/** This host is the owner from now on: something of it that needs it to be was done. */
void session_own(struct session *session, const uint8_t address[4]);
/** This host is the owner from now on, whoever was: a former one's jog and homing end, its other motion is
 * held.
 * @param discard  what is queued is discarded instead */
void session_take(struct session *session, const uint8_t address[4], bool discard);
/** It has a TCP connection. */
bool session_has_client(const struct session *session, const uint8_t address[4]);
/** A sign of life of this host, whatever the packet. */
void session_note_alive(struct session *session, const uint8_t address[4]);
/** Motion of a host has not come, or was not taken: a hold unless $78 is 0, or a stream is open, which sends
 * again what was lost. */
void session_note_lost(struct session *session);
/** A sequence number of this host: gaps are counted. */
void session_note_sequence(struct session *session, const uint8_t address[4], uint32_t sequence);
/** Motion of the host has ended: a gap next to it was no loss. */
void session_forget_gap(struct session *session);
/** A motion datagram was taken; its number was noted before. */
void session_note_moved(struct session *session, const struct session_pace *pace, uint32_t sequence);

/* segment.c */
/** A segment of the wire, its reserved flags left out. @param at  WIRE_SEGMENT_SIZE bytes */
struct host_queue_segment session_segment(const uint8_t *at);

/* session.c */
/* status.c */
void session_send_status(struct session *session, const uint8_t address[4]);
/** The reports that are due. */
void session_report(struct session *session);
/** How the newest segments with the probe flag ended. @param payload  room for WIRE_PROBE_RESULT_SIZE */
void session_put_probe(const struct session *session, uint8_t *payload);

/* rules.c */
/** Whether a datagram, or a message of a TCP client, may be looked into: it is known on its channel, long
 * enough, this device has what it is for, this host may do that now, and no later order of it came before.
 * @param sealed  it has proven who has sent it */
enum wire_refusal session_check_datagram(struct session *session, const uint8_t address[4],
                                         const struct wire_header *header, bool sealed);
enum wire_refusal session_check_request(struct session *session, const struct session_client *client,
                                        const struct wire_header *header);

/** The protocol's reason for a refusal of the machine. */
enum wire_refusal session_refusal(enum refusal refusal);

/* command.c */
/** What hosts may send by UDP and TCP. It was checked. */
enum wire_refusal session_command(struct session *session, const uint8_t address[4], uint8_t type,
                                  const uint8_t *payload);
/** Spindle or coolant run because the host has switched them on. */
bool session_runs_outputs(const struct session *session);
/** Switch these off. */
void session_switch_off(struct session *session);
/** @param refusal  of session_check_datagram(): refused segments are counted
 *  @param[out] pace  of what was taken
 *  @return false: nothing was taken */
bool session_motion(struct session *session, const uint8_t address[4], const struct wire_header *header,
                    const uint8_t *payload, enum wire_refusal refusal, struct session_pace *pace);

/* stream.c */
/** Notice that the machine has given up what was queued. */
void stream_follow(struct session *session);
enum wire_refusal stream_open(struct session *session, int place);
void stream_close(struct session *session, enum wire_refusal refusal);
/** @param refusal  of session_check_datagram(): nothing is taken then, but how far the stream is is answered
 */
void stream_segments(struct session *session, const struct session_peer *from,
                     const struct wire_header *header, const uint8_t *payload, enum wire_refusal refusal);

/* module.c */
/** As session_command(), of an I/O module. */
enum wire_refusal module_command(struct session *session, const uint8_t address[4], uint8_t type,
                                 const uint8_t *payload);
/** Inputs, and outputs whose host is gone. */
void module_poll(struct session *session);
void module_status(const struct session *session, struct wire_status *status);

/* config.c */
void config_get(const struct session *session, uint16_t key, struct wire_config_value *value);
enum wire_refusal config_set(const struct session *session, const struct wire_config_set *set);
enum wire_refusal config_save(const struct session *session);

#endif
