/* SPDX-License-Identifier: MIT
 * The stages before anything moves: storage, pins, step engine, machine. */
#include "app/board.h"
#include "app/entropy.h"
#include "app/motion_task.h"
#include "chip_ganged.h"
#include "firmware.h"
#include "io/dial.h"
#include "io/driver_bus.h"
#include "io/led_driver.h"
#include "io/spindle_bus.h"
#include "machine/motor_drivers.h"
#include "main/panic.h"
#include "store/nvs_channels.h"
#include "store/nvs_device.h"
#include "store/nvs_names.h"

#include <stdio.h>
#include <string.h>

void firmware_tell(struct firmware *firmware, const char *text) {
    net_hub_tell(&firmware->controller.hub, text);
}

void firmware_tell_complaints(struct firmware *firmware, struct complaints *complaints) {
    for (const char *line = strtok(complaints->text, "\n"); line != NULL; line = strtok(NULL, "\n"))
        firmware_tell(firmware, line);
}

/* @param ctx  struct firmware */
static bool read_u8(void *ctx, const char *key, uint8_t *value) {
    const struct nvs_store *store = &((const struct firmware *)ctx)->store;
    uint32_t stored;
    if (store->ops == NULL || !store->ops->get(store->ctx, key, NVS_U8, &stored))
        return false;
    *value = (uint8_t)stored;
    return true;
}

void firmware_read_choices(struct firmware *firmware) {
    struct channels *channels = &firmware->channels;
    firmware->access_open = ACCESS_OPEN_DEFAULT;
    (void)read_u8(firmware, NVS_ACCESS_OPEN, &firmware->access_open);
    nvs_device_finish(&firmware->store);
    lines_init(&firmware->lines, &firmware->pins, &firmware->store);
    channels_init(channels, &lines_ops, &firmware->lines);
    nvs_channels_load(&firmware->store, channels);
    channels->locked = firmware->safe_mode;
    firmware->is_module = channels_are_chosen(channels);
}

/* ---- pins ---- */

/* What reads the storage, and who gets the messages about impossible pins. */
struct pin_reader {
    struct firmware *firmware;
    struct complaints *complaints;
};

static bool read_pin(void *ctx, const char *key, uint8_t *value) {
    const struct pin_reader *reader = ctx;
    return read_u8(reader->firmware, key, value);
}

static void note_complaint(void *ctx, const char *text) {
    struct complaints *complaints = ((const struct pin_reader *)ctx)->complaints;
    size_t used = strlen(complaints->text);
    snprintf(complaints->text + used, sizeof complaints->text - used, "%s\n", text);
}

static void start_led(const struct pin_map *pins) {
    (void)led_driver_init(&pins->wire[SIGNAL_LED]);
}

void firmware_start_pins(struct firmware *firmware, struct complaints *complaints) {
    struct pin_reader reader = {.firmware = firmware, .complaints = complaints};
    const struct pin_moves moves = {.read = read_pin, .tell = note_complaint, .ctx = &reader};
    pin_map_init(&firmware->pins);
    (void)pin_map_move(&firmware->pins, &moves);
    if (firmware->is_module) {
        /* its pins are channels: a motor's output would drive an input's line */
        channels_apply(&firmware->channels);
        panic_guard_channels(&firmware->channels, firmware->note);
        start_led(&firmware->pins);
    } else {
        outputs_make_safe(&firmware->pins);
    }
}

/* ---- the chip's parts ---- */

/* After inputs_init(). */
static void start_encoder(struct firmware *firmware) {
    struct encoder_wire wire[ENCODER_LINES];
    struct hal *hal = &firmware->hal;
    board_encoder(&firmware->pins, wire);
    if (wire[ENCODER_A].gpio == NO_PIN || wire[ENCODER_B].gpio == NO_PIN)
        return;
    if (!encoder_init(&hal->encoder, wire))
        firmware_tell(firmware, "Cannot start the spindle encoder");
    else if (wire[ENCODER_INDEX].gpio != NO_PIN)
        inputs_add_index(&hal->inputs, &hal->encoder, &wire[ENCODER_INDEX]);
}

static void start_inputs(struct firmware *firmware) {
    struct input_roles roles = {
        .door = DOOR_INPUT_DEFAULT, .hold = HOLD_INPUT_DEFAULT, .start = START_INPUT_DEFAULT};
    struct input_wire wire[INPUT_COUNT];
    board_inputs(&firmware->pins, wire);
    (void)read_u8(firmware, NVS_DOOR_INPUT, &roles.door);
    (void)read_u8(firmware, NVS_HOLD_INPUT, &roles.hold);
    (void)read_u8(firmware, NVS_START_INPUT, &roles.start);
    inputs_init(&firmware->hal.inputs, wire, &firmware->step_pins.gang, &roles);
    /* Reads as a pressed e-stop: in safe mode, and during an update, nothing can be commanded to move. */
    firmware->hal.inputs.lock = firmware->safe_mode ? HAL_LOCK_SAFE_MODE : HAL_LOCK_NONE;
}

