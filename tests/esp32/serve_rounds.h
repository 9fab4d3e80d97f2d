/* SPDX-License-Identifier: MIT
 * A machine with the host's pins, and rounds of a millisecond, for programs that serve it over real sockets.
 */
#ifndef WIFICNC_TESTS_ESP32_SERVE_ROUNDS_H
#define WIFICNC_TESTS_ESP32_SERVE_ROUNDS_H

#include "host_inner.h"

#include <netinet/in.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <time.h>

enum { TICKS_A_ROUND = 20000, CLIENTS = 4 };

static const struct host_board board = {.timer_hz = 20000000,
                                        .step_pulse_ns = 2000,
                                        .dir_setup_ns = 2000,
                                        .max_step_rate_hz = 250000,
                                        .axis_count = 3};

static void pass_a_millisecond(struct host *host) {
    struct hal_step *hal = &host->hal.step;
    uint64_t until = hal->now_ticks + TICKS_A_ROUND;
    while (host->machine.drive.step.active && hal->alarm_ticks <= until) {
        hal->now_ticks = hal->alarm_ticks;
        hal->write = host->trace.events;
        step_isr(&host->machine.drive.step);
        (void)machine_poll(&host->machine);
    }
    hal->now_ticks = until;
}

static uint32_t page_time_us(void) {
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint32_t)((uint64_t)now.tv_sec * 1000000u + (uint64_t)now.tv_nsec / 1000u);
}

/* @return 0: none */
static unsigned port_of(int listener) {
    struct sockaddr_in here;
    socklen_t size = sizeof here;
    return getsockname(listener, (struct sockaddr *)&here, &size) == 0 ? ntohs(here.sin_port) : 0;
}

/* The page's: the other socket that listens. */
static int other_listener(int listener) {
    for (int handle = 0; handle < FD_SETSIZE; handle++) {
        int listens = 0;
        socklen_t size = sizeof listens;
        if (handle != listener && getsockopt(handle, SOL_SOCKET, SO_ACCEPTCONN, &listens, &size) == 0 &&
            listens)
            return handle;
    }
    return -1;
}

#endif
