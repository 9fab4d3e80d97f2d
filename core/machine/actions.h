/* SPDX-License-Identifier: MIT
 * What someone may have the machine do, from whichever side: a line of text, a network host, a button. Each
 * action has one rule (actions.c) and one set of reasons to refuse it (refusals.def). What is refused changes
 * nothing. Hold, reset and the door are never refused: they are real-time requests (input/rx.h) of
 * every side. [task] */
#ifndef WIFICNC_MACHINE_ACTIONS_H
#define WIFICNC_MACHINE_ACTIONS_H

#include "gcode/gcode.h"
#include "gcode/status.h"
#include "machine/machine.h"

/** Who asks. */
enum actor { ACTOR_TEXT, ACTOR_HOST };

enum action {
    ACTION_ASK,           /* $ $G */
    ACTION_MODE,          /* $C $X */
    ACTION_LIST_SETTINGS, /* $$ */
    ACTION_LIST_STORED,   /* $# $I $N */
    ACTION_COMMAND,       /* any other $ line */
    ACTION_CHECK,         /* $C */
    ACTION_UNLOCK,        /* $X */
    ACTION_STORE,         /* $n=value, $I= */
    ACTION_STARTUP_LINE,  /* $Nx= */
    ACTION_HOME,
    ACTION_JOG,
    ACTION_SEGMENTS,       /* motion that a host has planned */
    ACTION_TOOL_PROBE,     /* $TPW */
    ACTION_TOOL_REFERENCE, /* $TLR */
    ACTION_OUTPUTS_ON,     /* a host switches spindle or coolant on */
    ACTION_COOLANT_KEY,    /* 0xA0, 0xA1 */
    ACTION_SPINDLE_KEY,    /* 0x9E */
    ACTION_COUNT
};

enum refusal {
#define REFUSAL(name, error, packet) REFUSAL_##name,
#include "machine/refusals.def"
#undef REFUSAL
    REFUSAL_COUNT
};

/** Whether this action can be begun now. */
enum refusal action_may(const struct machine *machine, enum action action, enum actor actor);

/** What the text side answers. */
enum status refusal_status(enum refusal refusal);

/** The refusal that says the same as this answer. */
enum refusal refusal_of(enum status status);

/** Home these axes; those without an end are left out for a host, and refused for the text side. 0: all that
 * are in a cycle. Of a host machine->host.homed_ok says how it ended. */
enum refusal action_home(struct machine *machine, enum actor actor, axis_mask_t axes);

/** $X. A machine that is not locked stays as it is. */
enum refusal action_unlock(struct machine *machine);

/** A host's way out of alarm, e-stop and sleep; the position is kept. A lock that was there before the e-stop
 * is there again, and sleep ends locked. REFUSAL_BUSY: the machine was not locked. */
enum refusal action_end_lock(struct machine *machine);

/** Stop immediately; only a reset leads on. */
void action_estop(struct machine *machine);

/** `!` */
void action_hold(struct machine *machine);

/** `~` of a host. REFUSAL_BUSY: there is no hold. */
enum refusal action_resume(struct machine *machine);

/** [task] This setting may be set while the e-stop counts as pressed (alarm 50). @param number  of a setting,
 * or no number of one */
bool action_frees_estop(const struct machine *machine, int32_t number);

/** $number=value, not kept before action_save(). @return as settings_set(), or the status of a refusal */
enum status action_set(struct machine *machine, enum actor actor, uint16_t number, double value);

/** Keep all settings over a power cut. @return false: the storage has failed. (The store of a target with the
 * binary protocol is never busy.) */
bool action_save(struct machine *machine);

/** Outputs that a host switches. What is not meant stays as it is. */
struct outputs_wish {
    bool turns; /* spindle and rpm are meant */
    enum gcode_spindle spindle;
    float rpm;
    uint8_t coolant, coolant_mask; /* the bits that are meant */
    uint8_t digital, digital_mask; /* bit n = Pn of M62 .. M65 */
};

/** Spindle and coolant can be switched off at any time. */
enum refusal action_outputs(struct machine *machine, const struct outputs_wish *to);

#endif
