/* SPDX-License-Identifier: MIT
 * The owner's lines in a parked hold (docs/senders.md). The controller reads those between 0xA3 and ~ before
 * the job's, and answers them before those. So they pass what waits here of the job: lines of former owners,
 * and the owner's own from before 0xA3, which are kept until ~. Nothing of the job goes to the controller
 * meanwhile: it would take it for the operator's.
 *
 * One at a time is inside, and only while the controller reads them. A ~ waits for those before it. A ~ from
 * elsewhere (a button, a remote host), a stop or an alarm may leave some unread: these are refused, or they
 * would run within the job. */
#include "net_hub_inner.h"
#include "net_line.h"

#include <string.h>

enum { INSIDE_SHUT = 3 }; /* lines behind a door */

static const char unread[] = "The parked hold has ended: lines that were not read had no effect";

static enum machine_whose whose(const struct net_hub *hub) {
    return hub->ops->whose != NULL ? hub->ops->whose(hub->ctx) : MACHINE_WHOSE_NONE;
}

static bool is_operators(enum machine_whose lines) {
    return lines != MACHINE_WHOSE_NONE && lines != MACHINE_WHOSE_TOOL;
}

bool net_hub_may_follow_left(const struct net_hub *hub, uint8_t of) {
    return (of > 0 && of == hub->inside_of[hub->inside_left - 1]) || whose(hub) != MACHINE_WHOSE_TOOL;
}

static size_t count_lines(const char *lines, size_t count) {
    size_t found = 0;
    for (size_t at = 0; at < count; at++)
        found += lines[at] == '\n';
    return found;
}

size_t net_hub_operators_bytes(const struct net_hub *hub) {
    const struct net_client *owner = hub->owner;
    size_t bytes = 0;
    if (!hub->parked.on || owner == NULL)
        return 0;
    if (!hub->parked.resumes)
        return owner->whole;
    for (size_t lines = 0; lines < hub->parked.before_resume && bytes < owner->whole; bytes++)
        lines += net_queue_head(&owner->in)[bytes] == '\n';
    return bytes;
}

/* They were read, or are no more. */
static void pass_lines(struct net_hub *hub, size_t lines) {
    hub->parked.before_resume -= hub->parked.resumes ? lines : 0;
}

void net_hub_drop_operators(struct net_hub *hub, size_t count) {
    pass_lines(hub, count_lines(net_queue_head(&hub->owner->in), count));
    net_queue_drop(&hub->owner->in, count);
    hub->owner->whole -= count;
}

/* ---- into it ---- */

static void begin(struct net_hub *hub) {
    struct net_client *owner = hub->owner;
    hub->parked.on = true;
    hub->parked.opened = hub->parked.resumes = false;
    if (owner == NULL)
        return;
    hub->parked.job = (struct net_hub_lines){.in = owner->in,
                                             .whole = owner->whole,
                                             .in_long = owner->in_long,
                                             .called_off = owner->called_off,
                                             .skips = owner->skips,
                                             .refuses_rest = owner->refuses_rest};
    owner->in = (struct net_queue){0};
    owner->whole = 0;
    owner->in_long = owner->called_off = owner->skips = owner->refuses_rest = false;
}

/* ---- out of it ---- */

/* A line that the hub answers is answered in its turn whatever the controller does. */
static void answer_unread(struct net_hub *hub, struct net_client *client, const char *lines, size_t count) {
    for (size_t at = 0, size; at < count; at += size) {
        const char *line = lines + at, *end = memchr(line, '\n', count - at);
        size = end == NULL ? count - at : (size_t)(end + 1 - line);
        if (net_line_is_marked(line))
            net_hub_answer_line(hub, client, line + 1, size - 2);
        else if (client->out.count < hub->sizes.out)
            net_hub_refuse(hub, client, STATUS_PARKED, NULL);
        else
            net_hub_lose_line(hub, client);
    }
}

void net_hub_count_operators(struct net_hub *hub) {
    struct net_queue *waits = &hub->parked.unread;
    if (--hub->parked.inside > 0 || waits->count == 0)
        return;
    if (hub->parked.operator != NULL)
        answer_unread(hub, hub->parked.operator, net_queue_head(waits), waits->count);
    net_queue_free(waits);
}

