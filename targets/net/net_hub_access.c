/* SPDX-License-Identifier: MIT */
#include "net_hub_inner.h"
#include "net_line.h"

#include <stdio.h>
#include <string.h>

static const char login_line[] = "$LOGIN=";
static const char question_line[] = "$LOGIN";
static const char trust_line[] = "$TRUST=";
static const char list_line[] = "$TRUST";
#define BUTTON_US    60000000u
#define FORGOTTEN_US 1800000000u
enum {
    LOGIN_LENGTH = sizeof login_line - 1,
    TRUST_LENGTH = sizeof trust_line - 1,
    PROOF_LENGTH = 2 * SHA256_SIZE /* no key is that long */
};

_Static_assert((int)PROOF_LENGTH > (int)ACCESS_KEY_BYTES, "the length tells a proof from a key");

static const struct span {
    const char *word;
    const char *text;
    enum access_span span;
} spans[] = {
    {"no", "This address is not trusted any more", ACCESS_NOT},
    {"day", "Clients of this address are trusted for a day", ACCESS_DAY},
    {"always", "Clients of this address are trusted until $TRUST=no", ACCESS_ALWAYS},
};

static bool is_word(const char *text, size_t size, const char *word) {
    if (size != strlen(word))
        return false;
    for (size_t i = 0; i < size; i++)
        if (net_line_upper(text[i]) != net_line_upper(word[i]))
            return false;
    return true;
}

static const char *trust(const struct net_hub *hub, const struct net_client *client,
                         const struct span *span) {
    if (client->stream.local)
        return "A serial port needs no trust";
    if (hub->access == NULL || hub->access->open)
        return "Access is open: no address needs trust";
    return access_trust_at(hub->access, client->stream.peer, client->stream.host, span->span)
               ? NULL
               : "Too many trusted addresses: $TRUST=no at one of them makes room";
}

static bool is_trust(const char *line, size_t size) {
    return net_line_commands(line, size, trust_line) || is_word(line, size, list_line);
}

static size_t put_groups(char *text, size_t size, const char *begin, uint64_t half) {
    return (size_t)snprintf(text, size, "%s%x:%x:%x:%x", begin, (unsigned)(half >> 48 & 0xFFFF),
                            (unsigned)(half >> 32 & 0xFFFF), (unsigned)(half >> 16 & 0xFFFF),
                            (unsigned)(half & 0xFFFF));
}

/* As peer_of() in net_tcp.c makes it: the two halves of a link-local address are its lower one. */
static void put_address(char *text, size_t size, uint64_t who, uint64_t host) {
    const bool is_ipv4 = lockout_ipv4((const uint8_t[4]){0}) == (who & ~(uint64_t)UINT32_MAX);
    if (is_ipv4) {
        snprintf(text, size, "%u.%u.%u.%u", (unsigned)(who >> 24 & 255), (unsigned)(who >> 16 & 255),
                 (unsigned)(who >> 8 & 255), (unsigned)(who & 255));
        return;
    }
    const size_t count = host == who ? 0 : put_groups(text, size, "", who);
    if (host != 0)
        (void)put_groups(text + count, size - count, count == 0 ? "fe80::" : ":", host);
}

static void list_trust(struct net_hub *hub, struct net_client *client) {
    const struct access *access = hub->access;
    for (unsigned i = 0; access != NULL && i < ACCESS_TRUSTED; i++) {
        const struct access_trust *row = &access->trust[i];
        char address[NET_NAME_SIZE], line[NET_NAME_SIZE + 40];
        if (row->who == 0)
            continue;
        put_address(address, sizeof address, row->who, row->host);
        int size = row->end_us == UINT64_MAX
                       ? snprintf(line, sizeof line, "[TRUST:%u,%s,always]\r\n", i + 1, address)
                       : snprintf(line, sizeof line, "[TRUST:%u,%s,%u]\r\n", i + 1, address,
                                  (unsigned)((row->end_us - access->now_us) / 1000000));
        net_hub_say(hub, client, line, (size_t)size);
    }
}

/* `none`, or `no` and a place of the list. @return what to say; NULL: it is neither */
static const char *revoke(struct access *access, const char *word, size_t size) {
    unsigned place = ACCESS_TRUSTED;
    if (is_word(word, size, "none")) {
        for (unsigned i = 0; i < ACCESS_TRUSTED; i++)
            access_revoke(access, i);
        return "No address is trusted any more";
    }
    if (size == sizeof "no 1" - 1 && net_line_commands(word, size, "NO "))
        place = (unsigned)(word[size - 1] - '1');
    if (place >= ACCESS_TRUSTED)
        return NULL;
    access_revoke(access, place);
    return "That address is not trusted any more";
}

/* A sender that was connected before: what it has sent is lost, so it must not continue in the middle. */
static const char trusted_now[] = "This address is trusted now: connect again";

static bool is_trusted_now(const struct net_hub *hub, const struct net_client *client) {
    return net_hub_trusts(hub, &client->stream);
}

