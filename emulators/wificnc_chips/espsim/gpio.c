/* SPDX-License-Identifier: MIT
 * GPIO registers and the matrix behind them: a pin is driven by its GPIO register or by a signal of another
 * peripheral, with its inversion. Each change of an output pin is recorded with its cycle. */
#include "esp.h"

#include <string.h>

enum {
    OUT = 0x04, /* OUT, OUT_W1TS, OUT_W1TC of bank 0, then of bank 1 */
    OUT_END = 0x1C,
    ENABLE = 0x20, /* ENABLE, ENABLE_W1TS, ENABLE_W1TC of bank 0, then of bank 1 */
    ENABLE_END = 0x38,
    STRAP = 0x38,
    IN = 0x3C,
    IN1 = 0x40,
    STATUS = 0x44, /* STATUS, STATUS_W1TS, STATUS_W1TC of bank 0, then of bank 1 */
    STATUS_END = 0x5C,
    BLOCK_SIZE = 0x640,
};
enum {
    SIGNAL_GPIO = 256,
    SIGNAL_MASK = 0x1FF,
    FLASH_SIGNALS = 6,
    ROUTE_INVERTS = 1 << 9,
    ROUTE_ENABLES = 1 << 10, /* GPIO_ENABLE lets the pin out, not the peripheral */
    INPUT_PIN = 0x3F,
    INPUT_INVERTS = 1 << 6,
    STRAP_FLASH = 0x13
};

static const unsigned interrupt_source[2] = {22, 16};

static uint32_t pins_at(const struct esp *esp) {
    return esp->chip == ES_ESP32 ? 0x88 : 0x74;
}

static uint32_t inputs_at(const struct esp *esp) {
    return esp->chip == ES_ESP32 ? 0x130 : 0x154;
}

static uint32_t outputs_at(const struct esp *esp) {
    return esp->chip == ES_ESP32 ? 0x530 : 0x554;
}

/* PCPU_INT of bank 0; that of bank 1 lies `bank1_behind` after it. ACPU_INT lies before it, on the ESP32
 * alone. */
static uint32_t asking_at(const struct esp *esp, unsigned core) {
    return esp->chip == ES_ESP32S3 ? 0x5C : core == 0 ? 0x68 : 0x60;
}

static uint32_t bank1_behind(const struct esp *esp) {
    return esp->chip == ES_ESP32 ? 0x14 : 0x0C;
}

/* GPIO_PINn.INT_ENA: the bit of a core's interrupt. The S3's matrices choose the core. */
static uint32_t enabled_for(const struct esp *esp, unsigned core) {
    return esp->chip == ES_ESP32S3 || core == 1 ? 1u << 13 : 1u << 15;
}

static unsigned pins_of(const struct esp *esp) {
    return esp->chip == ES_ESP32 ? 40 : 49;
}

/* ---- levels ---- */

void gpio_record(struct esp *esp, uint64_t cycle, unsigned pin, bool level) {
    if (!esp->record_edges ||
        !chip_grow(&esp->edges, &esp->edge_room, esp->edge_count + 1, sizeof *esp->edges))
        return;
    esp->edges[esp->edge_count++] =
        (struct es_edge){.cycle = cycle, .pin = (uint8_t)pin, .level = (uint8_t)level};
}

/* Pins that are outputs: by GPIO_ENABLE, or by a peripheral, whose output is always on. */
static uint32_t outputs_of(const struct gpio *gpio, unsigned bank) {
    return gpio->enable[bank] | gpio->lets_out[bank];
}

/* The signal of a peripheral that is not emulated is low. */
static uint32_t level_of(const struct gpio *gpio, unsigned bank) {
    const uint32_t driven =
        (gpio->drive[bank] & gpio->driven[bank]) | (gpio->pulls[bank] & ~gpio->driven[bank]);
    const uint32_t own = gpio->out[bank] & ~gpio->foreign[bank];
    const uint32_t out = (own | (gpio->signal[bank] & gpio->foreign[bank])) ^ gpio->inverts[bank];
    const uint32_t outputs = outputs_of(gpio, bank);
    return (out & outputs) | (driven & ~outputs);
}

