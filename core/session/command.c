/* SPDX-License-Identifier: MIT
 * Motion and commands of hosts, by UDP or TCP. */
#include "session/inner.h"

#include <math.h>

enum { MISC_OUTPUTS = 0x1F, ALL_BITS = 0xFF }; /* of io_control */

#define DOUBLED_US 2000000u /* the network delivers both within this time */

/* ---- commands ---- */

static enum wire_refusal jog(struct session *session, const uint8_t *payload) {
    struct wire_jog jog;
    wire_get_jog(payload, &jog);
    if (session->stream.open)
        return WIRE_REFUSAL_BUSY;
    return session_refusal(machine_host_jog(session->machine, jog.axis, jog.direction, jog.speed_steps_s));
}

static enum wire_refusal home(struct session *session, const uint8_t *payload) {
    struct wire_home home;
    wire_get_home(payload, &home);
    if (session->homing != 0 || session->stream.open)
        return WIRE_REFUSAL_BUSY;
    if (home.axes == 0)
        return WIRE_REFUSAL_NO_HOMING;
    const enum refusal refusal = action_home(session->machine, ACTOR_HOST, home.axes);
    if (refusal == REFUSAL_NONE)
        session->homing = home.axes;
    return session_refusal(refusal);
}

static uint8_t coolant_bits(uint8_t wire) {
    return (uint8_t)(((wire & 1) != 0 ? COOLANT_FLOOD : 0) | ((wire & 2) != 0 ? COOLANT_MIST : 0));
}

/* With motion of its own a host commands all outputs, else only those that it has changed. */
static struct outputs_wish outputs_meant(const struct wire_io_control *io,
                                         const struct wire_io_control *known, bool all) {
    bool turns = io->spindle != known->spindle || (io->spindle != SPINDLE_OFF && io->rpm != known->rpm);
    unsigned coolant = all ? ALL_BITS : (unsigned)(io->coolant ^ known->coolant);
    unsigned digital = all ? ALL_BITS : (unsigned)(io->misc_outputs ^ known->misc_outputs);
    return (struct outputs_wish){.turns = turns || all,
                                 .spindle = (enum gcode_spindle)io->spindle,
                                 .rpm = (float)io->rpm,
                                 .coolant = coolant_bits(io->coolant),
                                 .coolant_mask = coolant_bits((uint8_t)coolant),
                                 .digital = io->misc_outputs,
                                 .digital_mask = (uint8_t)(digital & MISC_OUTPUTS)};
}

/* Repeated a hundred times a second by some hosts: only a change acts, and what the text side has switched
 * stays until there is one. */
static enum wire_refusal io_control(struct session *session, const uint8_t *payload) {
    struct wire_io_control io;
    wire_get_io_control(payload, &io);
    struct outputs_wish to = outputs_meant(&io, &session->outputs, false);
    if (io.spindle > SPINDLE_CCW)
        return WIRE_REFUSAL_MALFORMED;
    /* Before action_outputs(), so that a host which only repeats itself is not refused while a job runs. */
    if (!to.turns && to.coolant_mask == 0 && to.digital_mask == 0)
        return WIRE_REFUSAL_NONE;
    /* A host with motion commands all outputs: what the interrupted job had left on goes off with the
     * first change. */
    to = outputs_meant(&io, &session->outputs, machine_host(session->machine)->owns);
    const enum refusal refusal = action_outputs(session->machine, &to);
    if (refusal == REFUSAL_NONE)
        /* Only when done: after a refusal the next repetition is a change still, and tries again. */
        session->outputs = io;
    return session_refusal(refusal);
}

/* To switch off what the host has switched on and no one else has since. */
static struct outputs_wish own_outputs(const struct session *session) {
    const struct machine *machine = session->machine;
    const struct wire_io_control *known = &session->outputs;
    /* A program that has commanded another speed since uses the spindle itself. */
    bool turns = known->spindle != SPINDLE_OFF && known->spindle == machine_outputs(machine)->spindle;
    return (struct outputs_wish){.turns = turns && (float)known->rpm == machine_program_rpm(machine),
                                 .coolant_mask =
                                     coolant_bits(known->coolant) & machine_outputs(machine)->coolant};
}

bool session_runs_outputs(const struct session *session) {
    struct outputs_wish own = own_outputs(session);
    return own.turns || own.coolant_mask != 0;
}

void session_switch_off(struct session *session) {
    struct outputs_wish own = own_outputs(session);
    /* So that the same io_control of a host that returns is a change again, and acts. */
    session->outputs.spindle = session->outputs.coolant = 0;
    (void)action_outputs(session->machine, &own);
}

/* Ends a lock; or releases motion, when nothing of the host moves, and the hold that its loss has left. */
static enum wire_refusal reset(struct session *session) {
    /* BUSY is the answer where nothing is locked: then the request is meant for motion. */
    const enum refusal refusal = action_end_lock(session->machine);
    if (refusal != REFUSAL_BUSY)
        return session_refusal(refusal);
    if (session->stream.open || !machine_host_release(session->machine))
        return WIRE_REFUSAL_BUSY;
    sender_end_host_hold(session->machine);
    return WIRE_REFUSAL_NONE;
}

/* Only what moves or switches makes its sender the owner, and only when it is done: neither a stop, which any
 * host may send, nor what is refused. */
