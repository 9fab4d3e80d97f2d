/* SPDX-License-Identifier: MIT
 * The RS-485 bus of the controller on a PC. */
#include "host_bus.h"

#include "host_inner.h"
#include "virtual_vfd.h"

#include <string.h>

enum { BITS = 10 }; /* of a character without parity */

static uint64_t chars_ticks(const struct hal *hal, size_t count) {
    const unsigned bits = BITS + (hal->bus.format.parity != HAL_BUS_NONE);
    const uint32_t baud = hal->bus.format.baud;
    return baud == 0 ? 0 : (uint64_t)count * bits * hal->timer_hz / baud;
}

void host_bus_attach(struct host *host, host_bus_device *device, void *ctx) {
    host->hal.bus.device = device;
    host->hal.bus.ctx = ctx;
}

bool host_bus_use(struct host *host, const struct host_bus_line *line, int number) {
    struct host_bus *bus = &host->hal.bus;
    bus->line = line;
    bus->line_number = number;
    return bus->format.baud == 0 || line->configure(number, bus->format.baud, (int)bus->format.parity);
}

void host_bus_put(struct hal *hal, uint64_t t_ticks, const uint8_t *bytes, size_t count) {
    struct host_bus *bus = &hal->bus;
    for (size_t i = 0; i < count && bus->count < HOST_BUS_QUEUE; i++) {
        const uint64_t at_ticks = t_ticks + chars_ticks(hal, i + 1);
        size_t at = bus->count++;
        for (; at > 0 && bus->queue[at - 1].t_ticks > at_ticks; at--)
            bus->queue[at] = bus->queue[at - 1];
        bus->queue[at] = (struct host_bus_byte){.t_ticks = at_ticks, .byte = bytes[i]};
    }
}

void host_bus_answer(struct host *host, uint64_t t_ticks, const uint8_t *bytes, size_t count) {
    host_bus_put(&host->hal, t_ticks, bytes, count);
}

uint64_t host_bus_next_ticks(const struct hal *hal) {
    for (size_t i = 0; i < hal->bus.count; i++)
        if (hal->bus.queue[i].t_ticks > hal->step.now_ticks)
            return hal->bus.queue[i].t_ticks;
    return UINT64_MAX;
}

static bool configure(struct hal *hal, const struct hal_bus_format *format) {
    hal->bus.format = *format;
    return hal->bus.line == NULL ||
           hal->bus.line->configure(hal->bus.line_number, format->baud, (int)format->parity);
}

static void send_bytes(struct hal *hal, const uint8_t *bytes, size_t count) {
    struct host_bus *bus = &hal->bus;
    if (bus->line != NULL) {
        bus->line->write(bus->line_number, bytes, count);
        return;
    }
    bus->sends_until_ticks = hal->step.now_ticks + chars_ticks(hal, count);
    if (bus->device != NULL)
        bus->device(bus->ctx, bus->sends_until_ticks, bytes, count, bus->format.baud,
                    (uint32_t)bus->format.parity);
    else
        virtual_vfd_hear(hal, bus->sends_until_ticks, bytes, count);
}

static size_t receive_bytes(struct hal *hal, uint8_t *bytes, size_t size) {
    struct host_bus *bus = &hal->bus;
    size_t taken = 0, count = 0;
    if (bus->line != NULL)
        return bus->line->read(bus->line_number, bytes, size);
    while (taken < bus->count && bus->queue[taken].t_ticks <= hal->step.now_ticks && count < size) {
        const struct host_bus_byte *next = &bus->queue[taken++];
        if (next->t_ticks > bus->sends_until_ticks) /* the driver was on before */
            bytes[count++] = next->byte;
    }
    bus->count -= taken;
    memmove(bus->queue, bus->queue + taken, bus->count * sizeof bus->queue[0]);
    return count;
}

const struct hal_bus host_bus = {.configure = configure, .send = send_bytes, .receive = receive_bytes};
