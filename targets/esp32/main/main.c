/* SPDX-License-Identifier: MIT
 * Start of the firmware, in stages: outputs are made safe before anything else can go wrong; the motion side
 * stands before there is anybody who could command it; the network comes last, and nothing waits for it.
 *
 * The storage is read before the outputs, because it says which pins they are on; until then the pins do what
 * they do from reset. */
#include "app/board.h"
#include "app/boot_guard.h"
#include "app/controller.h"
#include "app/follow.h"
#include "app/io_module.h"
#include "app/motion_task.h"
#include "app/services.h"
#include "app/task_map.h"
#include "base/version.h"
#include "hal/esp32_hal.h"
#include "hal/hal.h"
#include "io/led_driver.h"
#include "io/lines.h"
#include "link/improv.h"
#include "link/serial_stream.h"
#include "machine/parts.h"
#include "net/access.h"
#include "net/network.h"
#include "net/page.h"
#include "net/wifi.h"
#include "pin_config.h"
#include "store/nvs_channels.h"
#include "store/nvs_flash_ops.h"
#include "store/nvs_names.h"
#include "task_periods.h"

#include "esp_attr.h"
#include "esp_random.h"
#include "esp_system.h"
#include "esp_task_wdt.h"
#include "freertos/FreeRTOS.h"
#include "freertos/task.h"

#include <stdio.h>
#include <string.h>

enum { US_PER_MS = 1000, LED_EVERY_US = 50000, TELNET_PORT = 23 };

static RTC_NOINIT_ATTR struct boot_guard guard; /* a reset keeps it */

static struct machine machine;
static struct hal hal;
static struct controller controller;
static struct services services;
static struct nvs_store store;
static struct follow follow;
static struct pin_map pins;
static struct step_engine_board step_pins;
static struct lines lines;
static struct channels channels;
static struct io_module io_module; /* when this board is one */
static char password[ACCESS_PASSWORD_MAX + 1];
static uint8_t link_lost;
static bool safe_mode, is_module, has_network;

/* A stage that fails is said on the serial ports; what needs it is left out. */
static void tell(const char *text) {
    net_hub_tell(&controller.hub, text);
}

/* Pins are sorted out before there is anybody to be told. */
struct complaints {
    char text[512]; /* lines */
};

static void note_complaint(void *ctx, const char *text) {
    struct complaints *complaints = ctx;
    size_t used = strlen(complaints->text);
    snprintf(complaints->text + used, sizeof complaints->text - used, "%s\n", text);
}

static void tell_complaints(struct complaints *complaints) {
    for (const char *line = strtok(complaints->text, "\n"); line != NULL; line = strtok(NULL, "\n"))
        tell(line);
}

/* ---- before anything moves ---- */

static bool read_u8(void *ctx, const char *key, uint8_t *value) {
    uint32_t stored;
    (void)ctx;
    if (store.ops == NULL || !store.ops->get(store.ctx, key, NVS_U8, &stored))
        return false;
    *value = (uint8_t)stored;
    return true;
}

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

static void read_choices(void) {
    link_lost = LINK_LOST_DEFAULT;
    (void)read_u8(NULL, NVS_LINK_LOST, &link_lost);
    lines_init(&lines, &pins, &store);
    channels_init(&channels, &lines_ops, &lines);
    nvs_channels_load(&store, &channels);
    channels.locked = safe_mode;
    is_module = channels_are_chosen(&channels);
}

static void start_led(void) {
    (void)led_driver_init(&pins.wire[SIGNAL_LED]);
}

static void start_pins(struct complaints *complaints) {
    const struct pin_moves moves = {.read = read_u8, .tell = note_complaint, .ctx = complaints};
    pin_map_init(&pins);
    (void)pin_map_move(&pins, &moves);
    if (is_module) {
        channels_apply(&channels); /* its pins are channels: a motor's output would drive an input's line */
        start_led();
    } else {
        outputs_make_safe(&pins);
    }
}

/* Behind inputs_init(). */
static void start_encoder(void) {
    struct encoder_wire wire[ENCODER_LINES];
    board_encoder(&pins, wire);
    if (wire[ENCODER_A].gpio == GPIO_NONE || wire[ENCODER_B].gpio == GPIO_NONE)
        return;
    if (!encoder_init(&hal.encoder, wire))
        tell("Cannot start the spindle encoder");
    else if (wire[ENCODER_INDEX].gpio != GPIO_NONE)
        inputs_add_index(&hal.inputs, &hal.encoder, &wire[ENCODER_INDEX]);
}

