/* SPDX-License-Identifier: MIT
 * What the device sends without a request: status, the end of homing and probing. */
#include "session/inner.h"

#include <math.h>
#include <string.h>

#define ANGLE_ONE 65536.0 /* one turn */

static bool is_moving(const struct session *session) {
    return !session_is_module(session) && !machine_is_standing(session->machine);
}

/* The protocol's alarms, of which it has fewer. A limit is named by the first axis whose switch is still
 * closed, X if it has opened again. */
static uint8_t alarm_code(const struct session *session, axis_mask_t limits) {
    unsigned axis = 0;
    if (machine_state(session->machine) != MACHINE_ALARM)
        return WIRE_ALARM_NONE;
    switch (machine_alarm(session->machine)) {
    case ALARM_ESTOP:
    case ALARM_LOCKED:
        return WIRE_ALARM_ESTOP;
    case ALARM_HARD_LIMIT:
        while (axis < AXIS_COUNT - 1 && (limits >> axis & 1) == 0)
            axis++;
        return (uint8_t)(WIRE_ALARM_LIMIT_X + ((limits >> axis & 1) != 0 ? axis : 0));
    case ALARM_SOFT_LIMIT:
        return WIRE_ALARM_TRAVEL;
    case ALARM_PROBE_CLOSED:
    case ALARM_PROBE_MISSED:
        return WIRE_ALARM_PROBE;
    case ALARM_HOMING_RESET:
    case ALARM_HOMING_DOOR:
    case ALARM_HOMING_PULL_OFF:
    case ALARM_HOMING_MISSED:
    case ALARM_SQUARING:
        return WIRE_ALARM_HOMING;
    case ALARM_NONE:
    case ALARM_RESET_IN_MOTION:
    default:
        return WIRE_ALARM_LOCKED;
    }
}

static uint8_t flags_of(const struct session *session) {
    unsigned flags = WIRE_STATUS_FLAG_NETWORK;
    for (unsigned i = 0; i < SESSION_CLIENTS; i++)
        flags |= session->client[i].used ? WIRE_STATUS_FLAG_CLIENT : 0;
    flags |= is_moving(session) ? WIRE_STATUS_FLAG_MOVING : 0;
    if (session_is_module(session))
        return (uint8_t)flags;
    flags |= machine_state(session->machine) == MACHINE_HOME ? WIRE_STATUS_FLAG_HOMING : 0;
    flags |= machine_host(session->machine)->owns ? WIRE_STATUS_FLAG_HOST : 0;
    flags |= machine_host_has_job(session->machine) ? WIRE_STATUS_FLAG_JOB : 0;
    return (uint8_t)flags;
}

/* Steps/s of the axis with the most steps, mean since the last round of reports. */
static int32_t rate_of(const struct session *session, const int32_t position[AXIS_COUNT]) {
    uint64_t us = session->now_us - session->status_us;
    uint32_t most = 0;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        int64_t way = (int64_t)position[ax] - session->position_steps[ax];
        uint32_t size = (uint32_t)(way < 0 ? -way : way);
        most = size > most ? size : most;
    }
    return us > 0 && is_moving(session) ? (int32_t)((uint64_t)most * 1000000u / us) : 0;
}

/* Measured, where there is an encoder. */
static void add_spindle(const struct machine *machine, struct wire_status *status) {
    struct host_spindle spindle;
    if (!machine_host_spindle(machine, &spindle))
        return;
    double whole = floor(spindle.turns);
    status->rpm = (uint16_t)(spindle.rpm < (float)UINT16_MAX ? spindle.rpm + 0.5f : (float)UINT16_MAX);
    status->spindle_angle = (uint16_t)(uint32_t)((spindle.turns - whole) * ANGLE_ONE);
    status->spindle_turns = (uint32_t)(int64_t)whole;
}

static void machine_status(const struct session *session, struct wire_status *status) {
    const struct machine *machine = session->machine;
    const struct machine_outputs *outputs = machine_outputs(machine);
    struct host_inputs inputs;
    machine_host_inputs(machine, &inputs);
    *status = (struct wire_status){
        .buffer_free = (uint16_t)(host_queue_free(&machine_host(machine)->queue) -
                                  host_queue_laid(&machine_host(machine)->queue)),
        .buffer_total = HOST_QUEUE_SIZE,
        .state = session_state(session),
        .alarm = alarm_code(session, inputs.limits),
        .limits = inputs.limits,
        .probe = inputs.probe,
        .homing = machine_homes(machine),
        .home_switches = inputs.home,
        .estop = inputs.estop,
        .segment_id = machine_host_id(machine),
        .misc_outputs = machine_host_digital(machine),
        .misc_inputs = inputs.digital,
        .spindle = (uint8_t)outputs->spindle,
        .coolant = (uint8_t)(((outputs->coolant & COOLANT_FLOOD) != 0 ? 1 : 0) |
                             ((outputs->coolant & COOLANT_MIST) != 0 ? 2 : 0)),
        .rpm = outputs->spindle != SPINDLE_OFF && outputs->rpm < 65536.0f ? (uint16_t)outputs->rpm : 0,
    };
    add_spindle(machine, status);
    machine_position(machine, status->position_steps);
    status->rate_steps_s = rate_of(session, status->position_steps);
}

