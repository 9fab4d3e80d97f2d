/* SPDX-License-Identifier: MIT */
#include "net_hub.h"

#include "net_hub_inner.h"
#include "net_line.h"
#include "net_opening.h"

#include "input/text_byte.h"

#include <stdio.h>
#include <string.h>

/* READ_REFUSED: of a client whose lines are refused, so that it has read the answers to some before the next.
 */
enum { READ_SIZE = 1024, READ_REFUSED = 128 };

enum { LONGEST_LINE = 1024 }; /* with all its blanks and comments */

static const char take_line[] = "$TAKE", in_control[] = "In control";

enum { TAKE_LENGTH = sizeof take_line - 1 };
enum { LOGIN_LINE_MAX = sizeof "$LOGIN=" + 64 };

void net_hub_init(struct net_hub *hub, const struct net_hub_sizes *sizes, const struct net_hub_ops *ops,
                  void *ctx) {
    *hub = (struct net_hub){.ops = ops, .ctx = ctx, .sizes = *sizes};
}

/* ---- ownership ---- */

void net_hub_set_owner(struct net_hub *hub, struct net_client *client) {
    char text[NET_NAME_SIZE + 32];
    struct net_client *before = hub->owner;
    net_hub_leave_parked(hub);
    hub->owner = NULL;
    for (struct net_client *other = hub->client; other < hub->client + NET_CLIENTS; other++)
        other->in_left = net_hub_waits_in_left(hub, other);
    if (before != NULL)
        net_hub_leave_lines(hub, before);
    hub->owner = client;
    hub->owner_peer = client != NULL ? client->stream.peer : hub->owner_peer;
    net_hub_note_left(hub, 0, net_hub_owners_inside(hub)); /* where no one was the owner */
    for (struct net_client *other = hub->client; other < hub->client + NET_CLIENTS; other++)
        other->hears_left = other != client;
    net_hub_follow_parked(hub);
    if (client == NULL) {
        net_hub_tell_observers(hub, net_hub_nobody);
        return;
    }
    client->letters = 0;
    hub->owner_is_new = true;
    hub->sender = client;
    hub->sender_lost = false;
    hub->ops->event(hub->ctx, "owner", client->name);
    snprintf(text, sizeof text, "%s commands", client->name);
    net_hub_tell_observers(hub, text);
    if (before != NULL)
        net_hub_explain(hub, before);
}

/* ---- the end of a connection ---- */

static bool is_busy(const struct net_hub *hub) {
    return hub->ops->busy != NULL && hub->ops->busy(hub->ctx);
}

/* No more comes from it, but it may still want to hear the answers to what it sent (`nc`). One that has
 * closed its connection altogether looks the same, until something is written to it. */
static void end_client(struct net_hub *hub, struct net_client *client) {
    client->ended = true;
    if (client != hub->owner)
        return;
    net_hub_set_owner(hub, NULL);
    if (is_busy(hub) || hub->left.count > 0)
        net_hub_say_message(hub, client, "End of input: the received lines are still executed");
}

static bool has_heard_all(const struct net_hub *hub, const struct net_client *client) {
    bool waits = client == hub->sender && is_busy(hub);
    return client->ended && !client->waits && hub->inside_left == 0 && hub->left.count == 0 &&
           client->lost_lines == 0 && client->out.count == 0 && !waits;
}

/* A transport may tell only a reader that the other end is gone. */
static void look_after(struct net_client *client) {
    char byte;
    if (client->ended && client->stream.ops->read(&client->stream, &byte, 1) == NET_GONE)
        client->gone = true;
}

/* ---- bytes of the owner and of observers ---- */

static void put_stop(struct net_hub *hub, struct net_client *client, uint8_t byte) {
    if (net_hub_may_stop(hub, client, byte))
        net_hub_take_realtime(hub, client, byte);
}

static bool is_take(const char *line, size_t size) {
    return size == TAKE_LENGTH && net_line_commands(line, size, take_line);
}

