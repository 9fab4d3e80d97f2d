/* SPDX-License-Identifier: MIT
 * Decisions of the firmware that need only a clock: safe mode, WiFi and Ethernet, the status LED. */
#include "app/boot_guard.h"
#include "app/restart_note.h"
#include "check.h"
#include "net/link_policy.h"
#include "net/update_trial.h"
#include "net/wifi_policy.h"
#include "net_light.h"

#include <string.h>

/* ---- safe mode ---- */

static void three_crashes_in_a_row_lead_to_safe_mode(void) {
    struct boot_guard kept;
    memset(&kept, 0xA5, sizeof kept); /* what is there after power-on */
    CHECK(!boot_guard_begin(&kept, BOOT_POWER));
    CHECK(!boot_guard_begin(&kept, BOOT_CRASH) && !boot_guard_begin(&kept, BOOT_CRASH));
    CHECK(boot_guard_begin(&kept, BOOT_CRASH));
    CHECK(boot_guard_begin(&kept, BOOT_CRASH) && boot_guard_begin(&kept, BOOT_SOFTWARE));
    boot_guard_healthy(&kept);
    CHECK(boot_guard_begin(&kept, BOOT_SOFTWARE)); /* only a power cycle ends it */
    CHECK(!boot_guard_begin(&kept, BOOT_POWER));
}

static void crashes_far_apart_do_not_add_up(void) {
    struct boot_guard kept = {0};
    for (int day = 0; day < 10; day++) {
        CHECK(!boot_guard_begin(&kept, BOOT_CRASH));
        boot_guard_healthy(&kept);
    }
}

static void a_weak_supply_is_no_crash_and_noise_is_no_count(void) {
    struct boot_guard kept = {0};
    for (int i = 0; i < 10; i++)
        CHECK(!boot_guard_begin(&kept, BOOT_BROWNOUT));
    CHECK(!boot_guard_begin(&kept, BOOT_CRASH) && !boot_guard_begin(&kept, BOOT_CRASH));
    kept.crashes ^= 8; /* a bit that a dip of the supply has turned */
    CHECK(!boot_guard_begin(&kept, BOOT_BROWNOUT));
}

/* ---- links ---- */

static void without_ethernet_wifi_is_on_at_once(void) {
    struct link_policy policy;
    link_policy_init(&policy, false, 1000);
    CHECK(link_policy_wifi(&policy, 1000) && link_policy_wifi(&policy, 100000));
}

static void ethernet_takes_over_and_gives_back_after_five_seconds(void) {
    struct link_policy policy;
    uint32_t t_ms = UINT32_MAX - 2000;
    link_policy_init(&policy, true, t_ms);
    CHECK(!link_policy_wifi(&policy, t_ms + 4999) && link_policy_wifi(&policy, t_ms += 5000));
    link_policy_ethernet(&policy, true, t_ms);
    CHECK(link_policy_wifi(&policy, t_ms + 4999) && !link_policy_wifi(&policy, t_ms += 5000));
    link_policy_ethernet(&policy, false, t_ms);
    link_policy_ethernet(&policy, true, t_ms + 3000); /* a loose plug */
    CHECK(!link_policy_wifi(&policy, t_ms + 7999));
    link_policy_ethernet(&policy, false, t_ms += 9000);
    CHECK(!link_policy_wifi(&policy, t_ms + 4999) && link_policy_wifi(&policy, t_ms + 5000));
}

static void an_address_within_five_seconds_keeps_wifi_off(void) {
    struct link_policy policy;
    link_policy_init(&policy, true, 0);
    link_policy_ethernet(&policy, true, 4900);
    for (uint32_t t_ms = 4900; t_ms < 20000; t_ms += 100)
        CHECK(!link_policy_wifi(&policy, t_ms));
}

