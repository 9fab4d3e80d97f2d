/* SPDX-License-Identifier: MIT
 * The ESP32's controller task over real sockets of this computer, with the host's pins behind it: says its
 * ports on stdout, telnet's and the page's, and ends with stdin. Virtual time advances by a ms per round,
 * some times faster than real time. Usage: telnet_serve KEY SENDER_LOST
 */
#include "app/controller.h"
#include "host_inner.h"
#include "net/page.h"

#include <fcntl.h>
#include <netinet/in.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

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

static bool stdin_is_open(void) {
    char byte;
    return read(STDIN_FILENO, &byte, 1) != 0;
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

int main(int argc, char **argv) {
    static const struct net_hub_sizes sizes = {.clients = CLIENTS, .in = 2048, .out = 16384, .left = 2048};
    static struct controller controller;
    static const struct timespec pace = {.tv_nsec = 100000}; /* leaves the processor to other tests */
    struct host *host = host_create(&board);
    int error;
    if (argc != 3 || host == NULL)
        return 2;
    const struct controller_options options = {.key = argv[1]};
    const struct page_names names = {.own = "WiFiCNC-1A2B", .others = "shop.lan,cnc.lan"};
    static const uint8_t salt[ACCESS_SALT];
    (void)signal(SIGPIPE, SIG_IGN);
    controller_init(&controller, &host->machine, &sizes);
    host->machine.out = controller_out(&controller);
    host->machine.settings.sender_lost = (uint8_t)atoi(argv[2]);
    access_init(&controller.access, argv[1], argv[1][0] == '\0', salt, hal_time_us(&host->hal));
    controller_set(&controller, &options);
    if (!controller_listen(&controller, "127.0.0.1", "0", &error) ||
        !page_start(&controller.hub, "127.0.0.1", &names, "0", &error))
        return 1;
    printf("%u %u\n", port_of(controller.listener), port_of(other_listener(controller.listener)));
    fflush(stdout);
    (void)fcntl(STDIN_FILENO, F_SETFL, O_NONBLOCK);
    while (stdin_is_open()) {
        bool more = page_poll(page_time_us());
        more |= controller_round(&controller);
        pass_a_millisecond(host);
        if (!more && !host->machine.drive.step.active)
            (void)nanosleep(&pace, NULL);
    }
    return 0;
}