/* The owner's `$TAKE` is an empty line: like any line it is answered once, and it is true already, with or
 * without its first byte: who has become the owner by it is informed as others that take control. So are its
 * `$RI=`, and a jog that was called off before its line was whole. */
void net_hub_end_line(struct net_hub *hub, struct net_client *owner) {
    size_t size = owner->in.count - owner->whole;
    const char *line = size == 0 ? "" : net_queue_head(&owner->in) + owner->whole;
    const bool takes = is_take(line, size);
    if (takes && owner == hub->owner)
        net_hub_end_mpg(hub, owner);
    if (takes && owner == hub->owner && hub->owner_is_new)
        net_hub_say_message(hub, owner, in_control);
    if (takes || net_hub_take_interval(hub, owner, line, size) ||
        (owner->called_off && net_line_is_jog(line, size)))
        net_queue_cut(&owner->in, owner->whole);
    owner->called_off = false;
}

static bool add_owners(struct net_hub *hub, struct net_client *client, const char *bytes, size_t count) {
    if (net_queue_add(&client->in, bytes, count))
        return true;
    client->gone = true;
    hub->ops->event(hub->ctx, "disconnected: out of memory", client->name);
    return false;
}

/* Who holds its jog key down is not in control now; all else is held, as no one else watches it. The line is
 * answered immediately, but behind what its client has sent before it lost control. */
static void take_control(struct net_hub *hub, struct net_client *client) {
    net_hub_end_mpg(hub, client);
    if (hub->owner != NULL || is_busy(hub)) {
        net_hub_put_realtime(hub, client, JOG_CANCEL);
        hub->ops->act(hub->ctx);
    }
    net_hub_leave_parked(hub);
    net_hub_refuse_unread(hub);
    if (is_busy(hub))
        net_hub_put_realtime(hub, client, '!');
    if (client != hub->owner)
        net_hub_set_owner(hub, client);
    net_hub_follow_parked(hub);
    hub->owner_is_new = false;
    net_hub_say_message(hub, client, in_control);
    net_hub_answer_observer(hub, client, "", 0);
}

/* By its first byte it is in control already, where no one was; but lines of a lost sender wait before it. */
static bool takes_from_lost(const struct net_hub *hub, const struct net_client *client) {
    const char *line = net_queue_head(&client->in);
    return client->whole == 0 && net_hub_owners_inside(hub) == 0 &&
           (hub->left.count > 0 || hub->inside_left > 0) && is_take(line, client->in.count);
}

static void end_skipped(struct net_hub *hub, struct net_client *client) {
    if (client->refuses_rest)
        net_hub_refuse_rest(hub, client);
    client->skips = client->spoiled = client->refuses_rest = false;
}

static void take_owners(struct net_hub *hub, struct net_client *client, char character, bool line_ends) {
    if (client->skips) {
        if (line_ends)
            end_skipped(hub, client);
        return;
    }
    if (client->spoiled)
        hub->has_spoiled |= add_owners(hub, client, &(char){(char)NET_LINE_SPOILED}, 1);
    client->spoiled = false;
    if (line_ends && takes_from_lost(hub, client)) {
        net_queue_cut(&client->in, 0);
        take_control(hub, client);
        return;
    }
    if (line_ends) {
        if (!net_hub_mark_line(hub, client))
            net_hub_end_line(hub, client);
        hub->owner_is_new = false;
        character = '\n';
    }
    if (add_owners(hub, client, &character, 1) && line_ends)
        client->whole = client->in.count;
}

/* Observers' lines are read for $TAKE and those of net_hub_is_its_line() only. */
static void take_observers(struct net_hub *hub, struct net_client *client, char character, bool line_ends) {
    if (!line_ends) {
        bool fits = client->letters < sizeof client->typed && !client->skips && !client->spoiled;
        if (fits)
            client->typed[client->letters] = character;
        client->letters = fits ? (uint8_t)(client->letters + 1) : UINT8_MAX;
        return;
    }
    size_t size = client->letters <= sizeof client->typed ? client->letters : 0;
    bool sound = !client->skips && !client->spoiled;
    bool takes = sound && is_take(client->typed, size);
    const bool known = sound && client->letters <= sizeof client->typed;
    client->letters = 0;
    client->skips = client->spoiled = client->refuses_rest = false;
    if (takes) {
        take_control(hub, client);
    } else if (known) {
        net_hub_answer_observer(hub, client, client->typed, size);
    } else {
        net_hub_answer_observer(hub, client, "?", 1); /* as any line that is refused */
    }
}

