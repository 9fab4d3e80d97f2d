/* SPDX-License-Identifier: MIT
 * Motor drivers with registers on a bus. */
#include "drivers/drivers.h"

#include <string.h>

#define UART_ANSWER_US 10000u /* a request and its answer take 1.3 ms at 115200 baud */
#define UART_WRITE_US  1500u  /* a write takes 0.7 ms, and has no answer */
#define SPI_US         5000u  /* a chain of six takes 0.3 ms at 1 MHz */
#define ANSWER_LOOK_US 1500u  /* from one look for an answer to the next */
#define SG_RESULT      0x41u  /* TMC2209: StallGuard's result */
#define STOOD_US       60000u /* a driver reports standstill 84 ms after its last step */
#define UNSEEN_MAX     4u     /* looks */
#define OPEN_MAX       16u    /* looks: it is only sure in slow motion */
#define SLOW_STEPS_S   300u   /* full steps */
#define SPI_NOTHING    0xFFFFFFFFu
#define VERSION_AT     24u

static const struct tmc_chip *chip_of(const struct drivers *drivers, unsigned n) {
    return tmc_chip(drivers->wire[n].kind);
}

void drivers_init(struct drivers *drivers, const struct driver_wire *wire, uint8_t count,
                  const struct hal_driver_bus *bus) {
    drivers->wire = wire;
    drivers->count = count < DRIVER_COUNT_MAX ? count : DRIVER_COUNT_MAX;
    drivers->bus = bus;
}

void drivers_want(struct drivers *drivers, unsigned n, const struct tmc_want *want) {
    struct driver *driver = &drivers->driver[n];
    const bool differs = memcmp(&driver->want, want, sizeof *want) != 0;
    /* An answer that is under way is that of what was wanted when it was asked for. */
    driver->waits = differs && drivers->open && drivers->now == n;
    if (!differs || driver->waits)
        return;
    driver->want = *want;
    driver->written = false;
    if ((driver->problems & DRIVER_LOST) != 0)
        return; /* it is written when it is found */
    if (driver->phase > DRIVER_RESET)
        driver->phase = DRIVER_RESET;
    driver->tries = 0;
}

void drivers_forget_reset(struct drivers *drivers, unsigned n) {
    drivers->driver[n].problems &= (uint16_t)~DRIVER_WAS_RESET;
}

static bool is_lost(const struct driver *driver) {
    return (driver->problems & DRIVER_LOST) != 0;
}

static bool is_busy(const struct driver *driver) {
    return !is_lost(driver) && driver->phase != DRIVER_WATCH;
}

/* The next request follows immediately: registers to be written, or it has answered again. */
static bool goes_on(const struct driver *driver) {
    const bool begins = is_busy(driver) && driver->lost == 0;
    return begins || (driver->phase != DRIVER_FIND && driver->phase != DRIVER_WATCH) ||
           (is_lost(driver) && driver->phase == DRIVER_WATCH);
}

bool drivers_are_busy(const struct drivers *drivers) {
    for (unsigned n = 0; n < drivers->count; n++)
        if (is_busy(&drivers->driver[n]) || drivers->driver[n].waits)
            return true;
    return false;
}

/* ---- what a driver goes through ---- */

/* What is looked at while it is watched. */
static const uint8_t looks[] = {TMC_DRV_STATUS, TMC_GSTAT,      TMC_DRV_STATUS,
                                TMC_CHOPCONF,   TMC_DRV_STATUS, SG_RESULT};

static void enter(struct driver *driver, enum driver_phase phase) {
    driver->phase = (uint8_t)phase;
    driver->at = 0;
}

static void next_look(const struct tmc_chip *chip, struct driver *driver) {
    do
        driver->at = (uint8_t)((driver->at + 1u) % sizeof looks);
    while ((looks[driver->at] == SG_RESULT && !chip->uart) ||
           (looks[driver->at] == TMC_CHOPCONF && !driver->written));
}

