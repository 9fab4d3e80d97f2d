/* SPDX-License-Identifier: MIT
 * Hold and safety door, and resuming from them: spindle, coolant, motion. [task] */
#ifndef WIFICNC_MACHINE_SUSPEND_H
#define WIFICNC_MACHINE_SUSPEND_H

#include "machine/machine.h"

/** Before the tools stop ($42): Z has not gone up, goes, or need not any more. */
enum suspend_tool { SUSPEND_WORKS, SUSPEND_RETRACTS, SUSPEND_PARKED };

/** Hold, door and a jog that is cancelled. */
struct machine_suspend {
    bool restores;          /* the door was closed, spindle and coolant start again */
    bool cancels;           /* a jog is being cancelled */
    bool hold_waits;        /* ! while M53 P0 is in force */
    uint8_t stops;          /* behind which a `~` that waits counts no more; wraps */
    enum suspend_tool tool; /* behind the door, in a hold */
};

/** A `~` from before counts no more. */
static inline void suspend_count_stop(struct machine_suspend *suspend) {
    suspend->stops++;
}

/** No hold, no way back, no jog to cancel. */
static inline void suspend_forget(struct machine_suspend *suspend) {
    *suspend = (struct machine_suspend){0};
}

/** A jog slows down and is forgotten, or that is over. */
static inline void suspend_cancel(struct machine_suspend *suspend, bool cancels) {
    suspend->cancels = cancels;
}

/** Spindle and coolant stop again, and `~` is asked for again. */
static inline void suspend_stop_restoring(struct machine_suspend *suspend) {
    suspend->restores = false;
}

/** @return whether a hold has waited; it does not any more */
static inline bool suspend_take_hold(struct machine_suspend *suspend) {
    const bool waits = suspend->hold_waits;
    suspend->hold_waits = false;
    return waits;
}

/** Z goes up before the tools stop ($42). */
bool suspend_retracts(const struct machine *machine);

/** Hold, door and jog cancel on their way. */
bool suspend_poll(struct machine *machine);

/** The safety door is open: slow down, then switch off. */
void suspend_open_door(struct machine *machine);

/** A hold that waits comes now, unless it must wait on. */
void suspend_release(struct machine *machine);

/** M48 .. M53: OVERRIDE_ bits in force from now on; a hold that waited for M53 comes now. */
void suspend_enable(struct machine *machine, uint8_t overrides);

/** As `!`. */
void suspend_hold(struct machine *machine);

/** As `!`, also while M53 P0 is in force; only a thread that is being cut is finished first. */
void suspend_force_hold(struct machine *machine);

/** `~` or the start button. */
void suspend_end(struct machine *machine);

#endif