/* Of a line end CR LF; whatever else comes ends that. */
static bool is_second_half(struct net_client *client, uint8_t byte) {
    const bool second_half = byte == '\n' && client->after_cr;
    client->after_cr = byte == '\r';
    return second_half;
}

/* In a key real-time characters are letters like others. A line that is too long is none. */
static void take_locked(struct net_hub *hub, struct net_client *client, uint8_t byte) {
    const char character = (char)byte;
    if (net_line_is_realtime(byte) && !net_hub_is_login(net_queue_head(&client->in), client->in.count)) {
        if (!net_hub_toggle_reports(hub, client, byte) && !net_hub_want_report(client, byte))
            put_stop(hub, client, byte);
    } else if (is_second_half(client, byte)) {
        return;
    } else if (byte == '\n' || byte == '\r') {
        if (client->in.count > 0)
            net_hub_log_in(hub, client);
        else
            net_hub_say(hub, client, "ok\r\n", 4);
    } else if (client->in.count < LOGIN_LINE_MAX)
        (void)net_queue_add(&client->in, &character, 1);
}

/* A key is of any bytes. @return false: the byte is the rest of a letter of UTF-8 */
static bool take_letter(struct net_client *client, uint8_t *byte) {
    const bool is_login = client->locked && net_hub_is_login(net_queue_head(&client->in), client->in.count);
    return is_login || text_byte(&client->text_left, byte);
}

static void take_byte(struct net_hub *hub, struct net_client *client, uint8_t byte) {
    if (!take_letter(client, &byte))
        return;
    bool mid_line = client->letters != 0 || client->skips;
    if (net_line_is_realtime(byte) || byte == '\n' || byte == '\r')
        net_hub_note_heard(hub, client);
    if (client->locked) {
        take_locked(hub, client, byte);
        return;
    }
    if (net_hub_toggle_reports(hub, client, byte) ||
        (client != hub->owner && net_hub_want_report(client, byte)))
        return;
    const bool is_realtime = net_line_is_realtime(byte);
    if (!is_realtime && is_second_half(client, byte))
        return;
    if (net_hub_is_pendant(client)) {
        net_hub_take_pendant(hub, client, byte);
        return;
    }
    if (hub->owner == NULL && !mid_line)
        net_hub_set_owner(hub, client);
    if (is_realtime) {
        (client == hub->owner ? net_hub_take_realtime : put_stop)(hub, client, byte);
        return;
    }
    bool line_ends = byte == '\n' || byte == '\r';
    (client == hub->owner ? take_owners : take_observers)(hub, client, (char)byte, line_ends);
}

/* The owner's bytes within a line, all in one go. @return how many; 0: this one takes the long way */
static size_t take_run(struct net_hub *hub, struct net_client *client, const char *bytes, size_t count) {
    if (client != hub->owner || client->locked || client->skips || client->spoiled || client->stream.telnet)
        return 0;
    const size_t run = net_line_plain_run(bytes, count);
    if (run == 0 || !add_owners(hub, client, bytes, run))
        return 0;
    client->after_cr = false;
    client->text_left = 0;
    return run;
}

/* A browser shows what it gets here; one that was made to send this by another page does not. */
static void refuse_browser(struct net_hub *hub, struct net_client *client, bool reads_text) {
    static const char refusal[] = "HTTP/1.1 400 Bad Request\r\nContent-Type: text/plain\r\n"
                                  "Connection: close\r\n\r\n"
                                  "This port is for senders of G-code. The page is at another port.\n";
    client->refused = true;
    hub->ops->event(hub->ctx, "refused: a web browser at the port for senders", client->name);
    if (reads_text)
        net_hub_say(hub, client, refusal, sizeof refusal - 1);
}