static void explain_trust_to_all(struct net_hub *hub) {
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++)
        if (net_hub_is_open(client) && client->locked && !client->waits && is_trusted_now(hub, client))
            net_hub_say_message(hub, client, trusted_now);
}

static bool take_trust(struct net_hub *hub, struct net_client *client, const char *line, size_t size) {
    const char *word = line + TRUST_LENGTH, *refusal = "$TRUST is no, day, always, none, or no and a number";
    if (is_word(line, size, list_line)) {
        list_trust(hub, client);
        return true;
    }
    const char *revoked = hub->access != NULL ? revoke(hub->access, word, size - TRUST_LENGTH) : NULL;
    if (revoked != NULL) {
        net_hub_say_message(hub, client, revoked);
        return true;
    }
    for (size_t i = 0; i < sizeof spans / sizeof spans[0]; i++) {
        if (!is_word(word, size - TRUST_LENGTH, spans[i].word))
            continue;
        refusal = trust(hub, client, &spans[i]);
        if (refusal == NULL) {
            net_hub_say_message(hub, client, spans[i].text);
            explain_trust_to_all(hub);
            return true;
        }
    }
    net_hub_say_message(hub, client, refusal);
    return false;
}

const char *net_hub_key_for(const struct net_hub *hub, const struct net_client *client) {
    const bool shows = client->stream.local && hub->ops->key != NULL && net_hub_locks(hub);
    return shows ? hub->ops->key(hub->ctx) : NULL;
}

void net_hub_tell_key(struct net_hub *hub, struct net_client *client) {
    char text[NET_MESSAGE_SIZE];
    const char *key = net_hub_key_for(hub, client);
    if (key == NULL)
        return;
    snprintf(text, sizeof text, "Access key of network clients: %s", key);
    net_hub_say_message(hub, client, text);
}

bool net_hub_is_login(const char *line, size_t size) {
    return net_line_commands(line, size, login_line);
}

static bool is_question(const char *line, size_t size) {
    return is_word(line, size, question_line);
}

static void put_hex(char *text, const uint8_t *bytes, size_t count) {
    for (size_t i = 0; i < count; i++)
        snprintf(text + 2 * i, 3, "%02x", bytes[i]);
}

static void ask_proof(struct net_hub *hub, struct net_client *client) {
    char nonce[2 * ACCESS_NONCE + 1], salt[2 * ACCESS_SALT + 1], line[sizeof nonce + sizeof salt + 32];
    uint8_t bytes[ACCESS_NONCE];
    hub->questions++;
    memcpy(client->typed, &hub->questions, sizeof hub->questions);
    client->letters = 1;
    access_nonce(hub->access, hub->questions, bytes);
    put_hex(nonce, bytes, sizeof bytes);
    put_hex(salt, hub->access->salt, ACCESS_SALT);
    int size = snprintf(line, sizeof line, "[LOGIN:%s,%s,%d]\r\nok\r\n", nonce, salt, (int)ACCESS_ROUNDS);
    net_hub_say(hub, client, line, (size_t)size);
}

static int digit_of(char letter) {
    return letter >= '0' && letter <= '9'   ? letter - '0'
           : letter >= 'a' && letter <= 'f' ? letter - 'a' + 10
                                            : -1;
}

static bool take_proof(const char *text, size_t size, uint8_t proof[SHA256_SIZE]) {
    if (size != PROOF_LENGTH)
        return false;
    for (size_t i = 0; i < SHA256_SIZE; i++) {
        int high = digit_of(text[2 * i]), low = digit_of(text[2 * i + 1]);
        if (high < 0 || low < 0)
            return false;
        proof[i] = (uint8_t)(high * 16 + low);
    }
    return true;
}

enum access_result net_hub_try_login(struct net_hub *hub, struct net_client *client) {
    const char *text = net_queue_head(&client->in) + LOGIN_LENGTH;
    const size_t size = (size_t)(client->login_size - LOGIN_LENGTH);
    uint8_t proof[SHA256_SIZE];
    uint32_t number;
    if (!take_proof(text, size, proof))
        return access_try(hub->access, client->stream.peer, client->heard_us, text, size);
    if (client->letters == 0) /* nothing to prove: as wrong as any other */
        return access_try(hub->access, client->stream.peer, client->heard_us, "", 0);
    memcpy(&number, client->typed, sizeof number);
    const enum access_result result =
        access_answer(hub->access, client->stream.peer, client->heard_us, number, proof);
    /* Each question may be answered once, right or wrong. */
    if (result != ACCESS_WAIT)
        client->letters = 0;
    return result;
}

void net_hub_end_login(struct net_hub *hub, struct net_client *client, enum access_result result) {
    client->waits = false;
    hub->ops->event(hub->ctx, result == ACCESS_GOOD ? "logged in" : "not logged in", client->name);
    if (result != ACCESS_GOOD) {
        net_hub_refuse(hub, client, STATUS_NOT_LOGGED_IN, "Wrong access key");
        return;
    }
    client->locked = false;
    client->letters = 0;
    net_hub_say(hub, client, "ok\r\n", 4);
    net_hub_greet(hub, client);
}