/* Times of the attempts while nothing answers. */
static void wifi_tries_again_after_ever_longer_times(void) {
    static const uint32_t wait_s[] = {0, 1, 2, 4, 8, 16, 32, 60, 60};
    struct wifi_policy policy;
    uint32_t t_ms = 0, failed_ms = 0;
    wifi_policy_init(&policy, true, 0);
    for (unsigned attempt = 0; attempt < sizeof wait_s / sizeof wait_s[0]; attempt++) {
        while (!wifi_policy_poll(&policy, t_ms).connect && t_ms < 300000)
            t_ms += 100;
        CHECK(t_ms - failed_ms == wait_s[attempt] * 1000);
        wifi_policy_event(&policy, WIFI_LOST, t_ms += 500);
        failed_ms = t_ms;
    }
    CHECK(wifi_policy_poll(&policy, t_ms).own);
    while (!wifi_policy_poll(&policy, t_ms).connect)
        t_ms += 100;
    wifi_policy_event(&policy, WIFI_GOT_ADDRESS, t_ms);
    CHECK(!wifi_policy_poll(&policy, t_ms).own && !wifi_policy_poll(&policy, t_ms + 100000).connect);
    wifi_policy_event(&policy, WIFI_LOST, t_ms += 200000);
    CHECK(!wifi_policy_poll(&policy, t_ms + 999).connect && wifi_policy_poll(&policy, t_ms + 1000).connect);
}

static void without_a_network_our_own_is_there_at_once(void) {
    struct wifi_policy policy;
    wifi_policy_init(&policy, false, 0);
    CHECK(wifi_policy_poll(&policy, 0).own && !wifi_policy_poll(&policy, 1000000).connect);
}

/* A phone in the own network sees how it went: that network stays until the trial has ended. */
static void an_own_network_stays_while_another_one_is_on_trial(void) {
    struct wifi_policy policy;
    wifi_policy_init(&policy, false, 0);
    wifi_policy_hold(&policy, true);
    wifi_policy_join(&policy, true, 1000);
    CHECK(wifi_policy_poll(&policy, 1000).own);
    wifi_policy_event(&policy, WIFI_GOT_ADDRESS, 2000);
    CHECK(wifi_policy_poll(&policy, 2000).own);
    wifi_policy_hold(&policy, false);
    CHECK(!wifi_policy_poll(&policy, 3000).own);
}

static void a_trial_opens_no_own_network_where_the_new_one_works(void) {
    struct wifi_policy policy;
    wifi_policy_init(&policy, true, 0);
    wifi_policy_event(&policy, WIFI_GOT_ADDRESS, 500);
    wifi_policy_hold(&policy, true);
    wifi_policy_join(&policy, true, 1000);
    CHECK(!wifi_policy_poll(&policy, 1000).own && !wifi_policy_poll(&policy, 60999).own);
    CHECK(wifi_policy_poll(&policy, 61000).own); /* it does not work: as always */
}

static void without_a_network_the_end_of_a_trial_leaves_our_own(void) {
    struct wifi_policy policy;
    wifi_policy_init(&policy, true, 0);
    wifi_policy_hold(&policy, true);
    wifi_policy_join(&policy, false, 1000);
    wifi_policy_hold(&policy, false);
    CHECK(wifi_policy_poll(&policy, 2000).own);
}

/* IEEE 802.11-2020, table 9-49, and ESP-IDF's own from 200 on. */
static void the_cause_of_a_failure_is_told_apart(void) {
    CHECK(wifi_policy_why(15) == WIFI_WRONG_PASSWORD && wifi_policy_why(204) == WIFI_WRONG_PASSWORD);
    CHECK(wifi_policy_why(202) == WIFI_WRONG_PASSWORD && wifi_policy_why(201) == WIFI_NOT_FOUND);
    CHECK(wifi_policy_why(211) == WIFI_WRONG_PASSWORD && wifi_policy_why(205) == WIFI_FAILED);
}

/* ---- an update on trial ---- */

static const uint32_t S = 1000000;

static void a_new_firmware_stays_when_someone_reaches_it(void) {
    struct update_trial trial = {.on = true};
    CHECK(update_trial_poll(&trial, 5 * S, false, true) == UPDATE_WAIT);
    CHECK(update_trial_poll(&trial, 6 * S, true, true) == UPDATE_WAIT); /* it may still crash */
    CHECK(update_trial_poll(&trial, 29 * S, false, true) == UPDATE_WAIT);
    CHECK(update_trial_poll(&trial, 30 * S, false, false) == UPDATE_CONFIRM);
    for (uint32_t up_s = 31; up_s < 4000; up_s++)
        CHECK(update_trial_poll(&trial, up_s * S, false, true) == UPDATE_WAIT);
}