static void start_hal(void) {
    struct input_roles roles = {
        .door = DOOR_INPUT_DEFAULT, .hold = HOLD_INPUT_DEFAULT, .start = START_INPUT_DEFAULT};
    struct input_wire inputs[INPUT_COUNT];
    struct output_wire outputs[SWITCH_COUNT];
    board_inputs(&pins, inputs);
    board_outputs(&pins, outputs);
    step_pins = board_step_engine(&pins);
    (void)read_u8(NULL, NVS_DOOR_INPUT, &roles.door);
    (void)read_u8(NULL, NVS_HOLD_INPUT, &roles.hold);
    (void)read_u8(NULL, NVS_START_INPUT, &roles.start);
    inputs_init(&hal.inputs, inputs, &roles);
    hal.inputs.locked = safe_mode;
    if (!outputs_init(&hal.outputs, outputs))
        tell("Cannot start the spindle PWM");
    start_encoder();
    if (!step_engine_init(&hal.step, &step_pins))
        tell("Invalid step pins or step timer: motion is disabled");
    start_led(); /* of the RMT's channels it gets what is left */
}

/* ---- networks by a serial port ---- */

/* Writing to flash stops the other core for milliseconds: not in motion. */
static bool join_network(void *ctx, const char *network, const char *wifi_password) {
    (void)ctx;
    if (store.ops == NULL || !has_network || !machine_is_at_rest(&machine))
        return false;
    bool kept = nvs_flash_ops_set_text(&store, NVS_WIFI_SSID, network);
    if (wifi_password[0] == '\0')
        (void)store.ops->erase(store.ctx, NVS_WIFI_PASSWORD);
    else
        kept = kept && nvs_flash_ops_set_text(&store, NVS_WIFI_PASSWORD, wifi_password);
    if (kept)
        network_join_stored();
    return kept;
}

/* The radio is elsewhere for two seconds. */
static bool scan_networks(void *ctx) {
    (void)ctx;
    return has_network && machine_is_at_rest(&machine) && network_scan();
}

static enum improv_scan scanned_network(void *ctx, size_t index, struct improv_network *network) {
    struct wifi_network found;
    (void)ctx;
    enum network_scan state = network_scanned(index, &found);
    if (state != NETWORK_FOUND)
        return state == NETWORK_SCANNING ? IMPROV_SCANNING : IMPROV_NO_MORE;
    *network = (struct improv_network){.rssi_dbm = found.rssi_dbm, .secured = found.secured};
    memcpy(network->name, found.name, sizeof network->name);
    return IMPROV_NETWORK;
}

static bool joined_network(void *ctx, char *text) {
    uint32_t address = network_station_address();
    (void)ctx;
    snprintf(text, IMPROV_TEXT_MAX, "http://%u.%u.%u.%u/", (unsigned)(address & 0xFF),
             (unsigned)(address >> 8 & 0xFF), (unsigned)(address >> 16 & 0xFF), (unsigned)(address >> 24));
    return address != 0;
}

static uint32_t port_time_us(void *ctx) {
    (void)ctx;
    return hal_time_us(&hal);
}

static void add_port(struct improv *improv, const struct net_stream *port, const char *name) {
    static const struct improv_ops ops = {.join = join_network,
                                          .joined = joined_network,
                                          .scan = scan_networks,
                                          .scanned = scanned_network,
                                          .now_us = port_time_us};
    static struct improv_info info = {.firmware = "WiFiCNC", .version = VERSION_TEXT, .chip = BOARD_CHIP};
    struct net_stream stream;
    info.name = network_name(); /* filled in later */
    improv_init(improv, port, &info, &ops, &stream);
    controller_add_port(&controller, &stream, name);
}

static void start_ports(void) {
    static struct improv uart, usb;
    struct net_stream port;
    if (serial_stream_uart(&port))
        add_port(&uart, &port, "UART");
    if (serial_stream_usb(&port))
        add_port(&usb, &port, "USB");
}