static uint32_t value_of(const struct drivers *drivers, unsigned n, uint8_t reg) {
    return tmc_value(chip_of(drivers, n), drivers->wire[n].sense_mohm, &drivers->driver[n].want, reg);
}

static void choose_request(struct drivers *drivers) {
    const struct driver *driver = &drivers->driver[drivers->now];
    const struct tmc_chip *chip = chip_of(drivers, drivers->now);
    static const uint8_t reads[] = {[DRIVER_RESET] = TMC_GSTAT,
                                    [DRIVER_COUNT] = TMC_IFCNT,
                                    [DRIVER_COUNTED] = TMC_IFCNT,
                                    [DRIVER_READ_BACK] = TMC_CHOPCONF};
    drivers->value = 0;
    switch ((enum driver_phase)driver->phase) {
    case DRIVER_FIND:
        drivers->reg = chip->ioin;
        break;
    case DRIVER_WRITE:
        drivers->reg = chip->writes[driver->at] | TMC_WRITE;
        drivers->value = value_of(drivers, drivers->now, chip->writes[driver->at]);
        break;
    case DRIVER_CLEAR: /* nothing else: that it was reset must be seen */
        drivers->reg = TMC_GSTAT | TMC_WRITE;
        drivers->value = TMC_GSTAT_UNDERVOLTAGE;
        break;
    case DRIVER_WATCH:
        drivers->reg = looks[driver->at];
        break;
    default:
        drivers->reg = reads[driver->phase];
        break;
    }
}

static void lose(struct drivers *drivers, struct driver *driver, enum driver_problem problem,
                 uint32_t now_us) {
    driver->retry_us = now_us;
    drivers->looked_us = now_us;
    enter(driver, DRIVER_FIND);
    if (driver->lost < DRIVER_LOST_MAX)
        driver->lost++;
    if (driver->lost < DRIVER_LOST_MAX)
        return;
    driver->problems = (uint16_t)problem; /* what else it had is not known any more */
    driver->written = false;
    driver->unseen = driver->open = driver->tries = 0;
}

/* It was written, but does not have it. */
static void write_again(struct drivers *drivers, struct driver *driver, uint32_t now_us) {
    driver->tries++;
    enter(driver, DRIVER_FIND);
    if (driver->tries < DRIVER_LOST_MAX)
        return;
    driver->lost = DRIVER_LOST_MAX;
    lose(drivers, driver, DRIVER_WRITE_LOST, now_us);
}

static void note_reset(struct driver *driver) {
    if (driver->had) {
        driver->problems |= DRIVER_WAS_RESET;
        driver->resets = (uint8_t)(driver->resets < UINT8_MAX ? driver->resets + 1 : UINT8_MAX);
    }
    driver->written = driver->had = false;
}

static void watch(struct driver *driver) {
    enter(driver, DRIVER_WATCH);
    driver->tries = 0;
}

static void take_gstat(const struct tmc_chip *chip, struct driver *driver, uint32_t gstat) {
    const bool reset = (gstat & TMC_GSTAT_RESET) != 0;
    if (reset)
        note_reset(driver);
    if ((gstat & TMC_GSTAT_UNDERVOLTAGE) != 0 && !reset) /* at power-on it is normal */
        driver->problems |= DRIVER_UNDERVOLTAGE;
    else
        driver->problems &= (uint16_t)~DRIVER_UNDERVOLTAGE;
    if (driver->want.current_ma != 0 && !driver->written)
        enter(driver, chip->uart ? DRIVER_COUNT : DRIVER_WRITE);
    else if (driver->phase == DRIVER_WATCH && (gstat & TMC_GSTAT_UNDERVOLTAGE) != 0 && chip->latches)
        enter(driver, DRIVER_CLEAR);
    else if (driver->phase == DRIVER_WATCH)
        next_look(chip, driver);
    else
        watch(driver);
}

static void set_problem(struct driver *driver, enum driver_problem problem, bool on) {
    driver->problems = (uint16_t)((driver->problems & ~(unsigned)problem) | (on ? (unsigned)problem : 0u));
}