static enum wire_refusal command(struct session *session, const uint8_t address[4], uint8_t type,
                                 const uint8_t *payload) {
    enum wire_refusal refusal = type == WIRE_JOG    ? jog(session, payload)
                                : type == WIRE_HOME ? home(session, payload)
                                                    : io_control(session, payload);
    if (refusal != WIRE_REFUSAL_NONE)
        return refusal;
    session_own(session, address);
    if (type == WIRE_JOG)
        session->jog_us = session->now_us;
    if (type != WIRE_IO_CONTROL)
        session->owner.motion_us = session->now_us;
    return WIRE_REFUSAL_NONE;
}

enum wire_refusal session_command(struct session *session, const uint8_t address[4], uint8_t type,
                                  const uint8_t *payload) {
    if (session_is_module(session))
        return module_command(session, address, type, payload);
    switch (type) {
    case WIRE_ESTOP:
        action_estop(session->machine);
        session_forget_gap(session); /* what comes next begins at rest, whatever was lost before */
        return WIRE_REFUSAL_NONE;
    case WIRE_HOLD:
        action_hold(session->machine);
        return WIRE_REFUSAL_NONE;
    case WIRE_JOG_STOP:
        machine_host_jog_stop(session->machine);
        return WIRE_REFUSAL_NONE;
    case WIRE_RESET:
        return reset(session);
    case WIRE_RESUME:
        return session_refusal(action_resume(session->machine));
    default:
        return command(session, address, type, payload);
    }
}

/* ---- motion datagrams ---- */

static struct session_mark mark_of(const struct wire_header *header) {
    return (struct session_mark){.sequence = header->sequence,
                                 .timestamp_us = header->timestamp_us,
                                 .checksum = header->checksum,
                                 .length = header->length};
}

/* A sender that numbers nothing is not judged. */
static bool is_numbered(const struct wire_header *header) {
    return header->sequence != 0 || header->timestamp_us != 0;
}

/* The very same datagram of the owner once more, soon after: the network has doubled it. Later it may be a
 * program that begins again. */
static bool is_duplicate(const struct session *session, const uint8_t address[4],
                         const struct wire_header *header) {
    const struct session_mark mark = mark_of(header);
    if (!is_numbered(header) || !session_same(session->owner.address, address) ||
        session->now_us - session->owner.motion_us >= DOUBLED_US)
        return false;
    for (unsigned i = 0; i < SESSION_RECENT && i < session->recents; i++) {
        const struct session_mark *old = &session->recent[i];
        if (old->sequence == mark.sequence && old->timestamp_us == mark.timestamp_us &&
            old->checksum == mark.checksum && old->length == mark.length)
            return true;
    }
    return false;
}

/* Motion of this host was taken: it is the owner's, and known when it comes again. */
static void own_motion(struct session *session, const uint8_t address[4], const struct wire_header *header) {
    session_own(session, address);
    if (session->now_us - session->owner.motion_us >= DOUBLED_US)
        session->recents = 0;
    if (is_numbered(header))
        session->recent[session->recents++ % SESSION_RECENT] = mark_of(header);
    session->owner.motion_us = session->now_us;
}

static void refuse(struct session *session, enum wire_refusal refusal, uint32_t segments) {
    session->counts.refused_segments += segments;
    session->counts.last_refusal = (uint8_t)refusal;
}

static enum wire_refusal push(struct session *session, const uint8_t *at) {
    uint32_t number;
    const struct host_queue_segment segment = session_segment(at);
    uint32_t ahead = host_queue_laid(&machine_host(session->machine)->queue);
    return session_refusal(machine_host_lay(session->machine, ahead, &segment, &number));
}

/* An axis has more steps than if it began or ended at rest: a t^2, and one by rounding. */
static bool is_fast(const struct session *session, const uint8_t *at) {
    const struct host_queue_segment segment = session_segment(at);
    const struct host_queue_limits *limits = &machine_host(session->machine)->queue.limits;
    const float seconds = (float)segment.duration_us * 1e-6f;
    bool fast = false;
    for (unsigned ax = 0; ax < limits->axis_count; ax++)
        fast |= fabsf((float)segment.steps[ax]) > limits->accel_steps_s2[ax] * seconds * seconds + 1.0f;
    return fast;
}

bool session_motion(struct session *session, const uint8_t address[4], const struct wire_header *header,
                    const uint8_t *payload, enum wire_refusal refusal, struct session_pace *pace) {
    const uint8_t *segments = payload + WIRE_MOTION_SIZE;
    struct wire_motion motion;
    wire_get_motion(payload, &motion);
    if (!wire_has_segments(header, WIRE_MOTION_SIZE, motion.count, 1)) {
        session->counts.malformed++;
        return false;
    }
    if (refusal == WIRE_REFUSAL_NONE && session->stream.open)
        refusal = WIRE_REFUSAL_BUSY;
    if (refusal != WIRE_REFUSAL_NONE) {
        refuse(session, refusal, motion.count);
        return false;
    }
    if (is_duplicate(session, address, header)) {
        session->counts.duplicates++;
        return false;
    }
    uint32_t taken = 0;
    while (taken < motion.count && refusal == WIRE_REFUSAL_NONE) {
        refusal = push(session, segments + (size_t)taken * WIRE_SEGMENT_SIZE);
        taken += refusal == WIRE_REFUSAL_NONE;
    }
    if (taken > 0) {
        own_motion(session, address, header);
        pace->begins_fast = is_fast(session, segments);
        pace->ends_fast = is_fast(session, segments + (size_t)(taken - 1) * WIRE_SEGMENT_SIZE);
    }
    if (taken == motion.count)
        return taken > 0;
    /* The rest of the datagram is refused with it: after a gap it would begin at another place. */
    refuse(session, refusal, motion.count - taken);
    if (session_same(session->owner.address, address))
        session_note_lost(session);
    return taken > 0;
}