static void start_machine(enum nvs_start kept) {
    struct machine_board board = board_machine(&pins);
    const struct text_out out = controller_out(&controller);
    board.store = kept == NVS_START_FAILED ? NULL : &nvs_hal_store;
    board.store_ctx = &store;
    board.servo = outputs_have_servo(&hal.outputs) ? &esp32_servo : NULL;
    const struct hal_encoder *encoder = hal.inputs.encoder != NULL ? &esp32_indexed_encoder : &esp32_encoder;
    board.encoder = hal.encoder.unit != NULL ? encoder : NULL;
    machine_init(&machine, &board, &hal, &hal.step, &out);
    follow_init(&follow, &machine, &hal, &step_pins);
    if (kept == NVS_START_ERASED)
        tell("Cannot read the storage: erased, all settings are at their defaults");
    if (kept == NVS_START_FAILED)
        tell("Storage failure: settings are lost at power-off");
    if (safe_mode)
        tell("Safe mode after three crashes in a row: motion is disabled until a power cycle");
    else if (motion_task_start(&machine, &hal))
        machine.board.motion_side = &motion_task_side;
    else
        tell("Cannot start the motion task: motion is disabled");
}

/* ---- the controller's task ---- */

/* For updates: nothing moves now, and nothing will until the end of it. */
static const char *lock_machine(void *ctx) {
    (void)ctx;
    if (!machine_is_at_rest(&machine))
        return "the machine is moving: wait until it stops, or stop it";
    hal.inputs.locked = true;
    return NULL;
}

static void unlock_machine(void *ctx) {
    (void)ctx;
    hal.inputs.locked = safe_mode;
}

static void chip_random(void *ctx, uint8_t *bytes, size_t count) {
    (void)ctx;
    esp_fill_random(bytes, count);
}

static enum nvs_text read_text(void *ctx, const char *key, char *text, size_t size) {
    (void)ctx;
    return nvs_flash_ops_find_text(&store, key, text, size);
}

/* Behind network_start(), which makes random numbers unpredictable. */
static void load_access(void) {
    static const struct access_ops ops = {.read = read_text, .random = chip_random};
    if (access_load(password, &ops, NULL) == ACCESS_LOST)
        tell("Cannot read the stored password, so network logins are disabled. "
             "Write the storage again over USB: wificnc nvs build, wificnc nvs flash");
}

static const struct session_ops wire_ops = {.send = net_wire_send, .random = chip_random};

static struct session_options wire_options(void) {
    return (struct session_options){.name = network_name(),
                                    .password = password,
                                    .version = VERSION_WORD,
                                    .status_port = WIRE_STATUS_PORT,
                                    .channels = &channels};
}

/* Hosts that plan motion themselves. */
static void start_wire(void) {
    const struct session_options options = wire_options();
    char text[64];
    int error;
    if (controller_serve_wire(&controller, &options, &wire_ops, &error))
        return;
    snprintf(text, sizeof text, "Cannot start WMC3, error %d", error);
    tell(text);
}

static void start_network(void) {
    static const struct ota_flash flash = {.lock = lock_machine, .unlock = unlock_machine};
    const struct controller_options options = {.password = password, .link_lost = link_lost};
    char text[128];
    int error;
    has_network = network_start(&store);
    if (!has_network) {
        tell("Cannot start WiFi or Ethernet");
        return;
    }
    snprintf(text, sizeof text, "Own network: %s password: %s", network_name(), wifi_own_password());
    tell(text);
    load_access();
    controller_set(&controller, &options);
    services_start(&services, &controller.gate.lockout, password, &flash, TELNET_PORT);
    start_wire();
    if (!controller_listen(&controller, NULL, "23", &error)) {
        snprintf(text, sizeof text, "Cannot start Telnet, error %d", error);
        tell(text);
    }
    if (!page_start(&controller.hub, NULL, network_name(), "80", &error)) {
        snprintf(text, sizeof text, "Cannot start the web page, error %d", error);
        tell(text);
    }
}

/* Said at every change, so that whoever listens at a serial port knows where to connect. */
static void tell_address(void) {
    static uint32_t told;
    uint32_t address = network_address();
    char text[96];
    if (address == told)
        return;
    told = address;
    snprintf(text, sizeof text, "Address %u.%u.%u.%u or %s.local: Grbl at port 23, web page at port 80",
             (unsigned)(address & 0xFF), (unsigned)(address >> 8 & 0xFF), (unsigned)(address >> 16 & 0xFF),
             (unsigned)(address >> 24), network_name());
    tell(address != 0 ? text : "No network");
}

