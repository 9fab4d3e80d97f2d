/* SPDX-License-Identifier: MIT */
#include "net_mdns.h"

#include <string.h>

enum { TYPE_A = 1, TYPE_PTR = 12, TYPE_TXT = 16, TYPE_SRV = 33, TYPE_ANY = 255 };
enum { CLASS_IN = 1, CLASS_ANY = 255, TOP_BIT = 0x8000 }; /* the top bit: unicast wanted; cache is flushed */
/* Packets come from anyone: QUESTIONS_MAX bounds the work for one, and JUMPS_MAX ends pointers that point in
 * a circle. DOTTED_SIZE is longer than any name of ours. */
enum { HEADER_SIZE = 12, QUESTIONS_MAX = 8, JUMPS_MAX = 8, DOTTED_SIZE = 128, LABEL_MAX = 63, FOREIGN = 1 };
enum { IS_RESPONSE = 0x8000, AUTHORITATIVE = 0x0400 };
enum { HOST_TTL_S = 120, SERVICE_TTL_S = 4500, LEGACY_TTL_S = 10 }; /* RFC 6762, 10 and 6.7 */

static const char services[] = "_services._dns-sd._udp.local";

enum service { TELNET, HTTP, SERVICES };
static const char *const service_name[SERVICES] = {"_telnet._tcp.local", "_http._tcp.local"};
static const char *const instance_rest[SERVICES] = {"._telnet._tcp.local", "._http._tcp.local"};

/* Our records, as bits: those of a service are shifted by its place. */
enum {
    POINTER = 1,
    SERVER = 2,
    TEXT = 4,
    LIST = 8,
    SERVICE_BITS = 4,
    ALL_OF_SERVICE = POINTER | SERVER | TEXT
};
enum { HOST = 1 << (SERVICES * SERVICE_BITS) };

static unsigned of_service(unsigned service, unsigned records) {
    return records << (service * SERVICE_BITS);
}

static uint16_t port_of(const struct net_mdns *mdns, unsigned service) {
    return service == TELNET ? mdns->telnet_port : mdns->http_port;
}

/* ---- reading ---- */

/* A byte of a label. A dot or a NUL separates nothing there: such a name is none of ours. */
static char letter_of(uint8_t byte) {
    if (byte == '.' || byte == '\0')
        return FOREIGN;
    return (char)(byte >= 'A' && byte <= 'Z' ? byte - 'A' + 'a' : byte);
}

/* A name as "a.b.local", letters in lower case. @return where it ends; 0: it is damaged */
static size_t read_name(const uint8_t *packet, size_t size, size_t at, char dotted[DOTTED_SIZE]) {
    size_t end = 0, length = 0;
    unsigned jumps = 0;
    while (at < size && packet[at] != 0) {
        size_t label = packet[at];
        if (label > LABEL_MAX) { /* a pointer: the rest is elsewhere */
            if (label < 0xC0 || at + 1 >= size || jumps++ == JUMPS_MAX)
                return 0;
            end = end == 0 ? at + 2 : end;
            at = (label & LABEL_MAX) << 8 | packet[at + 1];
            continue;
        }
        if (at + 1 + label > size || length + label + 2 > DOTTED_SIZE)
            return 0;
        if (length > 0)
            dotted[length++] = '.';
        for (size_t i = 1; i <= label; i++)
            dotted[length++] = letter_of(packet[at + i]);
        at += 1 + label;
    }
    dotted[length] = '\0';
    if (at >= size)
        return 0;
    return end == 0 ? at + 1 : end;
}

static unsigned word(const uint8_t *packet, size_t at) {
    return (unsigned)packet[at] << 8 | packet[at + 1];
}

static bool is(const char *dotted, const char *first, const char *rest) {
    size_t length = strlen(first);
    for (size_t i = 0; i < length; i++) {
        char letter = first[i] >= 'A' && first[i] <= 'Z' ? (char)(first[i] - 'A' + 'a') : first[i];
        if (dotted[i] != letter)
            return false;
    }
    return strcmp(dotted + length, rest) == 0;
}

/* @return records of one service that answer a question. With the pointer come the records that a client asks
 * for next (RFC 6763, 12). */
