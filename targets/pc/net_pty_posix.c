/* SPDX-License-Identifier: MIT */
#define _XOPEN_SOURCE 700 /* posix_openpt() and friends */

#include "net_pty.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

const char *const net_pty_missing = NULL;

/* Bytes pass unchanged, and none comes back as an echo. */
static int make_raw(int fd) {
    struct termios mode;
    if (tcgetattr(fd, &mode) != 0)
        return errno;
    mode.c_iflag &=
        ~(tcflag_t)(BRKINT | ICRNL | IGNBRK | IGNCR | INLCR | INPCK | ISTRIP | IXON | IXOFF | PARMRK);
    mode.c_oflag &= ~(tcflag_t)OPOST;
    mode.c_lflag &= ~(tcflag_t)(ECHO | ECHONL | ICANON | IEXTEN | ISIG);
    mode.c_cflag &= ~(tcflag_t)(CSIZE | PARENB);
    mode.c_cflag |= CS8 | CREAD | CLOCAL;
    mode.c_cc[VMIN] = 1;
    mode.c_cc[VTIME] = 0;
    cfsetispeed(&mode, B115200);
    cfsetospeed(&mode, B115200);
    return tcsetattr(fd, TCSANOW, &mode) == 0 ? 0 : errno;
}

/* Open and close the other end once: from now on the master says "hung up" while no one has it open. */
static int prepare_slave(struct net_pty *pty) {
    const char *name;
    if (grantpt(pty->master) != 0 || unlockpt(pty->master) != 0 || (name = ptsname(pty->master)) == NULL)
        return errno;
    if (strlen(name) >= sizeof pty->slave)
        return ENAMETOOLONG;
    strcpy(pty->slave, name);
    int slave = open(pty->slave, O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (slave < 0)
        return errno;
    int error = make_raw(slave);
    close(slave);
    return error;
}

/* A link to a terminal that is gone is one of ours, left over by a server that was killed. Any other stays:
 * one to an adapter that was unplugged (/dev/ttyUSB0) is someone's. */
static bool is_left_over(const struct net_pty *pty) {
    char target[NET_PTY_NAME_SIZE + 1] = "";
    size_t same = strcspn(pty->slave, "0123456789"); /* /dev/pts/ */
    struct stat status;
    if (readlink(pty->link, target, sizeof target - 1) <= (ssize_t)same ||
        strncmp(target, pty->slave, same) != 0)
        return false;
    return target[same + strspn(target + same, "0123456789")] == '\0' && stat(pty->link, &status) != 0;
}

static int make_link(const struct net_pty *pty) {
    if (is_left_over(pty))
        unlink(pty->link);
    return symlink(pty->slave, pty->link) == 0 ? 0 : errno;
}

int net_pty_open(struct net_pty *pty, const char *link) {
    *pty = (struct net_pty){.link = link, .master = posix_openpt(O_RDWR | O_NOCTTY)};
    if (pty->master < 0)
        return errno;
    int error = 0;
    if (fcntl(pty->master, F_SETFL, O_NONBLOCK) != 0 || fcntl(pty->master, F_SETFD, FD_CLOEXEC) != 0)
        error = errno;
    if (error == 0)
        error = prepare_slave(pty);
    if (error == 0)
        error = make_link(pty);
    if (error != 0)
        close(pty->master);
    return error;
}

void net_pty_unlink(const struct net_pty *pty) {
    char target[NET_PTY_NAME_SIZE + 1];
    ssize_t size = readlink(pty->link, target, sizeof target);
    if (size == (ssize_t)strlen(pty->slave) && memcmp(target, pty->slave, (size_t)size) == 0)
        unlink(pty->link);
}

void net_pty_close(struct net_pty *pty) {
    close(pty->master);
    pty->master = -1;
}

/* ---- the stream ---- */

static long pty_read(const struct net_stream *stream, char *bytes, size_t size) {
    ssize_t count = read(stream->fd, bytes, size);
    if (count > 0)
        return (long)count;
    if (count < 0 && (errno == EAGAIN || errno == EINTR))
        return 0;
    return NET_GONE; /* EIO: the last one that had it open has closed it */
}

static long pty_write(const struct net_stream *stream, const char *bytes, size_t count) {
    ssize_t taken = write(stream->fd, bytes, count);
    if (taken >= 0)
        return (long)taken;
    return errno == EAGAIN || errno == EINTR ? 0 : NET_GONE;
}

/* What no one has read is not for the next one that opens it: it is on its way to the slave's side, or there.
 */
static void pty_detach(const struct net_stream *stream) {
    struct net_pty *pty = stream->ctx;
    int slave = open(pty->slave, O_RDWR | O_NOCTTY | O_CLOEXEC);
    tcflush(pty->master, TCOFLUSH);
    if (slave >= 0) {
        tcflush(slave, TCIFLUSH);
        close(slave);
    }
    pty->attached = false;
}

bool net_pty_opened(struct net_pty *pty, struct net_stream *stream) {
    static const struct net_stream_ops ops = {.read = pty_read, .write = pty_write, .close = pty_detach};
    struct pollfd look = {.fd = pty->master, .events = POLLIN};
    if (pty->attached || poll(&look, 1, 0) < 0)
        return false;
    if ((look.revents & POLLHUP) != 0 && (look.revents & POLLIN) == 0)
        return false;
    pty->attached = true;
    *stream = (struct net_stream){.ops = &ops, .ctx = pty, .fd = pty->master, .local = true};
    return true;
}
