/* SPDX-License-Identifier: MIT */
#include "net/wifi.h"

#include "app/entropy.h"
#include "net/wifi_policy.h"
#include "store/nvs_flash_ops.h"

#include "esp_netif.h"
#include "esp_timer.h"
#include "esp_wifi.h"

#include <string.h>

enum { OWN_CHANNEL = 6, OWN_CLIENTS = 4, OWN_PASSWORD_LENGTH = 12 };

static struct {
    struct wifi_policy policy;
    const char *name;
    char password[OWN_PASSWORD_MAX + 1];
    bool has_network, on, own;
} wifi;

const char *wifi_own_password(void) {
    return wifi.password;
}

/* A virtual chip has no radio and answers this function in its place. It finds the address in the image
 * behind these words, as an image without its ELF file has no names (emulators/wificnc_chips/esp32/image.py).
 */
static esp_err_t start_radio(const wifi_init_config_t *config) {
    struct radio {
        char mark[16];
        esp_err_t (*init)(const wifi_init_config_t *config);
    };
    static const struct radio radio = {"WiFiCNC radio 1", esp_wifi_init};
    const struct radio *place = &radio;
    __asm__("" : "+r"(place)); /* the call is by the table, so it is kept */
    return place->init(config);
}

static uint32_t now_ms(void) {
    return (uint32_t)(esp_timer_get_time() / 1000);
}

/* Letters and digits that no one mistakes for one another: 32 of them, 5 bits each. */
static void make_password(void) {
    static const char letters[] = "abcdefghijkmnpqrstuvwxyz23456789";
    _Static_assert(sizeof letters == 33, "5 bits each");
    uint8_t bytes[OWN_PASSWORD_LENGTH];
    entropy_fill(bytes, sizeof bytes);
    for (unsigned i = 0; i < OWN_PASSWORD_LENGTH; i++)
        wifi.password[i] = letters[bytes[i] & 31];
    wifi.password[OWN_PASSWORD_LENGTH] = '\0';
}

static void load_password(const struct nvs_store *store) {
    if (nvs_flash_ops_get_text(store, NVS_OWN_PASSWORD, wifi.password, sizeof wifi.password) >=
        OWN_PASSWORD_MIN)
        return;
    make_password();
    (void)nvs_flash_ops_set_text(store, NVS_OWN_PASSWORD, wifi.password);
}

/* ---- start ---- */

static bool set_network(const struct nvs_store *store) {
    char name[WIFI_SSID_MAX + 1] = "", password[WIFI_PASSWORD_MAX + 1] = "";
    wifi_config_t config = {.sta = {.sae_pwe_h2e = WPA3_SAE_PWE_BOTH, .pmf_cfg = {.capable = true}}};
    size_t name_length = nvs_flash_ops_get_text(store, NVS_WIFI_SSID, name, sizeof name);
    size_t password_length = nvs_flash_ops_get_text(store, NVS_WIFI_PASSWORD, password, sizeof password);
    if (name_length == 0)
        return false;
    memcpy(config.sta.ssid, name, name_length);
    memcpy(config.sta.password, password, password_length);
    /* With a password: WPA2 or WPA3. Else a network of the same name without one would get us. */
    config.sta.threshold.authmode = password_length > 0 ? WIFI_AUTH_WPA2_PSK : WIFI_AUTH_OPEN;
    return esp_wifi_set_config(WIFI_IF_STA, &config) == ESP_OK;
}

bool wifi_init(const struct nvs_store *store, const char *name) {
    const wifi_init_config_t config = WIFI_INIT_CONFIG_DEFAULT();
    esp_netif_t *station = esp_netif_create_default_wifi_sta();
    wifi.name = name;
    if (station == NULL || esp_netif_create_default_wifi_ap() == NULL || start_radio(&config) != ESP_OK ||
        esp_wifi_set_storage(WIFI_STORAGE_RAM) != ESP_OK || esp_wifi_set_mode(WIFI_MODE_STA) != ESP_OK ||
        esp_wifi_start() != ESP_OK)
        return false;
    load_password(store);
    (void)esp_netif_set_hostname(station, name);
    wifi.has_network = set_network(store);
    return esp_wifi_stop() == ESP_OK;
}