/* The first bytes are held until it is known whose they are. */
static void open_with(struct net_hub *hub, struct net_client *client, uint8_t byte) {
    struct net_queue held = client->in;
    enum net_opening_is what = net_opening_take(net_queue_head(&held), held.count, byte);
    if (what == NET_OPENING_MORE) {
        (void)add_owners(hub, client, &(char){(char)byte}, 1);
        return;
    }
    client->in = (struct net_queue){0};
    client->opened = what == NET_OPENING_LINES;
    for (size_t i = 0; client->opened && i < held.count; i++)
        take_byte(hub, client, (uint8_t)net_queue_head(&held)[i]);
    net_queue_free(&held);
    if (client->opened)
        take_byte(hub, client, byte);
    else
        refuse_browser(hub, client, what == NET_OPENING_HTTP);
}

/* Bytes of a client's stream that are no telnet negotiation. */
static void take_data(struct net_hub *hub, struct net_client *client, uint8_t byte) {
    char reply[NET_TELNET_REPLY];
    size_t reply_count = 0;
    if (client->stream.telnet && net_telnet_take(&client->telnet, byte, reply, &reply_count) == 0)
        net_hub_say(hub, client, reply, reply_count);
    else if (client->opened)
        take_byte(hub, client, byte);
    else
        open_with(hub, client, byte);
}

/* What comes behind a login that waits is not read before its turn. */
static void take_bytes(struct net_hub *hub, struct net_client *client, const char *bytes, size_t count) {
    for (size_t i = 0; i < count && net_hub_is_open(client) && !client->refused; i++) {
        if (client->waits) {
            (void)net_queue_add(&client->in, bytes + i, count - i);
            return;
        }
        i += take_run(hub, client, bytes + i, count - i);
        if (i < count && net_hub_is_open(client))
            take_data(hub, client, (uint8_t)bytes[i]);
    }
}

void net_hub_log_in_again(struct net_hub *hub, struct net_client *client) {
    struct net_queue held = client->in;
    client->explained = false;
    enum access_result result = net_hub_try_login(hub, client);
    if (result == ACCESS_WAIT)
        return;
    client->in = (struct net_queue){0};
    net_hub_end_login(hub, client, result);
    take_bytes(hub, client, net_queue_head(&held) + client->login_size, held.count - client->login_size);
    net_queue_free(&held);
}

bool net_hub_wants_read(const struct net_hub *hub, const struct net_client *client) {
    return net_hub_is_open(client) && !client->ended && !client->refused && !client->waits &&
           (client != hub->owner || client->in.count < hub->sizes.in);
}

bool net_hub_wants_write(const struct net_client *client) {
    return net_hub_is_open(client) && client->out.count > 0;
}

bool net_hub_read(struct net_hub *hub, struct net_client *client) {
    char bytes[READ_SIZE];
    const bool refused = client->locked || (hub->owner != NULL && client != hub->owner);
    size_t room = hub->sizes.in - client->in.count, most = refused ? READ_REFUSED : READ_SIZE;
    size_t size = room < most ? room : most;
    client->explained = false;
    if (!net_hub_wants_read(hub, client))
        return false;
    long count;
    bool spoiled;
    do {
        spoiled = false;
        while ((count = client->stream.ops->read(&client->stream, bytes, size)) <= NET_LOST) {
            client->spoiled = spoiled = true;
            if (net_hub_is_pendant(client))
                net_hub_doubt_pendant(hub, client);
            if (count != NET_SPOILED)
                hub->ops->lost(hub->ctx, count);
        }
        if (count > 0)
            take_bytes(hub, client, bytes, (size_t)count);
    } while (spoiled && count > 0 && net_hub_wants_read(hub, client)); /* lines come one by one */
    if (count == NET_ENDED)
        end_client(hub, client);
    else if (count == NET_GONE)
        client->gone = true;
    return count == (long)size;
}

void net_hub_lost(struct net_client *client) {
    client->gone = true;
}

/* ---- lines to the controller ---- */

/* Lines that may be inside the controller at the same time, so that the owner's queue has room for every
 * answer: a line goes in only if there is room for its answer and for those still to come. */
