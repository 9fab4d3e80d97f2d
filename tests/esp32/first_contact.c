/* SPDX-License-Identifier: MIT
 * First contact: the ESP32's controller task, its page, its name server, its /api/network, and its rules for
 * WiFi, with a radio, a storage and a phone that are made up. Says its ports on stdout: the page's and the
 * name server's. The radio's clock advances by what stdin says only, a line at a time, each answered by
 * a line:
 *
 *   pass MS              time passes
 *   phone own | other    the network in which the phone is from now on
 *   moves 0 | 1          the machine moves
 *   state                the network that is stored, "+" when on trial; whether the own one is up; the
 * address; the status light
 *
 * It ends with stdin. Usage: first_contact KEY */
#include "app/controller.h"
#include "net/light.h"
#include "net/network.h"
#include "net/page.h"
#include "net/portal.h"
#include "serve_rounds.h"

#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { JOIN_MS = 500, SCAN_MS = 2000, WORKSHOP = 192 | 168 << 8 | 1 << 16 | 20 << 24 };
enum { OWN = 192 | 168 << 8 | 4 << 16 | 1 << 24 };

/* ---- the radio ---- */

static const struct {
    struct wifi_network network;
    const char *password;
} air[] = {{{"Werkstatt", -48, true}, "half past eight!"},
           {{"Nachbar \"5G\"", -71, true}, "not your business"},
           {{"Freifunk", -80, false}, ""}};

static struct {
    struct wifi_policy policy;
    struct device_network stored, before;
    unsigned restarts, pin_before; /* of p_sx; 0: no pins were stored */
    bool trial, phone_is_elsewhere, machine_moves, hold, own;
    uint32_t now_ms, connect_ms, scan_ms; /* 0: not under way */
    enum wifi_state state;
    uint32_t address;
} radio;

static bool has_network(void) {
    return radio.stored.ssid[0] != '\0';
}

/* The driver's reason; 0: it connects. */
static unsigned outcome(void) {
    for (size_t i = 0; i < sizeof air / sizeof air[0]; i++)
        if (strcmp(air[i].network.name, radio.stored.ssid) == 0)
            return strcmp(air[i].password, radio.stored.password) == 0 ? 0 : 15;
    return 201;
}

static void end_connect(void) {
    const unsigned reason = outcome();
    radio.connect_ms = 0;
    radio.state = reason == 0 ? WIFI_JOINED : wifi_policy_why(reason);
    radio.address = reason == 0 ? (uint32_t)WORKSHOP : 0;
    wifi_policy_event(&radio.policy, reason == 0 ? WIFI_GOT_ADDRESS : WIFI_LOST, radio.now_ms);
}

static void pass_a_radio_ms(void) {
    radio.now_ms++;
    wifi_policy_hold(&radio.policy, radio.hold);
    const struct wifi_action action = wifi_policy_poll(&radio.policy, radio.now_ms);
    radio.own = action.own;
    if (action.connect)
        radio.connect_ms = radio.now_ms;
    if (radio.connect_ms != 0 && radio.now_ms - radio.connect_ms >= JOIN_MS)
        end_connect();
    if (radio.scan_ms != 0 && radio.now_ms - radio.scan_ms >= SCAN_MS)
        radio.scan_ms = 0;
}

/* ---- net/network.h ---- */

static bool scanned;

const char *network_name(void) {
    return "WiFiCNC-1A2B";
}

void network_join_stored(void) {
    radio.address = radio.connect_ms = 0;
    radio.state = has_network() ? WIFI_JOINING : WIFI_NO_NETWORK;
    wifi_policy_join(&radio.policy, has_network(), radio.now_ms);
}

bool network_scan(void) {
    if (radio.scan_ms != 0)
        return false;
    radio.scan_ms = radio.now_ms;
    scanned = true;
    return true;
}

