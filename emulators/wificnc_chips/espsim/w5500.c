/* SPDX-License-Identifier: MIT
 * A W5500 outside of the chip, as ESP-IDF's driver uses it: socket 0 in MACRAW mode, frames of variable
 * length (data sheet W5500). A frame is sent immediately; commands are done when they are written. Other
 * sockets, the chip's own TCP/IP, and frames of fixed length are not emulated. */
#include "esp.h"

#include <string.h>

/* Common registers. */
enum {
    MODE = 0x00,
    MAC = 0x09,
    SOCKETS = 0x17,
    PHY = 0x2E,
    VERSION = 0x39,
    VERSION_IS = 4,
    MODE_RESET = 1 << 7
};
/* Of a socket. */
enum { S_MODE = 0x00, S_COMMAND, S_EVENTS, S_STATUS, S_RX_SIZE = 0x1E, S_TX_SIZE = 0x1F };
enum { S_TX_FREE = 0x20, S_TX_READ = 0x22, S_TX_WRITE = 0x24, S_RX_COUNT = 0x26, S_RX_READ = 0x28 };
enum { S_RX_WRITE = 0x2A, S_EVENTS_ON = 0x2C };
enum { OPEN = 0x01, CLOSE = 0x10, SEND = 0x20, RECEIVE = 0x40, MACRAW = 4, IS_MACRAW = 0x42 };
enum { FILTERS = 1 << 7, NO_MULTICAST = 1 << 5, RECEIVED = 1 << 2, HAS_SENT = 1 << 4 };
enum {
    COMMON_BLOCK,
    SOCKET_BLOCK,
    TX_BLOCK,
    RX_BLOCK,
    HEAD = 3,
    MAC_BYTES = 6,
    FRAME_MIN = 60,
    FRAME_MAX = 1518
};

static uint16_t word_at(const struct w5500 *chip, unsigned offset) {
    return (uint16_t)(chip->socket[offset] << 8 | chip->socket[offset + 1]);
}

static void set_word(struct w5500 *chip, unsigned offset, uint16_t value) {
    chip->socket[offset] = (uint8_t)(value >> 8);
    chip->socket[offset + 1] = (uint8_t)value;
}

/* Kilobytes: a power of two up to 16. */
static uint16_t size_of(const struct w5500 *chip, unsigned offset) {
    return (uint16_t)((chip->socket[offset] & 31u) * 1024u);
}

static void show_pointers(struct w5500 *chip) {
    set_word(chip, S_TX_READ, chip->tx_read);
    set_word(chip, S_TX_FREE,
             (uint16_t)(size_of(chip, S_TX_SIZE) - (uint16_t)(word_at(chip, S_TX_WRITE) - chip->tx_read)));
    set_word(chip, S_RX_WRITE, chip->rx_write);
    set_word(chip, S_RX_COUNT, (uint16_t)(chip->rx_write - chip->rx_read));
}

static void reset(struct w5500 *chip) {
    memset(chip->common, 0, sizeof chip->common);
    memset(chip->socket, 0, sizeof chip->socket);
    chip->common[PHY] = 0xB8;
    chip->common[VERSION] = VERSION_IS;
    chip->socket[S_RX_SIZE] = chip->socket[S_TX_SIZE] = 2;
    chip->socket[S_EVENTS_ON] = 0xFF;
    chip->tx_read = chip->rx_read = chip->rx_write = 0;
    show_pointers(chip);
}

/* ---- commands of socket 0 ---- */

static void send_frame(struct w5500 *chip) {
    const uint16_t size = size_of(chip, S_TX_SIZE), end = word_at(chip, S_TX_WRITE);
    const uint16_t count = (uint16_t)(end - chip->tx_read);
    if (size != 0 && count <= size && chip->socket[S_STATUS] == IS_MACRAW) {
        (void)chip_grow(&chip->sent, &chip->sent_room, chip->sent_count + 2u + count, 1);
        chip->sent[chip->sent_count++] = (uint8_t)(count >> 8);
        chip->sent[chip->sent_count++] = (uint8_t)count;
        for (uint16_t i = 0; i < count; i++)
            chip->sent[chip->sent_count++] = chip->tx[(uint16_t)(chip->tx_read + i) % size];
    }
    chip->tx_read = end;
    chip->socket[S_EVENTS] |= HAS_SENT;
}

static void command(struct w5500 *chip, uint8_t code) {
    if (code == OPEN) {
        chip->socket[S_STATUS] = (chip->socket[S_MODE] & 15) == MACRAW ? IS_MACRAW : 0;
        chip->tx_read = chip->rx_read = chip->rx_write = 0;
        set_word(chip, S_TX_WRITE, 0);
        set_word(chip, S_RX_READ, 0);
    } else if (code == CLOSE)
        chip->socket[S_STATUS] = 0;
    else if (code == SEND)
        send_frame(chip);
    else if (code == RECEIVE)
        chip->rx_read = word_at(chip, S_RX_READ);
    chip->socket[S_COMMAND] = 0;
    show_pointers(chip);
}

/* ---- frames of SPI ---- */

