/* SPDX-License-Identifier: MIT
 * Motor drivers with registers on a bus: each is found, gets what is wanted, and proves that it has it; then
 * it is asked again and again how it is. It knows nothing of a machine: in come what is wanted, the time, the
 * position and the bus; out go problems. [task]
 *
 *   find (IOIN) -> reset? (GSTAT) -> [count ->] write .. [-> counted] -> read back (CHOPCONF) -> watch
 *
 * A write by UART is proved by the chip's counter of accepted writes (IFCNT), a write by SPI by the next
 * transfer, which returns what was written. A driver that was reset, that reads back another value or that
 * was lost is found and written again. One transfer is under way at a time; nothing waits. */
#ifndef WIFICNC_DRIVERS_DRIVERS_H
#define WIFICNC_DRIVERS_DRIVERS_H

#include "base/axis.h"
#include "drivers/tmc.h"
#include "drivers/tmc_frame.h"
#include "hal/hal.h"

enum {
    DRIVER_COUNT_MAX = 8,
    DRIVER_LOST_MAX = 3,      /* answers in a row, and writes that are not proved */
    DRIVER_POLL_US = 6000,    /* from one look at a driver to the look at the next */
    DRIVER_RETRY_US = 500000, /* from one try to the next while one is lost */
};

/** Where a driver is; of the board file. */
struct driver_wire {
    uint8_t kind; /* enum tmc_kind */
    uint8_t axis;
    uint8_t motor;   /* 0: the first one of the axis, 1: the second one */
    uint8_t address; /* UART: 0 .. 3; SPI: its place in the chain, 0 next to the controller's output */
    uint8_t select;  /* the line that selects it or its chain */
    uint8_t chain;   /* chips on that line */
    uint16_t sense_mohm;
    bool diag; /* its DIAG is wired to the limit or home input of its motor */
};

/** What is wrong with a driver; bits. */
enum driver_problem {
    DRIVER_MUTE = 1,          /* not even what was sent comes back from the wire */
    DRIVER_SILENT = 2,        /* no answer */
    DRIVER_GARBLED = 4,       /* something, but no sound answer */
    DRIVER_OTHER_CHIP = 8,    /* its version is another chip's */
    DRIVER_WRITE_LOST = 16,   /* it answers, but does not take what is written */
    DRIVER_WAS_RESET = 32,    /* its supply failed for a moment; it has what is wanted again, or soon */
    DRIVER_UNDERVOLTAGE = 64, /* of its charge pump: its supply is too low */
    DRIVER_SHORT = 128,
    DRIVER_SHUT_DOWN = 256, /* too hot: its outputs are off */
    DRIVER_HOT = 512,
    DRIVER_OPEN = 1024,        /* no current in a coil */
    DRIVER_OTHER_STEPS = 2048, /* its axis moves, and it does not see any step */
    DRIVER_PROBLEMS = 12,
    DRIVER_LOST = DRIVER_MUTE | DRIVER_SILENT | DRIVER_GARBLED | DRIVER_OTHER_CHIP | DRIVER_WRITE_LOST,
    DRIVER_WARNINGS = DRIVER_HOT | DRIVER_OPEN, /* the motor still has its place */
};

enum driver_phase {
    DRIVER_FIND,
    DRIVER_RESET,
    DRIVER_COUNT,
    DRIVER_WRITE,
    DRIVER_COUNTED,
    DRIVER_READ_BACK,
    DRIVER_WATCH,
    DRIVER_CLEAR, /* a flag that stays until it is cleared */
};

struct driver {
    struct tmc_want want;
    uint16_t problems; /* enum driver_problem */
    uint8_t phase;     /* enum driver_phase */
    uint8_t at;        /* which write, or which look */
    uint8_t lost;      /* answers since the last look at its status */
    uint8_t tries;     /* of writing everything */
    uint8_t count;     /* IFCNT before the writes */
    uint8_t resets;    /* since power-on, 255 at most */
    bool waits;        /* something else is wanted, when the transfer that is under way is over */
    bool found;        /* it has answered since power-on */
    bool written;      /* it has what is wanted */
    bool had;          /* it had something that was wanted, and was not reset since */
    uint16_t load;     /* StallGuard's result */
    uint32_t retry_us; /* when it was tried last */
    struct tmc_status status;
    uint32_t word; /* SPI, which has no checksum: of DRV_STATUS at the last look ... */
    bool doubted;  /* ... and CHOPCONF was another one at the last look */
    /* its axis */
    int32_t steps;
    uint32_t steps_us;
    uint8_t unseen, open; /* looks in a row at which it stood while its axis moved; without current */
};

struct drivers {
    const struct driver_wire *wire;
    const struct hal_driver_bus *bus;
    uint8_t count;
    bool squares;   /* a motor may rest while its axis moves */
    uint8_t now;    /* whose turn it is */
    bool open;      /* a transfer is under way */
    bool second;    /* SPI: it is the one that brings the answer */
    bool moved;     /* when the request was sent, its axis had made steps since the last look, a moment ago */
    bool slow;      /* ... and slowly */
    uint8_t reg;    /* of the request; with TMC_WRITE: a write */
    uint32_t value; /* to be written */
    uint32_t from_us, looked_us;
    uint8_t sent[TMC_BYTES_MAX], sent_count;
    uint8_t received[TMC_BYTES_MAX], received_count;
    struct driver driver[DRIVER_COUNT_MAX];
};

/** Zeroed before. @param wire  count of them, which outlive it */
void drivers_init(struct drivers *drivers, const struct driver_wire *wire, uint8_t count,
                  const struct hal_driver_bus *bus);

/** What driver n is to be from now on; nothing when it is the same. To be called again and again: while a
 * transfer with it is under way, it is not taken yet. */
void drivers_want(struct drivers *drivers, unsigned n, const struct tmc_want *want);

/** Where its axes are, steps of the motors. */
typedef void drivers_position(const void *ctx, int32_t steps[AXIS_COUNT]);

/** Send, receive, notice. @return true when something was done */
bool drivers_poll(struct drivers *drivers, struct hal *hal, uint32_t now_us, drivers_position *position,
                  const void *ctx);

/** Poll again after this time at the latest. */
uint32_t drivers_wait_us(const struct drivers *drivers, uint32_t now_us);

/** A driver is to be found or written, and is not lost. */
bool drivers_are_busy(const struct drivers *drivers);

/** That it was reset was reported. */
void drivers_forget_reset(struct drivers *drivers, unsigned n);

#endif
