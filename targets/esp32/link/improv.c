/* SPDX-License-Identifier: MIT */
#include "link/improv.h"

#include <stdio.h>
#include <string.h>

/* A packet: IMPROV, version, type, length, data, and the sum of all bytes before it. */
enum { VERSION = 1, NAME_SIZE = 6, TYPE_AT = 7, LENGTH_AT = 8 };
enum type { TYPE_STATE = 1, TYPE_ERROR = 2, TYPE_RPC = 3, TYPE_RESULT = 4 };
enum state { STATE_READY = 2, STATE_JOINING = 3, STATE_JOINED = 4 };
enum error { ERROR_NONE = 0, ERROR_PACKET = 1, ERROR_COMMAND = 2, ERROR_CONNECT = 3, ERROR_OTHER = 0xFF };
enum command { COMMAND_JOIN = 1, COMMAND_STATE = 2, COMMAND_INFO = 3, COMMAND_SCAN = 4 };

/* A packet that stops in the middle is forgotten, so that the port is not deaf for ever. */
enum { PACKET_US = 500000, JOIN_US = 30000000, SCAN_US = 15000000 };

static const char name[] = "IMPROV";

/* ---- out ---- */

static uint8_t sum(const uint8_t *bytes, size_t count) {
    uint8_t total = 0;
    for (size_t i = 0; i < count; i++)
        total = (uint8_t)(total + bytes[i]);
    return total;
}

/* The line end before it ends whatever is on the line; who reads packets looks at line begins. A host
 * that does not read loses packets, and asks again. */
static void say(struct improv *improv, enum type type, const uint8_t *data, size_t size) {
    size_t whole = 1 + IMPROV_HEAD + size + 2;
    if (improv->out_count + whole > IMPROV_OUT)
        return;
    uint8_t *out = improv->out + improv->out_count;
    *out++ = '\n';
    memcpy(out, name, NAME_SIZE);
    out[NAME_SIZE] = VERSION;
    out[TYPE_AT] = (uint8_t)type;
    out[LENGTH_AT] = (uint8_t)size;
    memcpy(out + IMPROV_HEAD, data, size);
    out[IMPROV_HEAD + size] = sum(out, IMPROV_HEAD + size);
    out[IMPROV_HEAD + size + 1] = '\n';
    improv->out_count += whole;
}

static void say_state(struct improv *improv, enum state state) {
    say(improv, TYPE_STATE, &(uint8_t){(uint8_t)state}, 1);
}

static void say_error(struct improv *improv, enum error error) {
    say(improv, TYPE_ERROR, &(uint8_t){(uint8_t)error}, 1);
}

/* A result is a list of texts; one that has no room any more is left out. */
static void say_result(struct improv *improv, enum command command, const char *const *texts, size_t count) {
    uint8_t data[IMPROV_DATA_MAX] = {(uint8_t)command, 0};
    size_t size = 2;
    for (size_t i = 0; i < count; i++) {
        size_t length = strlen(texts[i]);
        if (size + 1 + length > IMPROV_DATA_MAX)
            break;
        data[size++] = (uint8_t)length;
        memcpy(data + size, texts[i], length);
        size += length;
    }
    data[1] = (uint8_t)(size - 2);
    say(improv, TYPE_RESULT, data, size);
}

static void say_joined(struct improv *improv, enum command command, const char *address) {
    say_state(improv, STATE_JOINED);
    say_result(improv, command, &address, 1);
}

/* Between two lines of the hub. */
static void flush(struct improv *improv) {
    if (improv->mid_line || improv->out_count == 0)
        return;
    long took = improv->inner.ops->write(&improv->inner, (const char *)improv->out + improv->out_sent,
                                         improv->out_count - improv->out_sent);
    improv->out_sent += took > 0 ? (size_t)took : 0;
    if (improv->out_sent == improv->out_count)
        improv->out_sent = improv->out_count = 0;
}

/* ---- commands ---- */

/* A text with its length before it, NUL-terminated. @return false: it is longer than its data or than size -
 * 1 */
