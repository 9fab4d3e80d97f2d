/* SPDX-License-Identifier: MIT
 * SPI2 and SPI3 of the ESP32 as masters: user commands of command, address, dummy and data, by the buffer's
 * words or by lists of DMA, each in its time (technical reference manual, chapter SPI). Their select lines
 * have edges; clock and data have none. All on one line, most significant bit first. The slave, and bits
 * that are no whole bytes, are not emulated. */
#include "esp.h"

#include <string.h>

enum {
    CMD = 0x00,
    ADDRESS = 0x04,
    CTRL = 0x08,
    CLOCK = 0x18,
    USER = 0x1C,
    USER1 = 0x20,
    USER2 = 0x24,
    OUT_BITS = 0x28,
    IN_BITS = 0x2C,
    PIN = 0x34,
    SLAVE = 0x38,
    BUFFER = 0x80,
    BUFFER_END = 0xC0,
    DMA = 0x100,
    OUT_LINK = 0x104,
    IN_LINK = 0x108,
    DMA_RAW = 0x114,
    DMA_CLEAR = 0x11C,
    DMA_END = 0x150,
};
enum { CMD_USER = 1 << 18, DONE = 1 << 4, DONE_ENABLED = 1 << 9, SLAVE_MODE = 1 << 30, LSB_FIRST = 3 << 25 };
enum { DUPLEX = 1 << 0, WIDE = 0xF << 12 | 1 << 16, OUT_HIGH = 1 << 25, IN_HIGH = 1 << 24 };
enum { HAS_OUT = 27, HAS_IN = 28, HAS_DUMMY = 29, HAS_ADDRESS = 30, HAS_COMMAND = 31 };
enum { LINK_ADDRESS = 0xFFFFF, LINK_STOP = 1 << 28, LINK_START = 3 << 29, DMA_RESETS = 0x3C };
#define LINK_BASE   0x3FF00000u
#define WHOLE_SPEED (1u << 31)
enum { EVENTS_IN = 1 << 3 | 1 << 5, EVENTS_OUT = 1 << 6 | 1 << 7 | 1 << 8, LIST_MAX = 64, SELECTS = 3 };
#define LIST_LAST (1u << 30)

static const struct {
    uint32_t base;
    unsigned source;
    uint8_t clock, miso, mosi, select[SELECTS];
} hosts[SPI_HOSTS] = {
    {0x3FF64000, 30, 8, 9, 10, {11, 61, 62}},
    {0x3FF65000, 31, 63, 64, 65, {68, 69, 70}},
};

static uint32_t *at(struct spi_host *spi, uint32_t offset) {
    return &spi->word[offset / 4];
}

static bool has(const struct spi_host *spi, unsigned bit) {
    return (spi->word[USER / 4] >> bit & 1) != 0;
}

/* ---- lists of DMA: size and length, the buffer, the next ---- */

static uint32_t word_of(const struct esp *esp, uint32_t address) {
    uint32_t word = 0;
    const uint8_t *bytes = bus_bytes(esp, address, 4);
    if (bytes != NULL)
        memcpy(&word, bytes, 4);
    return word;
}

/* @return bytes moved; what the list has no room for is lost, as on the chip */
static size_t walk(struct esp *esp, uint32_t link, uint8_t *bytes, size_t count, bool out) {
    size_t moved = 0;
    for (unsigned n = 0; link != 0 && moved < count && n < LIST_MAX; n++) {
        const uint32_t head = word_of(esp, link), buffer = word_of(esp, link + 4);
        const size_t room = out ? head >> 12 & 0xFFF : head & 0xFFF;
        const size_t size = room < count - moved ? room : count - moved;
        uint8_t *memory = bus_bytes(esp, buffer, size == 0 ? 1 : size);
        if (memory == NULL) {
            chip_fault(esp, "DMA of SPI to %zu bytes at %08x, where there is no memory", size, buffer);
            return moved;
        }
        memcpy(out ? bytes + moved : memory, out ? memory : bytes + moved, size);
        moved += size;
        if (out && (head & LIST_LAST) != 0)
            break;
        link = word_of(esp, link + 8);
    }
    return moved;
}

/* ---- transactions ---- */

static bool is_selected(const struct spi_host *spi, unsigned select) {
    return (spi->word[PIN / 4] >> select & 1) == 0;
}

static void select_lines(struct esp *esp, unsigned number, bool works) {
    const struct spi_host *spi = &esp->spi_host[number];
    for (unsigned select = 0; select < SELECTS; select++) {
        const bool high_active = (spi->word[PIN / 4] >> (6 + select) & 1) != 0;
        gpio_signal(esp, esp->cycles, hosts[number].select[select],
                    (works && is_selected(spi, select)) == high_active);
    }
}

