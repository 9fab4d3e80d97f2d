/* SPDX-License-Identifier: MIT
 * The sender in control is gone. No one sees what moves, turns or burns, so a jog ends, a program is held
 * and its spindle and coolant stop, until someone else comes and resumes or resets. [task] */
#ifndef WIFICNC_MACHINE_SENDER_H
#define WIFICNC_MACHINE_SENDER_H

#include "machine/machine.h"

/** The sender that commands the text side; machine/sender.c. */
enum machine_sender {
    SENDER_THERE, /* as far as anyone can know */
    SENDER_LOST,
    SENDER_LOST_WITH_LINES, /* and lines of it have not come here yet */
    SENDER_HELD,            /* its program waits for `~`, with spindle and coolant off */
};

/** The sender that commands the text side. */
struct machine_client {
    enum machine_sender sender;
    bool homing_lost; /* homing was stopped because its sender was lost; not said yet */
};

/** Someone commands the text side: it was reset, or continues. */
static inline void sender_is_there(struct machine_client *client) {
    client->sender = SENDER_THERE;
}

/** @return whether homing was stopped because its sender was lost, and that was not said yet */
static inline bool sender_take_homing_lost(struct machine_client *client) {
    const bool lost = client->homing_lost;
    client->homing_lost = false;
    return lost;
}

/** @return true when it came further */
bool sender_lost_poll(struct machine *machine);

/** No one sees the axes move any more: alarm 6, and a message after the banner. */
void sender_stop_homing(struct machine *machine);

/** The text for a client that connects, without [MSG: ]; NULL: the sender is not lost. */
const char *sender_notice(const struct machine *machine);

#endif
