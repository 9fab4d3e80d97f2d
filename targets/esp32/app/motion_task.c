/* SPDX-License-Identifier: MIT */
#include "app/motion_task.h"

#include "app/task_map.h"
#include "hal/step_engine.h"

#include "esp_task_wdt.h"
#include "freertos/FreeRTOS.h"
#include "freertos/task.h"

#define MOTORS_STAY_ON 255u /* $1: as in Grbl */
#define US_PER_MS      1000u

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
    bool motors_on;
    uint32_t rested_us; /* since when nothing moves */
    uint32_t pumped_us; /* the charge pump's last half wave */
} motion;

static portMUX_TYPE lock = portMUX_INITIALIZER_UNLOCKED;

/* ---- work for others ---- */

static void call(const void *ctx, void (*work)(void *arg), void *arg) {
    (void)ctx;
    asked.arg = arg;
    asked.waits = xTaskGetCurrentTaskHandle();
    __atomic_store_n(&asked.work, work, __ATOMIC_RELEASE);
    xTaskNotifyGive(motion.task);
    (void)ulTaskNotifyTake(pdTRUE, portMAX_DELAY);
}

const struct hal_motion_side motion_task_side = {.call = call};

static void do_what_is_asked(void) {
    void (*work)(void *arg) = __atomic_load_n(&asked.work, __ATOMIC_ACQUIRE);
    if (work == NULL)
        return;
    portENTER_CRITICAL(&lock); /* holds the step timer and the inputs off, too */
    work(asked.arg);
    portEXIT_CRITICAL(&lock);
    __atomic_store_n(&asked.work, NULL, __ATOMIC_RELEASE);
    xTaskNotifyGive(asked.waits);
}

/* ---- motors ---- */

static bool moves(const struct machine *machine) {
    return machine->step.active || segment_ring_peek(&machine->motion.ring) != NULL || machine->prep.loaded;
}

static void switch_motors(bool on) {
    motion.motors_on = on;
    outputs_motors(&motion.hal->outputs, on, motion.machine->settings.enable_invert);
}

/* On before the first step, off when $1 has passed since the last one. */
static void motors_poll(void) {
    uint16_t delay_ms = motion.machine->settings.idle_delay_ms;
    uint32_t now_us = hal_time_us(motion.hal);
    if (moves(motion.machine)) {
        motion.rested_us = now_us;
        if (!motion.motors_on) {
            switch_motors(true);
            vTaskDelay(1); /* drivers need up to a ms to wake */
        }
    } else if (motion.motors_on && delay_ms != MOTORS_STAY_ON &&
               now_us - motion.rested_us >= delay_ms * US_PER_MS) {
        switch_motors(false);
    }
}

static void pump_poll(void) {
    uint32_t now_us = hal_time_us(motion.hal);
    if (now_us - motion.pumped_us < US_PER_MS)
        return;
    motion.pumped_us = now_us;
    outputs_pump(&motion.hal->outputs);
}

/* ---- the task ---- */

static void run(void *unused) {
    (void)unused;
    motion.good =
        step_engine_attach(&motion.machine->step) && inputs_attach(&motion.hal->inputs, motion.machine);
    (void)esp_task_wdt_add(NULL);
    xTaskNotifyGive(motion.starts);
    while (motion.good) {
        do_what_is_asked();
        inputs_sample(&motion.hal->inputs);
        motors_poll();
        (void)machine_poll_motion(motion.machine);
        pump_poll();
        (void)esp_task_wdt_reset();
        (void)ulTaskNotifyTake(pdTRUE, pdMS_TO_TICKS(1));
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
