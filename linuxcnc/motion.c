/* SPDX-License-Identifier: MIT
 * What becomes of LinuxCNC's commands: a stream of segments; or the controller homes, or its probe has
 * stopped it. */
#include "link.h"
#include "wire/bytes.h"
#include "words_gen.h"

#include <math.h>
#include <string.h>

static const double SLICE_S = 0.01;        /* of servo time, in a segment */
static const double NEARLY = 0.999;        /* of it: the servo thread's time is a sum of rounded periods */
static const double SEEN_S = 0.005;        /* of servo time: the servo thread has run and seen the pins */
static const double STILL_S = 1.0;         /* no sample for this long: the servo thread does not run */
static const double HOMING_BEGINS_S = 1.0; /* after it was asked for */
static const double FAR_S = 0.25;          /* so much time at top speed away, and the command is a mistake */
static const double STANDS_S = 1.0;   /* after switching on the machine must be at rest within this time */
static const double HELD_S = 2.0;     /* LinuxCNC has seen a hold, and slowed down */
static const double MOVING_S = 0.1;   /* it commands motion as long as it did so in this time */
static const double SPARE_S = 0.1;    /* a queue may be longer by so much, or twice as long */
static const double HOMING_WAY = 0.1; /* units that a joint creeps when it is homed */
static const char NO_SAMPLES[] =
    "the servo thread gives no samples: load sampler, and addf it, as docs/linuxcnc.md shows";
static const char NO_MORE_SAMPLES[] = "LinuxCNC's servo thread has stopped for more than 1 s: this computer "
                                      "was too busy or asleep, or LinuxCNC "
                                      "ends";
static const char HELD_MOVES[] = "the controller is in a feed hold, and LinuxCNC moves on: a jog, or feed "
                                 "override is disabled (M48, M50); "
                                 "resume the controller first";
enum { LAST_US = 1000 }; /* a dwell behind the last motion */

static void ask_stream(struct link *link, uint8_t type, uint32_t stream) {
    uint8_t payload[WIRE_STREAM_CLOSE_SIZE];
    wire_put_stream_close(payload, &(struct wire_stream_close){.stream = stream}); /* both are the same */
    peer_ask(&link->peer, type, payload, sizeof payload);
    link->stream_asks++;
    link->is_open = link->watches = false;
}

bool link_is_holding_feedback(const struct link *link) {
    return link->phase >= LINK_DRAINING || (link->phase == LINK_OPENING && link->opens_for != LINK_OFF);
}

// ---- streams ----

static void put(struct link *link, const struct wire_segment *segment) {
    if (!sender_put(&link->sender, segment))
        link_fault(link, link->pins->message_late,
                   "the controller does not take motion as fast as it comes: is the network good enough?");
}

/* Nothing more comes for now: it follows this, and that is not an underrun. */
static void finish(struct link *link) {
    put(link, &(struct wire_segment){.duration_us = LAST_US, .flags = WIRE_SEGMENT_FLAG_LAST});
}

/* No more of this stream; what is queued in the controller is executed. */
static void close_stream(struct link *link, uint32_t stream) {
    ask_stream(link, WIRE_STREAM_CLOSE, stream);
}

void motion_drop(struct link *link, uint32_t stream) {
    ask_stream(link, WIRE_STREAM_DROP, stream);
}

/* The controller has said something of a stream, at this time of its clock. */
static void date_stream(struct link *link, uint32_t at_us) {
    if (!link->is_stale || peer_is_later(at_us, link->stale_us))
        link->stale_us = at_us;
    link->is_stale = true;
    link_date_report(link);
}

/* Top speeds, and a stream; both are answered in this order. */
static void open_stream(struct link *link, enum link_phase opens_for) {
    uint8_t payload[WIRE_CONFIG_GET_SIZE];
    for (unsigned joint = 0; joint < link->options.joints; joint++) {
        wire_put_config_get(payload,
                            &(struct wire_config_get){.key = (uint16_t)(KEY_MAX_RATE_MM_MIN + joint)});
        peer_ask(&link->peer, WIRE_CONFIG_GET, payload, sizeof payload);
    }
    put_zero(payload, WIRE_STREAM_OPEN_SIZE);
    peer_ask(&link->peer, WIRE_STREAM_OPEN, payload, WIRE_STREAM_OPEN_SIZE);
    link->stream_asks++;
    link->phase = LINK_OPENING;
    link->opens_for = opens_for;
}