/* ---- the task ---- */

static void set_own(bool up) {
    wifi_config_t config = {.ap = {.channel = OWN_CHANNEL,
                                   .max_connection = OWN_CLIENTS,
                                   .authmode = WIFI_AUTH_WPA2_WPA3_PSK, /* old phones know WPA2 only */
                                   .sae_pwe_h2e = WPA3_SAE_PWE_BOTH,
                                   .pmf_cfg = {.capable = true}}};
    if (!up) {
        (void)esp_wifi_set_mode(WIFI_MODE_STA);
        return;
    }
    config.ap.ssid_len = (uint8_t)strlen(wifi.name);
    memcpy(config.ap.ssid, wifi.name, strlen(wifi.name));
    memcpy(config.ap.password, wifi.password, strlen(wifi.password));
    /* stopped first, or it would be on the air with the driver's defaults for a moment, open to all */
    (void)esp_wifi_stop();
    (void)esp_wifi_set_mode(WIFI_MODE_APSTA);
    (void)esp_wifi_set_config(WIFI_IF_AP, &config);
    (void)esp_wifi_start();
}

static void switch_radio(bool on) {
    wifi.on = on;
    wifi.own = false;
    if (!on) {
        (void)esp_wifi_stop();
        return;
    }
    wifi_policy_init(&wifi.policy, wifi.has_network, now_ms());
    set_own(false);
    (void)esp_wifi_start();
    (void)esp_wifi_set_ps(WIFI_PS_NONE); /* no sleep between beacons: an answer must not wait 100 ms */
}

bool wifi_poll(bool on) {
    if (on != wifi.on)
        switch_radio(on);
    if (!on)
        return false;
    struct wifi_action action = wifi_policy_poll(&wifi.policy, now_ms());
    if (action.own != wifi.own) {
        wifi.own = action.own;
        set_own(wifi.own);
    }
    if (action.connect && esp_wifi_connect() != ESP_OK)
        wifi_policy_event(&wifi.policy, WIFI_LOST, now_ms());
    return wifi.own;
}

/* The driver's word that the old network was left comes later, and delays the new one by a second at most. */
void wifi_join_stored(const struct nvs_store *store) {
    bool has_network = set_network(store);
    wifi.has_network = has_network;
    if (!wifi.on)
        return;
    (void)esp_wifi_disconnect();
    wifi_policy_join(&wifi.policy, has_network, now_ms());
}

void wifi_hold_own(bool hold) {
    wifi_policy_hold(&wifi.policy, hold);
}

bool wifi_has_network(void) {
    return wifi.has_network;
}

/* ---- what else is on the air ---- */

/* While it connects the driver refuses; a hidden network has no name. */
bool wifi_scan(void) {
    return wifi.on && esp_wifi_scan_start(NULL, false) == ESP_OK;
}

static bool is_among(const struct wifi_network *found, size_t count, const char *name) {
    for (size_t i = 0; i < count; i++)
        if (strcmp(found[i].name, name) == 0)
            return true;
    return false;
}

/* One record at a time: all of them together are kilobytes of stack. */
size_t wifi_scanned(struct wifi_network found[WIFI_NETWORKS]) {
    wifi_ap_record_t record;
    size_t count = 0;
    while (count < WIFI_NETWORKS && esp_wifi_scan_get_ap_record(&record) == ESP_OK) {
        const char *name = (const char *)record.ssid;
        if (name[0] == '\0' || is_among(found, count, name))
            continue;
        found[count] =
            (struct wifi_network){.rssi_dbm = record.rssi, .secured = record.authmode != WIFI_AUTH_OPEN};
        memcpy(found[count].name, record.ssid, WIFI_SSID_MAX);
        count++;
    }
    (void)esp_wifi_clear_ap_list();
    return count;
}

void wifi_news(enum wifi_news news) {
    wifi_policy_event(&wifi.policy, news == WIFI_NEWS_ADDRESS ? WIFI_GOT_ADDRESS : WIFI_LOST, now_ms());
}