static uint8_t counted(bool on, uint8_t count, unsigned most) {
    return on ? (uint8_t)(count < most ? count + 1u : most) : 0;
}

/* Only now it is there: its version and its resets alone may be read from two with one address. */
static void take_status(const struct drivers *drivers, struct driver *driver, uint32_t word) {
    const struct tmc_chip *chip = chip_of(drivers, drivers->now);
    const struct tmc_status status = tmc_status_of(chip, word);
    /* A bit that is wrong on its way by SPI is not noticed: what is seen twice is a fault. */
    const struct tmc_status sure = chip->uart ? status : tmc_status_of(chip, word & driver->word);
    driver->word = word;
    driver->problems &= (uint16_t)~DRIVER_LOST;
    driver->lost = 0;
    driver->found = true;
    driver->status = status;
    if (!chip->uart)
        driver->load = status.stall;
    set_problem(driver, DRIVER_SHORT, sure.shorted);
    set_problem(driver, DRIVER_SHUT_DOWN, sure.shut_down);
    set_problem(driver, DRIVER_HOT, sure.hot && !sure.shut_down);
    if (!drivers->moved)
        return;
    driver->unseen = counted(status.stands, driver->unseen, UNSEEN_MAX);
    set_problem(driver, DRIVER_OTHER_STEPS, driver->unseen == UNSEEN_MAX);
    if (!drivers->slow)
        return;
    driver->open = counted(status.open_load && driver->written, driver->open, OPEN_MAX);
    set_problem(driver, DRIVER_OPEN, driver->open == OPEN_MAX);
}

/* Steps since the last look, and that was so short ago that a driver cannot have forgotten them. Before it is
 * asked: a step that comes between its answer and the look at the position is none that it has not seen. */
static void note_motion(struct drivers *drivers, uint32_t now_us, const int32_t steps[AXIS_COUNT]) {
    struct driver *driver = &drivers->driver[drivers->now];
    const int32_t at = steps[drivers->wire[drivers->now].axis];
    const uint32_t past_us = now_us - driver->steps_us;
    const uint32_t way =
        at > driver->steps ? (uint32_t)at - (uint32_t)driver->steps : (uint32_t)driver->steps - (uint32_t)at;
    drivers->moved = way != 0 && past_us <= STOOD_US && !drivers->squares;
    drivers->slow = (uint64_t)way * 1000000u <= (uint64_t)past_us * SLOW_STEPS_S * driver->want.microsteps;
    driver->steps = at;
    driver->steps_us = now_us;
}

static void take_look(const struct drivers *drivers, struct driver *driver, uint32_t value) {
    const struct tmc_chip *chip = chip_of(drivers, drivers->now);
    const uint8_t reg = looks[driver->at];
    if (reg == TMC_GSTAT) {
        take_gstat(chip, driver, value);
        return;
    }
    const bool differs = reg == TMC_CHOPCONF && value != value_of(drivers, drivers->now, reg);
    const bool again = differs && !chip->uart && !driver->doubted; /* by SPI it is looked at twice */
    if (reg == TMC_CHOPCONF)
        driver->doubted = again;
    if (again)
        return;
    if (differs) {
        note_reset(driver);
        enter(driver, DRIVER_FIND);
        return;
    }
    if (reg == SG_RESULT)
        driver->load = (uint16_t)(value & 0x3FFu);
    if (reg == TMC_DRV_STATUS)
        take_status(drivers, driver, value);
    next_look(chip, driver);
}

static void take_write(struct drivers *drivers, struct driver *driver, uint32_t echo, uint32_t now_us) {
    const struct tmc_chip *chip = chip_of(drivers, drivers->now);
    if (!chip->uart && echo != drivers->value) {
        write_again(drivers, driver, now_us);
        return;
    }
    driver->at++;
    if (driver->at == chip->write_count)
        enter(driver, chip->uart ? DRIVER_COUNTED : DRIVER_READ_BACK);
}