static void take_rate(struct link *link, const uint8_t *payload) {
    struct wire_config_value value;
    wire_get_config_value(payload, &value);
    unsigned joint = value.key - KEY_MAX_RATE_MM_MIN;
    if (joint < link->options.joints)
        link->slicer.rate[joint] = get_u32(value.value);
}

/* @return false: a scale that is none */
static bool begin_slices(struct link *link) {
    struct slicer *slicer = &link->slicer;
    slicer->joints = link->options.joints;
    slicer->level_s = link->options.level_s;
    slicer->stands = 0;
    memcpy(slicer->steps, link->peer.status.position_steps, sizeof slicer->steps);
    for (unsigned joint = 0; joint < slicer->joints; joint++) {
        slicer->scale[joint] = pins_scale(link->pins, joint);
        if (!isfinite(slicer->scale[joint])) {
            link_fault(link, link->pins->message_refused, "joint.%u.scale is not a number of steps per unit",
                       joint);
            return false;
        }
    }
    return true;
}

/* A stream from where the machine is. It begins with standing still for as long as shall wait in the
 * queue. */
static void begin(struct link *link, const struct wire_stream_opened *opened) {
    sender_begin(&link->sender, opened->stream, opened->capacity);
    link->stream = opened->stream;
    link->is_open = true;
    link->is_late = false;
    link->moving_end = 0;
    link->queued_s = link->options.level_s;
    link->phase = LINK_FOLLOWING;
    link->sampled_s = link->sample.servo_s;
    link->moved_s = link->peer.now_s;
    link->begins = true;
    link->probes = link->no_cut = false;
    link->probe_begins = sample_probes(&link->sample) && link->opens_for != LINK_TOUCHED;
    if (begin_slices(link))
        put(link, &(struct wire_segment){.duration_us = (uint32_t)(1e6 * link->options.level_s)});
}

// ---- what the servo thread sees of the pins ----

/* Samples that were taken before the pins changed may still wait in the sampler; at the next tick they have
 * been read. */
static void settle(struct link *link) {
    link->settles = true;
}

static void settle_from_here(struct link *link) {
    link->settled_s = link->sample.servo_s + SEEN_S;
    link->settles = false;
}

static bool is_settled(const struct link *link) {
    return !link->settles && link->sample.servo_s >= link->settled_s;
}

static void units_of(const struct link *link, const int32_t steps[PIN_JOINTS], double *units) {
    for (unsigned joint = 0; joint < link->options.joints; joint++)
        units[joint] = steps[joint] / pins_scale(link->pins, joint);
}

// ---- homing ----

static void stay_here(struct link *link) {
    memcpy(link->locked_at, link->sample.command, sizeof link->locked_at);
}

static void lock(struct link *link) {
    link->phase = LINK_LOCKED;
    link->is_unlocking = false;
    stay_here(link);
}

static const char GIVEN_UP[] = "LinuxCNC has given up homing";

static uint8_t homing_asked(const struct link *link) {
    uint8_t homes = 0;
    for (unsigned joint = 0; joint < link->options.joints; joint++)
        homes |= (uint8_t)(*link->pins->joint[joint].index_enable << joint);
    return homes;
}

static bool is_given_up(const struct link *link) {
    return (link->homes & ~homing_asked(link)) != 0;
}

static void look_for_homing(struct link *link) {
    if (homing_asked(link) == 0)
        return;
    finish(link);
    if (link->is_open)
        link->phase = LINK_DRAINING;
}

/* The controller looks for its own switches. LinuxCNC believes that it waits for an index pulse; when that
 * comes, it takes position-fb as where the joints are. */