/* Behind the answers to the operator's lines that the controller has. */
static void refuse_unread(struct net_hub *hub, struct net_client *owner, const char *lines, size_t count) {
    if (hub->parked.inside == 0 || hub->parked.operator != owner)
        answer_unread(hub, owner, lines, count);
    else
        owner->gone |= !net_queue_add(&hub->parked.unread, lines, count);
}

static void end_lines(struct net_hub *hub, struct net_client *owner) {
    const size_t bytes = net_hub_operators_bytes(hub);
    if (bytes == 0)
        return;
    net_hub_say_message(hub, owner, unread);
    refuse_unread(hub, owner, net_queue_head(&owner->in), bytes);
    net_hub_drop_operators(hub, bytes);
}

void net_hub_refuse_rest(struct net_hub *hub, struct net_client *owner) {
    refuse_unread(hub, owner, "\n", 1);
}

/* Half a line of the operator is none. Its rest is none either, and is refused at its end, unless what comes
 * is the rest of a line of the job. */
static void drop_half(struct net_hub *hub, struct net_client *owner) {
    const struct net_hub_lines *job = &hub->parked.job;
    if (hub->parked.resumes || owner->in.count == owner->whole)
        return;
    net_queue_cut(&owner->in, owner->whole);
    owner->called_off = false;
    if (job->in.count > job->whole || job->skips)
        return;
    owner->skips = owner->refuses_rest = true;
}

/* The job's lines are first again; what has come behind ~ follows them. */
static void take_back(struct net_hub *hub, struct net_client *owner) {
    struct net_hub_lines *job = &hub->parked.job;
    const size_t kept = job->in.count;
    if (owner->in.count == 0) {
        owner->skips |= job->skips;
        owner->refuses_rest |= job->refuses_rest;
        owner->called_off = job->called_off;
        owner->whole = job->whole;
    } else {
        owner->gone |= !net_queue_add(&job->in, net_queue_head(&owner->in), owner->in.count);
        owner->whole = owner->whole > 0 ? kept + owner->whole : job->whole;
    }
    net_queue_free(&owner->in);
    owner->in = job->in;
    owner->in_long = job->in_long;
    *job = (struct net_hub_lines){0};
}

/* Where 0xA3 was refused there were no lines of the operator: all are the job's. */
static void end(struct net_hub *hub) {
    struct net_client *owner = hub->owner;
    if (owner != NULL && hub->parked.opened) {
        end_lines(hub, owner);
        drop_half(hub, owner);
    }
    if (owner != NULL)
        take_back(hub, owner);
    net_queue_free(&hub->parked.job.in);
    hub->parked.on = hub->parked.resumes = false;
}

static void resume(struct net_hub *hub) {
    static const char character = '~';
    hub->ops->put(hub->ctx, &character, 1);
    end(hub);
}

void net_hub_leave_parked(struct net_hub *hub) {
    if (hub->parked.on)
        end(hub);
}

void net_hub_forget_parked(struct net_hub *hub) {
    net_queue_free(&hub->parked.job.in);
    net_queue_free(&hub->parked.unread);
    hub->parked = (struct net_hub_parked){.on = false};
}

/* A button or another host has held: the hold stays, and lines are still the operator's. */
static void look_at_stops(struct net_hub *hub) {
    if (!hub->parked.on || !hub->parked.resumes || hub->parked.stops == hub->ops->stops(hub->ctx))
        return;
    hub->parked.resumes = false;
    net_hub_tell(hub, "Not resumed: held meanwhile");
}

void net_hub_follow_parked(struct net_hub *hub) {
    const enum machine_whose now = whose(hub);
    if (!hub->parked.on && !is_operators(now))
        return; /* as nearly always */
    look_at_stops(hub);
    const bool resumes = hub->parked.on && hub->parked.resumes;
    if (is_operators(now) && !hub->parked.on)
        begin(hub);
    hub->parked.opened |= now == MACHINE_WHOSE_OPEN || now == MACHINE_WHOSE_SHUT;
    if (hub->parked.on && hub->parked.opened)
        net_hub_put_turn_aside(hub);
    if (resumes && (now == MACHINE_WHOSE_SHUT || !is_operators(now) || net_hub_operators_bytes(hub) == 0))
        resume(hub);
    else if (hub->parked.on && !is_operators(now))
        end(hub);
}