static void a_new_firmware_that_no_one_reaches_goes(void) {
    struct update_trial trial = {.on = true};
    for (uint32_t up_s = 0; up_s < 300; up_s++)
        CHECK(update_trial_poll(&trial, up_s * S, false, true) == UPDATE_WAIT);
    CHECK(update_trial_poll(&trial, 300 * S, false, false) == UPDATE_WAIT); /* a job, by cable */
    CHECK(update_trial_poll(&trial, 310 * S, false, true) == UPDATE_REVERT);
    CHECK(update_trial_poll(&trial, 311 * S, false, true) == UPDATE_WAIT);
    trial = (struct update_trial){.on = true};
    CHECK(update_trial_poll(&trial, 299 * S, true, true) == UPDATE_CONFIRM); /* at the last moment */
}

static void a_firmware_that_was_confirmed_is_not_on_trial(void) {
    struct update_trial trial = {.on = false};
    for (uint32_t up_s = 0; up_s < 400; up_s++)
        CHECK(update_trial_poll(&trial, up_s * S, false, true) == UPDATE_WAIT);
}

/* ---- LED ---- */

/* How often it changes in a second. */
static unsigned changes(enum net_light light) {
    unsigned count = 0;
    for (uint32_t t_ms = 0; t_ms < 4000; t_ms++) {
        struct net_light_colour now = net_light_colour(light, t_ms), next = net_light_colour(light, t_ms + 1);
        count += memcmp(&now, &next, sizeof now) != 0;
    }
    return count / 4;
}

static void the_led_shows_the_states_of_the_reference(void) {
    struct net_light_colour red = net_light_colour(NET_LIGHT_NO_NETWORK, 0);
    struct net_light_colour blue = net_light_colour(NET_LIGHT_READY, 0);
    struct net_light_colour green = net_light_colour(NET_LIGHT_RUNNING, 0);
    struct net_light_colour yellow = net_light_colour(NET_LIGHT_ALARM, 0);
    CHECK(red.red == 20 && red.green == 0 && red.blue == 0 && blue.blue == 20 && blue.red == 0);
    CHECK(green.green == 20 && green.red == 0 && yellow.red == 20 && yellow.green == 20 && yellow.blue == 0);
    CHECK(changes(NET_LIGHT_NO_NETWORK) == 2 && changes(NET_LIGHT_ALARM) == 8);
    CHECK(changes(NET_LIGHT_READY) == 0 && changes(NET_LIGHT_RUNNING) == 0);
    CHECK(!net_light_is_on(NET_LIGHT_NO_NETWORK, 0) && net_light_is_on(NET_LIGHT_READY, 700));
    CHECK(net_light_is_on(NET_LIGHT_RUNNING, 0) && !net_light_is_on(NET_LIGHT_RUNNING, 500));
    CHECK(net_light_is_on(NET_LIGHT_ALARM, 0) && !net_light_is_on(NET_LIGHT_ALARM, 125));
}

/* Of both kinds: over the time of the longest pattern, one ms after another. */
static void no_two_phases_look_the_same(void) {
    for (int one = 0; one < NET_LIGHT_COUNT; one++)
        for (int other = 0; other < one; other++) {
            bool colours_differ = false, levels_differ = false;
            for (uint32_t t_ms = 0; t_ms < 4000; t_ms++) {
                struct net_light_colour a = net_light_colour((enum net_light)one, t_ms);
                struct net_light_colour b = net_light_colour((enum net_light)other, t_ms);
                colours_differ |= memcmp(&a, &b, sizeof a) != 0;
                levels_differ |= net_light_is_on((enum net_light)one, t_ms) !=
                                 net_light_is_on((enum net_light)other, t_ms);
            }
            CHECK(colours_differ && levels_differ);
        }
}

static void what_matters_most_is_shown(void) {
    struct net_light_facts facts = {.at_rest = true};
    CHECK(net_light_of(&facts) == NET_LIGHT_NO_NETWORK);
    facts.own = true;
    CHECK(net_light_of(&facts) == NET_LIGHT_OWN_NETWORK);
    facts.joining = true; /* a phone has sent a network: the own one stays until it is joined */
    CHECK(net_light_of(&facts) == NET_LIGHT_JOINING);
    facts.joined = true;
    CHECK(net_light_of(&facts) == NET_LIGHT_JOINED);
    facts.controlled = true;
    CHECK(net_light_of(&facts) == NET_LIGHT_READY);
    facts.at_rest = facts.controlled = false; /* whoever has sent the lines that still run */
    CHECK(net_light_of(&facts) == NET_LIGHT_RUNNING);
    facts.alarm = true;
    CHECK(net_light_of(&facts) == NET_LIGHT_ALARM);
}

