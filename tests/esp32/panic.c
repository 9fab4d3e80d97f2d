/* SPDX-License-Identifier: MIT
 * A panic of the ESP32: outputs first, then the note for the next start, then ESP-IDF's text and reset; and a
 * restart by software, which leaves the pins as they are, too. */
#include "main/panic.h"

#include "app/restart_note.h"
#include "check.h"
#include "hal/chip_hal.h"
#include "machine/parts.h"

#include "esp_debug_helpers.h"
#include "esp_private/panic_internal.h"
#include "esp_system.h"
#include "xtensa_context.h"

#include <string.h>

void __wrap_esp_panic_handler(panic_info_t *info);
void __real_esp_panic_handler(panic_info_t *info);

static char order[16];
static struct restart_note note;
static shutdown_handler_t shutdown;
static unsigned frames;

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

int main(void) {
    const XtExcFrame frame = {.pc = 0x400D1234, .a0 = 0x800D2003, .a1 = 0x3FFB0000};
    panic_info_t info = {.reason = "StoreProhibited", .addr = (const void *)0x400D1234, .frame = &frame};
    __wrap_esp_panic_handler(&info); /* before there are outputs */
    CHECK(strcmp(order, "p") == 0);
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
