/* SPDX-License-Identifier: MIT
 * The bus of motor drivers of the controller on a PC. */
#include "host_drivers.h"

#include "host_inner.h"

#include <string.h>

enum { BAUD = 115200, BITS = 10, SPI_HZ = 1000000, ANSWER_BITS = 24 };

/* ---- for tests ---- */

static unsigned motor_of(const struct driver_wire *wire) {
    return wire->axis + (unsigned)AXIS_COUNT * wire->motor;
}

static struct virtual_tmc *chip_of(struct hal *hal, unsigned motor) {
    for (unsigned n = 0; n < hal->drivers.count; n++)
        if (motor_of(&hal->drivers.wire[n]) == motor)
            return &hal->drivers.chip[n];
    return NULL;
}

bool host_driver_set_faults(struct host *host, unsigned motor, unsigned faults) {
    struct virtual_tmc *chip = chip_of(&host->hal, motor);
    if (chip != NULL)
        virtual_tmc_set_faults(chip, faults);
    return chip != NULL;
}

bool host_has_driver(const struct host *host, unsigned motor) {
    bool has = false;
    for (unsigned n = 0; n < host->hal.drivers.count; n++)
        has |= motor_of(&host->hal.drivers.wire[n]) == motor;
    return has;
}

bool host_driver_reset(struct host *host, unsigned motor) {
    struct virtual_tmc *chip = chip_of(&host->hal, motor);
    if (chip != NULL)
        virtual_tmc_reset(chip);
    return chip != NULL;
}

bool host_driver_set_address(struct host *host, unsigned motor, unsigned address) {
    struct virtual_tmc *chip = chip_of(&host->hal, motor);
    if (chip != NULL)
        chip->address = (uint8_t)address;
    return chip != NULL;
}

uint32_t host_driver_register(const struct host *host, unsigned motor, unsigned reg) {
    for (unsigned n = 0; n < host->hal.drivers.count; n++)
        if (motor_of(&host->hal.drivers.wire[n]) == motor)
            return host->hal.drivers.chip[n].registers[reg & 127u];
    return 0;
}

uint64_t host_driver_datagrams(const struct host *host) {
    uint64_t all = 0;
    for (unsigned n = 0; n < host->hal.drivers.count; n++)
        all += host->hal.drivers.chip[n].datagrams;
    return all;
}

/* ---- the bus ---- */

/* Two that answer together pull the wire low wherever one of them does. */
static void answer_uart(struct hal *hal, const uint8_t *bytes, size_t count) {
    struct host_drivers *drivers = &hal->drivers;
    uint8_t both[VIRTUAL_TMC_UART_BYTES], answer[VIRTUAL_TMC_UART_BYTES];
    size_t answers = 0;
    bool cut = false;
    memset(both, 0xFF, sizeof both);
    for (unsigned n = 0; n < drivers->count; n++) {
        cut |= (drivers->chip[n].faults & VIRTUAL_TMC_CUT) != 0;
        if (virtual_tmc_uart(&drivers->chip[n], bytes, count, hal->step.now_ticks, hal->timer_hz, answer) ==
            0)
            continue;
        answers++;
        for (unsigned i = 0; i < sizeof both; i++)
            both[i] &= answer[i];
    }
    drivers->byte_count = 0;
    if (!cut) {
        memcpy(drivers->bytes, bytes, count); /* one wire: it comes back */
        drivers->byte_count = (uint8_t)count;
    }
    if (answers > 0 && !cut) {
        memcpy(drivers->bytes + drivers->byte_count, both, sizeof both);
        drivers->byte_count = (uint8_t)(drivers->byte_count + sizeof both);
    }
    const uint64_t bits = BITS * (count + (answers > 0 ? sizeof both : 0)) + ANSWER_BITS;
    drivers->ready_ticks = hal->step.now_ticks + bits * hal->timer_hz / BAUD;
}

static void answer_spi(struct hal *hal, uint8_t select, const uint8_t *bytes, size_t count) {
    struct host_drivers *drivers = &hal->drivers;
    memset(drivers->bytes, 0, count);
    for (unsigned n = 0; n < drivers->count; n++) {
        const struct driver_wire *wire = &drivers->wire[n];
        const size_t at = (size_t)(wire->chain - 1u - wire->address) * VIRTUAL_TMC_SPI_BYTES;
        if (wire->select == select && at + VIRTUAL_TMC_SPI_BYTES <= count)
            virtual_tmc_spi(&drivers->chip[n], bytes + at, hal->step.now_ticks, hal->timer_hz,
                            drivers->bytes + at);
    }
    drivers->byte_count = (uint8_t)count;
    drivers->ready_ticks = hal->step.now_ticks + (uint64_t)count * 8 * hal->timer_hz / SPI_HZ;
}

