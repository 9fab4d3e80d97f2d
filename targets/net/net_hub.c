/* SPDX-License-Identifier: MIT */
#include "net_hub.h"

#include "net_line.h"

#include <stdio.h>
#include <string.h>

enum { READ_SIZE = 1024 };

static const char nobody[] = "No client is in control: the first line takes control";
static const char take_line[] = "$TAKE";
static const char login_line[] = "$LOGIN=";
static const char locked_out[] = "Password required: $LOGIN=...";

enum { JOG_CANCEL = 0x85 };
enum { TAKE_LENGTH = sizeof take_line - 1 };
enum { LOGIN_LENGTH = sizeof login_line - 1, LOGIN_LINE_MAX = LOGIN_LENGTH + 64 };

static bool is_open(const struct net_client *client) {
    return client->stream.ops != NULL && !client->gone;
}

void net_hub_init(struct net_hub *hub, const struct net_hub_sizes *sizes, const struct net_hub_ops *ops,
                  void *ctx) {
    *hub = (struct net_hub){.ops = ops, .ctx = ctx, .sizes = *sizes};
}

/* ---- messages to clients ---- */

/* An observer that does not read is disconnected; so is an owner, but much later. */
static void say(struct net_hub *hub, struct net_client *client, const char *bytes, size_t count) {
    size_t most = client == hub->owner ? 2 * hub->sizes.out : hub->sizes.out;
    if (!is_open(client))
        return;
    if (client->out.count + count <= most && net_queue_add(&client->out, bytes, count))
        return;
    client->gone = true;
    hub->ops->event(hub->ctx, "disconnected: it does not read", client->name);
}

static void say_message(struct net_hub *hub, struct net_client *client, const char *text) {
    char line[NET_MESSAGE_SIZE + sizeof "[MSG:]\r\n"];
    int size = snprintf(line, sizeof line, "[MSG:%s]\r\n", text);
    say(hub, client, line, (size_t)size);
}

void net_hub_tell(struct net_hub *hub, const char *text) {
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++)
        if (!client->locked)
            say_message(hub, client, text);
}

static void tell_observers(struct net_hub *hub, const char *text) {
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++)
        if (client != hub->owner && !client->locked)
            say_message(hub, client, text);
}

static void explain(struct net_hub *hub, struct net_client *observer) {
    char text[NET_NAME_SIZE + 64];
    if (hub->owner == NULL) {
        say_message(hub, observer, nobody);
        return;
    }
    snprintf(text, sizeof text, "Observer: %s is in control, %s takes control", hub->owner->name, take_line);
    say_message(hub, observer, text);
}

/* Notices for a client that may take control from now on. */
static void greet(struct net_hub *hub, struct net_client *client) {
    char text[NET_MESSAGE_SIZE];
    for (unsigned n = 0; hub->ops->notice != NULL && hub->ops->notice(hub->ctx, n, text, sizeof text); n++)
        say_message(hub, client, text);
    if (hub->owner != NULL)
        explain(hub, client);
}

/* ---- jogs that are called off ---- */

/* Jogs that still wait when they are called off must not run behind that: they become empty lines, so that
 * each has its answer; a half one when its rest has come. So does the controller with those that it has. */
static void call_off_jogs(struct net_client *client) {
    struct net_queue *in = &client->in;
    client->called_off = in->count > client->whole;
    if (client->whole > 0)
        client->whole = net_line_empty_jogs(in->bytes + in->begin, client->whole, &in->count);
}

/* ---- ownership ---- */

/* What the owner has sent stays in force: whole lines go to `left`. A half line is forgotten; if the
 * controller has got a part of it, it is ended, and its answer (too long) is no one's. */
static void leave_lines(struct net_hub *hub, struct net_client *client) {
    bool half = client->in.count > client->whole;
    if (client->whole == 0 && client->in_long) {
        net_queue_cut(&client->in, 0);
        if (net_queue_add(&client->in, "\n", 1))
            client->whole = 1;
    }
    if (hub->left.count + client->whole > hub->sizes.left ||
        !net_queue_add(&hub->left, net_queue_head(&client->in), client->whole))
        net_hub_tell(hub, "Queue full: lines of the previous owner discarded");
    else if (half)
        tell_observers(hub, "Incomplete line discarded: the sender disconnected");
    client->skips |= half;
    client->in_long = client->called_off = false;
    client->whole = 0;
    net_queue_free(&client->in);
}

static void set_owner(struct net_hub *hub, struct net_client *client) {
    char text[NET_NAME_SIZE + 32];
    struct net_client *before = hub->owner;
    hub->owner = NULL;
    if (before != NULL)
        leave_lines(hub, before);
    hub->owner = client;
    hub->inside_left = hub->inside;
    for (struct net_client *other = hub->client; other < hub->client + NET_CLIENTS; other++)
        other->hears_left = other != client;
    if (client == NULL) {
        tell_observers(hub, nobody);
        return;
    }
    client->letters = 0;
    hub->sender = client;
    hub->ops->event(hub->ctx, "owner", client->name);
    snprintf(text, sizeof text, "%s commands", client->name);
    tell_observers(hub, text);
    if (before != NULL)
        explain(hub, before);
}

