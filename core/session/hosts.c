/* SPDX-License-Identifier: MIT
 * Hosts: the one that commands, those that listen, those with a connection. What they have said, and when. */
#include "session/inner.h"

#include <string.h>

/* A sender whose number is behind later, or ahead by more than it can have sent since, begins again, too. */
#define LATE_US        1000000u
#define SILENCE_MAX_US 60000000u
enum { NUMBERS_A_MS = 2 };

enum { STEADY = 8 }; /* so many ways between motions make a habit */

/* The HAL's clock wraps after 71 minutes; time-outs of a session may be older. Called at least that often. */
void session_tick(struct session *session) {
    uint32_t clock_us = hal_time_us(session->hal);
    session->now_us += clock_us - session->clock_us;
    session->clock_us = clock_us;
}

size_t session_close(struct session *session, unsigned counter, uint8_t *packet, enum wire_type type,
                     size_t payload_size) {
    return wire_close(packet, (uint8_t)type, payload_size, session->sequence[counter]++,
                      (uint32_t)session->now_us);
}

uint8_t session_state(const struct session *session) {
    static const uint8_t states[MACHINE_STATE_COUNT] = {
        [MACHINE_IDLE] = WIRE_STATE_IDLE,   [MACHINE_RUN] = WIRE_STATE_RUN,
        [MACHINE_HOLD] = WIRE_STATE_HOLD,   [MACHINE_JOG] = WIRE_STATE_JOG,
        [MACHINE_ALARM] = WIRE_STATE_ALARM, [MACHINE_DOOR] = WIRE_STATE_HOLD,
        [MACHINE_CHECK] = WIRE_STATE_IDLE,  [MACHINE_HOME] = WIRE_STATE_HOMING,
        [MACHINE_SLEEP] = WIRE_STATE_ALARM,
    };
    const struct machine *machine = session->machine;
    const enum alarm alarm = machine_alarm(machine);
    if (machine_state(machine) == MACHINE_ALARM && (alarm == ALARM_ESTOP || alarm == ALARM_LOCKED))
        return WIRE_STATE_ESTOP;
    if (machine_state(machine) == MACHINE_RUN && machine_host(machine)->probing)
        return WIRE_STATE_PROBING;
    return states[machine_state(machine)];
}

uint32_t session_report_wait_us(const struct session *session) {
    bool listens = session->owner.on;
    for (unsigned i = 0; i < SESSION_LISTENERS; i++)
        listens |= session_reports_to(session, &session->listener[i]);
    if (!listens)
        return UINT32_MAX;
    uint64_t interval_us = session->settings->status_interval_ms * 1000ull;
    uint64_t due_us = session->status_us + interval_us; /* where the interval has just become shorter */
    due_us = due_us < session->due_us ? due_us : session->due_us;
    return session->now_us < due_us ? (uint32_t)(due_us - session->now_us) : 0;
}

/* ---- the host that commands ---- */

void session_own(struct session *session, const uint8_t address[4]) {
    struct session_owner *owner = &session->owner;
    if (!session_same(owner->address, address)) {
        *owner = (struct session_owner){.on = true};
        memcpy(owner->address, address, sizeof owner->address);
        session->recents = 0;
    }
    /* Also of the host that was the owner last: its numbers continue (struct session_owner). */
    owner->on = true;
    owner->heard_us = owner->alive_us = session->now_us;
    owner->left = owner->lost = false;
}

static void end_motion(struct session *session, bool discard) {
    struct machine *machine = session->machine;
    machine_host_gone(machine);
    if (discard)
        machine_host_discard(machine);
    else if (machine_host_has_segments(machine))
        action_hold(machine);
}

void session_take(struct session *session, const uint8_t address[4], bool discard) {
    const bool from_other = session->owner.on && !session_same(session->owner.address, address);
    if (!session_is_module(session) && (from_other || discard)) {
        /* The acks of the former owner's stream say who has ended it. */
        stream_close(session, from_other ? WIRE_REFUSAL_OWNER : WIRE_REFUSAL_STREAM_CLOSED);
        end_motion(session, discard);
    }
    session_own(session, address);
    session->owner.taken = true;
    session->owner.motion_us = session->now_us;
}

bool session_has_client(const struct session *session, const uint8_t address[4]) {
    for (unsigned i = 0; i < SESSION_CLIENTS; i++)
        if (session->client[i].used && session_same(session->client[i].address, address))
            return true;
    return false;
}

