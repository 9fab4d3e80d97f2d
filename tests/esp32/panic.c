/* SPDX-License-Identifier: MIT
 * A panic of the ESP32: outputs first, then the note for the next start, then ESP-IDF's text and reset; and a
 * restart by software, which leaves the pins as they are, too. Of an I/O module the outputs are its channels.
 */
#include "main/panic.h"

#include "app/restart_note.h"
#include "channels/channels.h"
#include "check.h"
#include "hal/chip_hal.h"
#include "machine/parts.h"

#include "esp_debug_helpers.h"
#include "esp_private/panic_internal.h"
#include "esp_system.h"
#include "soc/gpio_struct.h"
#include "xtensa_context.h"

#include <string.h>

void __wrap_esp_panic_handler(panic_info_t *info);
void __real_esp_panic_handler(panic_info_t *info);

static gpio_dev_t gpio;
static char order[16];
static struct restart_note note;
static shutdown_handler_t shutdown;
static unsigned frames;

gpio_dev_t *emulated_gpio(void) {
    return &gpio;
}

static void did(char what) {
    order[strlen(order)] = what;
}

void hal_estop(struct hal *hal, bool invert, uint16_t dark) {
    CHECK(hal != NULL && invert && dark == 7);
    did('e');
}
void outputs_cut(const struct outputs *outputs, struct hal_step *step) {
    (void)outputs, (void)step;
    did('o');
}
bool esp_backtrace_get_next_frame(esp_backtrace_frame_t *frame) {
    CHECK(order[1] == 'o');
    frame->pc = 0x800D2003 + 16 * frames;
    return ++frames < 3;
}
void __real_esp_panic_handler(panic_info_t *info) {
    (void)info;
    did('p');
}
esp_err_t esp_register_shutdown_handler(shutdown_handler_t handler) {
    shutdown = handler;
    return ESP_OK;
}

static struct hal hal;
static struct machine machine;

/* Safe: channel 1 on, which is inverted, and 2 off; 3 on, in the other bank. Channel 0 is an input. */
static void a_module_goes_to_its_safe_state(void) {
    static struct channels channels = {.config.value[CHANNELS_IO_SAFE] = 0xB,
                                       .invert = 2,
                                       .outputs = 4,
                                       .locked = true,
                                       .wiring = {.pin = {4, 5, 6, 33, CHANNELS_NO_PIN}, .outputs = 0x1E}};
    panic_guard_channels(&channels, &note);
    shutdown();
    CHECK(gpio.out_w1ts == 0 && gpio.out_w1tc == (1u << 5 | 1u << 6));
    CHECK(gpio.out1_w1ts.val == 1u << (33 - 32) && gpio.out1_w1tc.val == 0);
    panic_info_t info = {.reason = "LoadProhibited", .addr = (const void *)0x400D1234};
    memset((void *)(uintptr_t)&gpio, 0, sizeof gpio);
    __wrap_esp_panic_handler(&info);
    CHECK(gpio.out_w1tc == (1u << 5 | 1u << 6));
    CHECK(strcmp(restart_note_begin(&note, HAL_RESTART_FAULT)->detail, "LoadProhibited") == 0);
}

int main(void) {
    const XtExcFrame frame = {.pc = 0x400D1234, .a0 = 0x800D2003, .a1 = 0x3FFB0000};
    panic_info_t info = {.reason = "StoreProhibited", .addr = (const void *)0x400D1234, .frame = &frame};
    __wrap_esp_panic_handler(&info); /* before there are outputs */
    CHECK(strcmp(order, "p") == 0);
    a_module_goes_to_its_safe_state();
    machine.motors.inverted = true;
    machine.drive.prep.timing.pwm.dark = 7;
    memset(order, 0, sizeof order);
    panic_guard(&hal, &machine, &note);
    __wrap_esp_panic_handler(&info);
    CHECK(strcmp(order, "eop") == 0);
    const struct hal_restart *restart = restart_note_begin(&note, HAL_RESTART_FAULT);
    CHECK(restart != NULL && restart->address_count == 3 && strcmp(restart->detail, "StoreProhibited") == 0);
    CHECK(restart->address[0] == 0x400D1234 && restart->address[1] == 0x400D2000 &&
          restart->address[2] == 0x400D2010);
    info.frame = NULL;
    __wrap_esp_panic_handler(&info);
    CHECK(restart_note_begin(&note, HAL_RESTART_WATCHDOG)->address_count == 1);
    memset(order, 0, sizeof order);
    shutdown();
    CHECK(strcmp(order, "eo") == 0);
    return report();
}
