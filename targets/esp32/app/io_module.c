/* SPDX-License-Identifier: MIT */
#include "app/io_module.h"

#include "esp_task_wdt.h"
#include "esp_timer.h"
#include "freertos/FreeRTOS.h"
#include "freertos/task.h"

/* Nothing moves here: an update may come at any time. */
static const char *lock(void *ctx) {
    (void)ctx;
    return NULL;
}

static void unlock(void *ctx) {
    (void)ctx;
}

void io_module_run(struct services *services, struct lockout *lockout, const char *password) {
    static const struct ota_flash flash = {.lock = lock, .unlock = unlock};
    services_start(services, lockout, password, &flash);
    (void)esp_task_wdt_add(NULL);
    for (;;) {
        (void)esp_task_wdt_reset();
        uint32_t now_us = (uint32_t)esp_timer_get_time();
        lockout_poll(lockout, now_us);
        if (!services_poll(services, now_us))
            vTaskDelay(1);
    }
}
