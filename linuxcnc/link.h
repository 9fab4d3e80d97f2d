/* SPDX-License-Identifier: MIT
 * One controller: LinuxCNC's pins and the controller are kept together. No socket, no HAL, no clock: the
 * caller gives what came and the time, s of any clock that never goes back. Nothing here waits, but for the
 * servo thread. */
#ifndef WIFICNC_LINUXCNC_LINK_H
#define WIFICNC_LINUXCNC_LINK_H

#include "clearance.h"
#include "encoder.h"
#include "peer.h"
#include "pins.h"
#include "reference.h"
#include "sender.h"
#include "slicer.h"

/** How long the caller may wait between two calls of link_tick, and of link_follow_spindle while there is an
 * encoder; s. */
#define LINK_TICK_S    0.01
#define LINK_SPINDLE_S 0.001

/** What the servo thread has seen in one period. */
struct sample {
    double command[PIN_JOINTS]; /* commanded positions, units */
    double servo_s;             /* its own time: only differences count */
    int32_t motion_type;        /* motion.motion-type: what LinuxCNC executes */
};

/* motion.motion-type, motion(9). A rapid, a jog, a tool change are no cuts: a laser is dark then. */
enum { LINUXCNC_LINEAR_FEED = 2, LINUXCNC_ARC_FEED = 3, LINUXCNC_PROBING = 5 };

static inline bool sample_probes(const struct sample *sample) {
    return sample->motion_type == LINUXCNC_PROBING;
}

static inline bool sample_cuts(const struct sample *sample) {
    return sample->motion_type == LINUXCNC_LINEAR_FEED || sample->motion_type == LINUXCNC_ARC_FEED;
}

struct link_options {
    unsigned joints; /* 1 .. PIN_JOINTS; joint n is the controller's axis n */
    double level_s;  /* motion that shall wait in the controller's queue */
    double run_up_s; /* of a spindle without an encoder */
    const char *key; /* of access; "": none */
};

enum link_phase {
    LINK_OFF,       /* LinuxCNC has not switched on, or motion has ended */
    LINK_LOCKED,    /* LinuxCNC is on, and the controller locked: only homing leads on */
    LINK_OPENING,   /* a stream is asked for */
    LINK_FOLLOWING, /* commands become segments */
    LINK_DRAINING,  /* what is queued is executed, and then the controller homes */
    LINK_HOMING,    /* it does */
    LINK_HOMED,     /* it is asked whether it has found its switches */
    LINK_CONTACT,   /* the stream was ended: it is asked whether the probe has touched */
    LINK_TOUCHED,   /* it has: LinuxCNC's own motion comes to an end */
};

struct link {
    struct pins *pins;
    struct link_options options;
    struct peer peer;
    struct encoder encoder;
    bool has_encoder;
    struct at_speed at_speed;
    struct wire_io_control said;
    double said_s;
    struct reference reference; /* stays, as `stream` does, from one connection to the next */
    uint32_t stream;            /* the newest, whose queue may still be there; 0: none */
    double trust_s;             /* when it was asked last whether its position is trusted */
    bool trust_is_dated;        /* only answers later than ... */
    uint32_t trust_us;          /* ... this time of its clock count */
    bool was_locked;            /* by the report before */
    bool was_stopped;           /* an ack has said that motion has ended by that, at ... */
    double stopped_s;           /* ... this time; the report that says why is to come */
    uint8_t state;              /* the controller's, the newest of reports and acks ... */
    uint32_t state_us;          /* ... which is of this time of its clock */
    bool is_held;               /* ... and that is a hold */
    double held_s;              /* since then */
    bool is_late;               /* more waits than should */
    bool resets;                /* the operator has asked for a reset ... */
    double resets_s;            /* ... then */
    double reset_done_s;        /* when reset-done rose */
    uint32_t samples_lost;

    bool was_enabled;              /* when the pins were last looked at */
    bool is_asked;                 /* switched on, and there is no motion yet ... */
    double asked_s;                /* ... since then */
    int32_t off_steps[PIN_JOINTS]; /* where the machine was when LinuxCNC was last off, and followed it */

