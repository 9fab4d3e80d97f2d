/* SPDX-License-Identifier: MIT */
#include "app/lost_clock.h"

#include "chip/clock.h"
#include "chip/system.h"
#include "hal/spindle_pwm.h"
#include "io/outputs.h"
#include "link/uart3.h"

void lost_clock(void) {
    outputs_make_safe();
    spindle_pwm_release();
    system_note_lost_clock();
    system_use_backup_clock();
    uart_send_on_backup_clock(
        "\r\n[MSG:Lost oscillator: the outputs are off, and the controller restarts. If this "
        "repeats, replace the 24 MHz oscillator]\r\n");
    const uint32_t began = system_count();
    while (system_count() - began < CLOCK_BACKUP_HZ / 2u) { /* 1 s */
    }
    system_reset();
}
