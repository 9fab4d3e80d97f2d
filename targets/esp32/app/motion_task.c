/* SPDX-License-Identifier: MIT */
#include "app/motion_task.h"

#include "app/task_map.h"
#include "hal/step_engine.h"
#include "io/charge_pump.h"
#include "task_periods.h"
#include "task_rest.h"

#include "esp_attr.h"
#include "esp_task_wdt.h"
#include "esp_timer.h"
#include "freertos/FreeRTOS.h"
#include "freertos/task.h"

/* Work that another task wants done here, and who waits for it. */
static struct {
    void (*work)(void *arg);
    void *arg;
    TaskHandle_t waits;
} asked;

static struct {
    struct machine *machine;
    struct hal *hal;
    TaskHandle_t task;
    TaskHandle_t starts; /* who waits for the start */
    volatile bool good;
} motion;

static portMUX_TYPE lock = portMUX_INITIALIZER_UNLOCKED;

/* ---- work for others ---- */

static void call(const void *ctx, void (*work)(void *arg), void *arg) {
    (void)ctx;
    asked.arg = arg;
    asked.waits = xTaskGetCurrentTaskHandle();
    /* Last: the motion task takes it as the sign that the rest is there. */
    __atomic_store_n(&asked.work, work, __ATOMIC_RELEASE);
    xTaskNotifyGive(motion.task);
    (void)ulTaskNotifyTake(pdTRUE, portMAX_DELAY);
}

const struct hal_motion_side motion_task_side = {.call = call};

static void IRAM_ATTR do_what_is_asked(void) {
    void (*work)(void *arg) = __atomic_load_n(&asked.work, __ATOMIC_ACQUIRE);
    if (work == NULL)
        return;
    portENTER_CRITICAL(&lock); /* holds the inputs off, not the step timer: work() halts it first */
    work(asked.arg);
    portEXIT_CRITICAL(&lock);
    /* First the slot is free, then the caller continues: it may ask again immediately. */
    __atomic_store_n(&asked.work, NULL, __ATOMIC_RELEASE);
    xTaskNotifyGive(asked.waits);
}

/* ---- the task ---- */

/* Until the next ms, or until it is woken; not while there is more to do. The controller may wake it again
 * and again, so that only a wait that has run out is a rest of this core. */
static void IRAM_ATTR rest(struct task_rest *rested, bool more) {
    const TickType_t tick = pdMS_TO_TICKS(ESP32_MOTION_PERIOD_US / 1000);
    bool blocked = true;
    if (task_rest_is_due(rested, (uint32_t)esp_timer_get_time()))
        vTaskDelay(tick);
    else
        blocked = ulTaskNotifyTake(pdTRUE, more ? 0 : tick) == 0 && !more;
    if (blocked)
        task_rest_end(rested, (uint32_t)esp_timer_get_time());
}

static void IRAM_ATTR run(void *unused) {
    struct task_rest rested = {0};
    (void)unused;
    /* Here, because ESP-IDF puts an interrupt on the core that allocates it. */
    motion.good = step_engine_attach(machine_step(motion.machine)) &&
                  inputs_attach(&motion.hal->inputs, motion.machine);
    (void)esp_task_wdt_add(NULL);
    xTaskNotifyGive(motion.starts);
    while (motion.good) {
        do_what_is_asked();
        inputs_sample(&motion.hal->inputs);
        bool more = machine_poll_motion(motion.machine);
        step_engine_show(machine_step(motion.machine));
        charge_pump_beat();
        (void)esp_task_wdt_reset();
        rest(&rested, more);
    }
    vTaskDelete(NULL);
}

bool motion_task_start(struct machine *machine, struct hal *hal) {
    motion.machine = machine;
    motion.hal = hal;
    motion.starts = xTaskGetCurrentTaskHandle();
    if (xTaskCreatePinnedToCore(run, "motion", MOTION_TASK_STACK, NULL, MOTION_TASK_PRIORITY, &motion.task,
                                MOTION_CORE) != pdPASS)
        return false;
    (void)ulTaskNotifyTake(pdTRUE, portMAX_DELAY);
    return motion.good;
}

void motion_task_wake(void) {
    xTaskNotifyGive(motion.task);
}