uint32_t net_hub_lines_allowed(const struct net_hub *hub) {
    size_t taken = hub->owner == NULL ? 0 : hub->owner->out.count;
    size_t room = taken >= hub->sizes.out ? 0 : (hub->sizes.out - taken) / NET_ANSWER_MAX;
    return room < NET_LINES_INSIDE ? (uint32_t)room : NET_LINES_INSIDE;
}

/* What is longer than any line is refused: it goes in pieces. */
static bool leaves_room(const struct net_hub *hub, size_t size, size_t keep) {
    return size > LONGEST_LINE || size + keep <= hub->ops->room(hub->ctx);
}

size_t net_hub_feed_lines(struct net_hub *hub, struct net_queue *queue, size_t count, uint32_t allowed,
                          size_t keep) {
    const bool keeps = keep > 0 && hub->ops->room != NULL;
    size_t fed = 0;
    while (fed < count && hub->inside < allowed) {
        const char *line = net_queue_head(queue);
        if (net_line_is_marked(line) || net_line_says_whose(line))
            break;
        const char *line_end = memchr(line, '\n', count - fed);
        size_t size = line_end == NULL ? count - fed : (size_t)(line_end + 1 - line);
        if (keeps && !leaves_room(hub, size, keep))
            break;
        if (net_line_is_jog(line, size))
            hub->jogs = queue;
        size_t piece = hub->has_spoiled ? net_line_sound(line, size) : size;
        size_t took = piece > 0 ? hub->ops->put(hub->ctx, line, piece) : hub->ops->spoil(hub->ctx);
        net_queue_drop(queue, took);
        fed += took;
        if (took == 0 || took < piece)
            break;
        hub->inside += line_end != NULL && piece == size;
    }
    return fed;
}

static bool feed_left(struct net_hub *hub) {
    uint32_t before = hub->inside;
    size_t fed =
        net_hub_feed_lines(hub, &hub->left, hub->left.count, net_hub_lines_allowed(hub), NET_OPERATOR_BYTES);
    net_hub_note_left(hub, hub->left_of, hub->inside - before);
    return fed > 0;
}

/* A line longer than the queue continues as it comes: the controller will refuse it. */
static bool feed_owner(struct net_hub *hub, struct net_client *owner) {
    bool too_long = owner->whole == 0 && owner->in.count >= hub->sizes.in;
    size_t count = too_long ? owner->in.count : owner->whole;
    size_t fed = net_hub_feed_lines(hub, &owner->in, count, net_hub_lines_allowed(hub), NET_OPERATOR_BYTES);
    if (fed == 0)
        return false;
    owner->in_long = too_long;
    owner->whole -= too_long ? 0 : fed;
    return true;
}

/* Looked at for every line, so without a call. */
static bool has_turns(const struct net_hub *hub) {
    const struct net_client *owner = hub->owner;
    return hub->left.count > 0 || hub->has_lost ||
           (owner != NULL && owner->whole > 0 && net_line_is_marked(net_queue_head(&owner->in)));
}

/* Lines of former owners first. */
static bool feed_job(struct net_hub *hub) {
    const bool lefts = hub->left.count > 0;
    if (hub->inside_left > 0 && !net_hub_may_follow_left(hub, lefts ? hub->left_of : 0))
        return false;
    return lefts ? feed_left(hub) : net_hub_feeds_owner(hub) && feed_owner(hub, hub->owner);
}

bool net_hub_feed(struct net_hub *hub) {
    if (hub->stops || hub->resets)
        net_hub_end_stop(hub);
    if (hub->ops->whose != NULL)
        net_hub_follow_parked(hub);
    if (hub->parked.inside_hand > 0) /* what is answered of it is no answer to the operator's next line */
        net_hub_hear(hub);
    const bool answered = has_turns(hub) && net_hub_answer_turns(hub);
    const bool pendants = hub->has_pendants && net_hub_feed_pendants(hub);
    if (hub->has_pendants && net_hub_waits_for_pendant(hub))
        return pendants || answered;
    bool fed = hub->parked.on ? net_hub_feed_operator(hub) : feed_job(hub);
    hub->others_first = false;
    hub->operators = fed ? NULL : hub->operators;
    hub->has_spoiled &= hub->left.count > 0 || (hub->owner != NULL && hub->owner->in.count > 0);
    return fed || pendants || answered;
}

