/* SPDX-License-Identifier: MIT
 * The RS-485 bus of the controller on a PC. In virtual time characters take as long as their baud rate says,
 * and at the other end is the drive of the virtual machine (virtual_vfd.h), or a device of a test; or the bus
 * is a serial port of the computer.
 *
 * One thread, as the host. */
#ifndef WIFICNC_PC_HOST_BUS_H
#define WIFICNC_PC_HOST_BUS_H

#include "hal/hal.h"

struct host;

enum { HOST_BUS_QUEUE = 512 };

/** [tests] A device gets each request with the time when its last bit leaves, before that time comes, and
 * answers by host_bus_answer(). */
typedef void host_bus_device(void *ctx, uint64_t end_ticks, const uint8_t *bytes, size_t count, uint32_t baud,
                             uint32_t parity);

/** A real bus in the place of the virtual one. */
struct host_bus_line {
    bool (*configure)(int line, uint32_t baud, int parity);
    void (*write)(int line, const uint8_t *bytes, size_t count);
    size_t (*read)(int line, uint8_t *bytes, size_t size);
};

struct host_bus_byte {
    uint64_t t_ticks; /* when its stop bit is over */
    uint8_t byte;
};

struct host_bus {
    struct hal_bus_format format;
    host_bus_device *device; /* NULL: the drive of the virtual machine */
    void *ctx;
    const struct host_bus_line *line; /* NULL: virtual */
    int line_number;
    uint64_t sends_until_ticks;
    struct host_bus_byte queue[HOST_BUS_QUEUE]; /* on their way to the controller, in order of time */
    size_t count;
};

/** [tests] This device instead of the one before. */
void host_bus_attach(struct host *host, host_bus_device *device, void *ctx);

/** [tests] Bytes for the controller, one after the other from this time on. */
void host_bus_answer(struct host *host, uint64_t t_ticks, const uint8_t *bytes, size_t count);

/** From now on this line. @return false: it does not have the format that settings ask for */
bool host_bus_use(struct host *host, const struct host_bus_line *line, int number);

/* --- for host.c --- */

extern const struct hal_bus host_bus;

/** When the next byte is there; UINT64_MAX: none is on its way. */
uint64_t host_bus_next_ticks(const struct hal *hal);

/** As host_bus_answer(). */
void host_bus_put(struct hal *hal, uint64_t t_ticks, const uint8_t *bytes, size_t count);

#endif
