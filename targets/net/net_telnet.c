/* SPDX-License-Identifier: MIT */
#include "net_telnet.h"

/* RFC 854 */
enum { SE = 240, SB = 250, WILL = 251, WONT = 252, DO = 253, DONT = 254, IAC = 255 };

enum state { DATA, COMMAND, OPTION, SUBNEGOTIATION, SUBNEGOTIATION_IAC };

static enum state after_command(struct net_telnet *telnet, uint8_t byte) {
    telnet->verb = byte;
    if (byte == SB)
        return SUBNEGOTIATION;
    return byte >= WILL && byte != IAC ? OPTION : DATA;
}

/* Every option is refused, and a refusal is not answered, so that no two sides negotiate for ever (RFC
 * 854). */
static size_t refuse(uint8_t verb, uint8_t option, char reply[NET_TELNET_REPLY]) {
    if (verb != WILL && verb != DO)
        return 0;
    reply[0] = (char)IAC;
    reply[1] = (char)(verb == WILL ? DONT : WONT);
    reply[2] = (char)option;
    return NET_TELNET_REPLY;
}

int net_telnet_take(struct net_telnet *telnet, uint8_t byte, char reply[NET_TELNET_REPLY],
                    size_t *reply_count) {
    *reply_count = 0;
    switch ((enum state)telnet->state) {
    case COMMAND:
        telnet->state = (uint8_t)after_command(telnet, byte);
        return 0; /* IAC IAC is the data byte 0xFF, which the controller drops anyway */
    case OPTION:
        *reply_count = refuse(telnet->verb, byte, reply);
        telnet->state = DATA;
        return 0;
    case SUBNEGOTIATION:
        telnet->state = byte == IAC ? SUBNEGOTIATION_IAC : SUBNEGOTIATION;
        return 0;
    case SUBNEGOTIATION_IAC:
        telnet->state = byte == SE ? DATA : SUBNEGOTIATION;
        return 0;
    case DATA:
    default:
        telnet->state = byte == IAC ? COMMAND : DATA;
        return byte != IAC;
    }
}
