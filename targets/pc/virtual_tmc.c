/* SPDX-License-Identifier: MIT
 * A motor driver with registers. */
#include "virtual_tmc.h"

#include <string.h>

enum { IS_2209 = 1, IS_5160 = 2, IS_2130 = 3 };
enum { GCONF = 0, GSTAT = 1, IFCNT = 2, SPI_IOIN = 4, UART_IOIN = 6, TSTEP = 0x12, IHOLD_IRUN = 0x10 };
enum {
    TPWMTHRS = 0x13,
    TCOOLTHRS = 0x14,
    SGTHRS = 0x40,
    SG_RESULT = 0x41,
    CHOPCONF = 0x6C,
    DRV_STATUS = 0x6F
};

#define CLOCK_HZ      12000000.0
#define TSTEP_MAX     0xFFFFFu
#define STANDS_CLOCKS 1048576.0 /* 2^20 */

void virtual_tmc_reset(struct virtual_tmc *tmc) {
    static const uint32_t chopconf[] = {[IS_2209] = 0x10000053u, [IS_5160] = 0x10410150u, [IS_2130] = 0};
    memset(tmc->registers, 0, sizeof tmc->registers);
    tmc->registers[CHOPCONF] = chopconf[tmc->kind];
    tmc->registers[GCONF] = tmc->kind == IS_2209 ? 0x101u : 0;
    tmc->registers[GSTAT] = 1;
    tmc->accepted = 0;
    tmc->reply = 0;
}

void virtual_tmc_set_faults(struct virtual_tmc *tmc, unsigned faults) {
    if ((tmc->faults & VIRTUAL_TMC_NO_SUPPLY) != 0 && (faults & VIRTUAL_TMC_NO_SUPPLY) == 0)
        virtual_tmc_reset(tmc);
    if (tmc->kind == IS_5160 && (faults & VIRTUAL_TMC_UNDERVOLTAGE) != 0)
        tmc->registers[GSTAT] |= 4u; /* until a one is written */
    tmc->faults = faults;
}

void virtual_tmc_step(struct virtual_tmc *tmc, uint64_t t_ticks, bool backwards) {
    if ((tmc->faults & VIRTUAL_TMC_CROSSED) != 0)
        return;
    tmc->gap_ticks = tmc->step_ticks != 0 ? t_ticks - tmc->step_ticks : 0;
    tmc->step_ticks = t_ticks;
    tmc->backwards = backwards;
}

static unsigned microsteps(const struct virtual_tmc *tmc) {
    return 256u >> (tmc->registers[CHOPCONF] >> 24 & 15u);
}

static uint32_t tstep(const struct virtual_tmc *tmc, uint32_t timer_hz) {
    const double clocks = (double)tmc->gap_ticks / timer_hz * CLOCK_HZ * microsteps(tmc) / 256.0;
    return tmc->gap_ticks == 0 || clocks >= TSTEP_MAX ? TSTEP_MAX : (uint32_t)clocks;
}

static bool stands(const struct virtual_tmc *tmc, uint64_t now_ticks, uint32_t timer_hz) {
    return tmc->step_ticks == 0 ||
           (double)(now_ticks - tmc->step_ticks) / timer_hz * CLOCK_HZ >= STANDS_CLOCKS;
}

static uint32_t drv_status(const struct virtual_tmc *tmc, uint64_t now_ticks, uint32_t timer_hz) {
    /*                            hot, shut down, short to ground A, open load B */
    static const uint8_t at_2209[] = {0, 1, 2, 7}, at_spi[] = {26, 25, 27, 30};
    static const unsigned faults[] = {VIRTUAL_TMC_HOT, VIRTUAL_TMC_SHUT_DOWN, VIRTUAL_TMC_SHORT,
                                      VIRTUAL_TMC_OPEN};
    const uint8_t *at = tmc->kind == IS_2209 ? at_2209 : at_spi;
    const bool rests = stands(tmc, now_ticks, timer_hz);
    uint32_t word = rests ? 1u << 31 : 0;
    word |= (tmc->registers[IHOLD_IRUN] >> (rests ? 0 : 8) & 31u) << 16;
    for (unsigned i = 0; i < sizeof faults / sizeof faults[0]; i++)
        word |= (tmc->faults & faults[i]) != 0 ? 1u << at[i] : 0;
    return word | (tmc->kind == IS_2209 ? 0 : (uint32_t)tmc->load & 0x3FFu);
}

static uint32_t read_register(struct virtual_tmc *tmc, uint8_t reg, uint64_t now_ticks, uint32_t timer_hz) {
    static const uint32_t version[] = {
        [IS_2209] = 0x21000000u, [IS_5160] = 0x30000000u, [IS_2130] = 0x11000000u};
    const bool uart = tmc->kind == IS_2209;
    if (reg == (uart ? UART_IOIN : SPI_IOIN))
        return version[tmc->kind] | tmc->address;
    switch (reg) {
    case IFCNT:
        return uart ? tmc->accepted : 0;
    case TSTEP:
        return stands(tmc, now_ticks, timer_hz) ? TSTEP_MAX : tstep(tmc, timer_hz);
    case DRV_STATUS:
        return drv_status(tmc, now_ticks, timer_hz);
    case SG_RESULT:
        return uart ? (uint32_t)tmc->load : 0;
    case GCONF:
    case CHOPCONF:
        return tmc->registers[reg];
    case GSTAT: {
        const uint32_t now = tmc->registers[GSTAT] | ((tmc->faults & VIRTUAL_TMC_UNDERVOLTAGE) != 0 ? 4u : 0);
        if (tmc->kind == IS_2130) /* cleared by being read */
            tmc->registers[GSTAT] = 0;
        return now;
    }
    default: /* write only */
        return 0;
    }
}

