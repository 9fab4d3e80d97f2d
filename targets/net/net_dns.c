/* SPDX-License-Identifier: MIT */
#include "net_dns.h"

#include "net_socket.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

enum { PACKET = 512 }; /* of UDP, without extensions */
enum {
    HEADER = 12,
    LABEL_MAX = 63,
    NAME_MAX_SIZE = 255,
    TYPE_A = 1,
    TYPE_ANY = 255,
    CLASS_IN = 1,
    CLASS_ANY = 255
};
enum {
    FLAG_RESPONSE = 0x80,
    FLAGS_OPCODE = 0x78,
    FLAG_OWN = 0x04,
    FLAG_RECURSE = 0x01,
    FLAG_RECURSES = 0x80
};
enum { NOT_SUPPORTED = 4 };

/* A flood of questions must not hold up the caller's loop. */
enum { PACKETS_A_POLL = 8 };

static unsigned u16_at(const uint8_t *bytes) {
    return (unsigned)bytes[0] << 8 | bytes[1];
}

/* The end of the name that begins here. @return 0: it is damaged, or a pointer, which questions do not need
 */
static size_t end_of_name(const uint8_t *query, size_t size) {
    size_t at = HEADER;
    while (at < size && query[at] != 0) {
        if (query[at] > LABEL_MAX)
            return 0;
        at += query[at] + 1u;
    }
    return at < size && at + 1 - HEADER <= NAME_MAX_SIZE ? at + 1 : 0;
}

/* The record of the name in the question. @return its bytes */
static size_t put_record(uint8_t *out, const uint8_t address[4]) {
    static const uint8_t head[] = {0xC0, HEADER, 0, TYPE_A, 0, CLASS_IN, 0, 0, 0, 0, 0, 4};
    memcpy(out, head, sizeof head);
    memcpy(out + sizeof head, address, 4);
    return sizeof head + 4;
}

/* A record for a question of type A, no record for other types, so that a client does not wait for IPv6. It
 * is never kept: in another network it would be wrong. @return bytes; 0: it is no question, or it is damaged
 */
static size_t make_answer(const uint8_t address[4], const uint8_t *query, size_t size,
                          uint8_t answer[PACKET]) {
    if (size < HEADER || size > PACKET || (query[2] & FLAG_RESPONSE) != 0 || u16_at(query + 4) != 1)
        return 0;
    const size_t name_end = end_of_name(query, size);
    if (name_end == 0 || name_end + 4 > size)
        return 0;
    const unsigned type = u16_at(query + name_end), class = u16_at(query + name_end + 2);
    const bool known = (query[2] & FLAGS_OPCODE) == 0;
    const bool found =
        known && (type == TYPE_A || type == TYPE_ANY) && (class == CLASS_IN || class == CLASS_ANY);
    size_t count = name_end + 4;
    memcpy(answer, query, count);
    memset(answer + 6, 0, HEADER - 6);
    answer[2] = (uint8_t)(FLAG_RESPONSE | (query[2] & (FLAGS_OPCODE | FLAG_RECURSE)) | FLAG_OWN);
    answer[3] = (uint8_t)(FLAG_RECURSES | (known ? 0 : NOT_SUPPORTED));
    answer[7] = found;
    if (found && count + 16 > PACKET)
        return 0;
    return count + (found ? put_record(answer + count, address) : 0);
}

int net_dns_open(const char *host, uint16_t port) {
    struct net_address here;
    int error;
    return net_address_v4(host, port, &here) ? net_socket_udp(&here, false, &error) : -1;
}

void net_dns_poll(int fd, const uint8_t address[4]) {
    uint8_t query[PACKET], answer[PACKET];
    for (int i = 0; i < PACKETS_A_POLL; i++) {
        struct net_address from;
        long count = net_socket_receive(fd, query, sizeof query, &from);
        if (count == NET_NOTHING)
            return;
        size_t size = count > 0 ? make_answer(address, query, (size_t)count, answer) : 0;
        if (size > 0)
            net_socket_send(fd, &from, answer, size);
    }
}
