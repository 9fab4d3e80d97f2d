/* SPDX-License-Identifier: MIT */
#include "net/network.h"

#include "app/task_map.h"
#include "base/lockout.h"
#include "net/ethernet.h"
#include "net/link_policy.h"
#include "net/wifi.h"
#include "store/nvs_device.h"
#include "store/nvs_flash_ops.h"

#include "esp_eth.h"
#include "esp_event.h"
#include "esp_mac.h"
#include "esp_netif.h"
#include "esp_timer.h"
#include "esp_wifi.h"
#include "freertos/FreeRTOS.h"
#include "freertos/queue.h"
#include "freertos/task.h"

#include <stdio.h>
#include <string.h>

enum { POLL_MS = 100, SCAN_MS = 10000, EVENTS = 8, US_PER_MS = 1000 };
enum { OWN_ADDRESS = 192 | 168 << 8 | 4 << 16 | 1 << 24 }; /* 192.168.4.1, ESP-IDF's own */

enum { LEFT_BY_US = 8 }; /* the driver's reason: esp_wifi_disconnect() */

enum change { ETHERNET_UP, ETHERNET_DOWN, STATION_UP, STATION_DOWN, STORED, SCAN, SCANNED };

/* From the events' task to ours. */
struct news {
    enum change change;
    uint32_t address; /* of STATION_DOWN: the driver's reason */
};

static struct {
    const char *name; /* on the heap: few are as long as they may be */
    QueueHandle_t news;
    struct link_policy policy;
    bool has_wifi;
    const struct nvs_store *store;
    uint32_t ethernet, station; /* addresses; 0: none */
    uint32_t address;
    uint8_t state;    /* enum wifi_state */
    bool hold, own;   /* wanted: an own network stays; and whether one is up */
    uint32_t scan_ms; /* since when it looks */
    bool scanning;    /* the network task alone writes `found` until it is false */
    struct wifi_network found[WIFI_NETWORKS];
    size_t found_count;
} network;

const char *network_name(void) {
    return network.name != NULL ? network.name : "";
}

uint32_t network_address(void) {
    return __atomic_load_n(&network.address, __ATOMIC_RELAXED);
}

uint32_t network_station_address(void) {
    return __atomic_load_n(&network.station, __ATOMIC_RELAXED);
}

enum wifi_state network_state(void) {
    return (enum wifi_state)__atomic_load_n(&network.state, __ATOMIC_RELAXED);
}

void network_hold_own(bool hold) {
    __atomic_store_n(&network.hold, hold, __ATOMIC_RELAXED);
}

bool network_own_is_up(void) {
    return __atomic_load_n(&network.own, __ATOMIC_RELAXED);
}

bool network_is_own(uint64_t here, uint64_t peer) {
    static const uint8_t own[4] = {OWN_ADDRESS & 0xFF, OWN_ADDRESS >> 8 & 0xFF, OWN_ADDRESS >> 16 & 0xFF,
                                   OWN_ADDRESS >> 24};
    const uint64_t ours = lockout_ipv4(own);
    return network_own_is_up() && here == ours && (peer ^ ours) >> 8 == 0;
}

static void set_state(enum wifi_state state) {
    __atomic_store_n(&network.state, (uint8_t)state, __ATOMIC_RELAXED);
}

static uint32_t now_ms(void) {
    return (uint32_t)(esp_timer_get_time() / US_PER_MS);
}

/* ---- events ---- */

/* Called in the event task and in the controller's: neither may wait, so news that find no room are lost. */
static bool pass_on(enum change change, uint32_t address) {
    const struct news news = {change, address};
    return xQueueSend(network.news, &news, 0) == pdTRUE;
}

void network_join_stored(void) {
    __atomic_store_n(&network.station, 0, __ATOMIC_RELAXED); /* of the network before */
    (void)pass_on(STORED, 0);
}

bool network_scan(void) {
    bool idle = false;
    if (!network.has_wifi || !__atomic_compare_exchange_n(&network.scanning, &idle, true, false,
                                                          __ATOMIC_ACQ_REL, __ATOMIC_RELAXED))
        return false;
    bool asked = pass_on(SCAN, 0);
    if (!asked)
        __atomic_store_n(&network.scanning, false, __ATOMIC_RELEASE);
    return asked;
}

enum network_scan network_scanned(size_t index, struct wifi_network *found) {
    if (__atomic_load_n(&network.scanning, __ATOMIC_ACQUIRE))
        return NETWORK_SCANNING;
    if (index >= network.found_count)
        return NETWORK_NO_MORE;
    *found = network.found[index];
    return NETWORK_FOUND;
}

static void on_address(void *ctx, esp_event_base_t base, int32_t id, void *data) {
    const ip_event_got_ip_t *got = data;
    (void)ctx;
    (void)base;
    if (id == IP_EVENT_STA_GOT_IP)
        (void)pass_on(STATION_UP, got->ip_info.ip.addr);
    else if (id == IP_EVENT_ETH_GOT_IP)
        (void)pass_on(ETHERNET_UP, got->ip_info.ip.addr);
    else if (id == IP_EVENT_ETH_LOST_IP)
        (void)pass_on(ETHERNET_DOWN, 0);
}

static void on_wifi(void *ctx, esp_event_base_t base, int32_t id, void *data) {
    (void)ctx;
    (void)base;
    if (id == WIFI_EVENT_STA_DISCONNECTED)
        (void)pass_on(STATION_DOWN, ((const wifi_event_sta_disconnected_t *)data)->reason);
    else if (id == WIFI_EVENT_SCAN_DONE)
        (void)pass_on(SCANNED, 0);
}

static void on_cable(void *ctx, esp_event_base_t base, int32_t id, void *data) {
    (void)ctx;
    (void)base;
    (void)data;
    if (id == ETHERNET_EVENT_DISCONNECTED)
        (void)pass_on(ETHERNET_DOWN, 0);
}

