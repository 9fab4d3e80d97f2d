/* SPDX-License-Identifier: MIT
 * The machine as a network host moves it: timed segments, jogs, homing, outputs. [task]
 *
 * While a host owns motion, lines of the text side wait; real-time bytes, switches and buttons act as ever. A
 * host gets motion when nothing else moves; or its segments lie ready until the job of the text side has
 * slowed down along its path, and that waits (machine/preempt.c). It releases motion by
 * machine_host_release(). Who may be that host is the session's business (session/session.h). Everything here
 * answers immediately; what is refused changes nothing. */
#ifndef WIFICNC_MACHINE_HOST_H
#define WIFICNC_MACHINE_HOST_H

#include "gcode/gcode.h"
#include "hal/hal.h"
#include "machine/actions.h"
#include "motion/hosted.h"
#include "segment/host_queue.h"

/** A jog of a network host: it continues until it is stopped, so its end is kept ahead of it. */
struct host_jog {
    bool on, waits; /* waits: for the one before to rest */
    uint8_t axis;
    int8_t direction;
    float speed_mm_s;
    double target_mm; /* planned so far */
};

/** A job of the text side that a network host or the operator (machine/park.h) has interrupted; preempt.c. */
enum host_job {
    HOST_JOB_NONE,
    HOST_JOB_BRAKES, /* it slows down along its path; the host's segments lie ready */
    HOST_JOB_WAITS,  /* it is at rest with its plan kept, until the host has let go and ~ comes; or parked */
    HOST_JOB_LIFTS,  /* the axes go to above where it was left */
    HOST_JOB_RESTORES, /* spindle and outputs are again as the job had them */
    HOST_JOB_LOWERS,   /* Z goes to where it was left */
};
struct host_suspended {
    enum host_job step;
    bool hold_asked; /* ! came while it slowed down: the host's motion begins held */
    bool by_release; /* the hold is that of the host's letting go, no one else has asked for it */
    int32_t left_steps[AXIS_COUNT];
    int32_t top_steps;                         /* Z is at least so high before the other axes return */
    enum gcode_spindle spindle, modal_spindle; /* as they were put out, and as the program had set them */
    float rpm, modal_rpm;
    uint8_t coolant, modal_coolant, digital;
};

/** Motion of a network host; machine/host.h. */
struct machine_host {
    struct host_queue queue;
    struct hosted hosted; /* what is made of it */
    struct host_suspended job;
    bool owns;                     /* motion is a host's: lines of the text side wait */
    bool jog_stopped;              /* its jog was ended by a stop that is not its own */
    bool end_known;                /* end_steps is right */
    int64_t end_steps[AXIS_COUNT]; /* where the segments taken so far end */
    uint32_t own;                  /* segments ever taken that no host has sent (host_move_self()); wraps */
    uint32_t dropped;              /* times that queued motion was given up: e-stop, reset, contact; wraps */
    uint32_t done_at_drop;         /* segments executed to their end before that */
    uint32_t late_refusals;        /* segments that waited for a job to stop and then left the travel */
    uint32_t late_refused;         /* number of the first of them, as machine_host_taken() counts */
    struct host_jog jog;
    bool homing, homed_ok;       /* it homes; the last time went well */
    bool discards;               /* its motion slows down; then what is queued is discarded */
    bool probing, probe_contact; /* segments with SEGMENT_PROBE are queued; how the last of them ended */
    uint32_t probes_done;        /* wraps */
    int32_t probe_steps[AXIS_COUNT];
};

/** Lay a segment `ahead` places after the newest one that follows without a gap (segment/host_queue.h).
 *  @param[out] number  of the segment that was refused, counted as machine_host_taken() */
enum refusal machine_host_lay(struct machine *machine, uint32_t ahead,
                              const struct host_queue_segment *segment, uint32_t *number);

/** Segments ever taken without a gap; wraps. */
uint32_t machine_host_taken(const struct machine *machine);

/** Segments ever executed to their end; wraps. Dropped ones count, too: machine->host.dropped says that there
 * were some, and done_at_drop what this was just before. */
uint32_t machine_host_done(const struct machine *machine);

/** Slow down along the path, stop, and discard what is queued. Segments are refused until then. A feed hold
 * stays. */
void machine_host_discard(struct machine *machine);

/** The host's own number of the segment that runs, or is about to. 0: none does */
uint16_t machine_host_id(const struct machine *machine);

/** Forget what was laid beyond a gap. */
void machine_host_forget_ahead(struct machine *machine);

/** Move an axis until machine_host_jog_stop(). @param direction  1 or -1 @param speed_steps_s  > 0; at most
 * the axis' top speed is used */
enum refusal machine_host_jog(struct machine *machine, unsigned axis, int direction, uint32_t speed_steps_s);
/** End a jog of the host, if there is one. */
void machine_host_jog_stop(struct machine *machine);

/** The host is gone: its jog ends, its homing ends in alarm 6. What is queued still runs. */
void machine_host_gone(struct machine *machine);

/** Segments of a host run or wait. */
bool machine_host_has_segments(const struct machine *machine);

/** A job of the text side is under way, or waits until the host has given motion back. */
bool machine_host_has_job(const struct machine *machine);

/** Release motion to the text side. A job that was interrupted is in a hold then; `~` brings the axes back
 * to where it was left, and on. @return false: something of the host still moves or waits */
bool machine_host_release(struct machine *machine);

/** Inputs as they mean: 1 = hit, touches, pressed. */
struct host_inputs {
    axis_mask_t limits;
    axis_mask_t home; /* what homing looks for: home switches, or of axes without one the limits */
    bool probe, estop;
    uint8_t digital; /* those of M66 that the board has: bit n = Pn, 1 = high */
};
void machine_host_inputs(const struct machine *machine, struct host_inputs *inputs);

/** Digital outputs that the board has and that are on: bit n = Pn. */
uint8_t machine_host_digital(const struct machine *machine);

/** The spindle by its encoder. */
struct host_spindle {
    float rpm;    /* measured, >= 0 */
    double turns; /* whole at the index pulse, or where there is no index line at the place of power-on */
};
/** @return false: there is no encoder, and nothing is written */
bool machine_host_spindle(const struct machine *machine, struct host_spindle *spindle);

/** Motion is its own from now on. */
static inline void host_own(struct machine_host *host) {
    host->owns = true;
}

/** A hold or jog cancel of the text side, or the hold button, ends its jog: what waits for that is held then.
 */
static inline void host_stop_jog(struct machine_host *host) {
    host->jog_stopped = host->owns;
}

/** Homing that it has asked for has begun. */
static inline void host_home(struct machine_host *host) {
    host->homing = true;
    host->homed_ok = host->end_known = false;
}

/** Motion of a network host continues. @return true when anything was done */
bool host_poll(struct machine *machine);

/** How far motion of hosts is. */
const struct machine_host *machine_host(const struct machine *machine);

#endif
