/* SPDX-License-Identifier: MIT
 * How the sockets of a system differ: Linux, macOS and lwIP from Winsock. For net_socket.c and what opens
 * connections; all others know net_socket.h alone. */
#ifndef WIFICNC_NET_SYSTEM_H
#define WIFICNC_NET_SYSTEM_H

#include <stdbool.h>

#ifdef _WIN32

#include <winsock2.h>
#include <ws2tcpip.h>

typedef SOCKET system_socket;
typedef int system_size; /* of bytes to send or receive */

/* There SO_REUSEADDR takes a port away from a program that listens. */
enum { SYSTEM_LISTEN_OPTION = SO_EXCLUSIVEADDRUSE, SYSTEM_KEEP_IDLE = TCP_KEEPIDLE };

static inline int system_error(void) {
    return WSAGetLastError();
}

static inline bool system_would_block(void) {
    return WSAGetLastError() == WSAEWOULDBLOCK;
}

static inline bool system_interrupted(void) {
    return WSAGetLastError() == WSAEINTR;
}

static inline void system_close(int fd) {
    const int error = WSAGetLastError();
    closesocket((SOCKET)fd);
    WSASetLastError(error);
}

static inline bool system_unblock(int fd) {
    u_long on = 1;
    SetHandleInformation((HANDLE)(SOCKET)fd, HANDLE_FLAG_INHERIT, 0);
    return ioctlsocket((SOCKET)fd, (long)FIONBIO, &on) == 0;
}

/* Before the first socket; the system counts the calls. Without it each call fails with a clear error. */
static inline void system_start(void) {
    WSADATA data;
    (void)WSAStartup(MAKEWORD(2, 2), &data);
}

#else

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stddef.h>
#include <sys/socket.h>
#include <unistd.h>

typedef int system_socket;
typedef size_t system_size;

#ifdef __APPLE__
enum { SYSTEM_KEEP_IDLE = TCP_KEEPALIVE };
#else
enum { SYSTEM_KEEP_IDLE = TCP_KEEPIDLE };
#endif

enum { SYSTEM_LISTEN_OPTION = SO_REUSEADDR }; /* a restart need not wait for old connections */

static inline int system_error(void) {
    return errno;
}

static inline bool system_would_block(void) {
    return errno == EAGAIN || errno == EWOULDBLOCK;
}

static inline bool system_interrupted(void) {
    return errno == EINTR;
}

static inline void system_close(int fd) {
    const int error = errno;
    close(fd);
    errno = error;
}

static inline bool system_unblock(int fd) {
    int flags = fcntl(fd, F_GETFL);
    (void)fcntl(fd, F_SETFD, FD_CLOEXEC); /* unknown where there are no processes */
    return flags >= 0 && fcntl(fd, F_SETFL, flags | O_NONBLOCK) == 0;
}

static inline void system_start(void) {}

#endif

#ifdef __linux__

#include <linux/errqueue.h>
#include <string.h>

static inline void system_watch_unreachable(int fd) {
    const int on = 1;
    (void)setsockopt(fd, IPPROTO_IP, IP_RECVERR, &on, sizeof on);
}

/* The next ICMP error that waits. @param[out] to  the datagram's destination
 * @param[out] unreachable  its kind @return false: none */
static inline bool system_next_error(int fd, struct sockaddr_storage *to, bool *unreachable) {
    enum {
        DESTINATION_UNREACHABLE = 3,
        TOO_LARGE = 4
    }; /* RFC 792; the second one asks for smaller packets */
    char control[256], nothing[1];
    struct iovec rest = {nothing, sizeof nothing};
    struct msghdr message = {.msg_name = to,
                             .msg_namelen = sizeof *to,
                             .msg_iov = &rest,
                             .msg_iovlen = 1,
                             .msg_control = control,
                             .msg_controllen = sizeof control};
    *unreachable = false;
    if (recvmsg(fd, &message, MSG_ERRQUEUE) < 0)
        return false;
    for (struct cmsghdr *at = CMSG_FIRSTHDR(&message); at != NULL; at = CMSG_NXTHDR(&message, at)) {
        struct sock_extended_err error;
        if (at->cmsg_level != IPPROTO_IP || at->cmsg_type != IP_RECVERR)
            continue;
        memcpy(&error, CMSG_DATA(at), sizeof error);
        *unreachable = error.ee_origin == SO_EE_ORIGIN_ICMP && error.ee_type == DESTINATION_UNREACHABLE &&
                       error.ee_code != TOO_LARGE;
    }
    return true;
}

#else

/* Winsock and macOS do not say which datagram it was, and lwIP drops the ICMP message. */
static inline void system_watch_unreachable(int fd) {
    (void)fd;
}

static inline bool system_next_error(int fd, struct sockaddr_storage *to, bool *unreachable) {
    (void)fd;
    (void)to;
    *unreachable = false;
    return false;
}

#endif

#endif