static unsigned records_of(const struct net_mdns *mdns, unsigned service, const char *dotted, unsigned type) {
    const bool pointer = type == TYPE_PTR || type == TYPE_ANY;
    if (port_of(mdns, service) == 0)
        return 0;
    if (is(dotted, "", service_name[service]))
        return pointer ? of_service(service, ALL_OF_SERVICE) | HOST : 0;
    if (is(dotted, "", services))
        return pointer ? of_service(service, LIST) : 0;
    if (!is(dotted, mdns->name, instance_rest[service]))
        return 0;
    return (type == TYPE_SRV || type == TYPE_ANY ? of_service(service, SERVER) | HOST : 0) |
           (type == TYPE_TXT || type == TYPE_ANY ? of_service(service, TEXT) : 0);
}

static unsigned records_for(const struct net_mdns *mdns, const char *dotted, unsigned type) {
    unsigned records = 0;
    if (is(dotted, mdns->name, ".local"))
        return type == TYPE_A || type == TYPE_ANY ? HOST : 0;
    for (unsigned service = 0; service < SERVICES; service++)
        records |= records_of(mdns, service, dotted, type);
    return records;
}

/* ---- writing ---- */

struct writer {
    uint8_t *packet;
    size_t size, records;
    bool legacy, leaves;
};

/* No check of room: all records together, with the question of a legacy resolver, are shorter than
 * NET_MDNS_PACKET, because name, id and board are bounded. */
static void put(struct writer *out, const void *bytes, size_t count) {
    memcpy(out->packet + out->size, bytes, count);
    out->size += count;
}

static void put_word(struct writer *out, unsigned value) {
    const uint8_t bytes[2] = {(uint8_t)(value >> 8), (uint8_t)value};
    put(out, bytes, sizeof bytes);
}

static void put_name(struct writer *out, const char *first, const char *dotted) {
    uint8_t length = (uint8_t)strlen(first);
    if (length > 0) {
        put(out, &length, 1);
        put(out, first, length);
    }
    while (*dotted != '\0') {
        size_t label = strcspn(dotted, ".");
        length = (uint8_t)label;
        put(out, &length, 1);
        put(out, dotted, label);
        dotted += label + (dotted[label] == '.');
    }
    put(out, "", 1);
}

/* Name, type, class, time to live; then room for the length of what follows. @return where that is */
static size_t begin_record(struct writer *out, const char *first, const char *dotted, unsigned type,
                           uint32_t ttl_s) {
    /* A cache must drop what it has of a unique record; PTR records are shared with other controllers, and
     * a simple resolver does not know the bit (RFC 6762, 10.2 and 6.7). */
    bool unique = type != TYPE_PTR && !out->legacy;
    uint32_t seconds = out->leaves ? 0 : out->legacy && ttl_s > LEGACY_TTL_S ? LEGACY_TTL_S : ttl_s;
    put_name(out, first, dotted);
    put_word(out, type);
    put_word(out, CLASS_IN | (unique ? TOP_BIT : 0u));
    put_word(out, seconds >> 16);
    put_word(out, seconds & 0xFFFF);
    put_word(out, 0);
    out->records++;
    return out->size - 2;
}

static void end_record(struct writer *out, size_t length_at) {
    size_t length = out->size - length_at - 2;
    out->packet[length_at] = (uint8_t)(length >> 8);
    out->packet[length_at + 1] = (uint8_t)length;
}

/* One string of a TXT record: key=value. */
static void put_text(struct writer *out, const char *key, const char *value) {
    const uint8_t length = (uint8_t)(strlen(key) + 1 + strlen(value));
    put(out, &length, 1);
    put(out, key, strlen(key));
    put(out, "=", 1);
    put(out, value, strlen(value));
}

static void put_texts(struct writer *out, const struct net_mdns *mdns, unsigned service) {
    if (service == TELNET) {
        put_text(out, "wificnc", mdns->board);
        return;
    }
    put_text(out, "path", "/");
    put_text(out, "board", mdns->board);
    put_text(out, "id", mdns->id);
}

