/* SPDX-License-Identifier: MIT
 * Multicast DNS. Whatever arrives: an answer is a well-formed response that fits into its packet, it is about
 * names of ours that were asked for, label by label, and a response or a damaged query has none.
 *
 * The first byte of the input: 1 from another port than 5353, 2 no telnet, 4 no address, 8 no page. The
 * rest is the packet. */
#include "fuzz.h"
#include "net_mdns.h"

#include <string.h>
#include <strings.h>

enum { HEAD = 12, NAMES_MAX = 255, JUMPS_MAX = 64, QUESTIONS_MAX = 8 };

static const char name[] = "WiFiCNC-1A2B";

static unsigned word(const uint8_t *at) {
    return (unsigned)at[0] << 8 | at[1];
}

/* A name in its labels, each with its length before it, so that no byte of a label looks like a separator. */
static size_t read_labels(const uint8_t *packet, size_t size, size_t at, uint8_t labels[NAMES_MAX + 1],
                          size_t *count) {
    size_t end = 0;
    *count = 0;
    for (unsigned jumps = 0; at < size;) {
        size_t label = packet[at];
        if (label >= 0xC0) {
            if (at + 1 >= size || ++jumps > JUMPS_MAX)
                return 0;
            end = end == 0 ? at + 2 : end;
            at = (label & 0x3F) << 8 | packet[at + 1];
            continue;
        }
        if (label > 63 || at + 1 + label > size || *count + 1 + label > NAMES_MAX)
            return 0;
        memcpy(labels + *count, packet + at, 1 + label);
        *count += 1 + label;
        at += 1 + label;
        if (label == 0)
            return end == 0 ? at : end;
    }
    return 0;
}

/* As a packet has it; "" is left out. */
static size_t put_labels(uint8_t *labels, const char *const *texts, unsigned count) {
    size_t size = 0;
    for (unsigned n = 0; n < count; n++) {
        labels[size++] = (uint8_t)strlen(texts[n]);
        memcpy(labels + size, texts[n], strlen(texts[n]));
        size += strlen(texts[n]);
    }
    labels[size++] = 0;
    return size;
}

/* Lengths are below 'A': letters alone differ. */
static bool are_same(const uint8_t *labels, size_t count, const char *const *texts, unsigned parts) {
    uint8_t ours[NAMES_MAX + 1];
    size_t size = put_labels(ours, texts, parts);
    for (size_t n = 0; n < count && count == size; n++) {
        uint8_t one = labels[n], other = ours[n];
        one = one >= 'A' && one <= 'Z' ? one + 32 : one;
        other = other >= 'A' && other <= 'Z' ? other + 32 : other;
        if (one != other)
            return false;
    }
    return count == size;
}

static bool is_ours(const uint8_t *labels, size_t count) {
    static const char *const host[] = {name, "local"}, *const telnet[] = {name, "_telnet", "_tcp", "local"},
                             *const http[] = {name, "_http", "_tcp", "local"},
                             *const list[] = {"_services", "_dns-sd", "_udp", "local"};
    return are_same(labels, count, host, 2) || are_same(labels, count, telnet + 1, 3) ||
           are_same(labels, count, telnet, 4) || are_same(labels, count, http + 1, 3) ||
           are_same(labels, count, http, 4) || are_same(labels, count, list, 4);
}

/* Whether any of the questions that are looked at has a name of ours. */
static bool asks_for_us(const uint8_t *query, size_t size) {
    uint8_t labels[NAMES_MAX + 1];
    size_t at = HEAD, count;
    for (unsigned n = 0; n < word(query + 4) && n < QUESTIONS_MAX; n++) {
        at = read_labels(query, size, at, labels, &count);
        if (at == 0 || at + 4 > size)
            return false;
        at += 4;
        if (is_ours(labels, count))
            return true;
    }
    return false;
}

static void check_answer(const uint8_t *answer, size_t size, const uint8_t *query, bool legacy) {
    uint8_t labels[NAMES_MAX + 1];
    size_t at = HEAD, count;
    CLAIM(size >= HEAD && size <= NET_MDNS_PACKET, "%zu bytes", size);
    CLAIM(word(answer) == (legacy ? word(query) : 0) && word(answer + 2) == 0x8400, "the head");
    CLAIM(word(answer + 4) == legacy && word(answer + 8) == 0 && word(answer + 10) == 0, "the counts");
    for (unsigned n = 0; n < word(answer + 4); n++) {
        at = read_labels(answer, size, at, labels, &count);
        CLAIM(at != 0 && at + 4 <= size && is_ours(labels, count), "the question");
        at += 4;
    }
    CLAIM(word(answer + 6) > 0, "no record");
    for (unsigned n = 0; n < word(answer + 6); n++) {
        at = read_labels(answer, size, at, labels, &count);
        CLAIM(at != 0 && at + 10 <= size && is_ours(labels, count), "record %u", n);
        at += 10 + word(answer + at + 8);
        CLAIM(at <= size, "record %u ends behind the packet", n);
    }
    CLAIM(at == size, "%zu bytes are left", size - at);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    struct net_mdns mdns = {.id = "7cdfa1001a2b",
                            .board = "esp32s3-devkitc",
                            .address = {192, 168, 1, 20},
                            .telnet_port = 23,
                            .http_port = 80};
    uint8_t answer[NET_MDNS_PACKET];
    bool unicast;
    if (size == 0)
        return 0;
    bool legacy = (data[0] & 1) != 0;
    memcpy(mdns.name, name, sizeof name);
    if ((data[0] & 2) != 0)
        mdns.telnet_port = 0;
    if ((data[0] & 4) != 0)
        memset(mdns.address, 0, sizeof mdns.address);
    if ((data[0] & 8) != 0)
        mdns.http_port = 0;
    const uint8_t *query = data + 1;
    size_t count = net_mdns_answer(&mdns, query, size - 1, legacy, answer, &unicast);
    if (count == 0)
        return 0;
    CLAIM((data[0] & 4) == 0, "an answer without an address");
    CLAIM(size - 1 >= HEAD && (query[2] & 0x80) == 0, "an answer to a response");
    CLAIM(asks_for_us(query, size - 1), "an answer that nobody asked for");
    check_answer(answer, count, query, legacy);
    return 0;
}