static bool take_text(const uint8_t **data, size_t *left, char *text, size_t size) {
    if (*left < 1 || **data > *left - 1 || **data >= size)
        return false;
    size_t length = **data;
    memcpy(text, *data + 1, length);
    text[length] = '\0';
    *data += 1 + length;
    *left -= 1 + length;
    return strlen(text) == length;
}

static void join(struct improv *improv, const uint8_t *data, size_t size) {
    char network[WIFI_SSID_MAX + 1], password[WIFI_PASSWORD_MAX + 1];
    bool good = take_text(&data, &size, network, sizeof network) &&
                take_text(&data, &size, password, sizeof password) && size == 0;
    if (!good || network[0] == '\0' || (password[0] != '\0' && strlen(password) < WIFI_PASSWORD_MIN)) {
        say_error(improv, ERROR_PACKET);
        return;
    }
    if (!improv->ops->join(improv->ops->ctx, network, password)) {
        say_error(improv, ERROR_OTHER);
        return;
    }
    improv->joining = true;
    improv->join_us = improv->ops->now_us(improv->ops->ctx);
    say_error(improv, ERROR_NONE);
    say_state(improv, STATE_JOINING);
}

static void tell_state(struct improv *improv) {
    char address[IMPROV_TEXT_MAX];
    if (improv->joining)
        say_state(improv, STATE_JOINING);
    else if (improv->ops->joined(improv->ops->ctx, address))
        say_joined(improv, COMMAND_STATE, address);
    else
        say_state(improv, STATE_READY);
}

static void tell_info(struct improv *improv) {
    const struct improv_info *info = improv->info;
    const char *const texts[] = {info->firmware, info->version, info->chip, info->name};
    say_result(improv, COMMAND_INFO, texts, sizeof texts / sizeof texts[0]);
}

static void scan(struct improv *improv) {
    if (!improv->scanning && !improv->ops->scan(improv->ops->ctx)) {
        say_error(improv, ERROR_OTHER);
        return;
    }
    improv->scanning = true;
    improv->scan_us = improv->ops->now_us(improv->ops->ctx);
    improv->scan_told = 0;
}

static void obey(struct improv *improv) {
    const uint8_t *data = improv->packet + IMPROV_HEAD;
    size_t size = improv->packet[LENGTH_AT];
    bool good = improv->packet[IMPROV_HEAD + size] == sum(improv->packet, IMPROV_HEAD + size);
    if (!good || improv->packet[TYPE_AT] != TYPE_RPC || size < 2 || data[1] != size - 2) {
        say_error(improv, ERROR_PACKET);
        return;
    }
    switch (data[0]) {
    case COMMAND_JOIN:
        join(improv, data + 2, size - 2);
        return;
    case COMMAND_STATE:
        tell_state(improv);
        return;
    case COMMAND_INFO:
        tell_info(improv);
        return;
    case COMMAND_SCAN:
        scan(improv);
        return;
    default:
        say_error(improv, ERROR_COMMAND);
    }
}

/* What became of a join. */
static void watch_join(struct improv *improv, uint32_t now_us) {
    char address[IMPROV_TEXT_MAX];
    if (!improv->joining)
        return;
    if (improv->ops->joined(improv->ops->ctx, address)) {
        improv->joining = false;
        say_joined(improv, COMMAND_JOIN, address);
    } else if (now_us - improv->join_us >= JOIN_US) {
        improv->joining = false;
        say_error(improv, ERROR_CONNECT);
        say_state(improv, STATE_READY);
    }
}

static void say_network(struct improv *improv, const struct improv_network *network) {
    char rssi[12];
    const char *const texts[] = {network->name, rssi, network->secured ? "YES" : "NO"};
    snprintf(rssi, sizeof rssi, "%d", network->rssi_dbm);
    say_result(improv, COMMAND_SCAN, texts, sizeof texts / sizeof texts[0]);
}