/* ---- interrupts ---- */

enum { RISING = 1, FALLING = 2, EDGES = 3, LOW = 4, HIGH = 5 };

/* @return whether the pin has what its GPIO_PINn.INT_TYPE is for */
static bool is_met(uint32_t type, bool level, bool has_changed) {
    switch (type) {
    case RISING:
        return has_changed && level;
    case FALLING:
        return has_changed && !level;
    case EDGES:
        return has_changed;
    case LOW:
        return !level;
    case HIGH:
        return level;
    default:
        return false;
    }
}

static uint32_t asking(const struct esp *esp, unsigned core, unsigned bank) {
    uint32_t enabled = 0;
    for (unsigned bit = 0; bit < 32; bit++)
        if ((esp->gpio.pin[32 * bank + bit] & enabled_for(esp, core)) != 0)
            enabled |= 1u << bit;
    return esp->gpio.status[bank] & enabled;
}

static void notice(struct esp *esp, unsigned bank, uint32_t changed) {
    struct gpio *gpio = &esp->gpio;
    for (unsigned bit = 0; bit < 32; bit++) {
        const uint32_t type = gpio->pin[32 * bank + bit] >> 7 & 7;
        if (type != 0 && is_met(type, (gpio->level[bank] >> bit & 1) != 0, (changed >> bit & 1) != 0))
            gpio->status[bank] |= 1u << bit;
    }
    for (unsigned core = 0; core < CORES; core++)
        matrix_set_core(esp, core, interrupt_source[esp->chip],
                        (asking(esp, core, 0) | asking(esp, core, 1)) != 0);
}

static void record_changes(struct esp *esp, uint64_t cycle, unsigned bank, uint32_t pins) {
    for (uint32_t left = pins; left != 0; left &= left - 1) {
        const unsigned bit = (unsigned)__builtin_ctz(left);
        gpio_record(esp, cycle, 32 * bank + bit, (esp->gpio.level[bank] >> bit & 1) != 0);
    }
}

static void update_at(struct esp *esp, uint64_t cycle, unsigned bank) {
    struct gpio *gpio = &esp->gpio;
    const uint32_t now = level_of(gpio, bank), changed = now ^ gpio->level[bank];
    gpio->level[bank] = now;
    if (gpio->watched)
        notice(esp, bank, changed);
    record_changes(esp, cycle, bank, changed & outputs_of(gpio, bank));
    if ((changed & gpio->listened[bank]) != 0) {
        pcnt_pins(esp, cycle);
        shift_pins(esp, cycle, bank, changed);
    }
}

static void update(struct esp *esp, unsigned bank) {
    update_at(esp, esp->cycles, bank);
}

/* ---- signals of other peripherals ---- */

void gpio_has_signals(struct esp *esp, unsigned first, unsigned count) {
    for (unsigned signal = first; signal < first + count; signal++)
        esp->gpio.emulated[signal / 32] |= 1u << signal % 32;
}

static bool is_emulated(const struct esp *esp, unsigned signal) {
    return signal < SIGNALS && (esp->gpio.emulated[signal / 32] >> signal % 32 & 1) != 0;
}

static void show_signal(struct gpio *gpio, unsigned pin, bool level) {
    const uint32_t bit = 1u << pin % 32;
    gpio->signal[pin / 32] = level ? gpio->signal[pin / 32] | bit : gpio->signal[pin / 32] & ~bit;
}

void gpio_signal(struct esp *esp, uint64_t cycle, unsigned signal, bool level) {
    struct gpio *gpio = &esp->gpio;
    gpio->high[signal / 32] =
        level ? gpio->high[signal / 32] | 1u << signal % 32 : gpio->high[signal / 32] & ~(1u << signal % 32);
    for (uint64_t left = gpio->pins_of[signal]; left != 0; left &= left - 1)
        show_signal(gpio, (unsigned)__builtin_ctzll(left), level);
    for (unsigned bank = 0; bank < 2; bank++)
        if ((gpio->pins_of[signal] >> 32 * bank & UINT32_MAX) != 0)
            update_at(esp, cycle, bank);
}

