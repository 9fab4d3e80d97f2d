/* SPDX-License-Identifier: MIT
 * Pendants: hands at the machine, at ports of their own.
 *
 * A pendant never owns. Its real-time bytes act as the owner's. Its lines are read in a turn of its own,
 * which begins when the machine is at rest and has answered every other line, or in a parked hold, and ends
 * when all of the pendant's is done, or answered in a parked hold: meanwhile the owner's lines wait, so each
 * answer is of one side only. While a job runs or is held, a pendant's lines are refused: nothing of them
 * starts later.
 *
 * What is refused before its line comes to its turn waits as a mark, so that answers are in order.
 *
 * 0x8B (MPG, grblHAL's) makes the turn last until it comes again, and has the lines of others refused. */
#include "net_hub_inner.h"
#include "net_line.h"

#include <string.h>

/* XON, XOFF and the form feed, by which pendants of FluidNC switch an echo off, are no part of a line. */
enum { FORM_FEED = 0x0C, XON = 0x11, XOFF = 0x13, DELETE = 0x7F };

/* LINE_MAX_BYTES: of a pendant, in a line. WAITS_MAX_BYTES: of its lines that wait; those behind are lost. */
enum { LINE_MAX_BYTES = 255, WAITS_MAX_BYTES = 1024 };

/* A line that is refused in its place: its bytes were unreadable, control by 0x8B has ended before it, or it
 * waited behind a jog that was stopped. */
enum { MARK_UNREADABLE = NET_LINE_SPOILED, MARK_CALLED_OFF = 0xFE, MARK_STOPPED = NET_PENDANT_STOPPED };

static const char unreadable[] = "Pendant: unreadable bytes; check its baud rate, cable and ground";
static const char too_many[] = "Pendant: too many lines; it must wait for answers";
static const char no_control[] = "Pendant: 0x8B takes control";
static const char busy[] = "Pendant: a job runs or is held; hold and park it (0xA3) to jog";
static const char in_control[] = "The pendant is in control (MPG): 0x8B at the pendant, or $TAKE, ends that";

static enum machine_reads reads(const struct net_hub *hub) {
    return hub->ops->reads != NULL ? hub->ops->reads(hub->ctx) : MACHINE_READS_NOTHING;
}

static bool has_lines(const struct net_client *client) {
    return client->whole > 0 || client->lost_lines > 0;
}

static bool others_wait(const struct net_hub *hub) {
    return hub->left.count > 0 || (hub->owner != NULL && hub->owner->whole > 0);
}

/* ---- control by 0x8B ---- */

static void set_mpg(struct net_hub *hub, bool on) {
    hub->mpg = on;
    if (hub->ops->mpg != NULL)
        hub->ops->mpg(hub->ctx, on);
}

/* A mark takes no more room than the shortest line. */
static void call_off_lines(struct net_client *client) {
    char *lines = client->whole > 0 ? client->in.bytes + client->in.begin : NULL;
    size_t to = 0, from = 0;
    while (from < client->whole) {
        const char *end = memchr(lines + from, '\n', client->whole - from);
        const bool empty = lines + from == end;
        const bool known = (uint8_t)lines[from] == MARK_UNREADABLE;
        from = (size_t)(end + 1 - lines);
        if (!empty)
            lines[to++] = (char)(known ? MARK_UNREADABLE : MARK_CALLED_OFF);
        lines[to++] = '\n';
    }
    if (from == 0)
        return;
    memmove(lines + to, lines + from, client->in.count - from);
    client->in.count -= from - to;
    client->whole = to;
}

void net_hub_end_mpg(struct net_hub *hub, struct net_client *by) {
    if (!hub->mpg)
        return;
    call_off_lines(hub->hand);
    net_hub_take_realtime(hub, by, JOG_CANCEL);
    set_mpg(hub, false);
    net_hub_tell(hub, "The pendant has released control (MPG)");
}

/* Nothing of anyone else is under way: an answer that comes next is the pendant's. */
static bool may_begin(const struct net_hub *hub, enum machine_reads now) {
    const bool half_line = hub->owner != NULL && hub->owner->in_long;
    if (hub->hand != NULL || hub->inside_hand > 0 || hub->parked.inside > 0 || half_line)
        return false;
    return now == MACHINE_READS_OPERATORS || (now == MACHINE_READS_LINES && hub->inside == 0);
}

static void begin_turn(struct net_hub *hub, struct net_client *client, enum machine_reads now) {
    hub->hand = client;
    hub->hand_parked = now == MACHINE_READS_OPERATORS;
    hub->hand_stops = hub->ops->stops != NULL ? hub->ops->stops(hub->ctx) : 0;
}