static uint32_t clock_cycles(const struct spi_host *spi) {
    const uint32_t clock = spi->word[CLOCK / 4];
    return (clock & WHOLE_SPEED) != 0 ? 3 : 3 * ((clock >> 18 & 0x1FFF) + 1) * ((clock >> 12 & 63) + 1);
}

static uint32_t command_bits(const struct spi_host *spi) {
    return has(spi, HAS_COMMAND) ? (spi->word[USER2 / 4] >> 28) + 1 : 0;
}

static uint32_t address_bits(const struct spi_host *spi) {
    return has(spi, HAS_ADDRESS) ? (spi->word[USER1 / 4] >> 26) + 1 : 0;
}

static uint32_t out_bits(const struct spi_host *spi) {
    return has(spi, HAS_OUT) ? (spi->word[OUT_BITS / 4] & 0xFFFFFF) + 1 : 0;
}

static uint32_t in_bits(const struct spi_host *spi) {
    return has(spi, HAS_IN) ? (spi->word[IN_BITS / 4] & 0xFFFFFF) + 1 : 0;
}

static uint32_t data_bits(const struct spi_host *spi) {
    const uint32_t out = out_bits(spi), in = in_bits(spi);
    if ((spi->word[USER / 4] & DUPLEX) != 0)
        return out > in ? out : in;
    return out + in;
}

static bool can_do(struct esp *esp, unsigned number) {
    const struct spi_host *spi = &esp->spi_host[number];
    const uint32_t bits = command_bits(spi) | address_bits(spi) | out_bits(spi) | in_bits(spi);
    if ((bits & 7) == 0 && (spi->word[USER / 4] & WIDE) == 0 && (spi->word[SLAVE / 4] & SLAVE_MODE) == 0 &&
        (spi->word[CTRL / 4] & LSB_FIRST) == 0 && data_bits(spi) / 8 + 8 <= SPI_BYTES_MAX)
        return true;
    chip_fault(esp, "a transaction of SPI%u with CTRL %08x, USER %08x, %u bits is not emulated", number + 2,
               spi->word[CTRL / 4], spi->word[USER / 4], data_bits(spi));
    return false;
}

static void start(struct esp *esp, unsigned number) {
    struct spi_host *spi = &esp->spi_host[number];
    if (spi->works || !can_do(esp, number))
        return;
    const uint32_t dummy = has(spi, HAS_DUMMY) ? (spi->word[USER1 / 4] & 0xFF) + 1 : 0;
    const uint64_t bits = (uint64_t)command_bits(spi) + address_bits(spi) + dummy + data_bits(spi);
    spi->works = true;
    spi->due = esp->cycles + bits * clock_cycles(spi);
    select_lines(esp, number, true);
    chip_look(esp);
}

/* Command: its low byte first; address: from bit 31 on. @return bytes before the data */
static size_t put_head(struct spi_host *spi) {
    const uint32_t command = spi->word[USER2 / 4], address = spi->word[ADDRESS / 4];
    size_t count = 0;
    for (uint32_t bit = 0; bit < command_bits(spi); bit += 8)
        spi->out[count++] = (uint8_t)(command >> bit);
    for (uint32_t bit = 0; bit < address_bits(spi); bit += 8)
        spi->out[count++] = (uint8_t)(address >> (24 - bit % 32));
    return count;
}

static void put_data(struct esp *esp, struct spi_host *spi, uint8_t *to) {
    const size_t count = out_bits(spi) / 8, half = (spi->word[USER / 4] & OUT_HIGH) != 0 ? 32 : 0;
    if (spi->out_link != 0)
        (void)walk(esp, spi->out_link, to, count, true);
    else
        memcpy(to, (uint8_t *)at(spi, BUFFER) + half, count < 64 - half ? count : 64 - half);
}

static void take_data(struct esp *esp, struct spi_host *spi, uint8_t *from) {
    const size_t count = in_bits(spi) / 8, half = (spi->word[USER / 4] & IN_HIGH) != 0 ? 32 : 0;
    if (spi->in_link != 0)
        (void)walk(esp, spi->in_link, from, count, false);
    else
        memcpy((uint8_t *)at(spi, BUFFER) + half, from, count < 64 - half ? count : 64 - half);
}

static void finish(struct esp *esp, unsigned number) {
    struct spi_host *spi = &esp->spi_host[number];
    const bool duplex = (spi->word[USER / 4] & DUPLEX) != 0;
    const struct w5500 *w5500 = &esp->w5500;
    const size_t head = put_head(spi), count = head + data_bits(spi) / 8;
    memset(spi->out + head, 0, count - head);
    memset(spi->in, gpio_input(esp, hosts[number].miso) ? 0xFF : 0, count);
    put_data(esp, spi, spi->out + head);
    if (w5500->is_wired && w5500->host == number && is_selected(spi, w5500->select))
        w5500_exchange(esp, spi->out, spi->in, count);
    if (in_bits(spi) != 0)
        take_data(esp, spi, spi->in + head + (duplex ? 0 : out_bits(spi) / 8));
    spi->dma[(DMA_RAW - DMA) / 4] |=
        (spi->in_link != 0 ? EVENTS_IN : 0) | (spi->out_link != 0 ? EVENTS_OUT : 0);
    spi->out_link = spi->in_link = 0;
    spi->works = false;
    *at(spi, SLAVE) |= DONE;
    select_lines(esp, number, false);
}