static void find(struct drivers *drivers, struct driver *driver, uint32_t value, uint32_t now_us) {
    const struct tmc_chip *chip = chip_of(drivers, drivers->now);
    const bool nothing = !chip->uart && (value == 0 || value == SPI_NOTHING);
    if (nothing) {
        lose(drivers, driver, DRIVER_SILENT, now_us);
    } else if ((value >> VERSION_AT & 0xFFu) != chip->version) {
        lose(drivers, driver, DRIVER_OTHER_CHIP, now_us);
    } else {
        enter(driver, DRIVER_RESET);
    }
}

static void take_answer(struct drivers *drivers, uint32_t value, uint32_t now_us) {
    struct driver *driver = &drivers->driver[drivers->now];
    const struct tmc_chip *chip = chip_of(drivers, drivers->now);
    switch ((enum driver_phase)driver->phase) {
    case DRIVER_FIND:
        find(drivers, driver, value, now_us);
        break;
    case DRIVER_RESET:
        take_gstat(chip, driver, value);
        break;
    case DRIVER_COUNT:
        driver->count = (uint8_t)value;
        enter(driver, DRIVER_WRITE);
        break;
    case DRIVER_WRITE:
        take_write(drivers, driver, value, now_us);
        break;
    case DRIVER_COUNTED:
        if ((uint8_t)(value - driver->count) == chip->write_count)
            enter(driver, DRIVER_READ_BACK);
        else
            write_again(drivers, driver, now_us);
        break;
    case DRIVER_READ_BACK:
        driver->written = value == value_of(drivers, drivers->now, TMC_CHOPCONF);
        driver->had |= driver->written;
        if (driver->written)
            watch(driver);
        else
            write_again(drivers, driver, now_us);
        break;
    case DRIVER_WATCH:
        take_look(drivers, driver, value);
        break;
    case DRIVER_CLEAR:
        watch(driver);
        break;
    }
}

/* ---- the bus ---- */

static void send(struct drivers *drivers, struct hal *hal, uint32_t now_us) {
    const struct driver_wire *wire = &drivers->wire[drivers->now];
    uint8_t *bytes = drivers->sent;
    size_t count;
    if (!chip_of(drivers, drivers->now)->uart)
        count = tmc_spi_frame(bytes, wire->chain, wire->address, drivers->second ? TMC_GCONF : drivers->reg,
                              drivers->second ? 0 : drivers->value);
    else if ((drivers->reg & TMC_WRITE) != 0)
        count = tmc_uart_write(bytes, wire->address, drivers->reg & (uint8_t)~TMC_WRITE, drivers->value);
    else
        count = tmc_uart_read(bytes, wire->address, drivers->reg);
    drivers->sent_count = (uint8_t)count;
    drivers->received_count = 0;
    drivers->open = true;
    drivers->from_us = now_us;
    drivers->bus->send(hal, wire->select, bytes, count);
}

static void receive(struct drivers *drivers, struct hal *hal) {
    const size_t room = sizeof drivers->received - drivers->received_count;
    if (room > 0)
        drivers->received_count =
            (uint8_t)(drivers->received_count +
                      drivers->bus->receive(hal, drivers->received + drivers->received_count, room));
}

static enum driver_problem why_lost(const struct drivers *drivers) {
    if (!chip_of(drivers, drivers->now)->uart)
        return DRIVER_SILENT;
    if (drivers->received_count == 0)
        return DRIVER_MUTE;
    return tmc_uart_is_noisy(drivers->received, drivers->received_count, drivers->sent, drivers->sent_count)
               ? DRIVER_GARBLED
               : DRIVER_SILENT;
}

enum outcome { WAITS, ANSWERED, FAILED };

static enum outcome look_uart(const struct drivers *drivers, uint32_t now_us, uint32_t *value) {
    const uint32_t past_us = now_us - drivers->from_us;
    if ((drivers->reg & TMC_WRITE) != 0)
        return past_us >= UART_WRITE_US ? ANSWERED : WAITS;
    if (tmc_uart_answer(drivers->received, drivers->received_count, drivers->reg, value))
        return ANSWERED;
    return past_us >= UART_ANSWER_US ? FAILED : WAITS;
}