static void toggle_mpg(struct net_hub *hub, struct net_client *client) {
    const enum machine_reads now = reads(hub);
    const bool others_turn = hub->hand != NULL && hub->hand != client;
    if (hub->mpg && !others_turn) {
        net_hub_end_mpg(hub, client);
        return;
    }
    if (others_turn || others_wait(hub) || now == MACHINE_READS_OPERATORS ||
        (hub->hand == client ? hub->hand_parked : !may_begin(hub, now))) {
        net_hub_say_message(hub, client, "Pendant: control (MPG) needs a machine at rest");
        return;
    }
    begin_turn(hub, client, now);
    set_mpg(hub, true);
    net_hub_tell(hub, "The pendant is in control (MPG)");
}

/* ---- bytes ---- */

static void add_line(struct net_client *client, const char *bytes, size_t count) {
    if (net_queue_add(&client->in, bytes, count))
        client->whole = client->in.count;
    else
        client->gone = true;
}

/* Lines of a pendant that does not wait for answers are counted when there is no more room: it can always
 * stop, so its bytes are always read. */
static bool finds_no_room(const struct net_client *client) {
    return client->lost_lines > 0 || client->whole >= WAITS_MAX_BYTES;
}

static void end_pendants_line(struct net_hub *hub, struct net_client *client) {
    static const char mark[] = {(char)MARK_UNREADABLE, '\n'};
    const bool is_lost = finds_no_room(client), is_bad = client->garbled || client->spoiled;
    if (is_lost || is_bad)
        net_queue_cut(&client->in, client->whole);
    if (is_lost)
        client->lost_lines = (uint16_t)(client->lost_lines + (client->lost_lines < UINT16_MAX));
    else if (is_bad)
        add_line(client, mark, sizeof mark);
    if (is_lost || is_bad) {
        client->garbled = client->spoiled = client->called_off = false;
        return;
    }
    net_hub_end_line(hub, client);
    add_line(client, "\n", 1);
}

static void take_character(struct net_hub *hub, struct net_client *client, uint8_t byte) {
    const char character = (char)byte;
    const bool line_ends = byte == '\n' || byte == '\r';
    if (byte == XON || byte == XOFF) {
        client->paused = byte == XOFF;
        return;
    }
    if (byte == FORM_FEED)
        return;
    if (client->skips) {
        client->skips = !line_ends;
        client->spoiled &= !line_ends;
        return;
    }
    if (line_ends) {
        end_pendants_line(hub, client);
        return;
    }
    client->garbled |= (byte < ' ' && byte != '\t') || byte == DELETE;
    client->garbled |= client->in.count - client->whole >= LINE_MAX_BYTES;
    if (!client->garbled && !finds_no_room(client) && !net_queue_add(&client->in, &character, 1))
        client->gone = true;
}

/* A letter of UTF-8 or noise, which makes the line unreadable: no pendant gives control in mid-line. */
static bool is_in_line(const struct net_client *client) {
    return client->in.count > client->whole || client->garbled || client->skips;
}

void net_hub_take_pendant(struct net_hub *hub, struct net_client *client, uint8_t byte) {
    if (!net_line_is_realtime(byte))
        take_character(hub, client, byte);
    else if (byte == MPG_TOGGLE && is_in_line(client))
        client->garbled = true;
    else if (byte == MPG_TOGGLE)
        toggle_mpg(hub, client);
    else
        net_hub_take_realtime(hub, client, byte);
}

/* Its turn, or the newest of the operator's lines in a parked hold is its. */
static bool may_move(const struct net_hub *hub, const struct net_client *client) {
    const enum machine_reads now = reads(hub);
    return hub->hand == client ||
           (hub->operators == client && (now == MACHINE_READS_OPERATORS || now == MACHINE_READS_SOON));
}

void net_hub_doubt_pendant(struct net_hub *hub, struct net_client *client) {
    if (may_move(hub, client))
        net_hub_put_realtime(hub, client, JOG_CANCEL);
}

/* ---- lines ---- */

static size_t first_line(const struct net_client *client) {
    const char *line = net_queue_head(&client->in);
    const char *end = memchr(line, '\n', client->whole);
    return end == NULL ? client->whole : (size_t)(end + 1 - line);
}

static uint8_t first_byte(const struct net_client *client) {
    return client->whole > 0 ? (uint8_t)*net_queue_head(&client->in) : MARK_UNREADABLE;
}

static bool is_marked(const struct net_client *client) {
    const uint8_t first = first_byte(client);
    return first == MARK_UNREADABLE || first == MARK_CALLED_OFF || first == MARK_STOPPED;
}

