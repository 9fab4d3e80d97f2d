/* SPDX-License-Identifier: MIT
 * For a client that connects later: why the machine is locked, held or commanded by someone else.
 * The messages of that moment are gone, and a status report has the state without its cause. */
#include "machine/notice.h"

#include "machine/faults.h"
#include "machine/inputs.h"
#include "machine/park.h"
#include "machine/parts.h"
#include "machine/report.h"
#include "machine/reset.h"
#include "machine/restart.h"
#include "machine/sender.h"
#include "machine/stored.h"

#include <string.h>

typedef bool source_fn(const struct machine *machine, const struct text_out *out);

static bool put_damage(const struct machine *machine, const struct text_out *out) {
    stored_describe(machine, out);
    return stored_is_damaged(machine);
}

static bool put_restart(const struct machine *machine, const struct text_out *out) {
    if (!machine->life.restarted)
        return false;
    text_string(out, "Restarted by ");
    restart_describe(machine, out);
    return true;
}

/* The message of that moment, within a sentence. */
static void put_way_out(const struct machine *machine, const struct text_out *out) {
    const char *text = machine->life.critical ? reset_way_out(machine) : "'$H'|'$X' to unlock";
    const char first[] = {(char)(text[0] >= 'A' && text[0] <= 'Z' ? text[0] | 0x20 : text[0]), '\0'};
    text_string(out, first);
    text_string(out, text + 1);
}

static bool put_lock(const struct machine *machine, const struct text_out *out) {
    if (machine->life.state != MACHINE_ALARM || stored_is_damaged(machine))
        return false;
    if (machine->life.alarm != ALARM_NONE) {
        text_string(out, "Locked by ALARM:");
        text_int(out, (int32_t)machine->life.alarm);
    } else if (machine->settings.hard_limits && inputs_limits(machine) != 0) {
        text_string(out, "Locked, check limits");
    } else if (faults_any(machine)) {
        text_string(out, "Locked, check motor drivers");
    } else {
        text_string(out, "Locked since start or reset");
    }
    text_string(out, ": ");
    put_way_out(machine, out);
    return true;
}

static bool put_sender(const struct machine *machine, const struct text_out *out) {
    const char *text = sender_notice(machine);
    text_string(out, text != NULL ? text : "");
    return text != NULL;
}

static bool put_pause(const struct machine *machine, const struct text_out *out) {
    const struct machine_task *task = park_job_task(machine);
    if (task->stage == TASK_TOOL_WAIT) {
        text_string(out, "Tool change: T");
        text_int(out, task->command.next.tool);
    } else if (task->stage == TASK_PAUSED) {
        text_string(out, "Program pause");
    }
    return task->stage == TASK_TOOL_WAIT || task->stage == TASK_PAUSED;
}

static bool put_host(const struct machine *machine, const struct text_out *out) {
    if (machine->host.owns)
        text_string(out, "Remote host controls motion");
    else if (machine->park.open)
        text_string(out, "Parked: ~ returns to the job");
    else if (machine->host.job.step == HOST_JOB_WAITS)
        text_string(out, "Remote host released motion: ~ resumes the job");
    return machine->host.owns || machine->host.job.step == HOST_JOB_WAITS;
}

/* In the order in which they are shown: what locks the machine before what only waits. */
static source_fn *const sources[] = {put_damage, put_restart, put_lock, put_sender, put_pause, put_host};
enum { SOURCE_COUNT = sizeof sources / sizeof sources[0] };

/* A text of limited size. */
struct notice {
    char *text;
    size_t size, count;
};

static void add_to_notice(void *ctx, const char *bytes, size_t count) {
    struct notice *notice = ctx;
    size_t room = notice->size - 1 - notice->count;
    count = count < room ? count : room;
    memcpy(notice->text + notice->count, bytes, count);
    notice->count += count;
    notice->text[notice->count] = '\0';
}

bool machine_notice(const struct machine *machine, unsigned number, char *text, size_t size) {
    struct notice notice = {.text = text, .size = size};
    const struct text_out out = {.write = add_to_notice, .ctx = &notice};
    text[0] = '\0';
    for (unsigned i = 0; i < SOURCE_COUNT; i++) {
        if (sources[i](machine, &out) && number-- == 0)
            return true;
        notice.count = 0;
        text[0] = '\0';
    }
    return false;
}

void notice_report(struct machine *machine) {
    char text[NOTICE_SIZE];
    for (unsigned number = 0; machine_notice(machine, number, text, sizeof text); number++)
        report_message(machine, text);
}
