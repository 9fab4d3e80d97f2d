/* SPDX-License-Identifier: MIT
 * Registers of Trinamic's motor drivers. */
#include "drivers/tmc.h"

#define CLOCK_HZ 12000000.0f /* inside the chip */
#define ROOT_2   1.41421356f

/* GCONF */
#define GCONF_SPREAD      (1u << 2) /* TMC2209: en_SpreadCycle */
#define GCONF_STEALTH     (1u << 2) /* by SPI: en_pwm_mode, its contrary */
#define GCONF_PDN_DISABLE (1u << 6) /* TMC2209: the pin is the UART's */
#define GCONF_MSTEP_REG   (1u << 7) /* TMC2209: microsteps by CHOPCONF */
#define GCONF_FILTER      (1u << 8) /* TMC2209: of step pulses, its reset value */
#define GCONF_DIAG1_STALL (1u << 8) /* by SPI */
#define GCONF_DIAG1_PUSH  (1u << 13)

/* CHOPCONF: spreadCycle as the data sheets begin with it: TOFF 3, HSTRT 4, HEND 1, TBL 2. */
#define CHOPCONF_START  0x000100C3u
#define CHOPCONF_VSENSE (1u << 17)
#define CHOPCONF_INTPOL (1u << 28)
#define MRES_AT         24u

#define SCALES       32u /* of IRUN and IHOLD */
#define GLOBAL_MAX   256u
#define GLOBAL_MIN   32u
#define HOLD_DELAY   8u  /* IHOLDDELAY: each of the steps down to the hold current takes 2^18 clocks of it */
#define POWER_DOWN   20u /* TPOWERDOWN: 0.4 s from the last step to the hold current */
#define SEND_DELAY   2u  /* NODECONF: 3 * 8 bit times before an answer, as more than one chip needs it */
#define SEMAX        2u
#define SGT_MAX      63
#define UART_PWMCONF 0xC10D0024u /* reset values of stealthChop, which tunes itself */
#define PWMCONF_5160 0xC40C001Eu
#define PWMCONF_2130 0x00050480u

static const uint8_t writes_2209[] = {TMC_NODECONF, TMC_GCONF,     TMC_IHOLD_IRUN, TMC_TPOWERDOWN,
                                      TMC_TPWMTHRS, TMC_TCOOLTHRS, TMC_SGTHRS,     TMC_UART_COOLCONF,
                                      TMC_PWMCONF,  TMC_CHOPCONF,  TMC_GSTAT};
static const uint8_t writes_5160[] = {TMC_GCONF,    TMC_GLOBALSCALER, TMC_IHOLD_IRUN,   TMC_TPOWERDOWN,
                                      TMC_TPWMTHRS, TMC_TCOOLTHRS,    TMC_SPI_COOLCONF, TMC_PWMCONF,
                                      TMC_CHOPCONF, TMC_GSTAT};
static const uint8_t writes_2130[] = {TMC_GCONF,     TMC_IHOLD_IRUN,   TMC_TPOWERDOWN, TMC_TPWMTHRS,
                                      TMC_TCOOLTHRS, TMC_SPI_COOLCONF, TMC_PWMCONF,    TMC_CHOPCONF};

static const struct tmc_chip chips[TMC_KINDS] = {
    [TMC_2209] = {TMC_2209_CURRENT, .uart = true, .version = 0x21, .ioin = TMC_UART_IOIN,
                  .write_count = sizeof writes_2209, .writes = writes_2209},
    [TMC_5160] = {TMC_5160_CURRENT, .latches = true, .version = 0x30, .ioin = TMC_SPI_IOIN,
                  .write_count = sizeof writes_5160, .writes = writes_5160},
    [TMC_2130] = {TMC_2130_CURRENT, .clears_by_reading = true, .version = 0x11, .ioin = TMC_SPI_IOIN,
                  .write_count = sizeof writes_2130, .writes = writes_2130},
};

const struct tmc_chip *tmc_chip(unsigned kind) {
    return kind > TMC_NONE && kind < TMC_KINDS ? &chips[kind] : NULL;
}

/* I = scale/32 * V / (R sqrt 2), of which V / (R sqrt 2) is this, mA: mV / mOhm is A. */
static float full_ma(const struct tmc_chip *chip, unsigned sense_mohm, unsigned mv) {
    return 1000.0f * (float)mv / ((float)(sense_mohm + chip->sense_more_mohm) * ROOT_2);
}

uint32_t tmc_current_max_ma(const struct tmc_chip *chip, unsigned sense_mohm) {
    return (uint32_t)full_ma(chip, sense_mohm, chip->full_mv);
}

/* The scales of a current: 1 .. 32 in IRUN, 32 .. 256 in GLOBALSCALER. Rounded down, so that it is never more
 * than what was asked for, but for the least one. */
struct scales {
    unsigned run, global;
    bool fine;
};

static unsigned within(float value, unsigned low, unsigned high) {
    if (!(value > (float)low))
        return low;
    return value < (float)high ? (unsigned)value : high;
}

