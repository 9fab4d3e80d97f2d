/* SPDX-License-Identifier: MIT
 * Buses at work, second by second, to count what they cost: a spindle's drive that turns, on RS-485, and
 * motor drivers with registers, on a UART or by SPI, that are watched while their axes move. The other ends
 * answer as they should and byte by byte, in the time of the bus, so that each poll finds a part of an
 * answer.
 *
 *     traffic vfd MODEL SECONDS | traffic uart DRIVERS SECONDS | traffic spi DRIVERS SECONDS
 *
 * On Xtensa without an operating system: the words below are set, and `counted` is what the polls of the last
 * SECONDS took, as each instruction takes a cycle there. */
#include "drivers/drivers.h"
#include "spindle/vfd.h"

#include <stdlib.h>
#include <string.h>

enum traffic_kind { VFD_BUS, UART_BUS, SPI_BUS };
enum {
    POLL_US = 1000,
    SECOND_US = 1000000,
    ADDRESS = 1,
    CHAR_BITS = 10,
    UART_BAUD = 115200,
    SPI_HZ = 1000000,
    THINKS_US = 5000,
    ANY_BYTE = 0x10, /* where an answer may have anything */
    STEPS_A_POLL = 20,
    CURRENT_MA = 800,
    WIRE_SIZE = 64,
    TMC2209_IOIN = 0x21000040,
    TMC5160_IOIN = 0x30000000,
};

volatile uint32_t kind = VFD_BUS, what = 2, seconds = 1, done, counted;

/* One wire: what is on its way to the controller, and when each byte is there. */
struct hal {
    uint32_t now_us, baud;
    uint32_t request_count; /* VFD: a request is there for the drive */
    uint8_t request[WIRE_SIZE];
    uint8_t wire[WIRE_SIZE];
    uint32_t count, taken, from_us, byte_us;
    uint32_t registers[DRIVER_COUNT_MAX][128];
    uint32_t reply[DRIVER_COUNT_MAX]; /* SPI: what the next transfer returns */
};

static struct hal hal;
static struct vfd vfd;
static struct drivers drivers;
static struct driver_wire wires[DRIVER_COUNT_MAX];

static size_t take(uint8_t *bytes, size_t size) {
    size_t count = 0;
    while (count < size && hal.taken < hal.count &&
           (int32_t)(hal.now_us - hal.from_us - (hal.taken + 1) * hal.byte_us) >= 0)
        bytes[count++] = hal.wire[hal.taken++];
    return count;
}

/* ---- RS-485 ---- */

static bool bus_configure(struct hal *bus, const struct hal_bus_format *format) {
    bus->baud = format->baud;
    return true;
}

static void bus_send(struct hal *bus, const uint8_t *bytes, size_t count) {
    memcpy(bus->request, bytes, count);
    bus->request_count = (uint32_t)count;
    bus->count = bus->taken = 0;
}

static size_t bus_receive(struct hal *bus, uint8_t *bytes, size_t size) {
    (void)bus;
    return take(bytes, size);
}

static const struct hal_bus bus = {.configure = bus_configure, .send = bus_send, .receive = bus_receive};

/* What the request wants to have. */
static void answer_drive(void) {
    const struct modbus_pattern *pattern = &vfd.request.answer;
    uint8_t body[MODBUS_BODY_MAX];
    if (hal.request_count == 0)
        return;
    for (unsigned i = 0; i < pattern->count; i++)
        body[i] = (pattern->any >> i & 1u) != 0 ? ANY_BYTE : pattern->bytes[i];
    hal.count = (uint32_t)modbus_build(hal.wire, ADDRESS, body, pattern->count);
    hal.byte_us = CHAR_BITS * SECOND_US / hal.baud;
    hal.from_us = hal.now_us + hal.request_count * hal.byte_us + THINKS_US;
    hal.taken = hal.request_count = 0;
}

/* ---- drivers ---- */

static void put(uint8_t *bytes, uint32_t value) {
    for (unsigned i = 0; i < 4; i++)
        bytes[i] = (uint8_t)(value >> (24 - 8 * i));
}

static uint32_t get(const uint8_t *bytes) {
    return (uint32_t)bytes[0] << 24 | (uint32_t)bytes[1] << 16 | (uint32_t)bytes[2] << 8 | bytes[3];
}

/* Flags are cleared by ones. */
static void write_register(uint32_t registers[128], uint8_t reg, uint32_t value) {
    registers[reg] = reg == TMC_GSTAT ? registers[reg] & ~value : value;
}

static void uart_send(struct hal *to, uint8_t select, const uint8_t *bytes, size_t count) {
    (void)select;
    memcpy(to->request, bytes, count);
    memcpy(to->wire, bytes, count); /* it comes back */
    to->count = to->request_count = (uint32_t)count;
    to->taken = 0;
    to->byte_us = CHAR_BITS * SECOND_US / UART_BAUD;
    to->from_us = to->now_us;
}

static void spi_send(struct hal *to, uint8_t select, const uint8_t *bytes, size_t count) {
    (void)select;
    memcpy(to->request, bytes, count);
    to->count = to->request_count = (uint32_t)count;
    to->taken = 0;
    to->byte_us = 8 * SECOND_US / SPI_HZ;
    to->from_us = to->now_us;
}

static size_t drivers_receive(struct hal *from, uint8_t *bytes, size_t size) {
    if (kind == SPI_BUS && from->now_us - from->from_us < from->count * from->byte_us)
        return 0;
    return take(bytes, size);
}