enum network_scan network_scanned(size_t index, struct wifi_network *found) {
    if (radio.scan_ms != 0)
        return NETWORK_SCANNING;
    if (!scanned || index >= sizeof air / sizeof air[0])
        return NETWORK_NO_MORE;
    *found = air[index].network;
    return NETWORK_FOUND;
}

enum wifi_state network_state(void) {
    return radio.state;
}

void network_hold_own(bool hold) {
    radio.hold = hold;
}

bool network_own_is_up(void) {
    return radio.own;
}

uint32_t network_station_address(void) {
    return radio.address;
}

uint32_t network_address(void) {
    return radio.address != 0 ? radio.address : radio.own ? (uint32_t)OWN : 0;
}

bool network_is_own(uint64_t here, uint64_t peer) {
    (void)here;
    (void)peer;
    return radio.own && !radio.phone_is_elsewhere;
}

/* ---- the storage ---- */

static bool keep_network(void *ctx, const struct device_network *network,
                         const struct device_network *before) {
    (void)ctx;
    radio.stored = *network;
    radio.trial = before != NULL;
    return true;
}

static void join(void *ctx) {
    (void)ctx;
    network_join_stored();
}

static bool is_at_rest(void *ctx) {
    (void)ctx;
    return !radio.machine_moves;
}

static uint64_t radio_time_us(void *ctx) {
    (void)ctx;
    return radio.now_ms * (uint64_t)1000;
}

static void not_random(void *ctx, uint8_t *bytes, size_t count) {
    (void)ctx;
    memset(bytes, 0x5A, count);
}

/* ---- stdin ---- */

static void pass(struct device *device, struct portal *portal, unsigned long ms) {
    while (ms-- > 0) {
        pass_a_radio_ms();
        device_poll(device, radio_time_us(NULL), !radio.machine_moves);
        portal_poll(portal);
    }
}

static void obey(char *line, struct device *device, struct portal *portal) {
    if (strncmp(line, "pass ", 5) == 0)
        pass(device, portal, strtoul(line + 5, NULL, 10));
    else if (strncmp(line, "phone ", 6) == 0)
        radio.phone_is_elsewhere = strncmp(line + 6, "other", 5) == 0;
    else if (strncmp(line, "moves ", 6) == 0)
        radio.machine_moves = line[6] == '1';
    struct net_light_facts facts = {.at_rest = !radio.machine_moves};
    light_add_network(&facts);
    printf("%s%s own=%d joined=%d light=%s pin=%u restarts=%u\n", has_network() ? radio.stored.ssid : "none",
           radio.trial ? "+" : "", radio.own, radio.address != 0, net_light_name(net_light_of(&facts)),
           radio.pin_before, radio.restarts);
    fflush(stdout);
}

/* @return false: it is closed */
static bool read_stdin(struct device *device, struct portal *portal) {
    static char line[64];
    static size_t count;
    char byte;
    ssize_t got;
    while ((got = read(STDIN_FILENO, &byte, 1)) == 1) {
        line[count] = byte == '\n' ? '\0' : byte;
        if (byte == '\n')
            obey(line, device, portal);
        count = byte == '\n' || count == sizeof line - 1 ? 0 : count + 1;
    }
    return got != 0;
}

/* ---- the whole ---- */

/* The only socket of datagrams. @return -1: it is not open */
static int name_server(void) {
    for (int handle = 0; handle < FD_SETSIZE; handle++) {
        int type = 0;
        socklen_t size = sizeof type;
        if (getsockopt(handle, SOL_SOCKET, SO_TYPE, &type, &size) == 0 && type == SOCK_DGRAM)
            return handle;
    }
    return -1;
}

/* ---- pins ---- */

/* PROBE: its place in struct device_wiring. */
enum { PROBE = 19, XY_LEGAL = 1 << 1 | 1 << 2 | 1 << 6 };

/* Four signals of the board; that of Z cannot be moved. */
static const char *key_of(unsigned index) {
    static const char *const keys[] = {"p_sx", "p_sy", "p_sz"};
    return index < 3 ? keys[index] : index == PROBE ? "p_prb" : NULL;
}

