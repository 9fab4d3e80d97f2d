/* SPDX-License-Identifier: MIT
 * SPI1, which sends commands to the flash chip: they take as long as their bits at 40 MHz, on one line. SPI0
 * reads for the caches: its registers say by how many lines and how fast. */
#include "esp.h"

#include <string.h>

/* CMD: each bit is a command of its own. */
enum {
    CMD_READ = 31,
    CMD_WREN = 30,
    CMD_WRDI = 29,
    CMD_RDID = 28,
    CMD_RDSR = 27,
    CMD_WRSR = 26,
    CMD_PP = 25
};
enum { CMD_SE = 24, CMD_BE = 23, CMD_CE = 22, CMD_DP = 21, CMD_RES = 20, CMD_USR = 18 };
enum { CMD = 0x00, ADDRESS = 0x04, BUFFER = 64, CYCLES_OF_BIT = 6 };
enum {
    USER_COMMAND = 31,
    USER_ADDRESS = 30,
    USER_MISO = 28,
    USER_MOSI = 27,
    USER_MOSI_HIGH = 25,
    USER_MISO_HIGH = 24
};

/* Where the chips have their registers. */
struct places {
    uint32_t user, user1, user2, mosi, miso, status, data;
    uint32_t mosi_bits; /* of MOSI_DLEN and MISO_DLEN */
};
static const struct places places[2] = {
    {0x1C, 0x20, 0x24, 0x28, 0x2C, 0x10, 0x80, 0xFFFFFF},
    {0x18, 0x1C, 0x20, 0x24, 0x28, 0x2C, 0x58, 0x3FF},
};

static uint32_t *at(struct spi *spi, uint32_t offset) {
    return &spi->word[offset / 4];
}

static uint32_t bytes_of(uint32_t bits) {
    const uint32_t count = (bits + 8) / 8; /* the register has one less */
    return count < BUFFER ? count : BUFFER;
}

/* A user command: what USER enables, as long as the registers say. */
static void do_user(struct esp *esp, struct spi *spi) {
    const struct places *p = &places[esp->chip];
    const uint32_t user = *at(spi, p->user), length = *at(spi, p->user1) >> 26;
    const uint32_t address = *at(spi, ADDRESS);
    uint8_t *data = (uint8_t *)at(spi, p->data), out[BUFFER];
    struct flash_command command = {.code = (uint8_t)*at(spi, p->user2), .out = out};
    if ((user >> USER_ADDRESS & 1) != 0) /* the ESP32 sends from bit 31 on, the S3 has the number */
        command.address = esp->chip == ES_ESP32 ? address >> (length >= 31 ? 0 : 8) : address;
    if ((user >> USER_MOSI & 1) != 0) {
        command.out_count = bytes_of(*at(spi, p->mosi) & p->mosi_bits);
        memcpy(out, data + ((user >> USER_MOSI_HIGH & 1) != 0 ? BUFFER / 2 : 0), BUFFER / 2);
        if ((user >> USER_MOSI_HIGH & 1) == 0)
            memcpy(out, data, BUFFER);
    }
    if ((user >> USER_MISO & 1) != 0) {
        command.in = data + ((user >> USER_MISO_HIGH & 1) != 0 ? BUFFER / 2 : 0);
        command.in_count = bytes_of(*at(spi, p->miso) & p->mosi_bits);
    }
    flash_do(esp, &command);
    esp->cycles += (8 + 24 + 8 * (uint64_t)(command.in_count + command.out_count)) * CYCLES_OF_BIT;
}

/* PP: the count of bytes is in the address's top byte. */
static void do_page(struct esp *esp, struct spi *spi) {
    const uint32_t address = *at(spi, ADDRESS);
    const uint8_t *data = (const uint8_t *)at(spi, places[esp->chip].data);
    flash_do(esp, &(struct flash_command){
                      .code = 0x02, .address = address & 0xFFFFFF, .out = data, .out_count = address >> 24});
}

static uint32_t read_word(struct esp *esp, uint8_t code, uint32_t count) {
    uint8_t in[4] = {0};
    flash_do(esp, &(struct flash_command){.code = code, .in = in, .in_count = count});
    return in[0] | (uint32_t)in[1] << 8 | (uint32_t)in[2] << 16;
}

static void write_status(struct esp *esp, struct spi *spi) {
    const uint32_t value = *at(spi, places[esp->chip].status), has_two = *at(spi, 0x08) >> 22 & 1;
    const uint8_t out[2] = {(uint8_t)value, (uint8_t)(value >> 8)};
    flash_do(esp, &(struct flash_command){.code = 0x01, .out = out, .out_count = 1 + has_two});
}

static void do_command(struct esp *esp, struct spi *spi, uint32_t bits) {
    static const uint8_t plain[32] = {[CMD_WREN] = 0x06, [CMD_WRDI] = 0x04, [CMD_SE] = 0x20, [CMD_BE] = 0xD8,
                                      [CMD_CE] = 0xC7,   [CMD_DP] = 0xB9,   [CMD_RES] = 0xAB};
    const struct places *p = &places[esp->chip];
    const unsigned bit = bits == 0 ? 0 : 31 - (unsigned)__builtin_clz(bits);
    if (bits == 0)
        return;
    if (bit == CMD_USR)
        do_user(esp, spi);
    else if (bit == CMD_PP)
        do_page(esp, spi);
    else if (bit == CMD_RDSR)
        *at(spi, p->status) = (*at(spi, p->status) & ~0xFFu) | read_word(esp, 0x05, 1);
    else if (bit == CMD_RDID)
        *at(spi, p->data) = read_word(esp, 0x9F, 3);
    else if (bit == CMD_WRSR)
        write_status(esp, spi);
    else if (plain[bit] != 0)
        flash_do(esp, &(struct flash_command){.code = plain[bit], .address = *at(spi, ADDRESS) & 0xFFFFFF});
    else
        chip_fault(esp, "the command bit %u of SPI1 is not emulated", bit);
}

