/* SPDX-License-Identifier: MIT
 * The S3's general DMA: five channels each way between lists in RAM and a peripheral. A peripheral moves all
 * bytes of a transaction in one step (technical reference manual, chapter GDMA Controller). Memory to memory,
 * bursts, priorities and a FIFO's levels are not emulated. */
#include "esp.h"

#include <string.h>

/* Of a channel; those of its out half lie OUT_HALF behind. */
enum { CONF0 = 0x00, CONF1 = 0x04, RAW = 0x08, MASKED = 0x0C, ENABLED = 0x10, CLEAR = 0x14 };
enum { FIFO_STATUS = 0x18, LINK = 0x20, EOF_AT = 0x28, PERIPHERAL = 0x48, OUT_HALF = 0x60 };
enum { CHANNEL_SIZE = 0xC0, CHANNELS_END = GDMA_CHANNELS * CHANNEL_SIZE, BASE = 0x6003F000, SIZE = 0x410 };
enum { RESET = 1 << 0, MEMORY_TO_MEMORY = 1 << 4, FIFOS_EMPTY = 1 << 1 | 1 << 3 | 1 << 5 };
enum { LINK_ADDRESS = 0xFFFFF, LINK_STOP = 1 << 20, LINK_START = 1 << 21, LINK_RESTART = 1 << 22 };
enum { PARKED = 1 << 23, NO_PERIPHERAL = 63, LIST_MAX = 64 };
enum { IN_DONE = 1 << 0, IN_EOF = 1 << 1, OUT_DONE = 1 << 0, OUT_EOF = 1 << 1, OUT_ALL = 1 << 3 };
enum { FIRST_SOURCE_IN = 66, FIRST_SOURCE_OUT = 71 };
#define LINK_BASE 0x3FC00000u
#define LAST      (1u << 30)

static uint32_t *word(struct gdma_channel *channel, bool out, uint32_t offset) {
    return &channel->word[((out ? OUT_HALF : 0) + offset) / 4];
}

static void set_lines(struct esp *esp) {
    for (unsigned i = 0; i < GDMA_CHANNELS; i++) {
        struct gdma_channel *channel = &esp->gdma.channel[i];
        for (unsigned out = 0; out < 2; out++)
            matrix_set(esp, (out ? FIRST_SOURCE_OUT : FIRST_SOURCE_IN) + i,
                       (*word(channel, out, RAW) & *word(channel, out, ENABLED)) != 0);
    }
}

static struct gdma_channel *channel_of(struct esp *esp, unsigned peripheral, bool out) {
    for (unsigned i = 0; i < GDMA_CHANNELS; i++) {
        struct gdma_channel *channel = &esp->gdma.channel[i];
        if (channel->link[out] != 0 && (*word(channel, out, PERIPHERAL) & 63) == peripheral)
            return channel;
    }
    return NULL;
}

/* ---- lists: size and length, the buffer, the next ---- */

struct entry {
    uint32_t head, buffer, next;
};

static bool read_entry(struct esp *esp, uint32_t at, struct entry *entry) {
    const uint8_t *bytes = bus_bytes(esp, at, sizeof *entry);
    if (bytes == NULL) {
        chip_fault(esp, "DMA reads an entry of its list at %08x, where there is no memory", at);
        return false;
    }
    memcpy(entry, bytes, sizeof *entry);
    return true;
}

/* What has come into an entry's buffer. */
static void write_back(struct esp *esp, uint32_t at, uint32_t head, size_t size, bool last) {
    const uint32_t value = (head & 0xFFFu) | (uint32_t)size << 12 | (last ? LAST : 0);
    (void)es_write(esp, at, (const uint8_t *)&value, sizeof value);
}

