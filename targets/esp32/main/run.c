/* SPDX-License-Identifier: MIT
 * The controller's task, round by round: of a motion controller, or of an I/O module. */
#include "app/motion_task.h"
#include "firmware.h"
#include "hal/hal.h"
#include "io/led_driver.h"
#include "net/light.h"
#include "net/page.h"
#include "task_periods.h"
#include "task_rest.h"

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

static void show_led(enum net_light light, uint32_t now_us) {
    static uint32_t shown_us;
    if (now_us - shown_us < LED_EVERY_US)
        return;
    shown_us = now_us;
    led_driver_show(light, now_us / US_PER_MS);
}

/* Of every round of both. */
static uint32_t begin_round(struct firmware *firmware) {
    uint32_t now_us = hal_time_us(&firmware->hal);
    (void)esp_task_wdt_reset();
    note_health(firmware->guard, now_us);
    return now_us;
}

/* The end of every round of both. @param more  another one has work to do immediately */
static void end_round(const struct firmware *firmware, bool more) {
    static struct task_rest rest;
    if (more && !task_rest_is_due(&rest, hal_time_us(&firmware->hal)))
        return;
    vTaskDelay(pdMS_TO_TICKS(ESP32_CONTROLLER_PERIOD_US / 1000));
    task_rest_end(&rest, hal_time_us(&firmware->hal));
}

static enum net_light light_of(bool alarm, bool at_rest, bool controlled) {
    struct net_light_facts facts = {.alarm = alarm, .at_rest = at_rest, .controlled = controlled};
    light_add_network(&facts);
    return net_light_of(&facts);
}

static enum net_light controller_light(const struct firmware *firmware) {
    const struct controller *controller = &firmware->controller;
    return light_of(machine_state(&firmware->machine) == MACHINE_ALARM || firmware->safe_mode,
                    machine_is_at_rest(&firmware->machine),
                    controller->hub.owner != NULL || controller->session.owner.on);
}

/* @return true: there is more to do immediately */
static bool serve_network(struct firmware *firmware, uint32_t now_us) {
    if (!firmware->has_network)
        return false;
    const bool reached = controller_is_reached(&firmware->controller);
    const bool at_rest = controller_why_busy(&firmware->controller) == NULL;
    firmware_poll_wiring(firmware, now_us, reached, at_rest);
    bool more = services_poll(&firmware->services, now_us, reached, at_rest);
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
    firmware->hal.inputs.lock = HAL_LOCK_STEPS_LOST;
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
        restart_note_moves(firmware->note, !machine_is_at_rest(&firmware->machine));
        show_led(controller_light(firmware), now_us);
        bool more = serve_network(firmware, now_us);
        firmware_keep_trust(firmware);
        const bool moves = controller_round(&firmware->controller) && !firmware->safe_mode;
        if (moves)
            motion_task_wake();
        end_round(firmware, more || moves);
    }
}

static enum net_light io_module_light(const struct firmware *firmware) {
    return light_of(firmware->channels.locked || firmware->channels.faults != 0, true,
                    firmware->controller.session.owner.on);
}

void firmware_run_io_module(void *ctx) {
    struct firmware *firmware = ctx;
    (void)esp_task_wdt_add(NULL);
    firmware_start_io_module(firmware);
    for (;;) {
        uint32_t now_us = begin_round(firmware);
        access_poll(&firmware->controller.access, now_us);
        show_led(io_module_light(firmware), now_us);
        if (firmware->has_network)
            io_module_round(firmware->io_module);
        const bool reached = firmware->controller.session.owner.on;
        firmware_poll_wiring(firmware, now_us, reached, !reached);
        end_round(firmware,
                  firmware->has_network && services_poll(&firmware->services, now_us, reached, !reached));
    }
}