void session_note_alive(struct session *session, const uint8_t address[4]) {
    struct session_owner *owner = &session->owner;
    if (!owner->on || !session_same(owner->address, address))
        return;
    owner->alive_us = session->now_us;
    access_keep(session->options.access, lockout_ipv4(address));
    owner->lost = owner->lost && owner->left;
    if (session_is_module(session))
        owner->heard_us = session->now_us; /* it has no motion that would need more than a sign of life */
}

/* Behind a newer one: it was counted as missing, unless it is here for the second time. */
static void note_late(struct session *session, uint32_t behind) {
    struct session_owner *owner = &session->owner;
    uint64_t bit = behind < 64 ? (uint64_t)1 << behind : 0;
    if ((owner->seen & bit) != 0)
        return;
    owner->seen |= bit;
    owner->skipped -= bit != 0 && owner->skipped > 0 ? 1 : 0;
    session->counts.late++;
    session->counts.missing -= bit != 0 && session->counts.missing > 0 ? 1 : 0;
}

/* Numbers that a sender may have used in this time. */
static int32_t most_ahead(uint64_t silent_us) {
    uint64_t us = silent_us < SILENCE_MAX_US ? silent_us : SILENCE_MAX_US;
    return SEQUENCE_JUMP + (int32_t)(us * NUMBERS_A_MS / 1000);
}

void session_note_lost(struct session *session) {
    if (session->settings->host_hold_on_gap != GAP_IS_IGNORED && !session_is_module(session) &&
        !session->stream.open)
        sender_lose_motion(session->machine);
}

void session_forget_gap(struct session *session) {
    session->owner.skipped = 0;
    session->owner.ends_fast = false;
}

static void note_stride(struct session_owner *owner, uint32_t ahead) {
    if (ahead == owner->stride) {
        owner->steady = owner->steady < STEADY ? (uint8_t)(owner->steady + 1) : STEADY;
        return;
    }
    owner->stride = ahead < UINT8_MAX ? (uint8_t)ahead : 0;
    owner->steady = 0;
}

/* Stock LinuxCNC hosts take a number for motion every 10 ms and skip it when there is no step: only where the
 * machine cannot have stood still in the gap is motion missing. Nor is it where the next one comes after as
 * many numbers as before: what was lost between them was something else, which they repeat. */
void session_note_moved(struct session *session, const struct session_pace *pace, uint32_t sequence) {
    struct session_owner *owner = &session->owner;
    const uint32_t ahead = sequence - owner->motion_sequence;
    const uint32_t usual = owner->steady < STEADY ? 1 : owner->stride;
    const bool first = owner->motion_sequence == 0, late = !first && ahead > UINT32_MAX / 2;
    if (owner->skipped > 0 && ahead > usual && owner->ends_fast && pace->begins_fast)
        session_note_lost(session);
    if (!first && !late && owner->skipped == 0)
        note_stride(owner, ahead);
    if (!late)
        owner->motion_sequence = sequence;
    owner->skipped = 0;
    owner->ends_fast = pace->ends_fast;
}

void session_note_sequence(struct session *session, const uint8_t address[4], uint32_t sequence) {
    struct session_owner *owner = &session->owner;
    if (!owner->on || !session_same(owner->address, address))
        return;
    int32_t ahead = (int32_t)(sequence - owner->sequence);
    uint64_t silent_us = session->now_us - owner->numbered_us;
    if (owner->sequence_known && ahead < 0 && ahead > -SEQUENCE_JUMP && silent_us < LATE_US) {
        note_late(session, (uint32_t)-ahead);
        return;
    }
    /* What does not follow is a sender that was started again: its gap is not one of the network. */
    bool follows = owner->sequence_known && ahead >= 0 && ahead < most_ahead(silent_us);
    if (follows && ahead > 1) {
        session->counts.missing += (uint32_t)ahead - 1;
        owner->skipped += (uint32_t)ahead - 1;
        if (session->settings->host_hold_on_gap == GAP_IS_A_LOSS)
            session_note_lost(session);
    }
    if (!follows) {
        owner->skipped = owner->motion_sequence = 0;
        owner->stride = owner->steady = 0;
        owner->ends_fast = false;
    }
    /* From a new beginning on all earlier numbers count as seen: none of them was counted as missing. */
    owner->seen = !follows ? UINT64_MAX : (ahead < 64 ? owner->seen << ahead : 0) | 1;
    owner->sequence = sequence;
    owner->numbered_us = session->now_us;
    owner->sequence_known = true;
}