    enum link_phase phase;
    enum link_phase opens_for; /* LINK_OFF, LINK_HOMED or LINK_TOUCHED: the one before LINK_OPENING */
    bool is_open;
    struct sender sender;
    double queued_s;        /* motion that waits in the controller */
    uint32_t reported_done; /* sender.done when the newest report came */
    unsigned stream_asks;   /* requests for a stream and for its end that are not answered */
    bool is_stale;          /* the newest report is older than what is known of a stream ... */
    uint32_t stale_us;      /* ... which is of this time of the controller's clock */
    struct slicer slicer;
    struct clearance clearance;
    struct sample sample;         /* the newest */
    double sampled_s;             /* servo time up to which there are segments */
    double settled_s;             /* servo time from which on the servo thread has seen our pins ... */
    bool settles;                 /* ... which is known at the next tick */
    double moved_s;               /* when the newest sample came */
    bool has_samples;             /* the servo thread has run */
    double commanded_s;           /* when LinuxCNC last commanded motion */
    uint32_t moving_end;          /* end of the segments with steps */
    bool is_unlocking;            /* every joint is homed: the controller is asked to unlock */
    double locked_at[PIN_JOINTS]; /* commanded, in LINK_LOCKED */
    bool begins;                  /* there is no segment yet */
    bool probe_begins;            /* a G38 has begun since the newest segment */
    bool no_cut;                  /* a sample since the newest segment is of no G1, G2 or G3 */
    bool probes, was_probing;     /* in a sample since the newest segment; in the segment before */
    bool watches;                 /* a contact is to come, and exactly */
    uint32_t watched;             /* end of the segments that watch for it */
    uint8_t homes;                /* mask of joints */
    bool is_homing_seen;
    double homing_s;    /* when it was asked for */
    uint32_t homing_us; /* of the report that shows its end */
    uint16_t results;   /* probe results of the controller so far */
    int32_t contact_steps[PIN_JOINTS];
    bool is_deep;            /* `into` and `deepest` are set */
    double into[PIN_JOINTS]; /* way of LinuxCNC's command behind the contact; its length is 1 */
    double deepest;
};

/** A TCP connection is there: ask the controller who it is. All else is forgotten, but for the pins. What
 * comes is given to link->peer. */
void link_begin(struct link *link, struct pins *pins, const struct peer_world *world,
                const struct link_options *options, double now_s);
/** What the servo thread has seen in one period; each of them, oldest first. */
void link_sample(struct link *link, const struct sample *sample, double now_s);
/** How many periods the sampler could not keep since it was loaded. */
void link_note_lost_samples(struct link *link, uint32_t lost);
/** Every LINK_TICK_S. @return why the controller is gone, NULL: it is not */
const char *link_tick(struct link *link, double now_s);
/** The spindle's pins; may be called more often than link_tick. */
void link_follow_spindle(struct link *link, double now_s);
/** The controller is gone: pins say so. */
void link_lose(struct pins *pins);

/* ---- between link.c and motion.c ---- */

/** Motion has ended by itself: the operator resets and switches on again.
 *  @param message  the pin that shows it. printf's format for the terminal */
__attribute__((format(printf, 3, 4))) void link_fault(struct link *link, pin_BIT message, const char *format,
                                                      ...);
/** What the controller does, at this time of its clock. */
void link_note_state(struct link *link, uint8_t state, uint32_t at_us);
/** A report is newer than what is known of a stream, or the other way round. */
void link_date_report(struct link *link);
/** Nothing moves or waits, by a report that is newer than anything of a stream. */
bool link_stands(const struct link *link);
/** The feedback is held while the controller moves by itself. */
bool link_is_holding_feedback(const struct link *link);
/** No more of this stream; the controller slows down, and discards what is queued. */
void motion_drop(struct link *link, uint32_t stream);
/** Motion has ended, and not by us. */
void motion_fault_ended(struct link *link);
/** The machine must be where it was sent, when it has come to rest. */
void motion_check_position(struct link *link);
/** While it is switched off, the machine is where the newest report says. */
void motion_note_off(struct link *link);
/** What motion does in a tick. */
void motion_tick(struct link *link);
/** Answers that motion has asked for. */
void motion_answer(struct link *link, const struct control_answer *answer);
void motion_ack(struct link *link, const struct wire_stream_ack *ack, uint32_t at_us);
/** What the controller trusts is known as of this time of its clock. */
void motion_take_trust(struct link *link, uint32_t at_us);

#endif
