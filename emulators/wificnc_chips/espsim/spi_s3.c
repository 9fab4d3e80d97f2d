/* SPDX-License-Identifier: MIT
 * SPI2 and SPI3 of the ESP32-S3 as masters: command, address, dummy and data, by the buffer's words or by
 * GDMA, each in its time (technical reference manual, chapter SPI Controller). Select lines have edges; clock
 * and data have none, but shift registers take the bits. All on one line, most significant bit first. The
 * slave, and bits that are no whole bytes, are not emulated. */
#include "esp.h"

#include <string.h>

enum {
    CMD = 0x00,
    ADDRESS = 0x04,
    CTRL = 0x08,
    CLOCK = 0x0C,
    USER = 0x10,
    USER1 = 0x14,
    USER2 = 0x18,
    DATA_BITS = 0x1C,
    MISC = 0x20,
    DMA_CONF = 0x30,
    INT_ENA = 0x34,
    INT_CLR = 0x38,
    INT_RAW = 0x3C,
    INT_ST = 0x40,
    INT_SET = 0x44,
    BUFFER = 0x98,
    SLAVE = 0xE0,
    CLK_GATE = 0xE8,
    END = 0xF4,
};
enum { CMD_UPDATE = 1 << 23, CMD_USER = 1 << 24, TRANS_DONE = 1 << 12, SLAVE_MODE = 1 << 26 };
enum { DUPLEX = 1 << 0, HOLDS = 1 << 6, SETS_UP = 1 << 7, OUT_HIGH = 1 << 25, IN_HIGH = 1 << 24 };
enum { WIDE = 1 << 3 | 7 << 12 | 1 << 17, WIDE_CTRL = 7 << 5 | 7 << 8 | 7 << 14, LSB_FIRST = 15 << 23 };
enum { HAS_OUT = 27, HAS_IN = 28, HAS_DUMMY = 29, HAS_ADDRESS = 30, HAS_COMMAND = 31 };
enum { DMA_IN = 1 << 27, DMA_OUT = 1 << 28, SELECTS_MAX = 6, BUFFER_BYTES = 64, FROM_PLL = 1 << 2 };
#define WHOLE_SPEED (1u << 31)

static const struct {
    uint32_t base;
    unsigned source, selects;
    uint8_t clock, miso, mosi, select[SELECTS_MAX];
} hosts[SPI_HOSTS] = {
    {0x60024000, 21, 6, 101, 102, 103, {110, 111, 112, 113, 114, 115}},
    {0x60025000, 22, 3, 66, 67, 68, {71, 72, 127}},
};

static bool has(const struct spi_host *spi, unsigned bit) {
    return (spi->word[USER / 4] >> bit & 1) != 0;
}

/* ---- transactions ---- */

static bool is_selected(const struct spi_host *spi, unsigned select) {
    return (spi->word[MISC / 4] >> select & 1) == 0;
}

static void select_lines(struct esp *esp, unsigned number, uint64_t cycle, bool works) {
    const struct spi_host *spi = &esp->spi_host[number];
    for (unsigned select = 0; select < hosts[number].selects; select++) {
        const bool high_active = (spi->word[MISC / 4] >> (7 + select) & 1) != 0;
        gpio_signal(esp, cycle, hosts[number].select[select],
                    (works && is_selected(spi, select)) == high_active);
    }
}

/* Of a bit; the clock is the PLL's 80 MHz or the crystal. */
static uint32_t clock_cycles(const struct spi_host *spi) {
    const uint32_t clock = spi->word[CLOCK / 4], source = (spi->word[CLK_GATE / 4] & FROM_PLL) != 0 ? 3 : 6;
    return (clock & WHOLE_SPEED) != 0 ? source : source * ((clock >> 18 & 15) + 1) * ((clock >> 12 & 63) + 1);
}

static uint32_t command_bits(const struct spi_host *spi) {
    return has(spi, HAS_COMMAND) ? (spi->word[USER2 / 4] >> 28) + 1 : 0;
}

static uint32_t address_bits(const struct spi_host *spi) {
    return has(spi, HAS_ADDRESS) ? (spi->word[USER1 / 4] >> 27) + 1 : 0;
}

/* Of a phase with data: both have the same length. */
static uint32_t phase_bits(const struct spi_host *spi, unsigned phase) {
    return has(spi, phase) ? (spi->word[DATA_BITS / 4] & 0x3FFFF) + 1 : 0;
}

static uint32_t data_bits(const struct spi_host *spi) {
    const uint32_t out = phase_bits(spi, HAS_OUT), in = phase_bits(spi, HAS_IN);
    if ((spi->word[USER / 4] & DUPLEX) != 0)
        return out > in ? out : in;
    return out + in;
}

static bool can_do(struct esp *esp, unsigned number) {
    const struct spi_host *spi = &esp->spi_host[number];
    const uint32_t bits = command_bits(spi) | address_bits(spi) | data_bits(spi);
    if ((bits & 7) == 0 && (spi->word[USER / 4] & WIDE) == 0 && (spi->word[SLAVE / 4] & SLAVE_MODE) == 0 &&
        (spi->word[CTRL / 4] & (WIDE_CTRL | LSB_FIRST)) == 0 && data_bits(spi) / 8 + 8 <= SPI_BYTES_MAX)
        return true;
    chip_fault(esp, "a transaction of SPI%u with CTRL %08x, USER %08x, %u bits is not emulated", number + 2,
               spi->word[CTRL / 4], spi->word[USER / 4], data_bits(spi));
    return false;
}

