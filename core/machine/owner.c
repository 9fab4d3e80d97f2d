/* SPDX-License-Identifier: MIT
 * Whose motion is: the text side's, or a network host's. */
#include "machine/owner.h"

#include "machine/notes.h"
#include "machine/parts.h"
#include "machine/report.h"

/* Only an unlock, homing or a reset leads on. */
static bool is_locked(const struct machine *machine) {
    return machine->life.critical || machine->life.restart || machine->life.state == MACHINE_ALARM ||
           machine->life.state == MACHINE_SLEEP;
}

/* A pendant in control (MPG) keeps hosts out as it does the text side's other clients. */
bool owner_is_free(const struct machine *machine) {
    return machine->reports.mpg != MPG_IN_CONTROL && machine->task.stage == TASK_NONE &&
           !machine->park.open && host_queue_is_empty(&machine->host.queue) &&
           motion_is_planned_out(&machine->drive.motion) &&
           (machine->life.state == MACHINE_IDLE || machine->life.state == MACHINE_ALARM ||
            (machine->life.state == MACHINE_HOLD && machine_is_at_rest(machine)));
}

bool owner_host_is_busy(const struct machine *machine) {
    const struct machine_host *host = &machine->host;
    return machine->life.state == MACHINE_HOME || machine->suspend.cancels || host->jog.on ||
           host->jog.waits || host->discards;
}

static enum refusal refuse_lock(const struct machine *machine) {
    if (machine->life.critical || machine->life.restart)
        return REFUSAL_CRITICAL;
    return machine->life.state == MACHINE_SLEEP ? REFUSAL_SLEEP : REFUSAL_ALARM;
}

enum refusal owner_may_be_host(const struct machine *machine) {
    if (is_locked(machine))
        return refuse_lock(machine);
    if (owner_host_is_busy(machine))
        return REFUSAL_BUSY;
    if (machine->host.owns)
        return REFUSAL_NONE;
    if (machine->client.sender == SENDER_HELD &&
        machine->life.state == MACHINE_HOLD) /* the next client must see it */
        return REFUSAL_TEXT;
    if (machine->life.state == MACHINE_DOOR)
        return REFUSAL_BUSY;
    return owner_is_free(machine) ? REFUSAL_NONE : REFUSAL_TEXT;
}

void owner_take_over(struct machine *machine) {
    if (machine->host.owns)
        return;
    host_own(&machine->host);
    notes_forget(&machine->notes);
    report_message(machine, "Remote host controls motion");
}
