/* SPDX-License-Identifier: MIT
 * Start of the firmware, in stages: what can hurt is made safe before anything else can go wrong; the motion
 * side stands before there is anybody who could command it; the network comes last, and nothing waits for it.
 */
#include "app/board.h"
#include "app/controller.h"
#include "app/follow.h"
#include "app/motion_task.h"
#include "app/task_map.h"
#include "hal/esp32_hal.h"
#include "link/serial_stream.h"
#include "net/wifi.h"
#include "store/nvs_flash_ops.h"

#include "esp_task_wdt.h"
#include "freertos/FreeRTOS.h"
#include "freertos/task.h"

#include <stdio.h>

enum { TELNET_CLIENTS = 4 };

static struct machine machine;
static struct hal hal;
static struct controller controller;
static struct nvs_store store;
static struct follow follow;

/* A stage that fails is said on the serial ports; what needs it is left out. */
static void tell(const char *text) {
    net_hub_tell(&controller.hub, text);
}

static void start_hal(void) {
    struct input_wire inputs[INPUT_COUNT];
    struct output_wire outputs[SWITCH_COUNT];
    board_inputs(inputs);
    board_outputs(outputs);
    inputs_init(&hal.inputs, inputs);
    if (!outputs_init(&hal.outputs, outputs))
        tell("Spindle PWM did not start");
    if (!step_engine_init(&hal.step, &board_step_engine))
        tell("This board's step pins or timer are impossible, nothing moves");
}

static void start_ports(void) {
    struct net_stream stream;
    if (serial_stream_uart(&stream))
        controller_add_port(&controller, &stream, "UART");
    if (serial_stream_usb(&stream))
        controller_add_port(&controller, &stream, "USB");
}

static void start_machine(enum nvs_start kept) {
    struct machine_board board = board_machine();
    const struct text_out out = controller_out(&controller);
    board.store = kept == NVS_START_FAILED ? NULL : &nvs_hal_store;
    board.store_ctx = &store;
    machine_init(&machine, &board, &hal, &hal.step, &out);
    follow_init(&follow, &machine, &hal);
    if (kept == NVS_START_ERASED)
        tell("The storage could not be read and was erased: all settings are defaults");
    if (kept == NVS_START_FAILED)
        tell("The storage does not work: nothing is kept over a power cut");
    if (motion_task_start(&machine, &hal))
        machine.board.motion_side = &motion_task_side;
    else
        tell("The motion side did not start, nothing moves");
}

static void start_network(void) {
    char text[128];
    int error;
    if (!wifi_start(&store)) {
        tell("WiFi did not start");
        return;
    }
    snprintf(text, sizeof text, "Own network: %s password: %s", wifi_own_name(), wifi_own_password());
    tell(text);
    if (!controller_listen(&controller, NULL, "23", &error)) {
        snprintf(text, sizeof text, "Telnet did not start, error %d", error);
        tell(text);
    }
}

static void run_controller(void *unused) {
    (void)unused;
    (void)esp_task_wdt_add(NULL);
    start_network();
    for (;;) {
        (void)esp_task_wdt_reset();
        follow_poll(&follow);
        if (controller_round(&controller))
            motion_task_wake();
        else
            vTaskDelay(pdMS_TO_TICKS(1));
    }
}

void app_main(void) {
    static const struct net_hub_sizes sizes = {
        .clients = TELNET_CLIENTS + CONTROLLER_PORTS, .in = 2048, .out = 16384, .left = 2048};
    outputs_make_safe();
    controller_init(&controller, &machine, &sizes);
    start_ports();
    enum nvs_start kept = nvs_flash_ops_open(&store);
    start_hal();
    start_machine(kept);
    if (xTaskCreatePinnedToCore(run_controller, "controller", CONTROLLER_TASK_STACK, NULL,
                                CONTROLLER_TASK_PRIORITY, NULL, NETWORK_CORE) != pdPASS)
        tell("No memory for the controller task");
}