bool gpio_is_routed(const struct esp *esp, unsigned pin, unsigned signal) {
    return (esp->gpio.pins_of[signal] >> pin & 1) != 0;
}

/* FUNCn_IN_SEL: the pin, or one of two numbers that are no pin: always low, always high. */
bool gpio_input(const struct esp *esp, unsigned signal) {
    const uint32_t value = esp->gpio.input[signal], pin = value & INPUT_PIN;
    const uint32_t low = esp->chip == ES_ESP32 ? 0x30 : 0x3C;
    const bool level = pin == 0x38 || (pin != low && (esp->gpio.level[pin / 32] >> pin % 32 & 1) != 0);
    return level != ((value & INPUT_INVERTS) != 0);
}

void gpio_listen(struct esp *esp, unsigned pin) {
    esp->gpio.listened[pin / 32 & 1] |= 1u << pin % 32;
}

/* ---- registers ---- */

/* Three registers a bank: the word, bits to set, bits to clear. @param at  from the first of bank 0 */
static unsigned set_or_clear(uint32_t word[2], uint32_t at, uint32_t value) {
    const unsigned bank = at / 12;
    if (at % 12 == 0)
        word[bank] = value;
    else if (at % 12 == 4)
        word[bank] |= value;
    else
        word[bank] &= ~value;
    return bank;
}

/* Firmware in flash sets up all that its board has; a bare program uses what it sets up. */
static void check_signal(struct esp *esp, unsigned pin, unsigned signal) {
    if (signal < FLASH_SIGNALS || signal == SIGNAL_GPIO || is_emulated(esp, signal))
        return; /* the first ones are the flash chip's own wires */
    if (esp->flash.size != 0)
        chip_note(esp, "GPIO %u is routed to the signal %u, which is not emulated: it stays low", pin,
                  signal);
    else
        chip_fault(esp, "GPIO %u is routed to the signal %u, which is not emulated", pin, signal);
}

static void set_bit(uint32_t *word, uint32_t bit, bool on) {
    *word = on ? *word | bit : *word & ~bit;
}

static void route(struct esp *esp, unsigned pin, uint32_t value) {
    struct gpio *gpio = &esp->gpio;
    const uint32_t bit = 1u << pin % 32, bank = pin / 32, before = gpio->routed[pin] & SIGNAL_MASK;
    const unsigned signal = value & SIGNAL_MASK;
    shift_sync(esp);
    check_signal(esp, pin, signal);
    if (before < SIGNALS)
        gpio->pins_of[before] &= ~(1ull << pin);
    if (signal < SIGNALS) {
        gpio->pins_of[signal] |= 1ull << pin;
        show_signal(gpio, pin, (gpio->high[signal / 32] >> signal % 32 & 1) != 0);
    }
    gpio->routed[pin] = value;
    set_bit(&gpio->inverts[bank], bit, (value & ROUTE_INVERTS) != 0);
    set_bit(&gpio->foreign[bank], bit, signal != SIGNAL_GPIO);
    set_bit(&gpio->lets_out[bank], bit, is_emulated(esp, signal) && (value & ROUTE_ENABLES) == 0);
    update(esp, bank);
}

/* What listens takes the new pin's level. */
static void route_input(struct esp *esp, unsigned signal, uint32_t value) {
    esp->gpio.input[signal] = value;
    pcnt_routed(esp, signal);
}