/* ---- connections ---- */

bool net_hub_is_full(const struct net_hub *hub) {
    for (size_t i = 0; i < hub->sizes.clients; i++)
        if (hub->client[i].stream.ops == NULL)
            return false;
    return true;
}

static void lose_sender(struct net_hub *hub) {
    hub->sender = NULL;
    if (hub->ops->left != NULL)
        hub->ops->left(hub->ctx, hub->left.count > 0);
}

static void remove_client(struct net_hub *hub, struct net_client *client) {
    if (client == hub->owner) {
        call_off_jogs(client);
        set_owner(hub, NULL);
    }
    if (client == hub->sender)
        lose_sender(hub);
    struct net_client removed = *client;
    net_queue_free(&client->in);
    net_queue_free(&client->out);
    *client = (struct net_client){0};
    removed.stream.ops->close(&removed.stream);
    hub->ops->event(hub->ctx, "disconnected", removed.name);
}

/* @return NULL: all places are taken by clients that may stay */
static struct net_client *free_place(struct net_hub *hub) {
    struct net_client *locked = NULL;
    for (struct net_client *client = hub->client; client < hub->client + hub->sizes.clients; client++) {
        if (client->stream.ops == NULL)
            return client;
        if (client->locked && locked == NULL)
            locked = client;
    }
    if (locked != NULL)
        remove_client(hub, locked);
    return locked;
}

bool net_hub_connect(struct net_hub *hub, const struct net_stream *stream, const char *name) {
    static const char full[] = "[MSG:Connection refused: all client slots are in use]\r\n";
    struct net_client *client = free_place(hub);
    if (client == NULL) {
        stream->ops->write(stream, full, sizeof full - 1);
        stream->ops->close(stream);
        hub->ops->event(hub->ctx, "refused, all client slots are in use", name);
        return false;
    }
    *client = (struct net_client){.stream = *stream, .locked = hub->locks && !stream->local};
    snprintf(client->name, sizeof client->name, "%s", name);
    hub->ops->event(hub->ctx, "connected", name);
    if (client->locked)
        say_message(hub, client, locked_out);
    else
        greet(hub, client);
    return true;
}

void net_hub_close(struct net_hub *hub) {
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++)
        if (client->stream.ops != NULL)
            remove_client(hub, client);
    net_queue_free(&hub->left);
}

static bool is_busy(const struct net_hub *hub) {
    return hub->ops->busy != NULL && hub->ops->busy(hub->ctx);
}

/* No more comes from it, but it may still want to hear the answers to what it sent (`nc`). One that has
 * closed its connection altogether looks the same, until something is written to it. */
static void end_client(struct net_hub *hub, struct net_client *client) {
    client->ended = true;
    if (client != hub->owner)
        return;
    set_owner(hub, NULL);
    if (is_busy(hub) || hub->left.count > 0)
        say_message(hub, client, "End of input: the received lines are still executed");
}

static bool has_heard_all(const struct net_hub *hub, const struct net_client *client) {
    bool waits = client == hub->sender && is_busy(hub);
    return client->ended && hub->inside_left == 0 && hub->left.count == 0 && client->out.count == 0 && !waits;
}

/* A transport may tell only a reader that the other end is gone. */
static void look_after(struct net_client *client) {
    char byte;
    if (client->ended && client->stream.ops->read(&client->stream, &byte, 1) == NET_GONE)
        client->gone = true;
}

/* ---- real-time bytes ---- */

/* A reset forgets every line on its way; what comes behind it is new. */
static void net_hub_reset(struct net_hub *hub) {
    static const char reset = 0x18;
    struct net_client *owner = hub->owner;
    if (owner != NULL) {
        net_queue_drop(&owner->in, owner->in.count);
        owner->whole = 0;
        owner->in_long = owner->called_off = false;
    }
    net_queue_drop(&hub->left, hub->left.count);
    hub->ops->put(hub->ctx, &reset, 1);
    hub->ops->act(hub->ctx);
    net_hub_hear(hub);
}

static bool may_ask(const struct net_hub *hub) {
    return hub->owner == NULL || hub->owner->out.count < hub->sizes.out / 2;
}

static void put_realtime(struct net_hub *hub, struct net_client *client, uint8_t byte) {
    const char character = (char)byte;
    if (byte == 0x18)
        net_hub_reset(hub);
    else if (byte == '?' && !may_ask(hub))
        client->asks = true;
    else
        hub->ops->put(hub->ctx, &character, 1);
    if (byte == JOG_CANCEL || byte == '!')
        call_off_jogs(client);
}