static struct scales scales_of(const struct tmc_chip *chip, unsigned sense_mohm, unsigned current_ma) {
    const float rounding = 1.0001f; /* a current that a scale meets exactly gets that scale */
    struct scales scales = {.global = GLOBAL_MAX};
    float part = (float)current_ma / full_ma(chip, sense_mohm, chip->full_mv) * rounding;
    if (chip->fine_mv != 0) {
        const float fine = (float)current_ma / full_ma(chip, sense_mohm, chip->fine_mv) * rounding;
        scales.fine = fine <= rounding;
        scales.run = within((scales.fine ? fine : part) * (float)SCALES, 1, SCALES);
        return scales;
    }
    /* GLOBALSCALER is best from 128 on: so IRUN is as large as that allows. */
    scales.run = within(part * 2.0f * (float)SCALES, 1, SCALES);
    scales.global = within(part * (float)(GLOBAL_MAX * SCALES) / (float)scales.run, GLOBAL_MIN, GLOBAL_MAX);
    return scales;
}

static uint32_t gconf(const struct tmc_chip *chip, const struct tmc_want *want) {
    /* StallGuard needs stealthChop in a TMC2209, and spreadCycle in the others. */
    const bool stealth = want->stall_armed ? chip->uart : want->stealth_tstep != 0;
    if (chip->uart)
        return GCONF_PDN_DISABLE | GCONF_MSTEP_REG | GCONF_FILTER | (stealth ? 0 : GCONF_SPREAD);
    return (stealth ? GCONF_STEALTH : 0) | GCONF_DIAG1_PUSH | (want->stall_armed ? GCONF_DIAG1_STALL : 0);
}

static uint32_t ihold_irun(const struct scales *scales, const struct tmc_want *want) {
    const unsigned hold = within((float)(scales->run * want->hold_pct) / 100.0f, 1, SCALES);
    return HOLD_DELAY << 16 | (scales->run - 1) << 8 | (hold - 1);
}

static uint32_t chopconf(const struct scales *scales, const struct tmc_want *want) {
    uint32_t mres = 8; /* 0: 256 */
    for (unsigned steps = want->microsteps; steps > 1 && mres > 0; steps >>= 1)
        mres--;
    return CHOPCONF_START | CHOPCONF_INTPOL | mres << MRES_AT | (scales->fine ? CHOPCONF_VSENSE : 0);
}

/* SEMIN, SEMAX; of StallGuard by SPI its threshold, -64 .. 63: a small one is a light load. */
static uint32_t coolconf(const struct tmc_chip *chip, const struct tmc_want *want) {
    const uint32_t cool = want->coolstep != 0 ? (uint32_t)want->coolstep | SEMAX << 8 : 0;
    const int threshold = SGT_MAX - want->stall / 2;
    return chip->uart ? cool : cool | ((uint32_t)threshold & 0x7Fu) << 16;
}

static uint32_t stealth_below(const struct tmc_want *want) {
    if (want->stall_armed || want->stealth_tstep == UINT32_MAX)
        return 0;
    return want->stealth_tstep == 0 ? TMC_TSTEP_MAX : want->stealth_tstep;
}

uint32_t tmc_value(const struct tmc_chip *chip, unsigned sense_mohm, const struct tmc_want *want,
                   uint8_t reg) {
    const struct scales scales = scales_of(chip, sense_mohm, want->current_ma);
    switch (reg) {
    case TMC_GCONF:
        return gconf(chip, want);
    case TMC_GSTAT:
        return TMC_GSTAT_ALL;
    case TMC_NODECONF:
        return SEND_DELAY << 8;
    case TMC_GLOBALSCALER:
        return scales.global & (GLOBAL_MAX - 1); /* 0: 256 */
    case TMC_IHOLD_IRUN:
        return ihold_irun(&scales, want);
    case TMC_TPOWERDOWN:
        return POWER_DOWN;
    case TMC_TPWMTHRS:
        return stealth_below(want);
    case TMC_TCOOLTHRS:
        return want->stall_armed || want->coolstep != 0 ? want->load_tstep : 0;
    case TMC_SGTHRS:
        return want->stall_armed ? want->stall : 0;
    case TMC_UART_COOLCONF:
    case TMC_SPI_COOLCONF:
        return coolconf(chip, want);
    case TMC_CHOPCONF:
        return chopconf(&scales, want);
    case TMC_PWMCONF:
        return chip->uart ? UART_PWMCONF : chip->fine_mv != 0 ? PWMCONF_2130 : PWMCONF_5160;
    default:
        return 0;
    }
}

static bool bit(uint32_t word, unsigned at) {
    return (word >> at & 1u) != 0;
}

struct tmc_status tmc_status_of(const struct tmc_chip *chip, uint32_t drv_status) {
    struct tmc_status status = {.current_scale = (uint8_t)(drv_status >> 16 & 31u),
                                .stands = bit(drv_status, 31)};
    if (chip->uart) {
        status.hot = bit(drv_status, 0);
        status.shut_down = bit(drv_status, 1);
        status.shorted = (drv_status & 0x3Cu) != 0;
        status.open_load = (drv_status & 0xC0u) != 0;
        return status;
    }
    status.stall = (uint16_t)(drv_status & 0x3FFu);
    status.shut_down = bit(drv_status, 25);
    status.hot = bit(drv_status, 26);
    status.shorted = (drv_status & 3u << 27) != 0 || (chip->fine_mv == 0 && (drv_status & 3u << 12) != 0);
    status.open_load = (drv_status & 3u << 29) != 0;
    return status;
}

uint32_t tmc_tstep(float steps_per_s, unsigned microsteps) {
    const float clocks = CLOCK_HZ * (float)microsteps / 256.0f;
    if (!(steps_per_s * (float)TMC_TSTEP_MAX > clocks))
        return TMC_TSTEP_MAX;
    return steps_per_s < clocks ? (uint32_t)(clocks / steps_per_s) : 1;
}
