/* SPDX-License-Identifier: MIT
 * The controller's task, round by round: of a motion controller, or of an I/O module. */
#include "app/motion_task.h"
#include "firmware.h"
#include "hal/hal.h"
#include "io/led_driver.h"
#include "net/page.h"
#include "task_periods.h"

#include "esp_task_wdt.h"
#include "freertos/FreeRTOS.h"
#include "freertos/task.h"

enum { US_PER_MS = 1000, LED_EVERY_US = 50000 };

/* This firmware works: earlier crashes do not count. */
static void note_health(struct boot_guard *guard, uint32_t now_us) {
    static bool noted;
    if (noted || now_us < BOOT_HEALTHY_AFTER_MS * (uint32_t)US_PER_MS)
        return;
    noted = true;
    boot_guard_healthy(guard);
}

static void show_led(enum led_state state, uint32_t now_us) {
    static uint32_t shown_us;
    if (now_us - shown_us < LED_EVERY_US)
        return;
    shown_us = now_us;
    led_driver_show(state, now_us / US_PER_MS);
}

/* Of every round of both. */
static uint32_t begin_round(struct firmware *firmware) {
    uint32_t now_us = hal_time_us(&firmware->hal);
    (void)esp_task_wdt_reset();
    note_health(firmware->guard, now_us);
    return now_us;
}

static enum led_state controller_led(const struct firmware *firmware) {
    if (machine_state(&firmware->machine) == MACHINE_ALARM || firmware->safe_mode)
        return LED_ALARM;
    if (firmware->controller.hub.owner == NULL)
        return LED_DISCONNECTED;
    return machine_is_at_rest(&firmware->machine) ? LED_READY : LED_RUNNING;
}

/* @return true: there is more to do immediately */
static bool serve_network(struct firmware *firmware, uint32_t now_us) {
    if (!firmware->has_network)
        return false;
    bool more = services_poll(&firmware->services, now_us);
    more |= page_poll(now_us);
    if (firmware->portal != NULL)
        portal_poll(firmware->portal);
    firmware_tell_address(firmware);
    return more;
}

/* As a pressed e-stop, until the board restarts: the number of missing pulses is unknown. */
static void check_steps(struct firmware *firmware) {
    if (!step_engine_has_lost())
        return;
    firmware->hal.inputs.locked = true;
    firmware_tell(firmware, "The shift registers have lost step pulses: e-stop until the board is restarted");
}

void firmware_run_controller(void *ctx) {
    struct firmware *firmware = ctx;
    (void)esp_task_wdt_add(NULL);
    firmware_start_network(firmware);
    for (;;) {
        uint32_t now_us = begin_round(firmware);
        follow_poll(&firmware->follow);
        check_steps(firmware);
        show_led(controller_led(firmware), now_us);
        bool more = serve_network(firmware, now_us);
        firmware_keep_trust(firmware);
        if (controller_round(&firmware->controller) && !firmware->safe_mode)
            motion_task_wake();
        else if (!more)
            vTaskDelay(pdMS_TO_TICKS(ESP32_CONTROLLER_PERIOD_US / 1000));
    }
}

static enum led_state io_module_led(const struct firmware *firmware) {
    if (firmware->channels.locked || firmware->channels.faults != 0)
        return LED_ALARM;
    return firmware->controller.session.owner.on ? LED_READY : LED_DISCONNECTED;
}

void firmware_run_io_module(void *ctx) {
    struct firmware *firmware = ctx;
    (void)esp_task_wdt_add(NULL);
    firmware_start_io_module(firmware);
    for (;;) {
        uint32_t now_us = begin_round(firmware);
        access_poll(&firmware->controller.access, now_us);
        show_led(io_module_led(firmware), now_us);
        if (firmware->has_network)
            io_module_round(&firmware->io_module);
        if (!firmware->has_network || !services_poll(&firmware->services, now_us))
            vTaskDelay(pdMS_TO_TICKS(1));
    }
}