static void begin_homing(struct link *link) {
    uint8_t payload[WIRE_HOME_SIZE];
    wire_put_home(payload, &(struct wire_home){.axes = link->homes});
    peer_ask(&link->peer, WIRE_HOME, payload, sizeof payload);
    link->phase = LINK_HOMING;
    link->homing_s = link->peer.now_s;
    link->is_homing_seen = false;
}

static void drain(struct link *link) {
    link->homes = homing_asked(link);
    if (link->homes == 0)
        link->phase = LINK_FOLLOWING;
    if (link->homes == 0 || !sender_is_executed(&link->sender) || !link_stands(link))
        return;
    close_stream(link, link->sender.stream);
    begin_homing(link);
}

/* Only an e-stop ends the controller's homing. */
static void stop_homing(struct link *link) {
    peer_post(&link->peer, WIRE_ESTOP, NULL, 0);
    peer_ask(&link->peer, WIRE_ESTOP, NULL, 0);
    link_fault(link, link->pins->message_homing, "%s: the controller is stopped", GIVEN_UP);
}

static void await_homing(struct link *link) {
    bool homes = link->peer.status.state == WIRE_STATE_HOMING;
    link->is_homing_seen |= homes;
    bool begins = !link->is_homing_seen && link->peer.now_s - link->homing_s < HOMING_BEGINS_S;
    if (is_given_up(link)) {
        stop_homing(link);
        return;
    }
    if (homes || begins || !link_stands(link))
        return;
    link->homing_us = link->peer.status_us;
    link->phase = LINK_HOMED;
}

void motion_take_trust(struct link *link, uint32_t at_us) {
    if (link->phase != LINK_HOMED || !peer_is_later(at_us, link->homing_us))
        return;
    if ((link->reference.trusted & link->homes) != link->homes)
        link_fault(link, link->pins->message_homing, "the controller has not found its switches");
    else
        open_stream(link, LINK_HOMED);
}

/* The servo thread is to see both together. Joints that have asked meanwhile are homed next. */
static void show_homed(struct link *link) {
    if (is_given_up(link)) {
        link_fault(link, link->pins->message_homing, "%s", GIVEN_UP);
        return;
    }
    reference_note_switches(&link->reference, link->homes);
    link->peer.world.await_servo(link->peer.world.ctx);
    pins_show_position(link->pins, link->peer.status.position_steps);
    for (unsigned joint = 0; joint < link->options.joints; joint++) {
        if ((link->homes >> joint & 1) != 0)
            *link->pins->joint[joint].index_enable = false;
    }
    settle(link);
}

// ---- probing ----

void motion_fault_ended(struct link *link) {
    link_fault(link, link->pins->message_ended,
               "the controller has ended motion: it was reset, or its text side or another host has it");
}

/* Where the probe has touched in this G38. */
static void take_contact(struct link *link, const uint8_t *payload) {
    struct wire_probe_result result;
    wire_get_probe_result(payload, &result);
    bool is_new = result.contact != 0 && result.number != link->results;
    link->results = result.number;
    if (link->phase != LINK_CONTACT)
        return;
    if (!is_new && link->state >= WIRE_STATE_ALARM)
        return; /* a report is about to say why */
    if (!is_new) {
        motion_fault_ended(link);
        return;
    }
    memcpy(link->contact_steps, result.position_steps, sizeof link->contact_steps);
    pins_show_position(link->pins, link->contact_steps);
    *link->pins->probe = true;
    link->phase = LINK_TOUCHED;
    link->is_deep = false;
    settle(link);
}

/* How far behind the contact LinuxCNC's command is. */
static double depth_of(struct link *link, const double *touched) {
    double distance = 0.0, depth = 0.0;
    unsigned joints = link->options.joints;
    for (unsigned joint = 0; joint < joints; joint++)
        distance = hypot(distance, link->sample.command[joint] - touched[joint]);
    for (unsigned joint = 0; joint < joints; joint++) {
        double way = link->sample.command[joint] - touched[joint];
        if (!link->is_deep)
            link->into[joint] = distance > 0.0 ? way / distance : 0.0;
        depth += way * link->into[joint];
    }
    return depth;
}

/* LinuxCNC has taken the feedback at which its probe input rose: that is the contact, exact to the step. When
 * its own motion has ended, too, commands are followed again. */