/* ---- registers: CMD is zero again, as the command is done ---- */

static uint32_t load0(struct esp *esp, uint32_t offset) {
    return *at(&esp->spi[0], offset);
}

static void store0(struct esp *esp, uint32_t offset, uint32_t value) {
    *at(&esp->spi[0], offset) = offset == CMD ? 0 : value;
}

static uint32_t load1(struct esp *esp, uint32_t offset) {
    return *at(&esp->spi[1], offset);
}

static void store1(struct esp *esp, uint32_t offset, uint32_t value) {
    if (offset == CMD)
        do_command(esp, &esp->spi[1], value & 0xFFFC0000u);
    else
        *at(&esp->spi[1], offset) = value;
}

/* ---- SPI0 reads lines for the caches ---- */

/* CTRL, and codes of modes in an image's header. */
enum { QIO_BIT = 24, DIO_BIT = 23, QUAD_BIT = 20, DUAL_BIT = 14, FAST_BIT = 13, CTRL = 0x08 };
enum { QIO, QOUT, DIO, DOUT, FAST_READ, SLOW_READ, MODES };
enum { HALF_CYCLES_OF_80_MHZ = 6, AS_SYSTEM = 31 };

/* Clocks before the first bit of data, and lines of data: commands EBh, 6Bh, BBh, 3Bh, 0Bh, 03h of the flash
 * chips (data sheet of W25Q32JV). */
static const struct {
    uint8_t before, lines, bit;
} modes[MODES] = {{8 + 6 + 2 + 4, 4, QIO_BIT}, {8 + 24 + 8, 4, QUAD_BIT}, {8 + 12 + 4, 2, DIO_BIT},
                  {8 + 24 + 8, 2, DUAL_BIT},   {8 + 24 + 8, 1, FAST_BIT}, {8 + 24, 1, 0}};

static uint32_t *clock_of(struct esp *esp, unsigned number) {
    return at(&esp->spi[number], esp->chip == ES_ESP32 ? 0x18 : 0x14);
}

void spi_set_divider(struct esp *esp, uint32_t divider, uint32_t number) {
    const unsigned place = esp->chip == ES_ESP32 ? 12 : 16;
    if (number < 2)
        *clock_of(esp, number) = divider <= 1 ? 1u << AS_SYSTEM : (divider - 1) << place;
}

void spi_configure(struct esp *esp, const uint8_t *header) {
    enum { AT_40_MHZ, AT_26_MHZ, AT_20_MHZ, AT_80_MHZ = 15 };
    const unsigned mode = header[2] < MODES ? header[2] : DIO, frequency = header[3] & 15;
    *at(&esp->spi[0], CTRL) = modes[mode].bit == 0 ? 0 : 1u << modes[mode].bit | 1u << FAST_BIT;
    spi_set_divider(esp, frequency == AT_80_MHZ ? 1 : frequency + 2, 0);
}

/* Halves of a cycle that a bit takes: the S3 divides 80, 120, 160 or 240 MHz. */
static uint64_t half_cycles_of_clock(const struct esp *esp) {
    static const uint8_t of_source[4] = {6, 4, 3, 2};
    const struct spi *spi = &esp->spi[0];
    const uint32_t clock = *clock_of((struct esp *)esp, 0);
    if (esp->chip == ES_ESP32)
        return (clock >> AS_SYSTEM) != 0
                   ? HALF_CYCLES_OF_80_MHZ
                   : HALF_CYCLES_OF_80_MHZ * ((clock >> 18 & 0x1FFF) + 1) * ((clock >> 12 & 63) + 1);
    const uint32_t source = of_source[spi->word[0xEC / 4] & 3];
    return (clock >> AS_SYSTEM) != 0 ? source : source * ((clock >> 16 & 255) + 1);
}

uint64_t spi_line_cycles(const struct esp *esp, unsigned bytes) {
    const uint32_t control = esp->spi[0].word[CTRL / 4];
    unsigned mode = QIO;
    while (mode != SLOW_READ && (control >> modes[mode].bit & 1) == 0)
        mode++;
    return (modes[mode].before + 8 * bytes / modes[mode].lines) * half_cycles_of_clock(esp) / 2;
}

void spi_create(struct esp *esp) {
    static const uint8_t usual[2][4] = {{0, 0, DIO, 0}, {0, 0, DIO, 15}};
    const bool is_s3 = esp->chip == ES_ESP32S3;
    memset(esp->spi, 0, sizeof esp->spi);
    spi_configure(esp, usual[esp->chip]);
    bus_add(esp, &(struct block){"SPI1", is_s3 ? 0x60002000 : 0x3FF42000, 0x400, load1, store1, NULL});
    bus_add(esp, &(struct block){"SPI0", is_s3 ? 0x60003000 : 0x3FF43000, 0x400, load0, store0, NULL});
}