static void store(struct esp *esp, uint32_t offset, uint32_t value) {
    struct gpio *gpio = &esp->gpio;
    const uint32_t pins = pins_at(esp), inputs = inputs_at(esp), outputs = outputs_at(esp),
                   count = pins_of(esp);
    if (offset >= OUT && offset < OUT_END)
        update(esp, set_or_clear(gpio->out, offset - OUT, value));
    else if (offset >= ENABLE && offset < ENABLE_END)
        update(esp, set_or_clear(gpio->enable, offset - ENABLE, value));
    else if (offset >= STATUS && offset < STATUS_END)
        notice(esp, set_or_clear(gpio->status, offset - STATUS, value), 0);
    else if (offset - pins < 4 * count) {
        gpio->pin[(offset - pins) / 4] = value;
        gpio->watched |= (value >> 7 & 7) != 0;
        notice(esp, (offset - pins) / 4 / 32, 0);
    } else if (offset - inputs < 4 * 256)
        route_input(esp, (offset - inputs) / 4, value);
    else if (offset - outputs < 4 * count)
        route(esp, (offset - outputs) / 4, value);
    else
        chip_fault(esp, "the GPIO register %03x is not emulated", offset);
}

static uint32_t load(struct esp *esp, uint32_t offset) {
    const struct gpio *gpio = &esp->gpio;
    const uint32_t pins = pins_at(esp), inputs = inputs_at(esp), outputs = outputs_at(esp),
                   count = pins_of(esp);
    if (offset >= OUT && offset < OUT_END)
        return (offset - OUT) % 12 == 0 ? gpio->out[(offset - OUT) / 12] : 0;
    if (offset >= ENABLE && offset < ENABLE_END)
        return (offset - ENABLE) % 12 == 0 ? gpio->enable[(offset - ENABLE) / 12] : 0;
    if (offset >= STATUS && offset < STATUS_END)
        return (offset - STATUS) % 12 == 0 ? gpio->status[(offset - STATUS) / 12] : 0;
    if (offset == IN || offset == IN1)
        return gpio->level[(offset - IN) / 4];
    for (unsigned i = 0; i < 2 * CORES; i++)
        if (offset == asking_at(esp, i / 2) + i % 2 * bank1_behind(esp))
            return asking(esp, i / 2, i % 2);
    if (offset == STRAP)
        return STRAP_FLASH;
    if (offset - pins < 4 * count)
        return gpio->pin[(offset - pins) / 4];
    if (offset - inputs < 4 * 256)
        return gpio->input[(offset - inputs) / 4];
    if (offset - outputs < 4 * count)
        return gpio->routed[(offset - outputs) / 4];
    chip_fault(esp, "the GPIO register %03x is not emulated", offset);
    return 0;
}

/* Pins become inputs; what drives them from outside stays. */
void gpio_create(struct esp *esp) {
    struct gpio *gpio = &esp->gpio;
    const struct gpio before = *gpio;
    bus_add(esp, &(struct block){"GPIO", esp->chip == ES_ESP32 ? 0x3FF44000 : 0x60004000, BLOCK_SIZE, load,
                                 store, NULL});
    if (chip_keeps_outputs(esp))
        return;
    memset(gpio, 0, sizeof *gpio);
    memcpy(gpio->driven, before.driven, sizeof gpio->driven);
    memcpy(gpio->drive, before.drive, sizeof gpio->drive);
    for (unsigned pin = 0; pin < ES_PINS; pin++)
        gpio->routed[pin] = SIGNAL_GPIO;
    for (unsigned bank = 0; bank < 2; bank++) {
        gpio->level[bank] = level_of(gpio, bank);
        gpio->listened[bank] = before.listened[bank];
        record_changes(esp, esp->cycles, bank,
                       (gpio->level[bank] ^ before.level[bank]) & outputs_of(&before, bank));
    }
}

/* ---- pull-ups: IO_MUX, and of the ESP32's RTC pins, RTC_IO ---- */

enum { PULL_UP = 1 << 8, IO_MUX_WORDS = 64, NO_PIN = 255 };

/* Pins of the ESP32's IO_MUX registers, from offset 0 on. */
static const uint8_t pin_of_esp32[] = {NO_PIN, 36, 37, 38, 39, 34, 35, 32, 33, 25, 26, 27, 14,
                                       12,     13, 15, 2,  0,  4,  16, 17, 9,  10, 11, 6,  7,
                                       8,      5,  18, 19, 20, 21, 22, 3,  1,  23, 24};

