/* SPDX-License-Identifier: MIT */
#include "hal/step_rmt.h"

#include "hal/rmt_registers.h"

#include "driver/rmt_tx.h"
#include "esp_private/rmt.h"
#include "pin_config.h"
#include "sdkconfig.h"
#include "soc/soc_caps.h"

#include <stddef.h>

/* APB's clock, undivided. END_TICKS: low before the end mark, for the channel must have read it by then (TRM,
 * RMT, "Period"); less than the shortest pause. */
enum { RESOLUTION_HZ = 80000000, TICKS_PER_US = 80, END_TICKS = 16 };

/* Of the spread: until the interrupt has seen that the time is over. */
enum { SEEN_CYCLES = 24 };

/* What a channel plays: high for some ticks, low for some, end. */
#define PULSE_WORD(ticks) ((uint32_t)(ticks) | 1u << 15 | (uint32_t)END_TICKS << 16)
#define END_WORD          0u

/* Where the linker script of the chip has it. */
extern volatile uint32_t RMTMEM[][SOC_RMT_MEM_WORDS_PER_CHANNEL];

static bool make_channel(uint8_t gpio, unsigned wanted) {
    const rmt_tx_channel_config_t config = {.gpio_num = (gpio_num_t)gpio,
                                            .clk_src = RMT_CLK_SRC_DEFAULT,
                                            .resolution_hz = RESOLUTION_HZ,
                                            .mem_block_symbols = SOC_RMT_MEM_WORDS_PER_CHANNEL,
                                            .trans_queue_depth = 1};
    rmt_channel_handle_t channel;
    uint32_t resolution_hz;
    int id;
    return gpio != NO_PIN && rmt_new_tx_channel(&config, &channel) == ESP_OK &&
           rmt_get_channel_id(channel, &id) == ESP_OK && id == (int)wanted &&
           rmt_get_channel_resolution(channel, &resolution_hz) == ESP_OK && resolution_hz == RESOLUTION_HZ &&
           rmt_enable(channel) == ESP_OK;
}

bool step_rmt_init(struct hal_step *hal, const uint8_t step_gpio[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < BOARD_AXIS_COUNT; ax++)
        if (!make_channel(step_gpio[ax], ax))
            return false;
    /* One word for all channels, so that the interrupt needs no table; a driver that configures them
     * differently is refused. */
    const uint32_t rest = RMT.STEP_RMT_CONF(0) & ~STEP_RMT_ONCE;
    for (unsigned ax = 0; ax < BOARD_AXIS_COUNT; ax++) {
        if ((RMT.STEP_RMT_CONF(ax) & ~STEP_RMT_ONCE) != rest)
            return false;
        RMT.STEP_RMT_CONF(ax) = rest | STEP_RMT_TAKE_OVER;
    }
    hal->rmt_rest = rest;
    hal->rmt_rewind = rest | STEP_RMT_REWIND;
    return true;
}

void step_rmt_set_pulse(struct hal_step *hal, uint32_t ns) {
    uint32_t ticks = (ns * TICKS_PER_US + 999u) / 1000u;
    const uint32_t spread_cycles = BOARD_STEP_SPREAD_NS * CONFIG_ESP_DEFAULT_CPU_FREQ_MHZ / 1000u;
    for (unsigned ax = 0; ax < BOARD_AXIS_COUNT; ax++) {
        RMTMEM[ax][0] = PULSE_WORD(ticks);
        RMTMEM[ax][1] = END_WORD;
    }
    const uint32_t step_cycles = 2 * hal->pulse_cycles + spread_cycles - SEEN_CYCLES;
    hal->quiet = step_cycles > hal->dir_setup_cycles ? step_cycles : hal->dir_setup_cycles;
    hal->pulse_end_cycles = hal->pulse_cycles + spread_cycles;
}