static void start(struct esp *esp, unsigned number) {
    struct spi_host *spi = &esp->spi_host[number];
    if (spi->works || !can_do(esp, number))
        return;
    const uint32_t user = spi->word[USER / 4], user1 = spi->word[USER1 / 4];
    const uint32_t dummy = has(spi, HAS_DUMMY) ? (user1 & 0xFF) + 1 : 0;
    const uint32_t around =
        ((user & SETS_UP) != 0 ? (user1 >> 17 & 31) + 1 : 0) + ((user & HOLDS) != 0 ? user1 >> 22 & 31 : 0);
    const uint64_t bits = (uint64_t)command_bits(spi) + address_bits(spi) + dummy + data_bits(spi) + around;
    spi->works = true;
    spi->due = esp->cycles + bits * clock_cycles(spi);
    select_lines(esp, number, esp->cycles, true);
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

/* Out of the buffer's words, or into them: as many as there are. */
static void move_words(struct spi_host *spi, uint32_t high, uint8_t *bytes, size_t count, bool out) {
    const size_t half = (spi->word[USER / 4] & high) != 0 ? BUFFER_BYTES / 2 : 0, room = BUFFER_BYTES - half;
    uint8_t *words = (uint8_t *)&spi->word[BUFFER / 4] + half;
    memcpy(out ? bytes : words, out ? words : bytes, count < room ? count : room);
}

static void move_data(struct esp *esp, unsigned number, bool out, uint8_t *bytes) {
    struct spi_host *spi = &esp->spi_host[number];
    const size_t count = phase_bits(spi, out ? HAS_OUT : HAS_IN) / 8;
    if (count != 0 && (spi->word[DMA_CONF / 4] & (out ? DMA_OUT : DMA_IN)) != 0)
        (void)gdma_move(esp, number, out, bytes, count);
    else
        move_words(spi, out ? OUT_HIGH : IN_HIGH, bytes, count, out);
}

/* 74HC595 at the clock and the data line. */
static void shift_out(struct esp *esp, unsigned number, size_t count) {
    const struct shift *shift = &esp->shift;
    if (!shift->is_wired || !gpio_is_routed(esp, shift->clock, hosts[number].clock) ||
        !gpio_is_routed(esp, shift->data, hosts[number].mosi))
        return;
    for (size_t i = 0; i < count; i++)
        shift_bits(esp, esp->spi_host[number].out[i], 8);
}

static void finish(struct esp *esp, unsigned number) {
    struct spi_host *spi = &esp->spi_host[number];
    const bool duplex = (spi->word[USER / 4] & DUPLEX) != 0;
    const struct w5500 *w5500 = &esp->w5500;
    const size_t head = put_head(spi), count = head + data_bits(spi) / 8;
    memset(spi->out + head, 0, count - head);
    memset(spi->in, gpio_input(esp, hosts[number].miso) ? 0xFF : 0, count);
    move_data(esp, number, true, spi->out + head);
    if (w5500->is_wired && w5500->host == number && is_selected(spi, w5500->select))
        w5500_exchange(esp, spi->out, spi->in, count);
    if (has(spi, HAS_IN))
        move_data(esp, number, false, spi->in + head + (duplex ? 0 : phase_bits(spi, HAS_OUT) / 8));
    shift_out(esp, number, count);
    spi->works = false;
    spi->word[INT_RAW / 4] |= TRANS_DONE;
    select_lines(esp, number, spi->due, false);
}

static void set_line(struct esp *esp, unsigned number) {
    const uint32_t *word = esp->spi_host[number].word;
    matrix_set(esp, hosts[number].source, (word[INT_RAW / 4] & word[INT_ENA / 4]) != 0);
}

void spi_s3_event(struct esp *esp) {
    for (unsigned i = 0; i < SPI_HOSTS; i++)
        if (esp->spi_host[i].works && esp->spi_host[i].due <= esp->cycles) {
            finish(esp, i);
            set_line(esp, i);
        }
}

/* ---- registers: what is written holds immediately, so UPDATE is done ---- */

static void store(struct esp *esp, unsigned number, uint32_t offset, uint32_t value) {
    struct spi_host *spi = &esp->spi_host[number];
    spi_s3_event(esp);
    if (offset == CMD && (value & CMD_USER) != 0)
        start(esp, number);
    else if (offset == INT_CLR)
        spi->word[INT_RAW / 4] &= ~value;
    else if (offset == INT_SET)
        spi->word[INT_RAW / 4] |= value;
    else if (offset != CMD && offset != INT_ST)
        spi->word[offset / 4] = value;
    if (offset == MISC)
        select_lines(esp, number, esp->cycles, spi->works);
    set_line(esp, number);
}

static uint32_t load(struct esp *esp, unsigned number, uint32_t offset) {
    const struct spi_host *spi = &esp->spi_host[number];
    spi_s3_event(esp);
    if (offset == CMD)
        return spi->works ? CMD_USER : 0;
    if (offset == INT_ST)
        return spi->word[INT_RAW / 4] & spi->word[INT_ENA / 4];
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

void spi_s3_create(struct esp *esp) {
    bus_add(esp, &(struct block){"SPI2", hosts[0].base, END, load2, store2, NULL});
    bus_add(esp, &(struct block){"SPI3", hosts[1].base, END, load3, store3, NULL});
    for (unsigned i = 0; i < SPI_HOSTS; i++) {
        gpio_has_signals(esp, hosts[i].clock, 1);
        gpio_has_signals(esp, hosts[i].mosi, 1);
        esp->spi_host[i].word[MISC / 4] = 0x3E; /* select line 0 alone is on */
        for (unsigned select = 0; select < hosts[i].selects; select++)
            gpio_has_signals(esp, hosts[i].select[select], 1);
        select_lines(esp, i, esp->cycles, false);
    }
}