static void retreat(struct link *link) {
    double touched[PIN_JOINTS], wanted[PIN_JOINTS];
    if (!is_settled(link))
        return;
    settle_from_here(link);
    units_of(link, link->contact_steps, touched);
    double depth = depth_of(link, touched);
    if (!link->is_deep || depth > link->deepest) {
        link->is_deep = true;
        link->deepest = depth;
        clearance_begin(&link->clearance, touched, link->sample.command);
        return;
    }
    clearance_follow(&link->clearance, link->sample.command, wanted);
    if (link_stands(link))
        open_stream(link, LINK_TOUCHED);
}

static void shift_to_where_it_stands(struct link *link) {
    double touched[PIN_JOINTS], stands[PIN_JOINTS];
    units_of(link, link->contact_steps, touched);
    units_of(link, link->peer.status.position_steps, stands);
    clearance_shift(&link->clearance, touched, stands);
}

// ---- answers ----

static void opened(struct link *link, const uint8_t *payload) {
    struct wire_stream_opened opened;
    wire_get_stream_opened(payload, &opened);
    if (link->phase != LINK_OPENING) {
        if (opened.stream != 0)
            close_stream(link, opened.stream);
        return;
    }
    if (link->opens_for == LINK_HOMED && opened.refusal == WIRE_REFUSAL_LOCKED) {
        lock(link); /* other axes are to be homed, too */
        show_homed(link);
        return;
    }
    if (opened.refusal != WIRE_REFUSAL_NONE) {
        link_fault(link, link->pins->message_refused, "the controller refuses motion: %s",
                   peer_refusal(opened.refusal));
        return;
    }
    begin(link, &opened);
    if (link->opens_for != LINK_TOUCHED)
        clearance_clear(&link->clearance, link->options.joints);
    if (link->opens_for == LINK_TOUCHED)
        shift_to_where_it_stands(link);
    if (link->opens_for == LINK_HOMED)
        show_homed(link);
}

void motion_answer(struct link *link, const struct control_answer *answer) {
    if (answer->request == WIRE_STREAM_OPEN || answer->request == WIRE_STREAM_CLOSE ||
        answer->request == WIRE_STREAM_DROP) {
        link->stream_asks--;
        date_stream(link, answer->header.timestamp_us);
    }
    if (answer->type == WIRE_REFUSED) {
        struct wire_refused refused;
        wire_get_refused(answer->payload, &refused);
        if (answer->request == WIRE_HOME || answer->request == WIRE_STREAM_OPEN)
            link_fault(link, link->pins->message_refused, "the controller refuses %s: %s",
                       answer->request == WIRE_HOME ? "to home" : "motion", peer_refusal(refused.reason));
        else if (answer->request == WIRE_IO_CONTROL && refused.reason == WIRE_REFUSAL_NO_OUTPUT)
            link_fault(link, link->pins->message_refused, "the controller refuses spindle and coolant: %s",
                       peer_refusal(refused.reason));
    } else if (answer->request == WIRE_CONFIG_GET) {
        take_rate(link, answer->payload);
    } else if (answer->request == WIRE_STREAM_OPEN) {
        opened(link, answer->payload);
    } else if (answer->request == WIRE_PROBE_LAST) {
        take_contact(link, answer->payload);
    }
}

void motion_ack(struct link *link, const struct wire_stream_ack *ack, uint32_t at_us) {
    if (!link->is_open || !sender_take(&link->sender, ack))
        return;
    link->queued_s = ack->queued_us / 1e6;
    link_note_state(link, ack->state, at_us);
    date_stream(link, at_us);
    if (ack->refusal == WIRE_REFUSAL_NONE)
        return;
    link->is_open = link->watches = false;
    link->was_stopped = ack->state >= WIRE_STATE_ALARM && !link->peer.was_estop;
    link->stopped_s = link->peer.now_s;
    if (ack->refusal == WIRE_REFUSAL_STREAM_CLOSED) {
        peer_ask(&link->peer, WIRE_PROBE_LAST, NULL, 0);
        link->phase = LINK_CONTACT;
    } else {
        link_fault(link, link->pins->message_refused,
                   "the controller takes no more motion, segment %u: %s; %u of %u were executed",
                   (unsigned)ack->refused, peer_refusal(ack->refusal), (unsigned)link->sender.done,
                   (unsigned)link->sender.end);
    }
}