/* ---- the task ---- */

/* Static ones or DHCP, for WiFi and Ethernet; an interface that is not there is none. */
static void use_addresses(const struct nvs_store *store) {
    static const char *const interfaces[] = {"WIFI_STA_DEF", "ETH_DEF"};
    struct device_network stored, before;
    (void)nvs_device_load_network(store, &stored, &before);
    const esp_netif_ip_info_t info = {
        .ip = {stored.address}, .netmask = {stored.netmask}, .gw = {stored.gateway}};
    for (size_t i = 0; i < sizeof interfaces / sizeof interfaces[0]; i++) {
        esp_netif_t *netif = esp_netif_get_handle_from_ifkey(interfaces[i]);
        if (netif == NULL)
            continue;
        /* Each says so when it was stopped or started already. */
        if (stored.is_static == 0) {
            (void)esp_netif_dhcpc_start(netif);
            continue;
        }
        (void)esp_netif_dhcpc_stop(netif);
        (void)esp_netif_set_ip_info(netif, &info);
    }
}

/* The count first, then `scanning` with release: network_scanned() sees a complete list. */
static void end_scan(size_t found) {
    network.found_count = found;
    __atomic_store_n(&network.scanning, false, __ATOMIC_RELEASE);
}

static void take(const struct news *news) {
    switch (news->change) {
    case ETHERNET_UP:
    case ETHERNET_DOWN:
        /* 0 when it is down. */
        network.ethernet = news->address;
        link_policy_ethernet(&network.policy, news->change == ETHERNET_UP, now_ms());
        break;
    case STORED:
        use_addresses(network.store);
        if (network.has_wifi)
            wifi_join_stored(network.store);
        set_state(network.has_wifi && wifi_has_network() ? WIFI_JOINING : WIFI_NO_NETWORK);
        break;
    case SCAN:
        network.scan_ms = now_ms();
        if (!wifi_scan())
            end_scan(0);
        break;
    case SCANNED:
        if (__atomic_load_n(&network.scanning, __ATOMIC_RELAXED))
            end_scan(wifi_scanned(network.found));
        break;
    case STATION_UP:
        __atomic_store_n(&network.station, news->address, __ATOMIC_RELAXED);
        set_state(WIFI_JOINED);
        wifi_news(WIFI_NEWS_ADDRESS);
        break;
    case STATION_DOWN:
    default:
        __atomic_store_n(&network.station, 0, __ATOMIC_RELAXED);
        if (wifi_has_network() && news->address != LEFT_BY_US)
            set_state(wifi_policy_why(news->address));
        wifi_news(WIFI_NEWS_LOST);
        break;
    }
}

static void run(void *unused) {
    (void)unused;
    for (;;) {
        struct news news;
        if (xQueueReceive(network.news, &news, pdMS_TO_TICKS(POLL_MS)) == pdTRUE)
            take(&news);
        if (__atomic_load_n(&network.scanning, __ATOMIC_RELAXED) && now_ms() - network.scan_ms >= SCAN_MS)
            end_scan(0); /* the driver was switched off meanwhile, or its word was lost */
        wifi_hold_own(__atomic_load_n(&network.hold, __ATOMIC_RELAXED));
        bool own = network.has_wifi && wifi_poll(link_policy_wifi(&network.policy, now_ms()));
        __atomic_store_n(&network.own, own, __ATOMIC_RELAXED);
        uint32_t station = network_station_address();
        /* The address that is announced: the cable's before WiFi's, and that of the own network last. */
        uint32_t address = network.ethernet != 0 ? network.ethernet : station;
        address = address == 0 && own ? (uint32_t)OWN_ADDRESS : address;
        __atomic_store_n(&network.address, address, __ATOMIC_RELAXED);
    }
}

/* As stored, or the chip's own. */
static char *make_name(const struct nvs_store *store) {
    char name[HOST_NAME_MAX + 1];
    uint8_t mac[6] = {0};
    (void)esp_read_mac(mac, ESP_MAC_WIFI_SOFTAP);
    if (nvs_flash_ops_get_text(store, NVS_HOST_NAME, name, sizeof name) == 0)
        snprintf(name, sizeof name, "WiFiCNC-%02X%02X", mac[4], mac[5]);
    return strdup(name);
}

bool network_start(const struct nvs_store *store) {
    network.name = make_name(store);
    network.store = store;
    network.news = xQueueCreate(EVENTS, sizeof(struct news));
    if (network.name == NULL || network.news == NULL || esp_netif_init() != ESP_OK ||
        esp_event_loop_create_default() != ESP_OK ||
        esp_event_handler_register(IP_EVENT, ESP_EVENT_ANY_ID, on_address, NULL) != ESP_OK ||
        esp_event_handler_register(WIFI_EVENT, ESP_EVENT_ANY_ID, on_wifi, NULL) != ESP_OK ||
        esp_event_handler_register(ETH_EVENT, ESP_EVENT_ANY_ID, on_cable, NULL) != ESP_OK)
        return false;
    /* After the handlers, so that no event of the drivers is missed. */
    network.has_wifi = wifi_init(store, network.name);
    set_state(network.has_wifi && wifi_has_network() ? WIFI_JOINING : WIFI_NO_NETWORK);
    bool has_ethernet = ethernet_start(network.name);
    use_addresses(store);
    link_policy_init(&network.policy, has_ethernet, now_ms());
    return (network.has_wifi || has_ethernet) &&
           xTaskCreatePinnedToCore(run, "network", NETWORK_TASK_STACK, NULL, NETWORK_TASK_PRIORITY, NULL,
                                   NETWORK_CORE) == pdPASS;
}
