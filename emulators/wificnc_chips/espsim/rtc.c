/* SPDX-License-Identifier: MIT
 * The RTC's controller and what lies next to it: time by the slow clock, resets, stalls of cores, the RTC
 * watchdog. Other registers there keep what is written: clocks, voltages, pads. */
#include "esp.h"

#include <string.h>

/* Offsets of the ESP32, of the S3. */
enum place {
    TIME_UPDATE,
    TIME0,
    RESET_STATE,
    INT_RAW,
    INT_ST,
    STORE0,
    WATCHDOG,
    STALL,
    STORE4,
    BROWN_OUT,
    PLACES
};
static const uint32_t places[2][PLACES] = {
    {0x0C, 0x10, 0x34, 0x40, 0x44, 0x4C, 0x8C, 0xAC, 0xB0, 0xD4},
    {0x0C, 0x10, 0x38, 0x44, 0x48, 0x50, 0x98, 0xBC, 0xC0, 0xE8},
};

enum { OPTIONS = 0x00, RESET_PROCPU = 1 << 5, RESET_APPCPU = 1 << 4, WATCHDOG_WORDS = 7, SLOW_HZ = 150000 };
enum { RTC_IO = 0x400, RTC_IO_END = 0x4D0, XTAL_MHZ = 40, SOC_CLOCK_PLL = 1 };
#define RESET_SYSTEM (1u << 31)
#define TIME_VALID   (1u << 30)

static uint32_t at(const struct esp *esp, enum place place) {
    return places[esp->chip][place];
}

static void update_stalls(struct esp *esp) {
    const uint32_t low = esp->rtc[OPTIONS / 4], high = esp->rtc[at(esp, STALL) / 4];
    esp->app.stalled[1] = (low & 3) | (high >> 20 & 63) << 2;
    esp->app.stalled[0] = (low >> 2 & 3) | (high >> 26) << 2;
    cores_hold(esp);
}

static void options(struct esp *esp, uint32_t value) {
    esp->rtc[OPTIONS / 4] = value & ~(RESET_SYSTEM | RESET_PROCPU | RESET_APPCPU);
    if ((value & RESET_SYSTEM) != 0)
        chip_reset(esp, 3, "software, the whole chip");
    else if ((value & RESET_PROCPU) != 0)
        chip_reset(esp, 12, "software");
    else if ((value & RESET_APPCPU) != 0)
        cores_reset_app(esp);
    update_stalls(esp);
}

static void store(struct esp *esp, uint32_t offset, uint32_t value) {
    const uint32_t dog = offset - at(esp, WATCHDOG);
    if (offset == OPTIONS)
        options(esp, value);
    else if (dog < 4 * WATCHDOG_WORDS)
        watchdog_store(esp, WATCHDOG_RTC, dog / 4, value);
    else {
        esp->rtc[offset / 4] = value;
        if (offset == at(esp, STALL))
            update_stalls(esp);
        if (offset >= RTC_IO && offset < RTC_IO_END && esp->chip == ES_ESP32)
            gpio_pulls(esp);
        if (offset == at(esp, TIME_UPDATE)) {
            const uint64_t now = esp->cycles / (ES_CPU_HZ / SLOW_HZ);
            esp->rtc[at(esp, TIME0) / 4] = (uint32_t)now;
            esp->rtc[at(esp, TIME0) / 4 + 1] = (uint32_t)(now >> 32) & 0xFFFF;
            esp->rtc[offset / 4] = value | TIME_VALID;
        }
    }
}

static uint32_t load(struct esp *esp, uint32_t offset) {
    const uint32_t dog = offset - at(esp, WATCHDOG);
    if (dog < 4 * WATCHDOG_WORDS)
        return watchdog_load(esp, WATCHDOG_RTC, dog / 4);
    if (offset == at(esp, RESET_STATE))
        return esp->reset_cause | esp->reset_cause << 6;
    if (offset == at(esp, INT_RAW) || offset == at(esp, INT_ST))
        return 0;
    return esp->rtc[offset / 4];
}

/* What the bootloader leaves: the crystal's and the bus's frequencies, twice in a word, the processor on the
 * PLL. */
void rtc_create(struct esp *esp) {
    const bool is_s3 = esp->chip == ES_ESP32S3;
    const uint32_t apb = ES_APB_HZ >> 12;
    uint32_t stores[8];
    memcpy(stores, &esp->rtc[at(esp, STORE0) / 4], 16);
    memcpy(stores + 4, &esp->rtc[at(esp, STORE4) / 4], 16);
    memset(esp->rtc, 0, sizeof esp->rtc);
    memcpy(&esp->rtc[at(esp, STORE0) / 4], stores, 16);
    memcpy(&esp->rtc[at(esp, STORE4) / 4], stores + 4, 16);
    esp->rtc[at(esp, STORE4) / 4] = XTAL_MHZ | XTAL_MHZ << 16;
    esp->rtc[at(esp, STORE4) / 4 + 1] = apb | apb << 16;
    if (!is_s3)
        esp->rtc[0x70 / 4] = SOC_CLOCK_PLL << 27;
    bus_add(esp, &(struct block){"RTC", is_s3 ? 0x60008000 : 0x3FF48000, 4 * RTC_WORDS, load, store, NULL});
}