/* ---- restarts that were not requested ---- */

static void a_restart_has_its_cause_once(void) {
    struct restart_note note;
    memset(&note, 0xA5, sizeof note); /* power-on: anything */
    CHECK(restart_note_begin(&note, HAL_RESTART_EXTERNAL) == NULL);
    CHECK(restart_note_begin(&note, HAL_RESTART_NONE) == NULL);
    const struct hal_restart *restart = restart_note_begin(&note, HAL_RESTART_BROWN_OUT);
    CHECK(restart != NULL && restart->cause == HAL_RESTART_BROWN_OUT);
    CHECK(restart->address_count == 0 && restart->detail == NULL);
}

static void a_reset_in_motion_is_told_from_one_at_rest(void) {
    struct restart_note note = {0};
    restart_note_moves(&note, true);
    CHECK(restart_note_begin(&note, HAL_RESTART_EXTERNAL) == &note.restart);
    CHECK(restart_note_begin(&note, HAL_RESTART_EXTERNAL) == NULL);
    restart_note_moves(&note, true);
    restart_note_moves(&note, false);
    CHECK(restart_note_begin(&note, HAL_RESTART_EXTERNAL) == NULL);
    restart_note_moves(&note, true);
    CHECK(restart_note_begin(&note, HAL_RESTART_NONE) == NULL); /* an update begins at rest alone */
}

static void a_panic_leaves_its_place(void) {
    const uint32_t address[6] = {0x400D1234, 0x400D2000, 3, 4, 5, 6};
    struct restart_note note = {0};
    restart_note_panic(&note, address, 6, "LoadProhibited\nand a second line");
    const struct hal_restart *restart = restart_note_begin(&note, HAL_RESTART_FAULT);
    CHECK(restart->address_count == HAL_RESTART_ADDRESSES && restart->address[0] == 0x400D1234);
    CHECK(strcmp(restart->detail, "LoadProhibited") == 0);
    restart_note_panic(&note, address, 2, NULL);
    restart = restart_note_begin(&note, HAL_RESTART_WATCHDOG);
    CHECK(restart->address_count == 2 && restart->detail == NULL);
    restart_note_panic(&note, address, 1, "a panic before the supply dips");
    restart = restart_note_begin(&note, HAL_RESTART_BROWN_OUT);
    CHECK(restart->address_count == 0 && restart->detail == NULL);
    restart = restart_note_begin(&note, HAL_RESTART_FAULT); /* not the one before */
    CHECK(restart->address_count == 0);
    restart_note_panic(&note, address, 1, "more words than there is room for in the note");
    CHECK(strlen(restart_note_begin(&note, HAL_RESTART_FAULT)->detail) == RESTART_DETAIL_SIZE - 1);
}

int main(void) {
    a_restart_has_its_cause_once();
    a_reset_in_motion_is_told_from_one_at_rest();
    a_panic_leaves_its_place();
    three_crashes_in_a_row_lead_to_safe_mode();
    crashes_far_apart_do_not_add_up();
    a_weak_supply_is_no_crash_and_noise_is_no_count();
    without_ethernet_wifi_is_on_at_once();
    ethernet_takes_over_and_gives_back_after_five_seconds();
    an_address_within_five_seconds_keeps_wifi_off();
    wifi_tries_again_after_ever_longer_times();
    without_a_network_our_own_is_there_at_once();
    an_own_network_stays_while_another_one_is_on_trial();
    a_trial_opens_no_own_network_where_the_new_one_works();
    without_a_network_the_end_of_a_trial_leaves_our_own();
    the_cause_of_a_failure_is_told_apart();
    a_new_firmware_stays_when_someone_reaches_it();
    a_new_firmware_that_no_one_reaches_goes();
    a_firmware_that_was_confirmed_is_not_on_trial();
    the_led_shows_the_states_of_the_reference();
    no_two_phases_look_the_same();
    what_matters_most_is_shown();
    return report();
}