static void set_line(struct esp *esp, unsigned number) {
    const uint32_t slave = *at(&esp->spi_host[number], SLAVE);
    matrix_set(esp, hosts[number].source, (slave & DONE) != 0 && (slave & DONE_ENABLED) != 0);
}

uint64_t spi_master_next(const struct esp *esp) {
    uint64_t next = NEVER;
    for (unsigned i = 0; i < SPI_HOSTS; i++)
        if (esp->spi_host[i].works && esp->spi_host[i].due < next)
            next = esp->spi_host[i].due;
    return next;
}

void spi_master_event(struct esp *esp) {
    if (esp->chip == ES_ESP32S3) {
        spi_s3_event(esp);
        return;
    }
    for (unsigned i = 0; i < SPI_HOSTS; i++)
        if (esp->spi_host[i].works && esp->spi_host[i].due <= esp->cycles) {
            finish(esp, i);
            set_line(esp, i);
        }
}

/* ---- registers ---- */

static void store_dma(struct spi_host *spi, uint32_t offset, uint32_t value) {
    uint32_t *link = offset == OUT_LINK ? &spi->out_link : &spi->in_link;
    if (offset == DMA_CLEAR)
        spi->dma[(DMA_RAW - DMA) / 4] &= ~value;
    else if (offset != DMA_RAW)
        spi->dma[(offset - DMA) / 4] = value & ~(offset == OUT_LINK || offset == IN_LINK ? 7u << 28 : 0);
    if ((offset == OUT_LINK || offset == IN_LINK) && (value & LINK_START) != 0)
        *link = LINK_BASE | (value & LINK_ADDRESS);
    else if ((offset == OUT_LINK || offset == IN_LINK) && (value & LINK_STOP) != 0)
        *link = 0;
    else if (offset == DMA && (value & DMA_RESETS) != 0)
        spi->out_link = spi->in_link = 0;
}

static void store(struct esp *esp, unsigned number, uint32_t offset, uint32_t value) {
    struct spi_host *spi = &esp->spi_host[number];
    spi_master_event(esp);
    if (offset == CMD && (value & CMD_USER) != 0)
        start(esp, number);
    else if (offset >= DMA && offset < DMA_END)
        store_dma(spi, offset, value);
    else if (offset != CMD && offset < DMA)
        *at(spi, offset) = value;
    if (offset == PIN)
        select_lines(esp, number, spi->works);
    set_line(esp, number);
}

static uint32_t load(struct esp *esp, unsigned number, uint32_t offset) {
    const struct spi_host *spi = &esp->spi_host[number];
    spi_master_event(esp);
    if (offset == CMD)
        return spi->works ? CMD_USER : 0;
    if (offset >= DMA)
        return offset < DMA_END ? spi->dma[(offset - DMA) / 4] : 0;
    return spi->word[offset / 4];
}

static uint32_t load2(struct esp *esp, uint32_t offset) {
    return load(esp, 0, offset);
}

static uint32_t load3(struct esp *esp, uint32_t offset) {
    return load(esp, 1, offset);
}

static void store2(struct esp *esp, uint32_t offset, uint32_t value) {
    store(esp, 0, offset, value);
}

static void store3(struct esp *esp, uint32_t offset, uint32_t value) {
    store(esp, 1, offset, value);
}

void spi_master_create(struct esp *esp) {
    memset(esp->spi_host, 0, sizeof esp->spi_host);
    if (esp->chip == ES_ESP32S3) {
        spi_s3_create(esp);
        return;
    }
    bus_add(esp, &(struct block){"SPI2", hosts[0].base, 0x400, load2, store2, NULL});
    bus_add(esp, &(struct block){"SPI3", hosts[1].base, 0x400, load3, store3, NULL});
    for (unsigned i = 0; i < SPI_HOSTS; i++) {
        gpio_has_signals(esp, hosts[i].clock, 1);
        gpio_has_signals(esp, hosts[i].mosi, 1);
        *at(&esp->spi_host[i], PIN) = 6; /* select lines 1 and 2 are off */
        for (unsigned select = 0; select < SELECTS; select++)
            gpio_has_signals(esp, hosts[i].select[select], 1);
        select_lines(esp, i, false);
    }
}