static uint8_t read_byte(const struct w5500 *chip, unsigned block, uint16_t address) {
    if (block == COMMON_BLOCK && address == PHY)
        return (uint8_t)((chip->common[PHY] & 0xF8) | (chip->link ? 7 : 0)); /* 100 Mbit/s, both ways */
    if (block == COMMON_BLOCK && address == SOCKETS)
        return (chip->socket[S_EVENTS] & chip->socket[S_EVENTS_ON]) != 0;
    if (block == COMMON_BLOCK || block == SOCKET_BLOCK)
        return address >= 64 ? 0 : block == COMMON_BLOCK ? chip->common[address] : chip->socket[address];
    const uint16_t size = size_of(chip, block == TX_BLOCK ? S_TX_SIZE : S_RX_SIZE);
    if (block > RX_BLOCK || size == 0)
        return 0;
    return block == TX_BLOCK ? chip->tx[address % size] : chip->rx[address % size];
}

static void write_common(struct w5500 *chip, uint16_t address, uint8_t value) {
    if (address == MODE && (value & MODE_RESET) != 0)
        reset(chip);
    else if (address < 64 && address != VERSION)
        chip->common[address] = value;
}

static void write_socket(struct w5500 *chip, uint16_t address, uint8_t value) {
    if (address == S_EVENTS)
        chip->socket[S_EVENTS] &= (uint8_t)~value;
    else if (address == S_COMMAND)
        command(chip, value);
    else if (address < 64)
        chip->socket[address] = value;
    show_pointers(chip);
}

static void write_byte(struct w5500 *chip, unsigned block, uint16_t address, uint8_t value) {
    const uint16_t size = size_of(chip, S_TX_SIZE);
    if (block == COMMON_BLOCK)
        write_common(chip, address, value);
    else if (block == SOCKET_BLOCK)
        write_socket(chip, address, value);
    else if (block == TX_BLOCK && size != 0)
        chip->tx[address % size] = value;
}

void w5500_exchange(struct esp *esp, const uint8_t *out, uint8_t *in, size_t count) {
    struct w5500 *chip = &esp->w5500;
    for (size_t i = 0; i < count && i < HEAD; i++)
        in[i] = (uint8_t)(i + 1);
    if (count < HEAD)
        return;
    if ((out[2] & 3) != 0) {
        chip_fault(esp, "a frame of fixed length for the W5500 is not emulated");
        return;
    }
    uint16_t address = (uint16_t)(out[0] << 8 | out[1]);
    for (size_t i = HEAD; i < count; i++, address++) {
        in[i] = read_byte(chip, out[2] >> 3, address);
        if ((out[2] & 4) != 0)
            write_byte(chip, out[2] >> 3, address, out[i]);
    }
}

/* ---- from outside ---- */

bool es_w5500(struct esp *esp, unsigned host, unsigned select) {
    struct w5500 *chip = &esp->w5500;
    if (host - 2 >= SPI_HOSTS || select > 2)
        return false;
    chip->is_wired = chip->link = true;
    chip->host = host - 2;
    chip->select = select;
    reset(chip);
    return true;
}

void es_w5500_link(struct esp *esp, bool up) {
    esp->w5500.link = up;
}

static bool is_for(const struct w5500 *chip, const uint8_t *frame) {
    static const uint8_t all[MAC_BYTES] = {0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF};
    if ((chip->socket[S_MODE] & FILTERS) == 0 || memcmp(frame, all, sizeof all) == 0)
        return true;
    if ((frame[0] & 1) != 0)
        return (chip->socket[S_MODE] & NO_MULTICAST) == 0;
    return memcmp(frame, chip->common + MAC, MAC_BYTES) == 0;
}

/* One that is shorter than any on a cable is filled up, as its sender would have done. */
bool es_w5500_put(struct esp *esp, const uint8_t *frame, size_t count) {
    struct w5500 *chip = &esp->w5500;
    const uint16_t size = size_of(chip, S_RX_SIZE), used = (uint16_t)(chip->rx_write - chip->rx_read);
    if (!chip->is_wired || !chip->link || chip->socket[S_STATUS] != IS_MACRAW || count < 14 ||
        count > FRAME_MAX || !is_for(chip, frame))
        return false;
    const uint16_t whole = (uint16_t)((count < FRAME_MIN ? FRAME_MIN : count) + 2);
    if (used > size || whole > size - used)
        return false;
    for (uint16_t i = 0; i < whole; i++) {
        const uint8_t header = (uint8_t)(i == 0 ? whole >> 8 : whole);
        const uint8_t byte = i < 2 ? header : i - 2u < count ? frame[i - 2] : 0;
        chip->rx[(uint16_t)(chip->rx_write + i) % size] = byte;
    }
    chip->rx_write = (uint16_t)(chip->rx_write + whole);
    chip->socket[S_EVENTS] |= RECEIVED;
    show_pointers(chip);
    return true;
}

size_t es_w5500_get(struct esp *esp, uint8_t *frame, size_t room) {
    struct w5500 *chip = &esp->w5500;
    if (chip->sent_count == 0)
        return 0;
    const size_t count = (size_t)chip->sent[0] << 8 | chip->sent[1];
    if (count > room)
        return 0;
    memcpy(frame, chip->sent + 2, count);
    chip->sent_count -= count + 2;
    memmove(chip->sent, chip->sent + 2 + count, chip->sent_count);
    return count;
}