/* A network a time, when the one before is out; a result without texts is the end of the list. */
static void watch_scan(struct improv *improv, uint32_t now_us) {
    struct improv_network network;
    if (!improv->scanning || improv->out_count > 0)
        return;
    enum improv_scan found = improv->ops->scanned(improv->ops->ctx, improv->scan_told, &network);
    if (found == IMPROV_NETWORK) {
        improv->scan_told++;
        say_network(improv, &network);
    } else if (found == IMPROV_NO_MORE || now_us - improv->scan_us >= SCAN_US) {
        improv->scanning = false;
        say_result(improv, COMMAND_SCAN, NULL, 0);
    }
}

/* ---- in ---- */

/* Whether this byte continues with the packet that has begun; what it is too long for is none. */
static bool continues(const struct improv *improv, uint8_t byte) {
    if (improv->count < NAME_SIZE)
        return byte == (uint8_t)name[improv->count];
    if (improv->count == NAME_SIZE)
        return byte == VERSION;
    return improv->count != LENGTH_AT || byte <= IMPROV_DATA_MAX;
}

static bool is_whole(const struct improv *improv) {
    return improv->count > IMPROV_HEAD && improv->count == IMPROV_HEAD + 1u + improv->packet[LENGTH_AT];
}

/* @return bytes for the hub: what looked like a packet and is none, and perhaps this one */
static size_t take(struct improv *improv, uint8_t byte, char *text) {
    size_t given = 0;
    if (!continues(improv, byte)) {
        given = improv->count;
        memcpy(text, improv->packet, given);
        improv->count = 0;
    }
    if (!continues(improv, byte)) {
        text[given] = (char)byte;
        return given + 1;
    }
    improv->packet[improv->count++] = byte;
    if (is_whole(improv)) {
        obey(improv);
        improv->count = 0;
    }
    return given;
}

/* Room is left for a begin of a packet that turns out to be none. */
static long filter_read(const struct net_stream *stream, char *bytes, size_t size) {
    struct improv *improv = stream->ctx;
    char raw[256];
    uint32_t now_us = improv->ops->now_us(improv->ops->ctx);
    size_t most = size > IMPROV_HEAD ? size - IMPROV_HEAD : 0;
    watch_join(improv, now_us);
    watch_scan(improv, now_us);
    flush(improv);
    long count = improv->inner.ops->read(&improv->inner, bytes, most < sizeof raw ? most : sizeof raw);
    if (count <= 0)
        return count;
    if (improv->count > NAME_SIZE && now_us - improv->heard_us >= PACKET_US)
        improv->count = 0;
    improv->heard_us = now_us;
    if (improv->count == 0 && memchr(bytes, name[0], (size_t)count) == NULL)
        return count; /* nearly always */
    memcpy(raw, bytes, (size_t)count);
    size_t given = 0;
    for (long i = 0; i < count; i++) {
        if (improv->count == 0 && raw[i] != name[0])
            bytes[given++] = raw[i];
        else
            given += take(improv, (uint8_t)raw[i], bytes + given);
    }
    flush(improv);
    return (long)given;
}

static long filter_write(const struct net_stream *stream, const char *bytes, size_t count) {
    struct improv *improv = stream->ctx;
    flush(improv);
    if (improv->out_sent > 0 || count == 0)
        return 0; /* the rest of a packet comes first */
    long took = improv->inner.ops->write(&improv->inner, bytes, count);
    if (took > 0)
        improv->mid_line = bytes[took - 1] != '\n';
    return took;
}

static void filter_close(const struct net_stream *stream) {
    const struct improv *improv = stream->ctx;
    improv->inner.ops->close(&improv->inner);
}

void improv_init(struct improv *improv, const struct net_stream *inner, const struct improv_info *info,
                 const struct improv_ops *ops, struct net_stream *stream) {
    static const struct net_stream_ops filter = {
        .read = filter_read, .write = filter_write, .close = filter_close};
    *improv = (struct improv){.inner = *inner, .info = info, .ops = ops};
    *stream = *inner;
    stream->ops = &filter;
    stream->ctx = improv;
}