static bool keep_wiring(void *ctx, const struct device_wiring *wiring, const struct device_wiring *before) {
    (void)ctx;
    (void)wiring;
    radio.pin_before = before->pin[0];
    return true;
}

static const char *why_busy(void *ctx) {
    (void)ctx;
    return radio.machine_moves ? "a job is running or held: let it end, or reset the controller" : NULL;
}

static void restart(void *ctx) {
    (void)ctx;
    radio.restarts++;
}

static struct wiring_page *make_wiring_page(struct device *device, struct access *access) {
    static uint64_t legal[DEVICE_PINS] = {XY_LEGAL, XY_LEGAL, [PROBE] = (uint64_t)1 << 14};
    device->legal = legal;
    device->wiring.pin[0] = 1;
    device->wiring.pin[1] = 2;
    device->wiring.pin[2] = 42;
    device->wiring.pin[PROBE] = 14;
    return wiring_page_create(&(struct wiring_page_options){.device = device,
                                                            .access = access,
                                                            .key_of = key_of,
                                                            .why_busy = why_busy,
                                                            .restart = restart,
                                                            .now_us = radio_time_us});
}

static void start_page(struct controller *controller, struct portal *portal) {
    const struct page_names names = {.own = network_name(),
                                     .network = portal_network,
                                     .portal = portal_page,
                                     .setup = portal,
                                     .has_pins = true};
    int error;
    if (!controller_listen(controller, "127.0.0.1", "0", &error) ||
        !page_start(&controller->hub, "127.0.0.1", &names, "0", &error) || name_server() < 0)
        exit(1);
    const unsigned page = port_of(other_listener(controller->listener));
    printf("%u %u\n", page, port_of(name_server()));
    fflush(stdout);
}

int main(int argc, char **argv) {
    static const struct net_hub_sizes sizes = {.clients = CLIENTS, .in = 2048, .out = 16384, .left = 2048};
    static const struct device_ops device_ops = {
        .keep_wiring = keep_wiring, .keep_network = keep_network, .join = join};
    static const struct timespec pace = {.tv_nsec = 100000}; /* leaves the processor to other tests */
    static const uint8_t salt[ACCESS_SALT];
    static struct controller controller;
    static struct device device = {.ops = &device_ops};
    struct host *host = host_create(&board);
    if (argc != 2 || host == NULL)
        return 2;
    (void)signal(SIGPIPE, SIG_IGN);
    controller_init(&controller, &host->machine, &sizes);
    host->machine.out = controller_out(&controller);
    access_init(&controller.access, argv[1], argv[1][0] == '\0', salt, hal_time_us(&host->hal));
    controller_set(&controller, &(struct controller_options){.key = argv[1]});
    memset(device.wiring.pin, DEVICE_NO_PIN, sizeof device.wiring.pin);
    struct wiring_page *wiring = make_wiring_page(&device, &controller.access);
    device_begin(&device, false, 0);
    wifi_policy_init(&radio.policy, false, 0);
    struct portal *portal = portal_create(&(struct portal_options){.wiring = wiring,
                                                                   .device = &device,
                                                                   .access = &controller.access,
                                                                   .hub = &controller.hub,
                                                                   .page = "http://192.168.4.1/setup.html",
                                                                   .address = "127.0.0.1",
                                                                   .at_rest = is_at_rest,
                                                                   .now_us = radio_time_us,
                                                                   .random = not_random});
    pass(&device, portal, 100);
    start_page(&controller, portal);
    (void)fcntl(STDIN_FILENO, F_SETFL, O_NONBLOCK);
    while (read_stdin(&device, portal)) {
        bool more = page_poll(page_time_us());
        more |= controller_round(&controller);
        pass_a_millisecond(host);
        portal_poll(portal);
        if (!more)
            (void)nanosleep(&pace, NULL);
    }
    free(portal);
    free(wiring);
    return 0;
}