void net_hub_ask(struct net_hub *hub) {
    bool asks = false;
    if (!may_ask(hub))
        return;
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++) {
        asks |= client->asks;
        client->asks = false;
    }
    if (asks)
        hub->ops->put(hub->ctx, "?", 1);
}

/* ---- bytes of the owner and of observers ---- */

static bool is_take(const char *line, size_t size) {
    return size == TAKE_LENGTH && net_line_commands(line, size, take_line);
}

/* The owner's `$TAKE` is an empty line: like any line it is answered once, and it is true already. So is a
 * jog that was called off before its line was whole. */
static void end_line(struct net_client *owner) {
    const char *line = net_queue_head(&owner->in) + owner->whole;
    size_t size = owner->in.count - owner->whole;
    if (is_take(line, size) || (owner->called_off && net_line_is_jog(line, size)))
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

static void take_owners(struct net_hub *hub, struct net_client *client, char character, bool line_ends) {
    if (client->skips) {
        client->skips = !line_ends;
        client->spoiled &= !line_ends;
        return;
    }
    if (client->spoiled)
        hub->has_spoiled |= add_owners(hub, client, &(char){(char)NET_LINE_SPOILED}, 1);
    client->spoiled = false;
    if (line_ends) {
        end_line(client);
        character = '\n';
    }
    if (add_owners(hub, client, &character, 1) && line_ends)
        client->whole = client->in.count;
}

/* Observers' lines are read for $TAKE only. */
static void take_observers(struct net_hub *hub, struct net_client *client, char character, bool line_ends) {
    if (!line_ends) {
        bool fits =
            client->letters < TAKE_LENGTH && net_line_upper(character) == (uint8_t)take_line[client->letters];
        client->letters =
            fits && !client->skips && !client->spoiled ? (uint8_t)(client->letters + 1) : UINT8_MAX;
        return;
    }
    bool takes = client->letters == TAKE_LENGTH && !client->skips && !client->spoiled;
    bool empty = client->letters == 0 && !client->spoiled;
    client->letters = 0;
    client->skips = client->spoiled = false;
    if (takes) {
        set_owner(hub, client);
        take_owners(hub, client, '\n', true);
    } else if (!empty) {
        explain(hub, client);
    }
}

static bool is_login(const struct net_client *client) {
    return net_line_commands(net_queue_head(&client->in), client->in.count, login_line);
}

static void log_in(struct net_hub *hub, struct net_client *client) {
    static const char *const said[] = {[NET_GATE_WRONG] = "Wrong password",
                                       [NET_GATE_WAIT] = "Too many wrong passwords: wait, then try again"};
    if (!is_login(client)) {
        say_message(hub, client, locked_out);
        net_queue_free(&client->in);
        return;
    }
    enum net_gate_result result =
        hub->ops->login(hub->ctx, client->stream.peer, net_queue_head(&client->in) + LOGIN_LENGTH,
                        client->in.count - LOGIN_LENGTH);
    net_queue_free(&client->in);
    hub->ops->event(hub->ctx, result == NET_GATE_GOOD ? "logged in" : "not logged in", client->name);
    if (result != NET_GATE_GOOD) {
        say_message(hub, client, said[result]);
        return;
    }
    client->locked = false;
    say(hub, client, "ok\r\n", 4);
    greet(hub, client);
}

/* In a password real-time characters are letters like others. A line that is too long is none. */
static void take_locked(struct net_hub *hub, struct net_client *client, uint8_t byte) {
    const char character = (char)byte;
    if (byte == '\n' || byte == '\r') {
        if (client->in.count > 0)
            log_in(hub, client);
        return;
    }
    if (net_line_is_realtime(byte) && !is_login(client)) {
        client->asks |= byte == '?';
        return;
    }
    if (client->in.count < LOGIN_LINE_MAX)
        (void)net_queue_add(&client->in, &character, 1);
}

static void take_byte(struct net_hub *hub, struct net_client *client, uint8_t byte) {
    bool mid_line = client->letters != 0 || client->skips;
    if (client->locked) {
        take_locked(hub, client, byte);
        return;
    }
    if (byte == '?' && client != hub->owner) {
        client->asks = true;
        return;
    }
    if (hub->owner == NULL && !mid_line)
        set_owner(hub, client);
    if (net_line_is_realtime(byte)) {
        if (client == hub->owner)
            put_realtime(hub, client, byte);
        return;
    }
    bool second_half = byte == '\n' && client->after_cr;
    client->after_cr = byte == '\r';
    if (second_half)
        return;
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
    return run;
}

static void take_bytes(struct net_hub *hub, struct net_client *client, const char *bytes, size_t count) {
    char reply[NET_TELNET_REPLY];
    size_t reply_count = 0;
    for (size_t i = 0; i < count && is_open(client); i++) {
        i += take_run(hub, client, bytes + i, count - i);
        if (i == count || !is_open(client))
            return;
        uint8_t byte = (uint8_t)bytes[i];
        bool is_data =
            !client->stream.telnet || net_telnet_take(&client->telnet, byte, reply, &reply_count) != 0;
        if (is_data)
            take_byte(hub, client, byte);
        else if (reply_count > 0)
            say(hub, client, reply, reply_count);
    }
}

bool net_hub_wants_read(const struct net_hub *hub, const struct net_client *client) {
    return is_open(client) && !client->ended && (client != hub->owner || client->in.count < hub->sizes.in);
}

bool net_hub_wants_write(const struct net_client *client) {
    return is_open(client) && client->out.count > 0;
}

bool net_hub_read(struct net_hub *hub, struct net_client *client) {
    char bytes[READ_SIZE];
    size_t room = hub->sizes.in - client->in.count;
    size_t size = room < READ_SIZE ? room : READ_SIZE;
    if (!net_hub_wants_read(hub, client))
        return false;
    long count;
    bool spoiled;
    do {
        spoiled = false;
        while ((count = client->stream.ops->read(&client->stream, bytes, size)) <= NET_LOST) {
            client->spoiled = spoiled = true;
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
static uint32_t lines_allowed(const struct net_hub *hub) {
    size_t taken = hub->owner == NULL ? 0 : hub->owner->out.count;
    return taken >= hub->sizes.out ? 0 : (uint32_t)((hub->sizes.out - taken) / NET_ANSWER_MAX);
}

/* Give the first `count` bytes of the queue, line by line. @return bytes the controller took */
static size_t feed_lines(struct net_hub *hub, struct net_queue *queue, size_t count) {
    const uint32_t allowed = lines_allowed(hub);
    size_t fed = 0;
    while (fed < count && hub->inside < allowed) {
        const char *line = net_queue_head(queue);
        const char *line_end = memchr(line, '\n', count - fed);
        size_t size = line_end == NULL ? count - fed : (size_t)(line_end + 1 - line);
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
    size_t fed = feed_lines(hub, &hub->left, hub->left.count);
    hub->inside_left += hub->inside - before;
    return fed > 0;
}

/* A line longer than the queue continues as it comes: the controller will refuse it. */
static bool feed_owner(struct net_hub *hub, struct net_client *owner) {
    bool too_long = owner->whole == 0 && owner->in.count == hub->sizes.in;
    size_t fed = feed_lines(hub, &owner->in, too_long ? owner->in.count : owner->whole);
    if (fed == 0)
        return false;
    owner->in_long = too_long;
    owner->whole -= too_long ? 0 : fed;
    return true;
}

bool net_hub_feed(struct net_hub *hub) {
    bool fed = hub->left.count > 0 ? feed_left(hub) : hub->owner != NULL && feed_owner(hub, hub->owner);
    hub->has_spoiled &= hub->left.count > 0 || (hub->owner != NULL && hub->owner->in.count > 0);
    return fed;
}

/* ---- the controller's output ---- */

/* The controller has reset, by itself, by a button, or because a line said so: as it forgets all that it has
 * got, what waits here would be the rest of something. Senders begin again when they see the banner. */
static void forget_lines(struct net_hub *hub) {
    struct net_client *owner = hub->owner;
    bool any = hub->left.count > 0 || (owner != NULL && owner->in.count > 0);
    net_queue_drop(&hub->left, hub->left.count);
    if (owner != NULL) {
        owner->skips |= owner->in.count > owner->whole || owner->in_long;
        net_queue_drop(&owner->in, owner->in.count);
        owner->whole = 0;
        owner->in_long = owner->called_off = false;
    }
    hub->inside = hub->inside_left = 0; /* what was inside is not answered any more */
    if (any)
        net_hub_tell(hub, "Queued lines discarded by the reset");
}

/* Count answers; those to former owners' lines do not go to clients that would take them for their own. */
static void say_line(struct net_hub *hub, const char *line, size_t size) {
    bool answer = net_line_begins(line, size, "ok\r") || net_line_begins(line, size, "error:");
    bool of_left = hub->inside_left > 0 && !net_line_is_news(line, size);
    if (net_line_begins(line, size, "Grbl "))
        forget_lines(hub);
    hub->inside -= answer && hub->inside > 0;
    hub->inside_left -= answer && of_left;
    bool report = net_line_begins(line, size, "<");
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++)
        if (client->stream.ops != NULL && (report || !client->locked) && (!of_left || client->hears_left))
            say(hub, client, line, size);
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

static void write_out(struct net_client *client) {
    while (client->out.count > 0) {
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
            write_out(client);
        if (client->gone || has_heard_all(hub, client))
            remove_client(hub, client);
    }
}