/* ---- lines ---- */

static bool may_feed(const struct net_hub *hub, const struct net_client *owner) {
    return hub->parked.inside == 0 && hub->inside_hand == 0 && net_hub_has_room_for_operator(hub, owner) &&
           hub->ops->reads(hub->ctx) == MACHINE_READS_OPERATORS;
}

/* The rest of it is passed over. */
static void refuse_too_long(struct net_hub *hub, struct net_client *owner, size_t size) {
    net_hub_refuse(hub, owner, STATUS_LINE_TOO_LONG, NULL);
    if (owner->whole > 0) {
        net_hub_drop_operators(hub, size);
    } else {
        net_queue_drop(&owner->in, size);
        owner->skips = true;
    }
}

/* @return bytes of the first line that is the controller's; 0: there is none */
static size_t first_line(const struct net_hub *hub, const struct net_client *owner) {
    const size_t whole = net_hub_operators_bytes(hub);
    const char *line = net_queue_head(&owner->in);
    const char *line_end = whole > 0 ? memchr(line, '\n', whole) : NULL;
    if (line_end != NULL)
        return net_line_is_marked(line) ? 0 : (size_t)(line_end + 1 - line);
    const bool endless = owner->whole == 0 && !hub->parked.resumes && owner->in.count >= hub->sizes.in;
    return endless ? owner->in.count : 0;
}

static bool feed_line(struct net_hub *hub, struct net_client *owner, size_t size) {
    const uint32_t before = hub->inside;
    const size_t fed = net_hub_feed_lines(hub, &owner->in, size, before + 1, 0);
    owner->whole -= fed;
    pass_lines(hub, hub->inside - before);
    hub->parked.inside = (uint8_t)(hub->parked.inside + hub->inside - before);
    hub->parked.operator = owner;
    hub->operators = NULL;
    return fed > 0;
}

/* What is longer than the room finds none before ~. */
bool net_hub_feed_operator(struct net_hub *hub) {
    struct net_client *owner = hub->owner;
    if (owner == NULL || owner->in.count == 0 || !may_feed(hub, owner))
        return false;
    const size_t size = first_line(hub, owner);
    if (size == 0)
        return false;
    if (size <= hub->ops->room(hub->ctx))
        return feed_line(hub, owner, size);
    refuse_too_long(hub, owner, size);
    return true;
}

/* Behind a door lines wait for the parked hold to which ~ leads back, and those before it are the last. */
static void feed_shut(struct net_hub *hub, struct net_client *owner) {
    const bool anothers = hub->parked.inside > 0 && hub->parked.operator != owner;
    for (size_t size; !anothers && hub->inside_hand == 0 && hub->parked.inside < INSIDE_SHUT &&
                      (size = first_line(hub, owner)) > 0 && size <= hub->ops->room(hub->ctx);)
        if (!feed_line(hub, owner, size))
            return;
}

/* ---- real-time bytes ---- */

bool net_hub_keep_resume(struct net_hub *hub) {
    if (!hub->parked.on || net_hub_operators_bytes(hub) == 0)
        return false;
    hub->ops->act(hub->ctx); /* stops that came before it */
    net_hub_follow_parked(hub);
    if (!hub->parked.on)
        return false;
    if (whose(hub) == MACHINE_WHOSE_SHUT) {
        feed_shut(hub, hub->owner);
        return false;
    }
    if (!hub->parked.resumes)
        hub->parked.before_resume = count_lines(net_queue_head(&hub->owner->in), hub->owner->whole);
    hub->parked.stops = hub->ops->stops(hub->ctx);
    hub->parked.resumes = true;
    return true;
}

void net_hub_put_kept_resume(struct net_hub *hub) {
    if (hub->parked.on && hub->parked.resumes)
        resume(hub);
}
