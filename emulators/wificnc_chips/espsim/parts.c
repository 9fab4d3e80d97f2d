/* SPDX-License-Identifier: MIT
 * Peripherals that work by themselves, as one for chip.c: when something happens next, and that it does. */
#include "esp.h"

void parts_create(struct esp *esp) {
    i2s_create(esp);
    rmt_create(esp);
    ledc_create(esp);
    mcpwm_create(esp);
    pcnt_create(esp);
    gdma_create(esp);
    spi_master_create(esp);
}

static uint64_t soonest(uint64_t a, uint64_t b) {
    return a < b ? a : b;
}

uint64_t parts_next(const struct esp *esp) {
    return soonest(soonest(soonest(i2s_next(esp), esp->rmt.due), soonest(esp->ledc.due, esp->pcnt.due)),
                   soonest(soonest(esp->mcpwm.due, spi_master_next(esp)), usb_serial_next(esp)));
}

void parts_event(struct esp *esp) {
    i2s_sync(esp);
    if (esp->rmt.due <= esp->cycles)
        rmt_event(esp);
    if (esp->ledc.due <= esp->cycles)
        ledc_event(esp);
    if (esp->mcpwm.due <= esp->cycles)
        mcpwm_event(esp);
    if (spi_master_next(esp) <= esp->cycles)
        spi_master_event(esp);
    usb_serial_event(esp);
    if (esp->pcnt.due <= esp->cycles)
        pcnt_event(esp);
}