// ---- commands ----

static void look_for_probing(struct link *link) {
    if (link->probe_begins) {
        link->watches = link->peer.status.probe == 0; /* G38.4, G38.5 look for the opposite */
        link->watched = link->sender.end;
    }
    link->was_probing = link->probes;
    link->probe_begins = false;
    link->watches = link->watches && (link->probes || link->sender.done < link->watched);
}

static void slice(struct link *link) {
    double wanted[PIN_JOINTS];
    struct wire_segment segment;
    const struct sample *sample = &link->sample;
    clearance_follow(&link->clearance, sample->command, wanted);
    int wrong = link->begins ? slicer_far(&link->slicer, wanted, FAR_S) : -1;
    bool stands = slicer_is_there(&link->slicer, wanted);
    if (wrong < 0 && stands && (link->is_held || link->is_late)) { /* nothing more is queued */
        link->sampled_s = sample->servo_s;
        return;
    }
    if (wrong < 0)
        wrong =
            slicer_slice(&link->slicer, wanted, sample->servo_s - link->sampled_s, link->queued_s, &segment);
    if (wrong >= 0) {
        link_fault(link, link->pins->message_moved,
                   "joint %d is commanded to %g and is at %g: switch on again", wrong, wanted[wrong],
                   link->slicer.steps[wrong] / link->slicer.scale[wrong]);
        return;
    }
    look_for_probing(link);
    if (link->no_cut)
        segment.flags = WIRE_SEGMENT_FLAG_RAPID;
    if (link->watches && link->probes) {
        segment.flags = WIRE_SEGMENT_FLAG_PROBE;
        link->watched = link->sender.end + 1;
    }
    put(link, &segment);
    if (!stands) {
        link->moving_end = link->sender.end;
        link->commanded_s = link->peer.now_s;
    }
    link->begins = link->probes = link->no_cut = false;
    link->sampled_s = sample->servo_s;
}

/* While a joint asks for homing, LinuxCNC's command is none to be followed. */
void link_sample(struct link *link, const struct sample *sample, double now_s) {
    link->peer.now_s = now_s;
    if (sample->servo_s > link->sample.servo_s) {
        link->has_samples = link->moved_s > 0.0;
        link->moved_s = now_s;
    }
    link->probe_begins |= sample_probes(sample) && !sample_probes(&link->sample);
    link->sample = *sample;
    link->probes |= sample_probes(sample);
    link->no_cut |= !sample_cuts(sample);
    if (link->phase == LINK_FOLLOWING && is_settled(link) && homing_asked(link) == 0 &&
        sample->servo_s - link->sampled_s >= NEARLY * SLICE_S)
        slice(link);
}

/* Of motion and of reports that are lost: the feedback is no later than LinuxCNC's following error allows
 * (cli/wificnc/linuxcnc/config.py). With hysteresis, so that LinuxCNC does not stutter. */
static void look_for_delay(struct link *link) {
    double level_s = link->options.level_s, spare_s = fmax(level_s, SPARE_S);
    double waiting_s = SLICE_S * (link->sender.end - link->sender.done) + peer_blind_s(&link->peer);
    link->is_late = waiting_s > level_s + spare_s * (link->is_late ? 0.5 : 1.5);
}

static bool moves_while_held(const struct link *link) {
    double now_s = link->peer.now_s;
    return link->is_held && now_s - link->held_s > HELD_S && now_s - link->commanded_s < MOVING_S;
}

void motion_check_position(struct link *link) {
    const int32_t *at = link->peer.status.position_steps;
    unsigned joint = 0;
    if (link->phase != LINK_FOLLOWING || link->is_stale || link->sender.done < link->moving_end)
        return;
    while (joint < link->options.joints && at[joint] == link->slicer.steps[joint])
        joint++;
    if (joint < link->options.joints)
        link_fault(link, link->pins->message_moved, "joint %u is at step %d and was sent to step %d", joint,
                   (int)at[joint], (int)link->slicer.steps[joint]);
}

