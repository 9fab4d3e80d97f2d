/* SPDX-License-Identifier: MIT
 * What a panic does before it prints: a reset of the processors leaves GPIO, its matrix, LEDC, MCPWM and RMT
 * as they are, so the outputs are switched off before it, and the place of the fault is noted for the next
 * start. ESP-IDF's esp_panic_handler() is wrapped (main/CMakeLists.txt). */
#ifndef WIFICNC_ESP32_PANIC_H
#define WIFICNC_ESP32_PANIC_H

struct channels;
struct hal;
struct machine;
struct restart_note;

/** [start] From now on a panic, and a restart by software, switch these outputs off. All outlive the program.
 */
void panic_guard(struct hal *hal, const struct machine *machine, struct restart_note *note);

/** [start] The same for an I/O module: its outputs go to their safe state. */
void panic_guard_channels(const struct channels *channels, struct restart_note *note);

#endif
