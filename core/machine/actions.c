/* SPDX-License-Identifier: MIT
 * When an action is allowed: one rule for each, the same for the text side and a network host. */
#include "machine/actions.h"

#include "machine/axes.h"
#include "machine/configure.h"
#include "machine/drive.h"
#include "machine/faults.h"
#include "machine/homing.h"
#include "machine/inputs.h"
#include "machine/motor_current.h"
#include "machine/outputs.h"
#include "machine/owner.h"
#include "machine/parts.h"
#include "machine/preempt.h"
#include "machine/report.h"
#include "machine/reset.h"
#include "machine/state.h"
#include "machine/stored.h"
#include "machine/stored_write.h"

/* What an action needs besides its states, in the order in which it is looked at; as in Grbl. */
enum {
    EVER = 1,     /* also in an alarm that only a reset ends */
    MOTION = 2,   /* motion becomes its actor's */
    REST = 4,     /* nothing of anyone is under way */
    STORE = 8,    /* stored data that is whole: with other settings the machine would move wrongly */
    HOMING = 16,  /* $22 */
    DOOR = 32,    /* a closed one */
    PARKED = 64,  /* also while the hold is the operator's: machine/park.h */
    MOTORS = 128, /* whose drivers have no fault */
};

#define IN(state) (1u << MACHINE_##state)
enum { ANY_STATE = (1u << MACHINE_STATE_COUNT) - 1, LOCKED_OR_IDLE = IN(IDLE) | IN(ALARM) };

struct rule {
    uint16_t states;
    uint8_t needs;
};

static const struct rule rules[ACTION_COUNT] = {
    [ACTION_ASK] = {ANY_STATE, EVER},
    [ACTION_MODE] = {ANY_STATE, 0},
    [ACTION_LIST_SETTINGS] = {ANY_STATE & ~(IN(RUN) | IN(HOLD)), EVER | PARKED},
    [ACTION_LIST_STORED] = {LOCKED_OR_IDLE, EVER | REST | PARKED},
    [ACTION_COMMAND] = {LOCKED_OR_IDLE, REST},
    [ACTION_CHECK] = {IN(IDLE), REST},
    [ACTION_UNLOCK] = {ANY_STATE, STORE | DOOR | MOTORS},
    [ACTION_STORE] = {LOCKED_OR_IDLE, REST | STORE},
    [ACTION_STARTUP_LINE] = {IN(IDLE), REST},
    [ACTION_HOME] = {LOCKED_OR_IDLE, MOTION | REST | STORE | HOMING | DOOR | MOTORS},
    [ACTION_JOG] = {IN(IDLE) | IN(JOG), MOTION | REST | PARKED},
    [ACTION_TOOL_PROBE] = {0, PARKED},
    [ACTION_TOOL_REFERENCE] = {LOCKED_OR_IDLE, REST | PARKED},
    [ACTION_SEGMENTS] = {ANY_STATE & ~IN(ALARM), MOTION},
    [ACTION_OUTPUTS_ON] = {IN(IDLE), REST},
    [ACTION_COOLANT_KEY] = {IN(IDLE) | IN(RUN) | IN(HOLD), 0},
    [ACTION_SPINDLE_KEY] = {IN(HOLD), 0},
};

static enum refusal refuse_state(const struct machine *machine) {
    switch (machine->life.state) {
    case MACHINE_ALARM:
        return REFUSAL_ALARM;
    case MACHINE_SLEEP:
        return REFUSAL_SLEEP;
    default:
        return REFUSAL_BUSY;
    }
}

/* In Jog all that is queued are jogs, and one more may follow. */
static bool rests(const struct machine *machine, enum actor actor) {
    if (actor == ACTOR_HOST)
        return owner_is_free(machine);
    return machine->life.state == MACHINE_JOG || machine_is_at_rest(machine);
}