static void put_service(struct writer *out, const struct net_mdns *mdns, unsigned service, unsigned records) {
    const char *const name = service_name[service];
    size_t at;
    if ((records & POINTER) != 0) {
        at = begin_record(out, "", name, TYPE_PTR, SERVICE_TTL_S);
        put_name(out, mdns->name, name);
        end_record(out, at);
    }
    if ((records & LIST) != 0) {
        at = begin_record(out, "", services, TYPE_PTR, SERVICE_TTL_S);
        put_name(out, "", name);
        end_record(out, at);
    }
    if ((records & SERVER) != 0) {
        at = begin_record(out, mdns->name, name, TYPE_SRV, HOST_TTL_S);
        put_word(out, 0); /* priority and weight: there is but one */
        put_word(out, 0);
        put_word(out, port_of(mdns, service));
        put_name(out, mdns->name, "local");
        end_record(out, at);
    }
    if ((records & TEXT) != 0) {
        at = begin_record(out, mdns->name, name, TYPE_TXT, SERVICE_TTL_S);
        put_texts(out, mdns, service);
        end_record(out, at);
    }
}

static void put_records(struct writer *out, const struct net_mdns *mdns, unsigned records) {
    for (unsigned service = 0; service < SERVICES; service++)
        put_service(out, mdns, service, records >> (service * SERVICE_BITS));
    if ((records & HOST) != 0) {
        size_t at = begin_record(out, mdns->name, "local", TYPE_A, HOST_TTL_S);
        put(out, mdns->address, sizeof mdns->address);
        end_record(out, at);
    }
}

static void put_header(struct writer *out, unsigned id, unsigned questions) {
    put_word(out, id);
    put_word(out, IS_RESPONSE | AUTHORITATIVE);
    put_word(out, questions);
    put_word(out, 0); /* answers: when they are counted */
    put_word(out, 0);
    put_word(out, 0);
}

static size_t finish(struct writer *out) {
    /* The lower byte of the number of answers; there are nine at most. */
    out->packet[7] = (uint8_t)out->records;
    return out->size;
}

/* ---- */

static bool has_address(const struct net_mdns *mdns) {
    static const uint8_t none[4] = {0};
    return memcmp(mdns->address, none, sizeof none) != 0;
}

size_t net_mdns_answer(const struct net_mdns *mdns, const uint8_t *query, size_t size, bool legacy,
                       uint8_t answer[NET_MDNS_PACKET], bool *unicast) {
    char dotted[DOTTED_SIZE], asked[DOTTED_SIZE] = "";
    unsigned records = 0, asked_type = 0;
    size_t at = HEADER_SIZE;
    *unicast = legacy;
    if (size < HEADER_SIZE || !has_address(mdns) || (word(query, 2) & IS_RESPONSE) != 0)
        return 0;
    unsigned questions = word(query, 4);
    for (unsigned i = 0; i < questions && i < QUESTIONS_MAX; i++) {
        at = read_name(query, size, at, dotted);
        if (at == 0 || at + 4 > size)
            return 0;
        unsigned type = word(query, at), class = word(query, at + 2);
        at += 4;
        unsigned found = records_for(mdns, dotted, type);
        if (((class & ~(unsigned)TOP_BIT) != CLASS_IN && class != CLASS_ANY) || found == 0)
            continue;
        *unicast |= (class & TOP_BIT) != 0;
        records |= found;
        memcpy(asked, dotted, sizeof asked);
        asked_type = type;
    }
    if (records == 0)
        return 0;
    struct writer out = {.packet = answer, .legacy = legacy};
    put_header(&out, legacy ? word(query, 0) : 0, legacy);
    if (legacy) { /* it expects its question back */
        put_name(&out, "", asked);
        put_word(&out, asked_type);
        put_word(&out, CLASS_IN);
    }
    put_records(&out, mdns, records);
    return finish(&out);
}

bool net_mdns_may_answer(struct net_mdns *mdns, uint32_t now_us) {
    if (now_us - mdns->second_us >= 1000000) {
        mdns->second_us = now_us;
        mdns->answers = 0;
    }
    if (mdns->answers == NET_MDNS_ANSWERS)
        return false;
    mdns->answers++;
    return true;
}

size_t net_mdns_announce(const struct net_mdns *mdns, bool leaves, uint8_t packet[NET_MDNS_PACKET]) {
    struct writer out = {.packet = packet, .leaves = leaves};
    if (!has_address(mdns))
        return 0;
    put_header(&out, 0, 0);
    unsigned records = HOST;
    for (unsigned service = 0; service < SERVICES; service++)
        if (port_of(mdns, service) != 0)
            records |= of_service(service, ALL_OF_SERVICE);
    put_records(&out, mdns, records);
    return finish(&out);
}