static enum led_state led_state(void) {
    if (machine_state(&machine) == MACHINE_ALARM || safe_mode)
        return LED_ALARM;
    if (controller.hub.owner == NULL)
        return LED_DISCONNECTED;
    return machine_is_at_rest(&machine) ? LED_READY : LED_RUNNING;
}

/* This firmware works: earlier crashes do not count. */
static void note_health(uint32_t now_us) {
    static bool noted;
    if (noted || now_us < BOOT_HEALTHY_AFTER_MS * (uint32_t)US_PER_MS)
        return;
    noted = true;
    boot_guard_healthy(&guard);
}

static void show_led(enum led_state state, uint32_t now_us) {
    static uint32_t shown_us;
    if (now_us - shown_us < LED_EVERY_US)
        return;
    shown_us = now_us;
    led_driver_show(state, now_us / US_PER_MS);
}

static void run_controller(void *unused) {
    (void)unused;
    (void)esp_task_wdt_add(NULL);
    start_network();
    for (;;) {
        uint32_t now_us = hal_time_us(&hal);
        (void)esp_task_wdt_reset();
        note_health(now_us);
        follow_poll(&follow);
        show_led(led_state(), now_us);
        bool more = has_network && services_poll(&services, now_us);
        more |= has_network && page_poll(now_us);
        if (has_network)
            tell_address();
        if (controller_round(&controller) && !safe_mode)
            motion_task_wake();
        else if (!more)
            vTaskDelay(pdMS_TO_TICKS(ESP32_CONTROLLER_PERIOD_US / 1000));
    }
}

/* ---- or the I/O module's task ---- */

static const char *lock_outputs(void *ctx) {
    io_module_lock(ctx);
    return NULL;
}

static void unlock_outputs(void *ctx) {
    io_module_unlock(ctx);
}

static void start_io_module(void) {
    const struct ota_flash flash = {.lock = lock_outputs, .unlock = unlock_outputs, .ctx = &io_module};
    has_network = network_start(&store);
    if (!has_network)
        return; /* nobody can command: the outputs stay safe */
    load_access();
    const struct session_options options = wire_options();
    io_module =
        (struct io_module){.channels = &channels, .session = &controller.session, .wire = &controller.wire};
    io_module_start(&io_module, &store, &options, &wire_ops);
    services_start(&services, &controller.gate.lockout, password, &flash, 0);
}

static enum led_state io_module_led(void) {
    if (channels.locked || channels.faults != 0)
        return LED_ALARM;
    return controller.session.owner.on ? LED_READY : LED_DISCONNECTED;
}

static void run_io_module(void *unused) {
    (void)unused;
    (void)esp_task_wdt_add(NULL);
    start_io_module();
    for (;;) {
        uint32_t now_us = hal_time_us(&hal);
        (void)esp_task_wdt_reset();
        note_health(now_us);
        lockout_poll(&controller.gate.lockout, now_us);
        show_led(io_module_led(), now_us);
        if (has_network)
            io_module_round(&io_module);
        if (!has_network || !services_poll(&services, now_us))
            vTaskDelay(pdMS_TO_TICKS(1));
    }
}

void app_main(void) {
    static const struct net_hub_sizes sizes = {
        .clients = NET_CLIENTS, .in = 2048, .out = 16384, .left = 2048};
    struct complaints complaints = {.text = ""};
    enum nvs_start kept = nvs_flash_ops_open(&store);
    safe_mode = boot_guard_begin(&guard, cause_of_start());
    controller_init(&controller, &machine, &sizes);
    read_choices();
    start_pins(&complaints);
    void (*run)(void *) = run_io_module;
    if (!is_module) {
        start_ports();
        tell_complaints(&complaints);
        start_hal();
        start_machine(kept);
        run = run_controller;
    }
    if (xTaskCreatePinnedToCore(run, "controller", CONTROLLER_TASK_STACK, NULL, CONTROLLER_TASK_PRIORITY,
                                NULL, NETWORK_CORE) != pdPASS)
        tell("No memory for the controller task");
}