enum refusal action_may(const struct machine *machine, enum action action, enum actor actor) {
    const struct rule *rule = &rules[action];
    const bool parked = machine->park.open && machine->life.state == MACHINE_HOLD && actor == ACTOR_TEXT &&
                        (rule->needs & PARKED) != 0;
    const bool state_fits = parked || (rule->states >> machine->life.state & 1u) != 0;
    const bool locked = machine->life.state == MACHINE_ALARM;
    if ((rule->needs & EVER) == 0 && (machine->life.critical || machine->life.restart))
        return REFUSAL_CRITICAL;
    /* In an alarm owner_may_be_host() refuses all motion of a host; homing, whose states include the
     * alarm, is the exception. */
    if ((rule->needs & MOTION) != 0 && actor == ACTOR_HOST && !(locked && state_fits)) {
        const enum refusal refusal = owner_may_be_host(machine);
        if (refusal != REFUSAL_NONE)
            return refusal;
    }
    if (!state_fits)
        return refuse_state(machine);
    if ((rule->needs & REST) != 0 && !parked && !rests(machine, actor))
        return REFUSAL_BUSY;
    if ((rule->needs & STORE) != 0 && stored_is_damaged(machine))
        return REFUSAL_DAMAGED;
    if ((rule->needs & HOMING) != 0 && !machine->settings.homing)
        return REFUSAL_NO_HOMING;
    if ((rule->needs & DOOR) != 0 && inputs_door_is_open(machine))
        return REFUSAL_DOOR;
    if ((rule->needs & MOTORS) != 0 && faults_any(machine))
        return REFUSAL_FAULT;
    return REFUSAL_NONE;
}

static const uint8_t statuses[REFUSAL_COUNT] = {
#define REFUSAL(name, error, packet) [REFUSAL_##name] = STATUS_##error,
#include "machine/refusals.def"
#undef REFUSAL
};

enum status refusal_status(enum refusal refusal) {
    return (enum status)statuses[refusal];
}

/* From the text side's errors back to the reason, for what only returns a status (settings). What has no
 * row is a value that was refused. */
enum refusal refusal_of(enum status status) {
    unsigned refusal = 0;
    while (refusal < REFUSAL_COUNT && statuses[refusal] != (uint8_t)status)
        refusal++;
    return refusal < REFUSAL_COUNT ? (enum refusal)refusal : REFUSAL_VALUE;
}

/* ---- motion ---- */

enum refusal action_home(struct machine *machine, enum actor actor, axis_mask_t axes) {
    enum refusal refusal = action_may(machine, ACTION_HOME, actor);
    if (refusal != REFUSAL_NONE)
        return refusal;
    if (actor == ACTOR_HOST) {
        axes &= axes_with_ends(machine);
        if (axes == 0)
            return REFUSAL_NO_HOMING;
        drive_drop(machine); /* the planner continues from where the host is */
    }
    refusal = homing_begin(machine, axes);
    if (refusal != REFUSAL_NONE || actor == ACTOR_TEXT)
        return refusal;
    owner_take_over(machine);
    host_home(&machine->host);
    return REFUSAL_NONE;
}

enum refusal action_unlock(struct machine *machine) {
    if (machine->life.state != MACHINE_ALARM)
        return REFUSAL_NONE;
    const enum refusal refusal = action_may(machine, ACTION_UNLOCK, ACTOR_TEXT);
    if (refusal != REFUSAL_NONE)
        return refusal;
    report_message(machine, "Caution: Unlocked");
    report_not_homed(machine);
    state_go(machine, EVENT_UNLOCK);
    return REFUSAL_NONE;
}

enum refusal action_end_lock(struct machine *machine) {
    struct hal_inputs inputs;
    const bool sleeps = machine->life.state == MACHINE_SLEEP; /* motors without current may have moved */
    /* The pin as it is now: machine->inputs may be as old as the last poll. */
    hal_inputs_read(machine->hal, &inputs);
    if (machine->life.state == MACHINE_ALARM && reset_is_barred(machine, &inputs))
        return REFUSAL_CRITICAL;
    if (faults_any(machine))
        return REFUSAL_FAULT;
    if (stored_is_damaged(machine))
        return REFUSAL_DAMAGED;
    if (!machine->life.critical && machine->life.state != MACHINE_ALARM && !sleeps)
        return REFUSAL_BUSY;
    /* Before reset_machine(), which clears it. */
    const bool stays_locked = machine->life.locks_again || sleeps;
    reset_machine(machine, ALARM_NONE);
    timer_end_quiet(&machine->clock);
    if (!stays_locked)
        (void)state_go(machine, EVENT_UNLOCK);
    return REFUSAL_NONE;
}