static enum outcome look_spi(struct drivers *drivers, struct hal *hal, uint32_t now_us, uint32_t *value) {
    const struct driver_wire *wire = &drivers->wire[drivers->now];
    uint8_t status;
    if (drivers->received_count < drivers->sent_count)
        return now_us - drivers->from_us >= SPI_US ? FAILED : WAITS;
    if (!drivers->second) {
        drivers->second = true;
        send(drivers, hal, now_us);
        return WAITS;
    }
    *value = tmc_spi_value(drivers->received, wire->chain, wire->address, &status);
    const bool nothing = (*value == 0 && status == 0) || (*value == SPI_NOTHING && status == UINT8_MAX);
    /* In motion GSTAT and the status of a sound driver are all zeros. */
    const bool is_sure =
        drivers->driver[drivers->now].phase == DRIVER_WATCH && (drivers->reg != TMC_GSTAT || *value != 0);
    return nothing && is_sure ? FAILED : ANSWERED;
}

/* Who is next: a driver that is being written continues, a lost one is tried from time to time. */
static bool choose(struct drivers *drivers, uint32_t now_us) {
    const struct driver *driver = &drivers->driver[drivers->now];
    if (goes_on(driver))
        return true;
    if (now_us - drivers->looked_us < DRIVER_POLL_US)
        return false;
    for (unsigned n = 1; n <= drivers->count; n++) {
        const unsigned next = (drivers->now + n) % drivers->count;
        driver = &drivers->driver[next];
        if (is_lost(driver) && now_us - driver->retry_us < DRIVER_RETRY_US)
            continue;
        drivers->now = (uint8_t)next;
        drivers->looked_us = now_us;
        return true;
    }
    return false;
}

static void close(struct drivers *drivers, enum outcome outcome, uint32_t value, uint32_t now_us) {
    drivers->open = drivers->second = false;
    if (outcome == FAILED)
        lose(drivers, &drivers->driver[drivers->now], why_lost(drivers), now_us);
    else
        take_answer(drivers, value, now_us);
}

bool drivers_poll(struct drivers *drivers, struct hal *hal, uint32_t now_us, drivers_position *position,
                  const void *ctx) {
    uint32_t value = 0;
    if (drivers->count == 0)
        return false;
    if (!drivers->open) {
        if (!choose(drivers, now_us))
            return false;
        int32_t steps[AXIS_COUNT] = {0};
        choose_request(drivers);
        position(ctx, steps);
        note_motion(drivers, now_us, steps);
        send(drivers, hal, now_us);
        return true;
    }
    receive(drivers, hal);
    const bool uart = chip_of(drivers, drivers->now)->uart;
    const enum outcome outcome =
        uart ? look_uart(drivers, now_us, &value) : look_spi(drivers, hal, now_us, &value);
    if (outcome == WAITS)
        return false;
    close(drivers, outcome, value, now_us);
    return true;
}

static uint32_t left_us(uint32_t from_us, uint32_t us, uint32_t now_us) {
    return now_us - from_us < us ? us - (now_us - from_us) : 0;
}

uint32_t drivers_wait_us(const struct drivers *drivers, uint32_t now_us) {
    if (drivers->count == 0)
        return UINT32_MAX;
    if (drivers->open)
        return ANSWER_LOOK_US;
    const struct driver *driver = &drivers->driver[drivers->now];
    if (goes_on(driver))
        return 0;
    uint32_t least_us = UINT32_MAX;
    for (unsigned n = 0; n < drivers->count; n++) {
        driver = &drivers->driver[n];
        const uint32_t retry_us = left_us(driver->retry_us, DRIVER_RETRY_US, now_us);
        const uint32_t us = is_lost(driver) ? retry_us : 0;
        least_us = us < least_us ? us : least_us;
    }
    const uint32_t poll_us = left_us(drivers->looked_us, DRIVER_POLL_US, now_us);
    return least_us > poll_us ? least_us : poll_us;
}
