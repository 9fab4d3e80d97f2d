/* SPDX-License-Identifier: MIT
 * A motor driver with registers, as its data sheet has it: TMC2209 (UART), TMC5160 and TMC2130 (SPI), and
 * what can be wrong with one. It shares no code with core/drivers, so that a mistake there is one here only
 * if it was made twice. Time is in ticks of the board's timer; no clock of its own. */
#ifndef WIFICNC_PC_VIRTUAL_TMC_H
#define WIFICNC_PC_VIRTUAL_TMC_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { VIRTUAL_TMC_UART_BYTES = 8, VIRTUAL_TMC_SPI_BYTES = 5 };

/** What is wrong with it; bits. */
enum virtual_tmc_fault {
    VIRTUAL_TMC_NO_SUPPLY = 1, /* its registers are lost, and it answers nothing */
    VIRTUAL_TMC_UNWIRED = 2,   /* it has a supply, and hears nothing */
    VIRTUAL_TMC_DEAF = 4,      /* it answers, but does not take writes */
    VIRTUAL_TMC_NOISE = 8,     /* its answers are damaged */
    VIRTUAL_TMC_HOT = 16,
    VIRTUAL_TMC_SHUT_DOWN = 32,
    VIRTUAL_TMC_SHORT = 64,
    VIRTUAL_TMC_OPEN = 128,
    VIRTUAL_TMC_UNDERVOLTAGE = 256,
    VIRTUAL_TMC_CROSSED = 512, /* its step wire is not its axis' */
    VIRTUAL_TMC_CUT = 1024, /* nothing of what the controller sends comes back: its receiver is not wired */
    VIRTUAL_TMC_PARTLY = 2048, /* UART: answers are sound for IOIN and GSTAT only, as of two drivers with one
                                  address whose other registers differ */
    VIRTUAL_TMC_GLITCH = 4096, /* SPI: one bit of one answer is wrong, of DRV_STATUS or CHOPCONF */
};

struct virtual_tmc {
    uint8_t kind; /* enum tmc_kind: 1 TMC2209, 2 TMC5160, 3 TMC2130 */
    uint8_t address, select;
    unsigned faults; /* enum virtual_tmc_fault */
    uint32_t registers[128];
    uint8_t accepted;    /* IFCNT */
    uint32_t reply;      /* SPI: what the next transfer returns */
    uint8_t reply_of;    /* ... the register of that */
    uint64_t step_ticks; /* of the last step; 0: none yet */
    bool backwards;      /* ... was one */
    uint64_t gap_ticks;  /* from the one before to it */
    uint64_t load;       /* StallGuard's result */
    uint64_t datagrams, writes;
};

/** Power on. */
void virtual_tmc_reset(struct virtual_tmc *tmc);

/** What is wrong from now on; a supply that comes back resets it. */
void virtual_tmc_set_faults(struct virtual_tmc *tmc, unsigned faults);

void virtual_tmc_step(struct virtual_tmc *tmc, uint64_t t_ticks, bool backwards);

/** A datagram on its UART. @return bytes of the answer, 0: none */
size_t virtual_tmc_uart(struct virtual_tmc *tmc, const uint8_t *bytes, size_t count, uint64_t now_ticks,
                        uint32_t timer_hz, uint8_t answer[VIRTUAL_TMC_UART_BYTES]);

/** Its select line goes up behind these 40 bits. @param out  what it has sent meanwhile */
void virtual_tmc_spi(struct virtual_tmc *tmc, const uint8_t in[VIRTUAL_TMC_SPI_BYTES], uint64_t now_ticks,
                     uint32_t timer_hz, uint8_t out[VIRTUAL_TMC_SPI_BYTES]);

/** DIAG shows a stall when the motor is stopped now: StallGuard is on, and its last steps were fast enough.
 */
bool virtual_tmc_sees_stall(const struct virtual_tmc *tmc, uint32_t timer_hz);

#endif