static void answer_uart(void) {
    uint32_t *registers = hal.registers[hal.request[1] % DRIVER_COUNT_MAX];
    const uint8_t reg = hal.request[2] & 127u;
    uint8_t *answer = hal.wire + hal.count;
    if ((hal.request[2] & TMC_WRITE) != 0) {
        write_register(registers, reg, get(hal.request + 3));
        registers[TMC_IFCNT] = (registers[TMC_IFCNT] + 1) & 255u;
        return;
    }
    answer[0] = 5;
    answer[1] = 255;
    answer[2] = reg;
    put(answer + 3, registers[reg]);
    answer[7] = tmc_crc(answer, 7);
    hal.count += TMC_UART_FRAME_SIZE;
}

static void answer_spi(void) {
    for (unsigned n = 0; n < drivers.count; n++) {
        const size_t at = (drivers.count - 1u - n) * TMC_SPI_FRAME_SIZE;
        const uint8_t reg = hal.request[at] & 127u;
        put(hal.wire + at + 1, hal.reply[n]);
        hal.wire[at] = 1; /* its status */
        const bool writes = (hal.request[at] & TMC_WRITE) != 0;
        if (writes)
            write_register(hal.registers[n], reg, get(hal.request + at + 1));
        hal.reply[n] = writes ? get(hal.request + at + 1) : hal.registers[n][reg];
    }
}

static void answer_drivers(void) {
    if (hal.request_count == 0)
        return;
    hal.request_count = 0;
    if (kind == UART_BUS)
        answer_uart();
    else
        answer_spi();
}

/* All axes move. */
static void position(const void *ctx, int32_t steps[AXIS_COUNT]) {
    (void)ctx;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        steps[ax] = (int32_t)(hal.now_us / POLL_US * STEPS_A_POLL);
}

/* ---- a second ---- */

static uint32_t cycles(void) {
    uint32_t now = 0;
#if defined(__XTENSA__)
    __asm__ volatile("rsr %0, ccount" : "=r"(now));
#endif
    return now;
}

static void begin(void) {
    static const struct hal_driver_bus uart = {.send = uart_send, .receive = drivers_receive};
    static const struct hal_driver_bus spi = {.send = spi_send, .receive = drivers_receive};
    if (kind == VFD_BUS) {
        const struct vfd_model *model = vfd_model((uint8_t)what);
        const struct vfd_config config = {
            .model = (uint8_t)what,
            .address = ADDRESS,
            .format = {.baud = vfd_baud(model, 6), .parity = vfd_parity(model, 3)},
            .timeout_ms = 50,
            .rpm_per_hz = 60.0f,
            .own = {8192, 8193, 8451, 18, 34, 1, 100.0f, 60.0f, 60.0f, 100.0f}};
        (void)vfd_configure(&vfd, &hal, &bus, &config, hal.now_us);
        vfd_command(&vfd, 1, 12000.0f, 24000.0f, hal.now_us);
        return;
    }
    const bool is_uart = kind == UART_BUS;
    for (unsigned n = 0; n < what; n++) {
        wires[n] = (struct driver_wire){.kind = is_uart ? TMC_2209 : TMC_5160,
                                        .axis = (uint8_t)(n % AXIS_COUNT),
                                        .address = (uint8_t)n,
                                        .chain = (uint8_t)(is_uart ? 1 : what),
                                        .sense_mohm = is_uart ? 110 : 75};
        hal.registers[n][is_uart ? TMC_UART_IOIN : TMC_SPI_IOIN] = is_uart ? TMC2209_IOIN : TMC5160_IOIN;
    }
    drivers_init(&drivers, wires, (uint8_t)what, is_uart ? &uart : &spi);
    for (unsigned n = 0; n < what; n++)
        drivers_want(&drivers, n,
                     &(struct tmc_want){.current_ma = CURRENT_MA, .microsteps = 16, .hold_pct = 50});
}

/* A poll as the task side makes it: until there is nothing more to do. */
static void poll(void) {
    for (bool more = true; more;) {
        const uint32_t from = cycles();
        more = kind == VFD_BUS ? vfd_poll(&vfd, &hal, &bus, hal.now_us)
                               : drivers_poll(&drivers, &hal, hal.now_us, position, NULL);
        counted += cycles() - from;
        if (kind == VFD_BUS)
            answer_drive();
        else
            answer_drivers();
    }
}

/* @return it works as it should: what is counted is not a lost bus */
static bool works(void) {
    bool good = kind != VFD_BUS || vfd_is_confirmed(&vfd);
    for (unsigned n = 0; kind != VFD_BUS && n < what; n++)
        good = good && drivers.driver[n].written && drivers.driver[n].problems == 0;
    return good;
}

static int run(void) {
    begin();
    for (uint32_t second = 0; second <= seconds; second++) {
        if (second == 1)
            counted = 0; /* it has begun */
        for (uint32_t n = 0; n < SECOND_US / POLL_US; n++) {
            poll();
            hal.now_us += POLL_US;
        }
    }
    done = works() ? 1 : 2;
    return works() ? 0 : 1;
}

#if defined(__XTENSA__)
int main(void) {
    (void)run();
    for (;;)
        __asm__ volatile("");
}
#else
int main(int argc, char **argv) {
    if (argc != 4)
        return 2;
    kind = strcmp(argv[1], "vfd") == 0 ? VFD_BUS : strcmp(argv[1], "uart") == 0 ? UART_BUS : SPI_BUS;
    what = (uint32_t)atoi(argv[2]);
    seconds = (uint32_t)atoi(argv[3]);
    return run();
}
#endif