/* The time begins with the first try, not with each: who tries all day has one minute of it. */
static void note_knock(struct net_hub *hub, const struct net_client *client) {
    struct net_hub_knock *knock = &hub->knock;
    const uint64_t peer = client->stream.peer, host = client->stream.host;
    const bool is_same = peer == knock->peer && host == knock->host;
    const bool recent = knock->peer != 0 && hub->now_us - knock->last_us < BUTTON_US;
    const bool open = knock->peer != 0 && hub->now_us - knock->first_us < BUTTON_US;
    if (!is_same && open)
        knock->more = true; /* whom it would let in is not known */
    else if (!is_same || !recent)
        *knock = (struct net_hub_knock){.peer = peer, .host = host, .first_us = hub->now_us};
    knock->last_us = peer == knock->peer && host == knock->host ? hub->now_us : knock->last_us;
}

void net_hub_log_in(struct net_hub *hub, struct net_client *client) {
    if (is_question(net_queue_head(&client->in), client->in.count)) {
        ask_proof(hub, client);
        net_queue_free(&client->in);
        return;
    }
    if (net_hub_answer_reports(hub, client, net_queue_head(&client->in), client->in.count)) {
        net_queue_free(&client->in);
        return;
    }
    if (!net_hub_is_login(net_queue_head(&client->in), client->in.count)) {
        const bool trusted = is_trusted_now(hub, client);
        const char *why = trusted ? trusted_now : net_hub_locked_out;
        net_hub_refuse(hub, client, STATUS_NOT_LOGGED_IN, client->explained ? NULL : why);
        client->explained = true;
        if (!trusted)
            note_knock(hub, client);
        net_queue_free(&client->in);
        return;
    }
    client->login_size = (uint8_t)client->in.count;
    enum access_result result = net_hub_try_login(hub, client);
    client->waits = result == ACCESS_WAIT;
    if (client->waits)
        return;
    net_queue_free(&client->in);
    net_hub_end_login(hub, client, result);
}

/* ---- the start button ---- */

static void let_in(struct net_hub *hub, struct net_client *client) {
    client->locked = false;
    client->by_trust = true;
    client->letters = 0;
    net_queue_free(&client->in);
    net_hub_say_message(hub, client, "Let in by the start button");
    net_hub_greet(hub, client);
}

void net_hub_follow_button(struct net_hub *hub) {
    struct net_hub_knock *knock = &hub->knock;
    const uint8_t presses = hub->ops->presses != NULL ? hub->ops->presses(hub->ctx) : hub->presses;
    const bool pressed = presses != hub->presses;
    hub->presses = presses;
    if (knock->peer != 0 && hub->now_us - knock->last_us >= FORGOTTEN_US)
        knock->peer = 0; /* before the clock wraps */
    if (!pressed || knock->peer == 0 || !net_hub_locks(hub) || hub->now_us - knock->first_us >= BUTTON_US)
        return;
    char address[NET_NAME_SIZE], text[NET_NAME_SIZE + 48];
    put_address(address, sizeof address, knock->peer, knock->host);
    if (knock->more) {
        net_hub_tell(hub, "Start button: several addresses have tried to command, so none is let in");
        return;
    }
    if (!access_trust_at(hub->access, knock->peer, knock->host, ACCESS_DAY)) {
        net_hub_tell(hub, "Start button: too many trusted addresses, $TRUST=no at one of them makes room");
        return;
    }
    snprintf(text, sizeof text, "Start button: %s is trusted for a day", address);
    net_hub_tell(hub, text);
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++)
        if (net_hub_is_open(client) && client->locked && !client->waits &&
            client->stream.peer == knock->peer && client->stream.host == knock->host)
            let_in(hub, client);
    knock->peer = 0;
}

bool net_hub_may_stop(struct net_hub *hub, struct net_client *client, uint8_t byte) {
    bool holds = byte == '!' || byte == DOOR;
    if (!holds && byte != JOG_CANCEL && byte != RESET)
        return false;
    if (byte == RESET && !client->braked) {
        if (!client->told)
            net_hub_say_message(hub, client, "No reset by an observer: hold first (!), then reset");
        client->told = true;
        return false;
    }
    client->braked |= holds;
    hub->ops->event(hub->ctx, holds ? "holds the machine" : "stops the machine", client->name);
    return true;
}

bool net_hub_is_access_line(const char *line, size_t size) {
    return is_trust(line, size) || net_hub_is_login(line, size) || is_question(line, size);
}

void net_hub_answer_access(struct net_hub *hub, struct net_client *client, const char *line, size_t size) {
    const bool trusts = is_trust(line, size);
    const bool done = !trusts || take_trust(hub, client, line, size);
    if (done)
        net_hub_say(hub, client, "ok\r\n", 4);
    else
        net_hub_refuse(hub, client, STATUS_UNKNOWN_COMMAND, NULL);
    if (trusts && done && hub->access != NULL)
        net_hub_end_untrusted(hub, client);
}
