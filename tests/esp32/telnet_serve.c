/* SPDX-License-Identifier: MIT
 * The ESP32's controller task over real sockets of this computer, with the host's pins behind it: says its
 * ports on stdout, telnet's and the page's, and ends with stdin. Virtual time advances by a ms per round,
 * some times faster than real time. Usage: telnet_serve KEY SENDER_LOST
 */
#include "app/controller.h"
#include "net/page.h"
#include "serve_rounds.h"

#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static bool stdin_is_open(void) {
    char byte;
    return read(STDIN_FILENO, &byte, 1) != 0;
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
