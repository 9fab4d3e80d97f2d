/* SPDX-License-Identifier: MIT
 * The loops of the firmware's tasks, which block for a tick at least every ESP32_WORK_MAX_US, whatever always
 * has more to do: a job, a network, an update, who wakes the motion task. Time is that of the rounds. */
#include "app/motion_task.h"
#include "app/task_map.h"
#include "check.h"
#include "hal/hal.h"
#include "hal/step_engine.h"
#include "io/charge_pump.h"
#include "io/led_driver.h"
#include "main/firmware.h"
#include "net/light.h"
#include "net/page.h"
#include "task_periods.h"

#include "esp_task_wdt.h"
#include "esp_timer.h"
#include "freertos/FreeRTOS.h"
#include "freertos/task.h"

#include <setjmp.h>
#include <string.h>

enum { ROUND_US = 150, ROUNDS = 40000, TICK_US = 1000 };

/* What has more to do. */
static struct {
    bool job, page, update, spans;
    bool woken; /* by another task, all the time */
} busy;
static uint32_t now_us, rested_us, longest_us, rounds, delays;
static jmp_buf end;
static TaskFunction_t motion_run;

static void rest(void) {
    now_us += TICK_US - now_us % TICK_US;
    rested_us = now_us;
}

/* ---- FreeRTOS and ESP-IDF ---- */

void vTaskDelay(TickType_t ticks) {
    CHECK(ticks == 1);
    delays++;
    rest();
}
uint32_t ulTaskNotifyTake(BaseType_t clear, TickType_t ticks) {
    (void)clear;
    if (busy.woken || ticks == 0)
        return busy.woken;
    rest();
    return 0;
}
BaseType_t xTaskNotifyGive(TaskHandle_t task) {
    (void)task;
    return pdTRUE;
}
TaskHandle_t xTaskGetCurrentTaskHandle(void) {
    return NULL;
}
BaseType_t xTaskCreatePinnedToCore(TaskFunction_t function, const char *name, uint32_t stack_bytes, void *arg,
                                   UBaseType_t priority, TaskHandle_t *task, BaseType_t core) {
    (void)name, (void)stack_bytes, (void)arg, (void)priority, (void)task;
    CHECK(core == MOTION_CORE);
    motion_run = function;
    return pdPASS;
}
void vTaskDelete(TaskHandle_t task) {
    (void)task;
    CHECK(false);
}
esp_err_t esp_task_wdt_add(TaskHandle_t task) {
    (void)task;
    return ESP_OK;
}
int64_t esp_timer_get_time(void) {
    return now_us;
}
void vPortEnterCritical(portMUX_TYPE *mux) {
    (void)mux;
}
void vPortExitCritical(portMUX_TYPE *mux) {
    (void)mux;
}
uint32_t hal_time_us(const struct hal *hal) {
    (void)hal;
    return now_us;
}
/* Once a round of each task. */
esp_err_t esp_task_wdt_reset(void) {
    now_us += ROUND_US;
    longest_us = now_us - rested_us > longest_us ? now_us - rested_us : longest_us;
    if (++rounds == ROUNDS)
        longjmp(end, 1);
    return ESP_OK;
}

/* ---- the rest of the firmware ---- */

bool controller_round(struct controller *controller) {
    (void)controller;
    return busy.job;
}
bool services_poll(struct services *services, uint32_t us, bool reached, bool at_rest) {
    (void)services, (void)us, (void)reached, (void)at_rest;
    return busy.update;
}
bool page_poll(uint32_t us) {
    (void)us;
    return busy.page;
}
enum net_light net_light_of(const struct net_light_facts *facts) {
    (void)facts;
    return (enum net_light)0;
}
enum machine_state machine_state(const struct machine *machine) {
    (void)machine;
    return MACHINE_IDLE;
}
bool machine_is_at_rest(const struct machine *machine) {
    (void)machine;
    return true;
}
struct step *machine_step(struct machine *machine) {
    (void)machine;
    return NULL;
}
void access_poll(struct access *access, uint32_t us) {
    (void)access, (void)us;
}
bool machine_poll_motion(struct machine *machine) {
    (void)machine;
    return busy.spans;
}
void restart_note_moves(struct restart_note *note, bool moves) {
    (void)note, (void)moves;
}
void boot_guard_healthy(struct boot_guard *kept) {
    (void)kept;
}
void led_driver_show(enum net_light light, uint32_t ms) {
    (void)light, (void)ms;
}
void light_add_network(struct net_light_facts *facts) {
    (void)facts;
}
bool controller_is_reached(const struct controller *controller) {
    (void)controller;
    return true;
}
const char *controller_why_busy(const struct controller *controller) {
    (void)controller;
    return NULL;
}
void firmware_poll_wiring(struct firmware *firmware, uint32_t us, bool reached, bool at_rest) {
    (void)firmware, (void)us, (void)reached, (void)at_rest;
}
void portal_poll(struct portal *portal) {
    (void)portal;
}
void firmware_tell_address(struct firmware *firmware) {
    (void)firmware;
}
void firmware_tell(struct firmware *firmware, const char *text) {
    (void)firmware, (void)text;
}
void firmware_start_network(struct firmware *firmware) {
    (void)firmware;
}
void firmware_keep_trust(struct firmware *firmware) {
    (void)firmware;
}
void firmware_start_io_module(struct firmware *firmware) {
    (void)firmware;
}
void io_module_round(struct io_module *module) {
    (void)module;
}
void follow_poll(struct follow *follow) {
    (void)follow;
}
bool step_engine_has_lost(void) {
    return false;
}
bool step_engine_attach(struct step *step) {
    (void)step;
    return true;
}
void step_engine_show(const struct step *step) {
    (void)step;
}
void inputs_sample(struct inputs *inputs) {
    (void)inputs;
}
bool inputs_attach(struct inputs *inputs, struct machine *machine) {
    (void)inputs, (void)machine;
    return true;
}
void charge_pump_beat(void) {}

/* ---- */

static struct firmware firmware;

static void run(void (*task)(void *arg)) {
    rounds = delays = longest_us = 0;
    rested_us = now_us;
    if (setjmp(end) == 0)
        task(&firmware);
    CHECK(rounds == ROUNDS);
    CHECK(longest_us <= ESP32_WORK_MAX_US + 2 * ROUND_US);
}

/* Each alone, all together, and nothing. */
static void test_controller(void (*task)(void *arg)) {
    for (unsigned what = 0; what < 8; what++) {
        busy.job = (what & 1) != 0;
        busy.page = (what & 2) != 0;
        busy.update = (what & 4) != 0;
        run(task);
        CHECK(what != 0 || delays >= ROUNDS - 1);
    }
    memset(&busy, 0, sizeof busy);
}

static void test_motion(void) {
    static struct hal hal;
    (void)motion_task_start(&firmware.machine, &hal); /* the task says whether it is good */
    for (unsigned what = 0; what < 4; what++) {
        busy.spans = (what & 1) != 0;
        busy.woken = (what & 2) != 0;
        run(motion_run);
        CHECK(what != 0 || delays <= 1); /* a wait that can be cut short is rest enough */
    }
}

int main(void) {
    for (unsigned network = 0; network < 2; network++) {
        firmware.has_network = network != 0;
        for (unsigned safe = 0; safe < 2; safe++) {
            firmware.safe_mode = safe != 0;
            test_controller(firmware_run_controller);
        }
        test_controller(firmware_run_io_module);
    }
    test_motion();
    return report();
}