/* ---- the controller's output ---- */

/* The controller has reset, by itself, by a button, or because a line said so: as it forgets all that it has
 * got, what waits here would be the rest of something. Senders begin again when they see the banner. */
static void follow_reset(struct net_hub *hub) {
    const struct net_client *owner = hub->owner;
    bool any = hub->left.count > 0 || (owner != NULL && owner->in.count > 0);
    net_hub_forget_lines(hub, NULL);
    net_hub_end_reports(hub);
    hub->inside = hub->inside_left = 0; /* what was inside is not answered any more */
    if (any)
        net_hub_tell(hub, "Queued lines discarded by the reset");
}

/* Count answers; those to former owners' lines do not go to an owner that would take them for its own. */
static void say_line(struct net_hub *hub, const char *line, size_t size) {
    bool answer = net_line_begins(line, size, "ok\r") || net_line_begins(line, size, "error:");
    const bool is_news = net_line_is_news(line, size);
    const bool of_hand = hub->inside_hand > 0 && !is_news;
    const bool of_operator = hub->parked.inside > 0 && !is_news && !of_hand;
    const bool of_aside = hub->parked.inside_hand > 0 && !is_news && !of_hand && !of_operator;
    bool of_left = hub->inside_left > 0 && !is_news && !of_hand && !of_operator && !of_aside;
    if (net_line_begins(line, size, "Grbl "))
        follow_reset(hub);
    hub->inside -= answer && hub->inside > 0;
    bool report = net_line_begins(line, size, "<");
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++)
        if (client->stream.ops != NULL && (report ? net_hub_gets_report(hub, client) : !client->locked) &&
            (!of_left || client->hears_left || net_hub_left_is_of(hub, client)) &&
            (!of_operator || client != hub->owner || client == hub->parked.operator) &&
            net_hub_is_for(hub, client, is_news))
            net_hub_say(hub, client, line, size);
    hub->inside_hand = (uint8_t)(hub->inside_hand - (answer && of_hand));
    hub->parked.inside_hand = (uint8_t)(hub->parked.inside_hand - (answer && of_aside));
    if (answer && of_operator)
        net_hub_count_operators(hub);
    if (answer && of_left)
        net_hub_count_left(hub);
    if (report)
        net_hub_end_report(hub);
}

static void say_rest(struct net_hub *hub) {
    say_line(hub, hub->line, hub->line_size);
    hub->line_size = 0;
}

static void hear_bytes(struct net_hub *hub, const char *bytes, size_t count) {
    for (size_t i = 0; i < count; i++) {
        hub->line[hub->line_size++] = bytes[i];
        if (bytes[i] == '\n' || hub->line_size == NET_LINE_SIZE)
            say_rest(hub);
    }
}

void net_hub_hear(struct net_hub *hub) {
    char bytes[READ_SIZE];
    size_t count;
    while ((count = hub->ops->hear(hub->ctx, bytes, sizeof bytes)) > 0)
        hear_bytes(hub, bytes, count);
}

/* ---- writing ---- */

void net_hub_write(struct net_client *client) {
    while (client->out.count > 0 && !client->paused) {
        long took =
            client->stream.ops->write(&client->stream, net_queue_head(&client->out), client->out.count);
        if (took == NET_GONE)
            client->gone = true;
        if (took <= 0)
            return;
        net_queue_drop(&client->out, (size_t)took);
    }
}

void net_hub_flush(struct net_hub *hub) {
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++) {
        if (client->stream.ops == NULL)
            continue;
        look_after(client);
        if (!client->gone)
            net_hub_write(client);
        if (client->gone || (client->refused && client->out.count == 0) || has_heard_all(hub, client))
            net_hub_remove_client(hub, client);
    }
}