static void send_bytes(struct hal *hal, uint8_t select, const uint8_t *bytes, size_t count) {
    if (tmc_chip(hal->drivers.wire[0].kind)->uart)
        answer_uart(hal, bytes, count);
    else
        answer_spi(hal, select, bytes, count);
}

static size_t receive_bytes(struct hal *hal, uint8_t *bytes, size_t size) {
    struct host_drivers *drivers = &hal->drivers;
    if (hal->step.now_ticks < drivers->ready_ticks)
        return 0;
    const size_t count = drivers->byte_count < size ? drivers->byte_count : size;
    memcpy(bytes, drivers->bytes, count);
    drivers->byte_count = 0;
    return count;
}

uint64_t host_drivers_next_ticks(const struct hal *hal) {
    return hal->drivers.ready_ticks > hal->step.now_ticks ? hal->drivers.ready_ticks : UINT64_MAX;
}

void host_drivers_step(struct hal *hal, uint8_t step_mask, uint8_t dir_mask, uint64_t t_ticks) {
    const axis_mask_t waits[MOTOR_COUNT] = {hal->virtual_machine.first_waits,
                                            hal->virtual_machine.second_waits};
    for (unsigned n = 0; n < hal->drivers.count; n++) {
        const struct driver_wire *wire = &hal->drivers.wire[n];
        if ((step_mask >> wire->axis & 1u) != 0 && (waits[wire->motor] >> wire->axis & 1u) == 0)
            virtual_tmc_step(&hal->drivers.chip[n], t_ticks, (dir_mask >> wire->axis & 1u) != 0);
    }
}

/* A motor that leaves its end again is not stopped by it. */
static bool pushes(const struct virtual_machine *machine, const struct virtual_tmc *chip,
                   const struct driver_wire *wire) {
    const unsigned axis = wire->axis;
    const int32_t at = wire->motor != 0 ? machine->second[axis] : machine->position[axis];
    return chip->backwards ? at <= machine->low[axis] + 1 : at >= machine->high[axis] - 1;
}

void host_drivers_blind(const struct hal *hal, axis_mask_t blind[MOTOR_COUNT]) {
    memset(blind, 0, MOTOR_COUNT * sizeof blind[0]);
    for (unsigned n = 0; n < hal->drivers.count; n++) {
        const struct driver_wire *wire = &hal->drivers.wire[n];
        if (wire->diag && hal->settings->driver_stall[wire->axis] != 0 &&
            !(pushes(&hal->virtual_machine, &hal->drivers.chip[n], wire) &&
              virtual_tmc_sees_stall(&hal->drivers.chip[n], hal->timer_hz)))
            blind[wire->motor] |= (axis_mask_t)(1u << wire->axis);
    }
}

void host_drivers_init(struct host *host, const uint32_t driver[MOTOR_COUNT * AXIS_COUNT]) {
    static const struct hal_driver_bus bus = {.send = send_bytes, .receive = receive_bytes};
    struct host_drivers *drivers = &host->hal.drivers;
    for (unsigned motor = 0; motor < MOTOR_COUNT * AXIS_COUNT && drivers->count < DRIVER_COUNT_MAX; motor++) {
        const uint32_t code = driver[motor];
        const uint32_t sense_mohm = code >> 17;
        const struct tmc_chip *kind = tmc_chip(code & 15u);
        if (kind == NULL)
            continue;
        struct driver_wire *wire = &drivers->wire[drivers->count];
        *wire =
            (struct driver_wire){.kind = (uint8_t)(code & 15u),
                                 .axis = (uint8_t)(motor % AXIS_COUNT),
                                 .motor = (uint8_t)(motor / AXIS_COUNT),
                                 .address = (uint8_t)(code >> 4 & 15u),
                                 .select = (uint8_t)(code >> 8 & 15u),
                                 .chain = (uint8_t)(code >> 12 & 15u),
                                 .sense_mohm = (uint16_t)(sense_mohm != 0 ? sense_mohm : kind->sense_mohm),
                                 .diag = (code >> 16 & 1u) != 0};
        struct virtual_tmc *chip = &drivers->chip[drivers->count++];
        *chip = (struct virtual_tmc){.kind = wire->kind, .address = wire->address, .select = wire->select};
        virtual_tmc_reset(chip);
    }
    drivers_init(&host->drivers.set, drivers->wire, drivers->count, &bus);
}
