/* SPDX-License-Identifier: MIT
 * The I2S peripheral for programs whose boards have no shift registers: nothing may use it. */
#include "check.h"
#include "hal/i2s_registers.h"

#include "esp_private/periph_ctrl.h"
#include "esp_rom_sys.h"
#include "hal/i2s_ll.h"

#include <stddef.h>

volatile struct i2s_registers *emulated_i2s(void) {
    CHECK(!"no shift registers here");
    return NULL;
}
void esp_rom_delay_us(uint32_t us) {
    (void)us;
}
void periph_rcc_enter(void) {}
void periph_rcc_exit(void) {}
void i2s_ll_enable_bus_clock(int port, bool enable) {
    (void)port;
    (void)enable;
}
void i2s_ll_reset_register(int port) {
    (void)port;
}