static size_t status_packet(struct session *session, uint8_t *packet) {
    struct wire_status status;
    if (session_is_module(session))
        module_status(session, &status);
    else
        machine_status(session, &status);
    status.flags = flags_of(session);
    status.uptime_ms = (uint32_t)(session->now_us / 1000);
    wire_put_status(packet + WIRE_HEADER_SIZE, &status);
    return session_close(session, SEQUENCE_STATUS, packet, WIRE_STATUS, WIRE_STATUS_SIZE);
}

static void send_to(struct session *session, const uint8_t address[4], const uint8_t *packet, size_t size) {
    struct session_peer to = {.port = session->options.status_port};
    memcpy(to.address, address, sizeof to.address);
    session->ops->send(session->ctx, &to, packet, size);
    if (!session_is_module(session))
        return;
    /* A module reports to both ports: a program that looks only for modules need not share the port of the
     * others. */
    to.port = (uint16_t)(to.port + WIRE_IO_STATUS_PORT - WIRE_STATUS_PORT);
    session->ops->send(session->ctx, &to, packet, size);
}

static void send_to_all(struct session *session, const uint8_t *packet, size_t size) {
    for (unsigned i = 0; i < SESSION_LISTENERS; i++)
        if (session_reports_to(session, &session->listener[i]))
            send_to(session, session->listener[i].address, packet, size);
}

void session_send_status(struct session *session, const uint8_t address[4]) {
    uint8_t packet[WIRE_PACKET_MAX] = {0};
    send_to(session, address, packet, status_packet(session, packet));
}

/* `homing` of the session is set when a request was accepted, that of the machine until its end. */
static void report_homing(struct session *session) {
    const struct machine_host *host = machine_host(session->machine);
    if (session->homing == 0 || host->homing)
        return;
    uint8_t packet[WIRE_PACKET_MAX] = {0};
    struct wire_home_complete done = {.axes = session->homing, .success = host->homed_ok};
    session->homing = 0;
    wire_put_home_complete(packet + WIRE_HEADER_SIZE, &done);
    send_to_all(session, packet,
                session_close(session, SEQUENCE_EVENT, packet, WIRE_HOME_COMPLETE, WIRE_HOME_COMPLETE_SIZE));
}

void session_put_probe(const struct session *session, uint8_t *payload) {
    const struct machine_host *host = machine_host(session->machine);
    struct wire_probe_result result = {.contact = host->probe_contact, .number = (uint16_t)host->probes_done};
    memcpy(result.position_steps, host->probe_steps, sizeof result.position_steps);
    wire_put_probe_result(payload, &result);
}

static void report_probe(struct session *session) {
    const struct machine_host *host = machine_host(session->machine);
    if (session->probes_done == host->probes_done)
        return;
    uint8_t packet[WIRE_PACKET_MAX] = {0};
    session->probes_done = host->probes_done;
    session_put_probe(session, packet + WIRE_HEADER_SIZE);
    send_to_all(session, packet,
                session_close(session, SEQUENCE_EVENT, packet, WIRE_PROBE_RESULT, WIRE_PROBE_RESULT_SIZE));
}

void session_report(struct session *session) {
    const uint64_t interval_us = session->settings->status_interval_ms * 1000ull;
    if (!session_is_module(session)) {
        report_homing(session);
        report_probe(session);
    }
    uint32_t wait_us = session_report_wait_us(session);
    if (wait_us == UINT32_MAX) {
        /* No one listens: the pace begins with who comes next, and who comes again and again is no faster. */
        const uint64_t next_us = session->status_us + interval_us;
        session->due_us = session->now_us > next_us ? session->now_us : next_us;
    }
    if (wait_us != 0)
        return;
    /* Not before: clearing it costs as much as the rest of a poll without a report. */
    uint8_t packet[WIRE_PACKET_MAX] = {0};
    send_to_all(session, packet, status_packet(session, packet));
    session->status_us = session->now_us;
    /* From the time that was due, so that a late poll does not slow the pace down; a poll that is late by
     * a whole interval, or an interval that was made shorter, begins a new pace. */
    session->due_us += interval_us;
    if (session->due_us <= session->now_us || session->due_us > session->now_us + interval_us)
        session->due_us = session->now_us + interval_us;
    if (!session_is_module(session))
        machine_position(session->machine, session->position_steps);
}
