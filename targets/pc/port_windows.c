/* SPDX-License-Identifier: MIT */
#include "port.h"

#include "net_system.h"
#include "port_windows_text.h"

#include <windows.h>

#include <bcrypt.h>
#include <errno.h>
#include <fcntl.h>
#include <io.h>
#include <mmsystem.h>
#include <shellapi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* An argument in UTF-8, of its own memory. @return NULL: memory is short */
static char *narrow(const wchar_t *text) {
    int size = WideCharToMultiByte(CP_UTF8, 0, text, -1, NULL, 0, NULL, NULL);
    char *out = size > 0 ? malloc((size_t)size) : NULL;
    if (out != NULL)
        WideCharToMultiByte(CP_UTF8, 0, text, -1, out, size, NULL, NULL);
    return out;
}

/* Those of main() have lost what the code page lacks. Waits end on time: else a system sleeps for 16 ms. */
char **port_start(char **argv) {
    DWORD pipe_mode = PIPE_READMODE_BYTE | PIPE_NOWAIT;
    int count;
    (void)argv;
    timeBeginPeriod(1);
    SetNamedPipeHandleState(GetStdHandle(STD_OUTPUT_HANDLE), &pipe_mode, NULL, NULL); /* for port_say() */
    wchar_t **wide = CommandLineToArgvW(GetCommandLineW(), &count);
    char **out = wide != NULL ? calloc((size_t)count + 1, sizeof *out) : NULL;
    for (int i = 0; out != NULL && i < count; i++)
        if ((out[i] = narrow(wide[i])) == NULL)
            return NULL;
    LocalFree(wide);
    return out;
}

uint64_t port_clock_ns(void) {
    LARGE_INTEGER ticks, hz;
    QueryPerformanceFrequency(&hz);
    QueryPerformanceCounter(&ticks);
    uint64_t s = (uint64_t)ticks.QuadPart / (uint64_t)hz.QuadPart;
    uint64_t rest = (uint64_t)ticks.QuadPart % (uint64_t)hz.QuadPart;
    return s * 1000000000u + rest * 1000000000u / (uint64_t)hz.QuadPart;
}

void port_random(uint8_t *bytes, size_t count) {
    if (BCryptGenRandom(NULL, bytes, (ULONG)count, BCRYPT_USE_SYSTEM_PREFERRED_RNG) != 0)
        abort(); /* no nonce at all is better than one that can be foretold */
}

/* Errors of sockets begin here; those below are of the C library. */
enum { FIRST_OF_SOCKETS = 10000 };

const char *port_error_text(int error) {
    static char text[256];
    if (error < FIRST_OF_SOCKETS)
        return strerror(error);
    if (FormatMessageA(FORMAT_MESSAGE_FROM_SYSTEM | FORMAT_MESSAGE_IGNORE_INSERTS, NULL, (DWORD)error, 0,
                       text, sizeof text, NULL) == 0)
        snprintf(text, sizeof text, "error %d of Windows Sockets", error);
    text[strcspn(text, "\r\n")] = '\0';
    return text;
}

/* A pipe that is full takes nothing and does not wait, by port_start(). */
void port_say(const char *line, size_t size) {
    DWORD written;
    if (!WriteFile(GetStdHandle(STD_OUTPUT_HANDLE), line, (DWORD)size, &written, NULL))
        return; /* no one there */
}

/* ---- waiting ---- */

static short to_system(short wanted) {
    return (short)(((wanted & PORT_READ) != 0 ? POLLIN : 0) | ((wanted & PORT_WRITE) != 0 ? POLLOUT : 0));
}

static short from_system(short found) {
    return (short)(((found & POLLIN) != 0 ? PORT_READ : 0) | ((found & POLLOUT) != 0 ? PORT_WRITE : 0) |
                   ((found & (POLLERR | POLLHUP | POLLNVAL)) != 0 ? PORT_LOST : 0));
}