/* RTC_IO: the bit that pulls each of its pins up. */
static const struct {
    uint8_t pin, offset, bit;
} rtc_pulls[] = {{25, 0x84, 27}, {26, 0x88, 27}, {33, 0x8C, 27}, {32, 0x8C, 22},
                 {4, 0x94, 27},  {0, 0x98, 27},  {2, 0x9C, 27},  {15, 0xA0, 27},
                 {13, 0xA4, 27}, {12, 0xA8, 27}, {14, 0xAC, 27}, {27, 0xB0, 27}};
enum { RTC_IO = 0x400 }; /* from RTC_CNTL */

static unsigned pin_of(const struct esp *esp, uint32_t word) {
    if (esp->chip == ES_ESP32S3)
        return word == 0 || word > pins_of(esp) ? NO_PIN : word - 1;
    return word < sizeof pin_of_esp32 ? pin_of_esp32[word] : NO_PIN;
}

static void pull(struct gpio *gpio, unsigned pin, bool up) {
    const uint32_t bit = 1u << pin % 32;
    gpio->pulls[pin / 32] = up ? gpio->pulls[pin / 32] | bit : gpio->pulls[pin / 32] & ~bit;
}

/* On the ESP32 a pin that RTC_IO has is pulled by it alone. */
void gpio_pulls(struct esp *esp) {
    struct gpio *gpio = &esp->gpio;
    for (uint32_t word = 0; word < IO_MUX_WORDS; word++)
        if (pin_of(esp, word) != NO_PIN)
            pull(gpio, pin_of(esp, word), (gpio->io_mux[word] & PULL_UP) != 0);
    for (unsigned i = 0; i < sizeof rtc_pulls / sizeof *rtc_pulls && esp->chip == ES_ESP32; i++)
        pull(gpio, rtc_pulls[i].pin,
             (esp->rtc[(RTC_IO + rtc_pulls[i].offset) / 4] >> rtc_pulls[i].bit & 1) != 0);
    for (unsigned bank = 0; bank < 2; bank++)
        update(esp, bank);
}

static uint32_t mux_load(struct esp *esp, uint32_t offset) {
    return esp->gpio.io_mux[offset / 4];
}

static void mux_store(struct esp *esp, uint32_t offset, uint32_t value) {
    esp->gpio.io_mux[offset / 4] = value;
    gpio_pulls(esp);
}

void io_mux_create(struct esp *esp) {
    bus_add(esp, &(struct block){"IO_MUX", esp->chip == ES_ESP32 ? 0x3FF49000 : 0x60009000, 4 * IO_MUX_WORDS,
                                 mux_load, mux_store, NULL});
}

/* ---- from outside ---- */

void es_pin_drive(struct esp *esp, unsigned pin, int level) {
    struct gpio *gpio = &esp->gpio;
    const uint32_t bit = 1u << pin % 32;
    const unsigned bank = pin / 32 & 1;
    gpio->driven[bank] = level < 0 ? gpio->driven[bank] & ~bit : gpio->driven[bank] | bit;
    gpio->drive[bank] = level > 0 ? gpio->drive[bank] | bit : gpio->drive[bank] & ~bit;
    update(esp, bank);
}

int es_pin_level(const struct esp *esp, unsigned pin) {
    return (int)(esp->gpio.level[pin / 32 & 1] >> pin % 32 & 1);
}

void es_record_edges(struct esp *esp, bool on) {
    esp->record_edges = on;
}

size_t es_edges(struct esp *esp, struct es_edge *out, size_t room) {
    const size_t count = esp->edge_count < room ? esp->edge_count : room;
    memcpy(out, esp->edges, count * sizeof *out);
    memmove(esp->edges, esp->edges + count, (esp->edge_count - count) * sizeof *out);
    esp->edge_count -= count;
    return count;
}