static void write_register(struct virtual_tmc *tmc, uint8_t reg, uint32_t value) {
    tmc->writes++;
    if (reg == GSTAT && tmc->kind != IS_2130)
        tmc->registers[GSTAT] &= ~value;
    else if (reg != GSTAT)
        tmc->registers[reg] = value;
}

/* Bit by bit as it goes over the wire: low bit first into a register of x^8 + x^2 + x + 1. */
static uint8_t crc_of(const uint8_t *bytes, size_t count) {
    uint8_t crc = 0;
    for (size_t i = 0; i < count; i++) {
        uint8_t byte = bytes[i];
        for (int bit = 0; bit < 8; bit++, byte >>= 1) {
            if ((crc >> 7) != (byte & 1))
                crc = (uint8_t)(crc << 1 ^ 7);
            else
                crc = (uint8_t)(crc << 1);
        }
    }
    return crc;
}

static uint32_t value_at(const uint8_t *bytes) {
    return (uint32_t)bytes[0] << 24 | (uint32_t)bytes[1] << 16 | (uint32_t)bytes[2] << 8 | bytes[3];
}

static void put_value(uint8_t *bytes, uint32_t value) {
    for (int i = 3; i >= 0; i--, value >>= 8)
        bytes[i] = (uint8_t)value;
}

size_t virtual_tmc_uart(struct virtual_tmc *tmc, const uint8_t *bytes, size_t count, uint64_t now_ticks,
                        uint32_t timer_hz, uint8_t answer[VIRTUAL_TMC_UART_BYTES]) {
    const bool writes = count == VIRTUAL_TMC_UART_BYTES;
    if ((tmc->faults & (VIRTUAL_TMC_NO_SUPPLY | VIRTUAL_TMC_UNWIRED)) != 0 || (count != 4 && !writes) ||
        bytes[0] != 5 || bytes[1] != tmc->address || bytes[count - 1] != crc_of(bytes, count - 1) ||
        writes != (bytes[2] >> 7 != 0))
        return 0;
    tmc->datagrams++;
    if (writes) {
        if ((tmc->faults & VIRTUAL_TMC_DEAF) != 0)
            return 0;
        tmc->accepted++;
        write_register(tmc, bytes[2] & 0x7F, value_at(bytes + 3));
        return 0;
    }
    answer[0] = 5;
    answer[1] = 0xFF;
    answer[2] = bytes[2];
    put_value(answer + 3, read_register(tmc, bytes[2], now_ticks, timer_hz));
    answer[7] = crc_of(answer, 7);
    const bool partly = (tmc->faults & VIRTUAL_TMC_PARTLY) != 0 && bytes[2] != UART_IOIN && bytes[2] != GSTAT;
    if ((tmc->faults & VIRTUAL_TMC_NOISE) != 0 || partly)
        answer[4] ^= 0x10;
    return VIRTUAL_TMC_UART_BYTES;
}

void virtual_tmc_spi(struct virtual_tmc *tmc, const uint8_t in[VIRTUAL_TMC_SPI_BYTES], uint64_t now_ticks,
                     uint32_t timer_hz, uint8_t out[VIRTUAL_TMC_SPI_BYTES]) {
    memset(out, 0, VIRTUAL_TMC_SPI_BYTES);
    if ((tmc->faults & (VIRTUAL_TMC_NO_SUPPLY | VIRTUAL_TMC_UNWIRED)) != 0)
        return;
    tmc->datagrams++;
    out[0] = (uint8_t)((tmc->registers[GSTAT] & 3u) | (stands(tmc, now_ticks, timer_hz) ? 8u : 0));
    put_value(out + 1, tmc->reply);
    if ((tmc->faults & VIRTUAL_TMC_NOISE) != 0)
        out[2] ^= 0x10;
    if ((tmc->faults & VIRTUAL_TMC_GLITCH) != 0 && tmc->reply_of >= CHOPCONF) {
        tmc->faults &= ~(unsigned)VIRTUAL_TMC_GLITCH;
        out[1] ^= 0x08; /* short to ground; microsteps */
    }
    tmc->reply_of = in[0];
    if ((in[0] & 0x80) != 0) {
        tmc->reply = (tmc->faults & VIRTUAL_TMC_DEAF) != 0 ? 0 : value_at(in + 1);
        if ((tmc->faults & VIRTUAL_TMC_DEAF) == 0)
            write_register(tmc, in[0] & 0x7F, value_at(in + 1));
        return;
    }
    tmc->reply = read_register(tmc, in[0], now_ticks, timer_hz);
}

bool virtual_tmc_sees_stall(const struct virtual_tmc *tmc, uint32_t timer_hz) {
    const uint32_t *reg = tmc->registers;
    const bool stealth = tmc->kind == IS_2209 ? (reg[GCONF] & 4u) == 0 : (reg[GCONF] & 4u) != 0;
    const bool shows = tmc->kind == IS_2209 ? reg[SGTHRS] > 0 && stealth && reg[TPWMTHRS] == 0
                                            : (reg[GCONF] & 0x100u) != 0 && !stealth;
    return shows && tstep(tmc, timer_hz) <= reg[TCOOLTHRS];
}
