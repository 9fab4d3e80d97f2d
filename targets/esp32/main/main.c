/* SPDX-License-Identifier: MIT
 * Start of the firmware, in stages: outputs are made safe before anything else can go wrong; the motion side
 * is up before anyone can command it; the network comes last, and nothing waits for it.
 *
 * The storage is read before the outputs, because it says which pins they are on; until then the pins do what
 * they do from reset. */
#include "app/entropy.h"
#include "app/task_map.h"
#include "firmware.h"
#include "pin_config.h"

#include "esp_attr.h"
#include "esp_system.h"
#include "freertos/FreeRTOS.h"
#include "freertos/task.h"

static RTC_NOINIT_ATTR struct boot_guard guard; /* a reset keeps it */
static RTC_NOINIT_ATTR struct restart_note note;
static struct firmware firmware; /* without initial values: they would be as large in the image */

static enum boot_cause cause_of_start(void) {
    switch (esp_reset_reason()) {
    case ESP_RST_SW:
    case ESP_RST_USB:
        return BOOT_SOFTWARE;
    case ESP_RST_PANIC:
    case ESP_RST_INT_WDT:
    case ESP_RST_TASK_WDT:
    case ESP_RST_WDT:
        return BOOT_CRASH;
    case ESP_RST_BROWNOUT:
        return BOOT_BROWNOUT;
    default:
        return BOOT_POWER;
    }
}

/* The reset pin is the same as power-on for this chip, but the memory may have lasted: the mark of motion
 * says. */
static enum hal_restart_cause restart_cause(void) {
    switch (esp_reset_reason()) {
    case ESP_RST_PANIC:
    case ESP_RST_CPU_LOCKUP:
        return HAL_RESTART_FAULT;
    case ESP_RST_INT_WDT:
    case ESP_RST_TASK_WDT:
    case ESP_RST_WDT:
        return HAL_RESTART_WATCHDOG;
    case ESP_RST_BROWNOUT:
    case ESP_RST_PWR_GLITCH:
        return HAL_RESTART_BROWN_OUT;
    case ESP_RST_EXT:
    case ESP_RST_USB:
    case ESP_RST_JTAG:
    case ESP_RST_POWERON:
        return HAL_RESTART_EXTERNAL;
    case ESP_RST_SW:
        return HAL_RESTART_NONE;
    default:
        return HAL_RESTART_UNKNOWN;
    }
}

void app_main(void) {
    static const struct net_hub_sizes sizes = {.clients = NET_CLIENTS -
                                                          (BOARD_HAS_PENDANT != 0 ? 0 : NET_PENDANT_PLACES),
                                               .in = 2048,
                                               .out = 16384,
                                               .left = 2048};
    struct complaints complaints = {.text = ""};
    entropy_start(); /* it takes the ADC and I2S, which drives outputs later */
    firmware.guard = &guard;
    firmware.note = &note;
    firmware.restart = restart_note_begin(&note, restart_cause());
    enum nvs_start kept = nvs_flash_ops_open(&firmware.store);
    /* Before anything that may have been the cause of a crash. */
    firmware.safe_mode = boot_guard_begin(&guard, cause_of_start());
    controller_init(&firmware.controller, &firmware.machine, &sizes);
    firmware_read_choices(&firmware);
    firmware_start_pins(&firmware, &complaints);
    if (!firmware.is_module) {
        firmware_start_ports(&firmware);
        firmware_tell_complaints(&firmware, &complaints);
        firmware_start_hal(&firmware);
        firmware_start_machine(&firmware, kept);
    }
    void (*run)(void *) = firmware.is_module ? firmware_run_io_module : firmware_run_controller;
    if (xTaskCreatePinnedToCore(run, "controller", CONTROLLER_TASK_STACK, &firmware, CONTROLLER_TASK_PRIORITY,
                                NULL, NETWORK_CORE) != pdPASS)
        firmware_tell(&firmware, "No memory for the controller task");
}