/* Not a request that the next poll takes, but now. An alarm that only a reset ends has stopped everything
 * already. */
void action_estop(struct machine *machine) {
    if (!machine->life.critical)
        reset_alarm(machine, ALARM_ESTOP);
}

/* The same request as `!`: it also removes a `~` that came before, and drops jogs that wait to be read. */
void action_hold(struct machine *machine) {
    machine_stopped_by_other(machine);
    rx_request(&machine->lines.rx, REALTIME_HOLD);
}

enum refusal action_resume(struct machine *machine) {
    if (machine->life.state != MACHINE_HOLD)
        return REFUSAL_BUSY;
    rx_request(&machine->lines.rx, REALTIME_RESUME);
    return REFUSAL_NONE;
}

/* ---- settings ---- */

/* A contact of the other kind than $749 has counts as pressed, and no reset would lead on. */
bool action_frees_estop(const struct machine *machine, int32_t number) {
    return number == SETTING_ESTOP_NORMALLY_OPEN && machine->life.alarm == ALARM_ESTOP &&
           machine->inputs.estop;
}

enum status action_set(struct machine *machine, enum actor actor, uint16_t number, double value) {
    const enum refusal refusal =
        action_frees_estop(machine, number) ? REFUSAL_NONE : action_may(machine, ACTION_STORE, actor);
    return refusal == REFUSAL_NONE ? configure_set(machine, number, value) : refusal_status(refusal);
}

bool action_save(struct machine *machine) {
    return stored_save(machine, STORED_BIT(STORED_SETTINGS));
}

/* ---- outputs ---- */

static void set_coolant(struct machine *machine, uint8_t coolant) {
    if (machine->outputs.coolant == coolant)
        return;
    outputs_ask_coolant(&machine->outputs, coolant);
    outputs_apply(machine);
    report_changed_override(machine);
}

/* With motion of its own a host also switches in the middle of it. */
static enum refusal refuse_start(const struct machine *machine) {
    const enum refusal refusal = action_may(machine, ACTION_OUTPUTS_ON, ACTOR_HOST);
    if (refusal != REFUSAL_BUSY)
        return refusal;
    return machine->host.owns ? REFUSAL_NONE : REFUSAL_TEXT;
}

enum refusal action_outputs(struct machine *machine, const struct outputs_wish *to) {
    const struct gcode_ports *ports = &machine->interp.gcode.ports;
    const uint8_t on = to->coolant & to->coolant_mask;
    uint8_t coolant = (uint8_t)((machine->outputs.coolant & ~to->coolant_mask) | on);
    coolant &= (uint8_t)~ports->no_coolant; /* the status shows what is on */
    /* $91 lets M7 and M8 of a program pass, with a message to its sender: a host sees no messages. */
    if ((to->turns && !gcode_can_turn(ports, to->spindle)) || (on & ports->no_coolant) != 0)
        return REFUSAL_NO_OUTPUT;
    if ((to->turns && to->spindle != SPINDLE_OFF) || on != 0) {
        const enum refusal refusal = refuse_start(machine);
        if (refusal != REFUSAL_NONE)
            return refusal;
    }
    /* The program's modes follow, so that $G and the next line of G-code agree with the pins. */
    interp_know_wish(machine, to, coolant);
    preempt_know_off(&machine->host, to);
    if (to->turns)
        outputs_set(machine, to->spindle, to->rpm, coolant);
    else
        set_coolant(machine, coolant);
    motor_current_set_digital(machine, (machine->ports.digital & ~to->digital_mask) |
                                           (to->digital & to->digital_mask));
    return REFUSAL_NONE;
}