static void drop_line(struct net_hub *hub, struct net_client *client) {
    const size_t size = first_line(client);
    if (client->whole == 0)
        client->lost_lines--;
    if (client == hub->owner) { /* it may be one of the operator, which ~ waits for */
        net_hub_drop_operators(hub, size);
        return;
    }
    net_queue_drop(&client->in, size);
    client->whole -= size;
}

/* The first line, which was damaged or lost. */
static void refuse_unreadable(struct net_hub *hub, struct net_client *client) {
    const char *why = client->whole > 0 ? unreadable : too_many;
    net_hub_refuse(hub, client, STATUS_LINE_TOO_LONG, client->told ? NULL : why);
    client->told = true;
    drop_line(hub, client);
}

/* Each line has its answer, an empty one `ok`. */
static void refuse_line(struct net_hub *hub, struct net_client *client, enum status status, const char *why) {
    if (first_byte(client) == MARK_UNREADABLE) {
        refuse_unreadable(hub, client);
        return;
    }
    client->told = false;
    if (first_line(client) == 1) {
        net_hub_say(hub, client, "ok\r\n", 4);
    } else if (first_byte(client) == MARK_STOPPED) {
        net_hub_refuse(hub, client, STATUS_LOCKED, NULL);
    } else {
        net_hub_refuse(hub, client, status, client->explained ? NULL : why);
        client->explained = true;
    }
    drop_line(hub, client);
}

static bool has_room(const struct net_hub *hub, const struct net_client *client) {
    return client->out.count < hub->sizes.out / 2;
}

static bool waits_aside(const struct net_hub *hub, const struct net_client *client) {
    return hub->parked.inside_hand > 0 && hub->parked.hand == client;
}

/* Behind the answers to what it has inside. @return true: some were refused */
static bool refuse_lines(struct net_hub *hub, struct net_client *client, enum status status,
                         const char *why) {
    bool any = false;
    if (waits_aside(hub, client)) {
        call_off_lines(client);
        return false;
    }
    while (has_lines(client) && has_room(hub, client) && !(hub->hand == client && hub->inside_hand > 0)) {
        if (client->whole > 0 && net_line_is_marked(net_queue_head(&client->in)))
            break; /* that of an owner, which net_hub_answer_turns() answers */
        refuse_line(hub, client, status, why);
        any = true;
    }
    return any;
}

/* Lines of it that may be inside at the same time: there is room for their answers. While nothing moves and
 * others wait it is one, or a turn of a pendant that never waits would never end. */
static bool may_feed(const struct net_hub *hub, const struct net_client *client) {
    const enum machine_reads now = reads(hub);
    const bool yields = !hub->mpg && now != MACHINE_READS_NOTHING && others_wait(hub);
    const size_t due = client->out.count + (hub->inside_hand + 1u) * (size_t)NET_ANSWER_MAX;
    if (hub->hand_parked && now != MACHINE_READS_OPERATORS)
        return false;
    return hub->inside_hand < (yields ? 1 : UINT8_MAX) && due <= hub->sizes.out;
}

static bool feed_hand(struct net_hub *hub, struct net_client *client) {
    bool any = false;
    while (has_lines(client)) {
        if (is_marked(client)) {
            if (hub->inside_hand > 0 || !has_room(hub, client))
                break;
            refuse_line(hub, client, STATUS_PENDANT, hub->mpg ? NULL : no_control);
            any = true;
            continue;
        }
        if (!may_feed(hub, client))
            break;
        const uint32_t before = hub->inside;
        const size_t fed = net_hub_feed_lines(hub, &client->in, first_line(client), before + 1, 0);
        client->whole -= fed;
        client->told = false;
        hub->inside_hand = (uint8_t)(hub->inside_hand + hub->inside - before);
        hub->operators = hub->hand_parked ? client : NULL;
        any |= fed > 0;
        if (hub->inside == before)
            break;
    }
    return any;
}

/* @return true: its lines were fed or refused */
static bool look_at(struct net_hub *hub, struct net_client *client) {
    const enum machine_reads now = reads(hub);
    const bool in_turn = hub->hand == client, controls = hub->mpg && in_turn;
    if (!controls && (client->stream.pendant == NET_PENDANT_MPG || hub->mpg))
        return refuse_lines(hub, client, STATUS_PENDANT, hub->mpg ? in_control : no_control);
    if (in_turn)
        return feed_hand(hub, client);
    if (!hub->others_first && may_begin(hub, now)) {
        begin_turn(hub, client, now);
        return feed_hand(hub, client);
    }
    if (now != MACHINE_READS_NOTHING || hub->hand != NULL)
        return false;
    return refuse_lines(hub, client, STATUS_PENDANT, busy);
}