static void follow(struct link *link) {
    look_for_delay(link);
    link->watches = link->watches && (link->was_probing || link->sender.done < link->watched);
    if (link->peer.now_s - link->moved_s > STILL_S)
        link_fault(link, link->pins->message_servo, "%s", link->has_samples ? NO_MORE_SAMPLES : NO_SAMPLES);
    else if (moves_while_held(link))
        link_fault(link, link->pins->message_held, "%s", HELD_MOVES);
    else
        look_for_homing(link);
}

// ---- on and off ----

/* LinuxCNC is on; the lock stays until all is homed. */
static void follow_lock(struct link *link) {
    unsigned joints = link->options.joints;
    link->homes = homing_asked(link);
    if (!peer_awaits_homing(&link->peer)) {
        if (link_stands(link))
            open_stream(link, LINK_OFF);
        return;
    }
    if (link->homes != 0) {
        begin_homing(link);
        return;
    }
    if (!is_settled(link)) {
        stay_here(link); /* joints that were just homed are about to be commanded to where they are */
        return;
    }
    for (unsigned joint = 0; joint < joints; joint++) {
        if (fabs(link->sample.command[joint] - link->locked_at[joint]) > HOMING_WAY) {
            link_fault(link, link->pins->message_home_first,
                       "the controller is locked until all axes are homed: only homing moves it");
            return;
        }
    }
    if (link->reference.homed == (1u << joints) - 1 && !link->is_unlocking) {
        link->is_unlocking = true;
        peer_ask(&link->peer, WIRE_RESET, NULL, 0);
    }
}

/* What has not got to the controller yet is not wanted any more: it may be seconds, after a network that was
 * gone. */
static void switch_off(struct link *link) {
    if (link->phase == LINK_HOMING && !peer_is_locked(&link->peer)) {
        stop_homing(link);
        return;
    }
    if (link->is_open)
        motion_drop(link, link->sender.stream);
    link->phase = LINK_OFF;
    link->is_late = false;
}

/* LinuxCNC's command was the feedback until it was switched on. If the machine has moved since, it is not to
 * go back there. */
static void switch_on(struct link *link) {
    const struct wire_status *status = &link->peer.status;
    if (memcmp(link->off_steps, status->position_steps, link->options.joints * sizeof *link->off_steps) != 0)
        link_fault(link, link->pins->message_moved,
                   "the machine has moved since it was switched on: switch on again when it has stopped");
    else if (peer_awaits_homing(&link->peer))
        lock(link);
    else if (link_stands(link))
        open_stream(link, LINK_OFF);
    else if (link->peer.now_s - link->asked_s > STANDS_S)
        link_fault(link, link->pins->message_refused,
                   "the controller is at something else, and takes no motion: %s",
                   word_of_state[status->state & 7]);
}

void motion_note_off(struct link *link) {
    if (!*link->pins->enable)
        memcpy(link->off_steps, link->peer.status.position_steps, sizeof link->off_steps);
}

static void look_at_switch(struct link *link) {
    bool enable = *link->pins->enable, wants = enable && *link->pins->ready;
    if (!wants)
        switch_off(link);
    if (wants && !link->was_enabled)
        link->asked_s = link->peer.now_s;
    link->is_asked = wants && link->phase == LINK_OFF && (link->is_asked || !link->was_enabled);
    link->was_enabled = enable;
    motion_note_off(link);
}

void motion_tick(struct link *link) {
    if (link->settles)
        settle_from_here(link);
    look_at_switch(link);
    if (link->is_asked)
        switch_on(link);
    else if (link->phase == LINK_LOCKED)
        follow_lock(link);
    else if (link->phase == LINK_FOLLOWING)
        follow(link);
    else if (link->phase == LINK_DRAINING)
        drain(link);
    else if (link->phase == LINK_HOMING)
        await_homing(link);
    else if (link->phase == LINK_TOUCHED)
        retreat(link);
}
