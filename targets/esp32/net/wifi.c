/* SPDX-License-Identifier: MIT */
#include "net/wifi.h"

#include "app/task_map.h"
#include "net/wifi_policy.h"
#include "store/nvs_flash_ops.h"

#include "esp_event.h"
#include "esp_mac.h"
#include "esp_netif.h"
#include "esp_random.h"
#include "esp_timer.h"
#include "esp_wifi.h"
#include "freertos/FreeRTOS.h"
#include "freertos/queue.h"
#include "freertos/task.h"

#include <stdio.h>
#include <string.h>

enum { POLL_MS = 100, OWN_CHANNEL = 6, OWN_CLIENTS = 4, OWN_PASSWORD_LENGTH = 12, EVENTS = 8 };

/* Of the events' task, towards ours. */
static QueueHandle_t events;
static char own_name[WIFI_SSID_SIZE], own_password[WIFI_PASSWORD_SIZE];

const char *wifi_own_name(void) {
    return own_name;
}

const char *wifi_own_password(void) {
    return own_password;
}

static uint32_t now_ms(void) {
    return (uint32_t)(esp_timer_get_time() / 1000);
}

/* Letters and digits that nobody mistakes for one another: 32 of them, 5 bits each. */
static void make_password(char password[WIFI_PASSWORD_SIZE]) {
    static const char letters[] = "abcdefghijkmnpqrstuvwxyz23456789";
    _Static_assert(sizeof letters == 33, "5 bits each");
    for (unsigned i = 0; i < OWN_PASSWORD_LENGTH; i++)
        password[i] = letters[esp_random() & 31];
    password[OWN_PASSWORD_LENGTH] = '\0';
}

/* A password of this device alone: stored, or made now. */
static void load_own(const struct nvs_store *store) {
    uint8_t mac[6] = {0};
    (void)esp_read_mac(mac, ESP_MAC_WIFI_SOFTAP);
    snprintf(own_name, sizeof own_name, "WiFiCNC-%02X%02X", mac[4], mac[5]);
    if (nvs_flash_ops_get_text(store, "ap_pass", own_password, sizeof own_password) >= 8)
        return;
    make_password(own_password);
    (void)nvs_flash_ops_set_text(store, "ap_pass", own_password);
}

/* ---- events of the driver ---- */

static void on_event(void *ctx, esp_event_base_t base, int32_t id, void *data) {
    enum wifi_event event;
    (void)ctx;
    (void)data;
    if (base == IP_EVENT && id == IP_EVENT_STA_GOT_IP)
        event = WIFI_GOT_ADDRESS;
    else if (base == WIFI_EVENT && id == WIFI_EVENT_STA_DISCONNECTED)
        event = WIFI_LOST;
    else
        return;
    (void)xQueueSend(events, &event, 0);
}

/* ---- our task ---- */

static void set_own(bool up) {
    wifi_config_t config = {
        .ap = {.channel = OWN_CHANNEL, .max_connection = OWN_CLIENTS, .authmode = WIFI_AUTH_WPA2_PSK}};
    (void)esp_wifi_set_mode(up ? WIFI_MODE_APSTA : WIFI_MODE_STA);
    if (!up)
        return;
    config.ap.ssid_len = (uint8_t)strlen(own_name);
    memcpy(config.ap.ssid, own_name, strlen(own_name));
    memcpy(config.ap.password, own_password, strlen(own_password));
    (void)esp_wifi_set_config(WIFI_IF_AP, &config);
}

static void run(void *arg) {
    struct wifi_policy *policy = arg;
    bool own = false;
    for (;;) {
        enum wifi_event event;
        if (xQueueReceive(events, &event, pdMS_TO_TICKS(POLL_MS)) == pdTRUE)
            wifi_policy_event(policy, event, now_ms());
        struct wifi_action action = wifi_policy_poll(policy, now_ms());
        if (action.own != own) {
            own = action.own;
            set_own(own);
        }
        if (action.connect && esp_wifi_connect() != ESP_OK)
            wifi_policy_event(policy, WIFI_LOST, now_ms());
    }
}

/* ---- start ---- */

static bool set_network(const struct nvs_store *store) {
    char name[WIFI_SSID_SIZE], password[WIFI_PASSWORD_SIZE];
    wifi_config_t config = {.sta = {.threshold = {.authmode = WIFI_AUTH_OPEN}}};
    size_t name_length = nvs_flash_ops_get_text(store, "wifi_ssid", name, sizeof name);
    size_t password_length = nvs_flash_ops_get_text(store, "wifi_pass", password, sizeof password);
    if (name_length == 0)
        return false;
    memcpy(config.sta.ssid, name, name_length);
    memcpy(config.sta.password, password, password_length);
    return esp_wifi_set_config(WIFI_IF_STA, &config) == ESP_OK;
}

static bool start_driver(void) {
    const wifi_init_config_t config = WIFI_INIT_CONFIG_DEFAULT();
    if (esp_netif_init() != ESP_OK || esp_event_loop_create_default() != ESP_OK)
        return false;
    (void)esp_netif_create_default_wifi_sta();
    (void)esp_netif_create_default_wifi_ap();
    return esp_wifi_init(&config) == ESP_OK && esp_wifi_set_storage(WIFI_STORAGE_RAM) == ESP_OK &&
           esp_event_handler_register(WIFI_EVENT, ESP_EVENT_ANY_ID, on_event, NULL) == ESP_OK &&
           esp_event_handler_register(IP_EVENT, IP_EVENT_STA_GOT_IP, on_event, NULL) == ESP_OK &&
           esp_wifi_set_mode(WIFI_MODE_STA) == ESP_OK;
}

bool wifi_start(const struct nvs_store *store) {
    static struct wifi_policy policy;
    events = xQueueCreate(EVENTS, sizeof(enum wifi_event));
    if (events == NULL || !start_driver())
        return false;
    load_own(store);
    wifi_policy_init(&policy, set_network(store), now_ms());
    /* no sleep between beacons: an answer must not wait 100 ms */
    return esp_wifi_start() == ESP_OK && esp_wifi_set_ps(WIFI_PS_NONE) == ESP_OK &&
           xTaskCreatePinnedToCore(run, "wifi", WIFI_TASK_STACK, &policy, WIFI_TASK_PRIORITY, NULL,
                                   NETWORK_CORE) == pdPASS;
}
