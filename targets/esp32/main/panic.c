/* SPDX-License-Identifier: MIT */
#include "main/panic.h"

#include "app/restart_note.h"
#include "channels/channels.h"
#include "hal/chip_hal.h"
#include "io/output_cut.h"
#include "machine/parts.h"

#include "esp_attr.h"
#include "esp_cpu_utils.h"
#include "esp_debug_helpers.h"
#include "esp_private/panic_internal.h"
#include "esp_system.h"
#include "xtensa_context.h"

static struct {
    struct hal *hal; /* NULL: there are no outputs yet */
    const struct machine *machine;
    const struct channels *channels; /* of an I/O module, or NULL */
    struct restart_note *note;
} guarded;

void __real_esp_panic_handler(panic_info_t *info);
void __wrap_esp_panic_handler(panic_info_t *info);

/* Their lines are GPIO pins (io/lines.h). */
static void IRAM_ATTR make_channels_safe(const struct channels *channels) {
    const uint16_t levels = channels_safe_levels(channels);
    struct output_cut cut = {.high = {0}};
    for (unsigned n = 0; n < CHANNELS_MAX; n++) {
        const struct output_wire wire = {.pin = channels->wiring.pin[n]};
        if ((channels->wiring.outputs >> n & 1) != 0)
            output_cut_add(&cut, &wire, (levels >> n & 1) != 0);
    }
    output_cut_pins(&cut);
}

/* [panic: the other core is stalled, the cache may be off; or the restart's task] As an e-stop, and all else.
 */
static void IRAM_ATTR switch_off(void) {
    const struct machine *machine = guarded.machine;
    if (guarded.channels != NULL)
        make_channels_safe(guarded.channels);
    if (guarded.hal == NULL)
        return;
    hal_estop(guarded.hal, machine->motors.inverted, machine->drive.prep.timing.pwm.dark);
    outputs_cut(&guarded.hal->outputs, &guarded.hal->step);
}

static void IRAM_ATTR note_place(const panic_info_t *info) {
    uint32_t address[HAL_RESTART_ADDRESSES] = {(uint32_t)(uintptr_t)info->addr};
    uint8_t count = 1;
    const XtExcFrame *frame = info->frame;
    if (frame != NULL) {
        esp_backtrace_frame_t at = {.pc = (uint32_t)frame->pc,
                                    .sp = (uint32_t)frame->a1,
                                    .next_pc = (uint32_t)frame->a0,
                                    .exc_frame = frame};
        while (count < HAL_RESTART_ADDRESSES && at.next_pc != 0 && esp_backtrace_get_next_frame(&at))
            address[count++] = esp_cpu_process_stack_pc(at.pc);
    }
    restart_note_panic(guarded.note, address, count, info->reason);
}

void IRAM_ATTR __wrap_esp_panic_handler(panic_info_t *info) {
    switch_off();
    if (guarded.note != NULL)
        note_place(info);
    __real_esp_panic_handler(info);
}

static void begin(struct restart_note *note) {
    guarded.note = note;
    (void)esp_register_shutdown_handler(switch_off);
}

void panic_guard_channels(const struct channels *channels, struct restart_note *note) {
    guarded.channels = channels;
    begin(note);
}

void panic_guard(struct hal *hal, const struct machine *machine, struct restart_note *note) {
    guarded.machine = machine;
    guarded.hal = hal;
    begin(note);
}