/* WSAPoll() refuses a list without a socket, and counts places without one. */
int port_poll(struct port_poll *polls, size_t count, int timeout_ms, int *error) {
    WSAPOLLFD system[PORT_POLLS_MAX];
    ULONG used = 0;
    for (size_t i = 0; i < count; i++) {
        polls[i].found = 0;
        if (polls[i].fd >= 0)
            system[used++] = (WSAPOLLFD){.fd = (SOCKET)polls[i].fd, .events = to_system(polls[i].wanted)};
    }
    if (used == 0) {
        Sleep((DWORD)timeout_ms);
        return 0;
    }
    int ready = WSAPoll(system, used, timeout_ms);
    if (ready < 0) {
        *error = system_error();
        return system_interrupted() ? 0 : -1;
    }
    for (size_t i = 0, at = 0; i < count; i++)
        if (polls[i].fd >= 0)
            polls[i].found = from_system(system[at++].revents);
    return ready;
}

/* WSAPoll() knows sockets only: a datagram socket that sends to itself. */
int port_wake_open(struct port_wake *wake) {
    struct sockaddr_in here = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    int size = sizeof here;
    *wake = (struct port_wake){-1, -1};
    system_start();
    int fd = (int)socket(AF_INET, SOCK_DGRAM, 0);
    if (fd < 0)
        return system_error();
    wake->wait_fd = wake->wake_fd = fd;
    if (system_unblock(fd) && bind((SOCKET)fd, (const struct sockaddr *)&here, size) == 0 &&
        getsockname((SOCKET)fd, (struct sockaddr *)&here, &size) == 0 &&
        connect((SOCKET)fd, (const struct sockaddr *)&here, size) == 0)
        return 0;
    return system_error();
}

void port_wake_close(const struct port_wake *wake) {
    if (wake->wait_fd >= 0)
        system_close(wake->wait_fd);
}

void port_wake(const struct port_wake *wake) {
    const char byte = 0;
    (void)send((SOCKET)wake->wake_fd, &byte, 1, 0); /* full: it was woken already */
}

bool port_wake_taken(const struct port_wake *wake) {
    char bytes[16];
    bool woken = false;
    while (recv((SOCKET)wake->wait_fd, bytes, sizeof bytes, 0) > 0)
        woken = true;
    return woken;
}

/* ---- requests to end ---- */

static struct port_wake requests, parent;

/* The system ends the program when this returns of a closed console; it has 5 s until then. */
static BOOL WINAPI on_request(DWORD kind) {
    port_wake(&requests);
    if (kind == CTRL_CLOSE_EVENT || kind == CTRL_SHUTDOWN_EVENT)
        Sleep(INFINITE);
    return TRUE;
}

int port_catch_requests(int *wait_fd) {
    int error = port_wake_open(&requests);
    *wait_fd = requests.wait_fd;
    if (error == 0 && !SetConsoleCtrlHandler(on_request, TRUE))
        error = EINVAL;
    return error;
}

static DWORD WINAPI read_parent(void *unused) {
    char bytes[64];
    DWORD count;
    (void)unused;
    (void)ReadFile(GetStdHandle(STD_INPUT_HANDLE), bytes, sizeof bytes, &count, NULL);
    port_wake(&parent);
    return 0;
}

int port_parent_fd(void) {
    if (port_wake_open(&parent) != 0)
        return -1;
    HANDLE thread = CreateThread(NULL, 0, read_parent, NULL, 0, NULL);
    if (thread == NULL)
        return -1;
    CloseHandle(thread);
    return parent.wait_fd;
}

/* ---- locks ---- */

enum port_kind port_kind_of(const char *path) {
    wchar_t *name = port_wide(path);
    struct _stat64 status;
    bool found = name != NULL && _wstat64(name, &status) == 0;
    free(name);
    if (!found)
        return PORT_NOTHING;
    if ((status.st_mode & _S_IFMT) == _S_IFREG)
        return PORT_FILE;
    return (status.st_mode & _S_IFMT) == _S_IFDIR ? PORT_FOLDER : PORT_OTHER;
}

/* One byte at 0, as msvcrt.locking() of Python locks it. */
int port_lock(const char *path, int *error) {
    wchar_t *name = port_wide(path);
    int lock = -1;
    if (name != NULL)
        lock = _wopen(name, _O_RDWR | _O_CREAT | _O_BINARY | _O_NOINHERIT, _S_IREAD | _S_IWRITE);
    free(name);
    if (lock >= 0 && LockFile((HANDLE)_get_osfhandle(lock), 0, 0, 1, 0))
        return lock;
    *error = lock >= 0 ? EAGAIN : errno;
    if (lock >= 0)
        _close(lock);
    return -1;
}

void port_unlock(int lock) {
    if (lock >= 0)
        _close(lock);
}
