/* SPDX-License-Identifier: MIT */
#include "hal/shift_port.h"

#include "hal/spi_words.h"

#include "esp_private/periph_ctrl.h"
#include "hal/spi_ll.h"
#include "sdkconfig.h"

/* Longer than any word: what is not done then has stopped. */
#define WORD_CYCLES_MAX (4u * (uint32_t)CONFIG_ESP_DEFAULT_CPU_FREQ_MHZ)

/* Each register whole: what another program left there, such as a bootloader, does not count. */
static void make_master(void) {
    STEP_SPI->clk_gate = STEP_SPI_CLOCKED;
    STEP_SPI->slave = 0;
    STEP_SPI->int_ena = 0;
    STEP_SPI->ctrl = 0;
    STEP_SPI->clock = STEP_SPI_CLOCK;
    STEP_SPI->user = STEP_SPI_OUT;
    STEP_SPI->user1 = STEP_SPI_HOLD;
    STEP_SPI->user2 = 0;
    STEP_SPI->ms_dlen = STEP_SPI_BITS;
    STEP_SPI->misc = STEP_SPI_CS0;
    STEP_SPI->dout_mode = 0;
    STEP_SPI->dma_conf = STEP_SPI_RESETS;
    STEP_SPI->dma_conf = 0;
    STEP_SPI->int_clr = STEP_SPI_LATE;
}

static void wait_for_a_word(void) {
    const uint32_t begin = esp_cpu_get_cycle_count();
    while (STEP_SPI->cmd != 0 && esp_cpu_get_cycle_count() - begin < WORD_CYCLES_MAX) {
    }
}

/* The latch is high already, as CS at rest. */
void shift_spi_start(uint32_t word) {
    PERIPH_RCC_ATOMIC() {
        spi_ll_enable_bus_clock(SPI2_HOST, true);
        spi_ll_reset_register(SPI2_HOST);
    }
    make_master();
    (void)step_spi_put(word);
    wait_for_a_word();
    shift_port_connect(PIN_I2SO_DATA, STEP_SPI_DATA_SIGNAL);
    shift_port_connect(PIN_I2SO_BCK, STEP_SPI_CLOCK_SIGNAL);
    shift_port_connect(PIN_I2SO_WS, STEP_SPI_CS_SIGNAL);
}

/* Waits behind the word, too: should this be the e-stop's interrupt in the middle of the motion task's
 * step_spi_put(), that one continues with a transfer that is done. */
HAL_ISR void shift_spi_put(uint32_t word) {
    wait_for_a_word();
    (void)step_spi_put(word);
    wait_for_a_word();
}

bool shift_spi_has_lost(void) {
    const bool lost = (STEP_SPI->int_raw & STEP_SPI_LATE) != 0;
    STEP_SPI->int_clr = STEP_SPI_LATE;
    return lost;
}
