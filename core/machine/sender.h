/* SPDX-License-Identifier: MIT
 * The sender in control is gone. No one sees what moves, turns or burns, so a jog ends, a program is held
 * and its spindle and coolant stop, until someone else comes and resumes or resets. [task] */
#ifndef WIFICNC_MACHINE_SENDER_H
#define WIFICNC_MACHINE_SENDER_H

#include "machine/machine.h"
#include "machine/timer.h"

/** The sender that commands the text side; machine/sender.c. */
enum machine_sender {
    SENDER_THERE, /* as far as anyone can know */
    SENDER_LOST,
    SENDER_LOST_WITH_LINES, /* and lines of it have not come here yet */
    SENDER_HELD,            /* its program waits for `~`, with spindle and coolant off */
};

/** What happens to the job of a sender or a remote host that is lost: $74. */
enum lost_job { LOST_JOB_FINISHES, LOST_JOB_IS_HELD, LOST_JOB_STOPS };

/** The sender that commands the text side, and a remote host that is lost. */
struct machine_client {
    enum machine_sender sender;
    bool homing_lost;   /* homing was stopped because its sender was lost; not said yet */
    bool host_held;     /* motion of a remote host that is lost waits for `~` */
    bool motion_lost;   /* of a remote host, and that is reported */
    bool host_hold;     /* the hold is that of such a host, and no one else has asked for one */
    bool outputs_waits; /* spindle and coolant are on until outputs_time is over */
    struct machine_timer outputs_time;
};

/** Someone commands the text side: it was reset, or continues. */
static inline void sender_is_there(struct machine_client *client) {
    client->sender = SENDER_THERE;
    client->host_held = client->host_hold = client->motion_lost = client->outputs_waits = false;
}

/** A hold is not only that of a lost host any more: someone else has asked for it. */
static inline void sender_share_hold(struct machine_client *client) {
    client->host_hold = false;
}

/** @return whether homing was stopped because its sender was lost, and that was not said yet */
static inline bool sender_take_homing_lost(struct machine_client *client) {
    const bool lost = client->homing_lost;
    client->homing_lost = false;
    return lost;
}

/** Of the text side: one is under way, or not read yet. */
bool sender_has_lines(const struct machine *machine);

/** @return true when it came further */
bool sender_lost_poll(struct machine *machine);

/** A remote host is lost: its jog and homing end, and its queued motion continues, is held or is reset, as
 * $74 says. */
void sender_lose_host(struct machine *machine, bool left);

/** A part of a remote host's motion has not come, or was refused: it is held, so that no one cuts on without
 * it. What the text side does is not. */
void sender_lose_motion(struct machine *machine);

/** End the hold of a remote host that was lost, when it keeps nothing back any more: a host is there again.
 */
void sender_end_host_hold(struct machine *machine);

/** No one sees the axes move any more: alarm 6, and a message after the banner. */
void sender_stop_homing(struct machine *machine);

/** The text for a client that connects, without [MSG: ]; NULL: the sender is not lost. */
const char *sender_notice(const struct machine *machine);

#endif