/* A sender that was lost meanwhile is missed from now on: what waits of it would run next. */
static void end_hand(struct net_hub *hub) {
    hub->hand = NULL;
    if (hub->sender_lost && hub->ops->left != NULL)
        hub->ops->left(hub->ctx, hub->left.count > 0);
    hub->sender_lost = false;
}

void net_hub_put_turn_aside(struct net_hub *hub) {
    if (hub->hand_parked || (hub->hand == NULL && hub->inside_hand == 0))
        return;
    hub->parked.hand = hub->hand;
    hub->parked.inside_hand = hub->inside_hand;
    hub->inside_hand = 0;
    hub->hand_parked = true;
    if (!hub->mpg)
        hub->hand = NULL;
}

static void take_turn_back(struct net_hub *hub) {
    struct net_hub_parked *parked = &hub->parked;
    const bool waits = parked->hand != NULL || parked->inside_hand > 0;
    if (!waits || parked->on || hub->inside_hand > 0 || (hub->hand != NULL && hub->hand != parked->hand))
        return;
    hub->hand = parked->hand;
    hub->inside_hand = parked->inside_hand;
    hub->hand_parked = false;
    parked->hand = NULL;
    parked->inside_hand = 0;
}

/* Who has stopped the pendant's motion wants nothing to move: the lines that waited for its end would begin
 * then. */
static void hold_others(struct net_hub *hub) {
    if (hub->hand_parked || hub->ops->stops == NULL || hub->ops->stops(hub->ctx) == hub->hand_stops)
        return;
    (void)hub->ops->put(hub->ctx, "!", 1);
    hub->ops->act(hub->ctx);
    net_hub_tell(hub, "Stopped: the sender's lines wait for ~");
}

/* What it has begun is done, and it has nothing more to say; or it has, and others wait. */
static void end_turn(struct net_hub *hub) {
    if (hub->hand == NULL || hub->mpg || hub->inside_hand > 0)
        return;
    if (!hub->hand_parked && reads(hub) != MACHINE_READS_LINES)
        return;
    if (!hub->hand_parked && has_lines(hub->hand) && !others_wait(hub))
        return;
    hub->others_first = others_wait(hub);
    if (hub->others_first)
        hold_others(hub);
    end_hand(hub);
}

bool net_hub_feed_pendants(struct net_hub *hub) {
    bool any = false;
    end_turn(hub);
    take_turn_back(hub);
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++)
        if (net_hub_is_open(client) && net_hub_is_pendant(client) && has_lines(client))
            any |= look_at(hub, client);
    if (hub->mpg && net_hub_feeds_owner(hub) && hub->owner->whole > 0)
        any |= refuse_lines(hub, hub->owner, STATUS_PENDANT, in_control);
    return any;
}

/* Also for the rest of a line that is under way: a pendant's line that waits would else wait for ever. */
bool net_hub_waits_for_pendant(const struct net_hub *hub) {
    if (hub->hand != NULL || hub->inside_hand > 0)
        return true;
    if (hub->others_first || (hub->owner != NULL && hub->owner->in_long))
        return false;
    for (const struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++)
        if (net_hub_is_open(client) && net_hub_is_pendant(client) && has_lines(client))
            return true;
    return false;
}

bool net_hub_is_for(const struct net_hub *hub, const struct net_client *client, bool is_news) {
    const bool in_turn = hub->inside_hand > 0;
    const bool aside = !in_turn && hub->parked.inside == 0 && hub->parked.inside_hand > 0;
    if (is_news)
        return true;
    if (!net_hub_is_pendant(client))
        return !in_turn && !aside;
    return (in_turn && client == hub->hand) || (aside && client == hub->parked.hand);
}

/* ---- ends ---- */

void net_hub_end_turns(struct net_hub *hub) {
    hub->inside_hand = hub->parked.inside_hand = 0;
    hub->parked.hand = NULL;
    hub->hand_parked = hub->others_first = hub->sender_lost = false;
    hub->operators = NULL;
    if (!hub->mpg)
        hub->hand = NULL;
}

/* No one sees what it has started. Answers that are still due are no one's. */
void net_hub_lose_pendant(struct net_hub *hub, struct net_client *client) {
    const bool moves = may_move(hub, client);
    if (hub->operators == client)
        hub->operators = NULL;
    if (hub->parked.hand == client)
        hub->parked.hand = NULL;
    if (!moves)
        return;
    net_hub_drop_lines(client);
    if (hub->hand == client)
        net_hub_end_mpg(hub, client);
    if (hub->ops->pendant_left != NULL)
        hub->ops->pendant_left(hub->ctx);
    if (hub->hand == client)
        end_hand(hub);
}