void firmware_start_hal(struct firmware *firmware) {
    struct output_wire wire[SWITCH_COUNT];
    struct hal *hal = &firmware->hal;
    board_outputs(&firmware->pins, wire);
    firmware->step_pins = board_step_engine(&firmware->pins);
    start_inputs(firmware);
    if (!outputs_init(&hal->outputs, wire, &hal->step.shifted))
        firmware_tell(firmware, "Cannot start the spindle PWM");
    start_encoder(firmware);
    if (!step_engine_init(&hal->step, &firmware->step_pins))
        firmware_tell(firmware, "Invalid step pins or step timer: motion is disabled");
    start_led(&firmware->pins); /* of the RMT's channels it gets what is left */
}

/* ---- the machine ---- */

/* After the pins: RTS and TX go to the transceiver. */
static void start_spindle_bus(struct firmware *firmware, struct machine_board *board) {
    struct spindle_bus_wire wire;
    if (!board_spindle_bus(&wire))
        return;
    board->bus = spindle_bus_init(&wire);
    board->vfd = board->bus != NULL ? spindle_bus_drive() : NULL;
    if (board->vfd == NULL)
        firmware_tell(firmware, "Cannot start the RS-485 bus of the spindle's drive");
}

static void start_drivers(struct firmware *firmware, struct machine_board *board) {
    struct driver_bus_wire wire;
    uint8_t count;
    const struct driver_wire *drivers = board_drivers(&wire, &count);
    if (count == 0)
        return;
    const struct hal_driver_bus *bus = driver_bus_init(&wire);
    board->drivers = bus != NULL ? driver_bus_drivers() : NULL;
    if (board->drivers == NULL)
        firmware_tell(firmware,
                      "Cannot start the bus of the motor drivers: they keep the registers they have");
    else
        drivers_init(&board->drivers->set, drivers, count, bus);
}

/* After the spindle's encoder, whose interrupt reads the first unit of the pulse counter. */
static void start_dial(struct firmware *firmware, struct machine_board *board) {
    static const struct dial_wire wire[DIAL_LINES] = {BOARD_DIAL_WIRES(DIAL_WIRE)};
    if (!BOARD_HAS_DIAL)
        return;
    board->dial = dial_init(wire);
    board->dial_state = dial_state();
    if (board->dial == NULL)
        firmware_tell(firmware, "Cannot start the dial");
}

static struct machine_board board_of(struct firmware *firmware, enum nvs_start kept) {
    struct machine_board board = board_machine(&firmware->pins);
    const struct hal *hal = &firmware->hal;
    board.restart = firmware->restart;
    entropy_fill(&board.start_id, sizeof board.start_id);
    board.start_id |= 1u; /* 0 means that there is none */
    board.store = kept == NVS_START_FAILED ? NULL : &nvs_hal_store;
    board.store_ctx = &firmware->store;
    board.digest = ota_flash_digest();
    board.ganged = chip_ganged(&firmware->hal, &firmware->step_pins.gang);
    board.servo = outputs_have_servo(&hal->outputs) ? &esp32_servo : NULL;
    board.pump = outputs_have_pump(&hal->outputs) ? &esp32_pump : NULL;
    start_spindle_bus(firmware, &board);
    start_drivers(firmware, &board);
    start_dial(firmware, &board);
    const struct hal_encoder *encoder = hal->inputs.encoder != NULL ? &esp32_indexed_encoder : &esp32_encoder;
    board.encoder = hal->encoder.unit != NULL ? encoder : NULL;
    return board;
}

void firmware_start_machine(struct firmware *firmware, enum nvs_start kept) {
    struct machine *machine = &firmware->machine;
    struct hal *hal = &firmware->hal;
    const struct machine_board board = board_of(firmware, kept);
    const struct text_out out = controller_out(&firmware->controller);
    machine_init(machine, &board, hal, &hal->step, &out);
    panic_guard(hal, machine, firmware->note);
    follow_init(&firmware->follow, machine, hal);
    if (kept == NVS_START_ERASED)
        firmware_tell(firmware, "Cannot read the storage: erased, all settings are at their defaults");
    if (kept == NVS_START_FAILED)
        firmware_tell(firmware, "Storage failure: settings are lost at power-off");
    if (firmware->safe_mode)
        firmware_tell(firmware,
                      "Safe mode after three crashes in a row: motion is disabled until a power cycle");
    else if (motion_task_start(machine, hal))
        machine->board.motion_side = &motion_task_side;
    else
        firmware_tell(firmware, "Cannot start the motion task: motion is disabled");
}