/* @return bytes moved; what the list has no room for is lost, as on the chip */
static size_t walk(struct esp *esp, uint32_t *link, uint32_t *end, uint8_t *bytes, size_t count, bool out) {
    size_t moved = 0;
    struct entry entry;
    for (unsigned n = 0; *link != 0 && moved < count && n < LIST_MAX; n++) {
        if (!read_entry(esp, *link, &entry))
            return moved;
        const size_t room = out ? entry.head >> 12 & 0xFFF : entry.head & 0xFFF;
        const size_t size = room < count - moved ? room : count - moved;
        if (!(out ? es_read(esp, entry.buffer, bytes + moved, size)
                  : es_write(esp, entry.buffer, bytes + moved, size))) {
            chip_fault(esp, "DMA of %zu bytes at %08x, where there is no memory", size, entry.buffer);
            return moved;
        }
        moved += size;
        *end = *link;
        if (!out)
            write_back(esp, *link, entry.head, size, moved == count);
        *link = out && (entry.head & LAST) != 0 ? 0 : entry.next;
    }
    return moved;
}

size_t gdma_move(struct esp *esp, unsigned peripheral, bool out, uint8_t *bytes, size_t count) {
    struct gdma_channel *channel = channel_of(esp, peripheral, out);
    if (channel == NULL)
        return 0;
    const size_t moved = walk(esp, &channel->link[out], word(channel, out, EOF_AT), bytes, count, out);
    *word(channel, out, RAW) |= out ? OUT_DONE | OUT_EOF | OUT_ALL : IN_DONE | IN_EOF;
    channel->link[out] = 0;
    set_lines(esp);
    return moved;
}

/* ---- registers ---- */

/* The in half has AUTO_RET at bit 20, and start, stop and parked each a bit higher. */
static void store_link(struct gdma_channel *channel, bool out, uint32_t value) {
    const uint32_t bits = out ? value : value >> 1;
    *word(channel, out, LINK) = value & (LINK_ADDRESS | (out ? 0 : 1u << 20));
    if ((bits & (LINK_START | LINK_RESTART)) != 0)
        channel->link[out] = LINK_BASE | (value & LINK_ADDRESS);
    else if ((bits & LINK_STOP) != 0)
        channel->link[out] = 0;
}

static void store_half(struct esp *esp, struct gdma_channel *channel, bool out, uint32_t offset,
                       uint32_t value) {
    if (offset == CLEAR)
        *word(channel, out, RAW) &= ~value;
    else if (offset == LINK)
        store_link(channel, out, value);
    else if (offset != RAW && offset != MASKED)
        *word(channel, out, offset) = value;
    if (offset == CONF0 && (value & RESET) != 0)
        channel->link[out] = 0;
    if (offset == CONF0 && !out && (value & MEMORY_TO_MEMORY) != 0)
        chip_fault(esp, "DMA from memory to memory is not emulated");
    set_lines(esp);
}

static void store(struct esp *esp, uint32_t offset, uint32_t value) {
    const uint32_t of_channel = offset % CHANNEL_SIZE;
    const bool out = of_channel >= OUT_HALF;
    if (offset >= CHANNELS_END)
        esp->gdma.rest[(offset - CHANNELS_END) / 4] = value;
    else
        store_half(esp, &esp->gdma.channel[offset / CHANNEL_SIZE], out, of_channel - (out ? OUT_HALF : 0),
                   value);
}

static uint32_t load(struct esp *esp, uint32_t offset) {
    const uint32_t of_channel = offset % CHANNEL_SIZE;
    const bool out = of_channel >= OUT_HALF;
    const uint32_t at = of_channel - (out ? OUT_HALF : 0);
    if (offset >= CHANNELS_END)
        return esp->gdma.rest[(offset - CHANNELS_END) / 4];
    struct gdma_channel *channel = &esp->gdma.channel[offset / CHANNEL_SIZE];
    if (at == MASKED)
        return *word(channel, out, RAW) & *word(channel, out, ENABLED);
    if (at == FIFO_STATUS)
        return FIFOS_EMPTY;
    if (at == LINK)
        return *word(channel, out, LINK) | (channel->link[out] != 0 ? 0 : out ? PARKED : PARKED << 1);
    return *word(channel, out, at);
}

void gdma_create(struct esp *esp) {
    memset(&esp->gdma, 0, sizeof esp->gdma);
    for (unsigned i = 0; i < GDMA_CHANNELS; i++)
        for (unsigned out = 0; out < 2; out++)
            *word(&esp->gdma.channel[i], out, PERIPHERAL) = NO_PERIPHERAL;
    if (esp->chip == ES_ESP32S3)
        bus_add(esp, &(struct block){"GDMA", BASE, SIZE, load, store, NULL});
}
