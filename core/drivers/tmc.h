/* SPDX-License-Identifier: MIT
 * Registers of Trinamic's motor drivers: which chip has which, and what settings are as their values. Pure:
 * no clock, no bus. Numbers are from the data sheets of TMC2209 (rev. 1.09), TMC2130 (1.15) and TMC5160
 * (1.17).
 */
#ifndef WIFICNC_DRIVERS_TMC_H
#define WIFICNC_DRIVERS_TMC_H

#include "drivers/tmc_chips_gen.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum tmc_register {
    TMC_GCONF = 0x00,
    TMC_GSTAT = 0x01,
    TMC_IFCNT = 0x02,
    TMC_NODECONF = 0x03,
    TMC_SPI_IOIN = 0x04,
    TMC_UART_IOIN = 0x06,
    TMC_GLOBALSCALER = 0x0B,
    TMC_IHOLD_IRUN = 0x10,
    TMC_TPOWERDOWN = 0x11,
    TMC_TPWMTHRS = 0x13,
    TMC_TCOOLTHRS = 0x14,
    TMC_SGTHRS = 0x40,
    TMC_UART_COOLCONF = 0x42,
    TMC_CHOPCONF = 0x6C,
    TMC_SPI_COOLCONF = 0x6D,
    TMC_DRV_STATUS = 0x6F,
    TMC_PWMCONF = 0x70,
};

/** Bits of GSTAT. */
enum { TMC_GSTAT_RESET = 1, TMC_GSTAT_ERROR = 2, TMC_GSTAT_UNDERVOLTAGE = 4, TMC_GSTAT_ALL = 7 };

/** A threshold that no speed reaches, and one that all do. */
enum { TMC_TSTEP_MAX = 0xFFFFF };

/** DRV_STATUS in the words of all chips. */
struct tmc_status {
    bool hot, shut_down, shorted, open_load, stands;
    uint16_t stall;        /* load: small is heavy. TMC2209: it has a register for it, and this is 0 */
    uint8_t current_scale; /* 0 .. 31 */
};

/** A chip. */
struct tmc_chip {
    const char *name;
    bool uart;               /* else SPI */
    bool clears_by_reading;  /* GSTAT; else by writing ones */
    bool latches;            /* undervoltage in GSTAT; else it shows what is now */
    uint8_t version;         /* the high byte of IOIN */
    uint8_t ioin;            /* where that is */
    uint8_t write_count;     /* of `writes`, in this order */
    const uint8_t *writes;   /* enum tmc_register */
    uint16_t sense_mohm;     /* of common modules */
    uint8_t sense_more_mohm; /* inside the chip, in a row with it */
    uint16_t full_mv,
        fine_mv; /* across the sense resistor at full scale; fine_mv: with vsense, 0: has none */
};

/** NULL: TMC_NONE, or no kind. */
const struct tmc_chip *tmc_chip(unsigned kind);

/** What is wanted of a driver. Comparable by memcmp(): no padding. */
struct tmc_want {
    uint16_t current_ma;    /* rms, moving; 0: its registers are left alone */
    uint16_t microsteps;    /* 1 .. 256, a power of two */
    uint32_t stealth_tstep; /* stealthChop while TSTEP is this or more; 0: never, UINT32_MAX: always */
    uint32_t load_tstep;    /* coolStep and StallGuard work while TSTEP is this or less; 0: never */
    uint8_t hold_pct;       /* of current_ma, at rest */
    uint8_t coolstep;       /* 0: off; 1 .. 15: the load at which the current rises */
    uint8_t stall;          /* 0 .. 255: the more, the lighter a load is a stall */
    bool stall_armed;       /* DIAG shows stalls */
};

/** The most current that this sense resistor allows, mA rms. */
uint32_t tmc_current_max_ma(const struct tmc_chip *chip, unsigned sense_mohm);

/** The value of one of chip->writes. */
uint32_t tmc_value(const struct tmc_chip *chip, unsigned sense_mohm, const struct tmc_want *want,
                   uint8_t reg);

/** What DRV_STATUS says. */
struct tmc_status tmc_status_of(const struct tmc_chip *chip, uint32_t drv_status);

/** TSTEP, the chip's clocks between two 1/256 microsteps, at this rate of steps; 1 to TMC_TSTEP_MAX. */
uint32_t tmc_tstep(float steps_per_s, unsigned microsteps);

#endif
