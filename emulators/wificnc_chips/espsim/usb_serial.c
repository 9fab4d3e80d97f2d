/* SPDX-License-Identifier: MIT
 * The S3's USB-Serial-JTAG, as a serial port: packets of 64 bytes each way, at full speed. A computer at the
 * port takes and sends them as soon as it may. The JTAG half and the endpoints' pointers are not emulated.
 * Technical Reference Manual, chapter USB Serial/JTAG Controller. */
#include "esp.h"

#include <string.h>

enum {
    EP1 = 0x00,
    EP1_CONF = 0x04,
    INT_RAW = 0x08,
    INT_ST = 0x0C,
    INT_ENA = 0x10,
    INT_CLR = 0x14,
    CONF0 = 0x18,
    FRAM_NUM = 0x24,
};
enum { WR_DONE = 1 << 0, IN_FREE = 1 << 1, OUT_AVAIL = 1 << 2 }; /* EP1_CONF */
enum { SOF = 1 << 1, OUT_RECEIVED = 1 << 2, IN_EMPTY = 1 << 3 }; /* INT_RAW */
enum { DP_PULLUP = 1 << 9, PAD_ENABLE = 1 << 14, SOURCE = 96 };
enum { FRAME = ES_CPU_HZ / 1000, BIT = ES_CPU_HZ / 12000000 }; /* cycles */
enum { OVERHEAD_BITS = 8 * 13, FRAME_NUMBERS = 0x7FF, BASE = 0x60038000 };

/* A packet's time on the wires: token, data and handshake. */
static uint64_t cycles_of(uint32_t bytes) {
    return (OVERHEAD_BITS + 8 * (uint64_t)bytes) * BIT;
}

static void update(struct esp *esp) {
    matrix_set(esp, SOURCE, (esp->usb.raw & esp->usb.enabled) != 0);
}

static bool is_connected(const struct usb_serial *usb) {
    return usb->plugged && (usb->word[CONF0 / 4] & PAD_ENABLE) != 0;
}

/* What the computer does next: it takes a packet that waits, and sends when there is room for one. */
static void schedule(struct esp *esp) {
    struct usb_serial *usb = &esp->usb;
    const size_t waiting = usb->in_count - usb->in_at;
    const uint32_t count = waiting < USB_PACKET ? (uint32_t)waiting : USB_PACKET;
    if (!is_connected(usb)) {
        usb->taken_at = usb->sent_at = usb->frame_at = NEVER;
        chip_look(esp);
        return;
    }
    if (usb->frame_at == NEVER)
        usb->frame_at = esp->cycles + FRAME;
    if (usb->is_full && usb->taken_at == NEVER)
        usb->taken_at = esp->cycles + cycles_of(usb->tx_count);
    if (count != 0 && usb->rx_at == usb->rx_count && usb->sent_at == NEVER)
        usb->sent_at = esp->cycles + cycles_of(count);
    chip_look(esp);
}

static void take_packet(struct usb_serial *usb) {
    (void)chip_grow(&usb->out, &usb->out_room, usb->out_count + usb->tx_count, 1);
    memcpy(usb->out + usb->out_count, usb->tx, usb->tx_count);
    usb->out_count += usb->tx_count;
    usb->tx_count = 0;
    usb->is_full = false;
    usb->taken_at = NEVER;
    usb->raw |= IN_EMPTY;
}

static void send_packet(struct usb_serial *usb) {
    const size_t waiting = usb->in_count - usb->in_at;
    usb->rx_count = waiting < USB_PACKET ? (uint32_t)waiting : USB_PACKET;
    usb->rx_at = 0;
    memcpy(usb->rx, usb->in + usb->in_at, usb->rx_count);
    usb->in_at += usb->rx_count;
    usb->sent_at = NEVER;
    usb->raw |= OUT_RECEIVED;
}

uint64_t usb_serial_next(const struct esp *esp) {
    const struct usb_serial *usb = &esp->usb;
    const uint64_t next = usb->taken_at < usb->sent_at ? usb->taken_at : usb->sent_at;
    return usb->frame_at < next ? usb->frame_at : next;
}

void usb_serial_event(struct esp *esp) {
    struct usb_serial *usb = &esp->usb;
    if (usb_serial_next(esp) > esp->cycles)
        return;
    for (; usb->frame_at <= esp->cycles; usb->frame_at += FRAME) {
        usb->raw |= SOF;
        usb->word[FRAM_NUM / 4] = (usb->word[FRAM_NUM / 4] + 1) & FRAME_NUMBERS;
    }
    if (usb->taken_at <= esp->cycles)
        take_packet(usb);
    if (usb->sent_at <= esp->cycles)
        send_packet(usb);
    schedule(esp);
    update(esp);
}

/* ---- registers ---- */

/* A full packet leaves without WR_DONE. */
static void put(struct esp *esp, uint32_t value) {
    struct usb_serial *usb = &esp->usb;
    if (usb->is_full) {
        chip_fault(esp, "a byte is written to USB-Serial-JTAG while its packet waits for the computer");
        return;
    }
    usb->tx[usb->tx_count++] = (uint8_t)value;
    usb->is_full = usb->tx_count == USB_PACKET;
}

static uint32_t take(struct esp *esp) {
    struct usb_serial *usb = &esp->usb;
    if (usb->rx_at == usb->rx_count) {
        chip_fault(esp, "USB-Serial-JTAG is read while it has no byte");
        return 0;
    }
    const uint8_t byte = usb->rx[usb->rx_at++];
    schedule(esp);
    return byte;
}

static uint32_t load(struct esp *esp, uint32_t offset) {
    struct usb_serial *usb = &esp->usb;
    switch (offset) {
    case EP1:
        return take(esp);
    case EP1_CONF:
        return (usb->is_full ? 0 : IN_FREE) | (usb->rx_at < usb->rx_count ? OUT_AVAIL : 0);
    case INT_RAW:
        return usb->raw;
    case INT_ST:
        return usb->raw & usb->enabled;
    case INT_ENA:
        return usb->enabled;
    default:
        return usb->word[offset / 4];
    }
}

static void store(struct esp *esp, uint32_t offset, uint32_t value) {
    struct usb_serial *usb = &esp->usb;
    if (offset == EP1)
        put(esp, value);
    else if (offset == EP1_CONF)
        usb->is_full = usb->is_full || (value & WR_DONE) != 0;
    else if (offset == INT_CLR)
        usb->raw &= ~value;
    else if (offset == INT_ENA)
        usb->enabled = value;
    else if (offset != FRAM_NUM)
        usb->word[offset / 4] = value;
    schedule(esp);
    update(esp);
}

/* The packet for the computer is empty, which the register says from reset on. */
void usb_serial_create(struct esp *esp) {
    struct usb_serial *usb = &esp->usb;
    const struct usb_serial before = *usb;
    memset(usb, 0, sizeof *usb);
    usb->plugged = before.plugged;
    usb->in = before.in;
    usb->in_room = before.in_room;
    usb->out = before.out;
    usb->out_count = before.out_count;
    usb->out_room = before.out_room;
    usb->raw = IN_EMPTY;
    usb->word[CONF0 / 4] = DP_PULLUP | PAD_ENABLE;
    usb->taken_at = usb->sent_at = usb->frame_at = NEVER;
    if (esp->chip != ES_ESP32S3)
        return;
    bus_add(esp, &(struct block){"USB-Serial-JTAG", BASE, 4 * USB_WORDS, load, store, NULL});
    schedule(esp);
}

/* ---- from outside ---- */

bool es_usb_plug(struct esp *esp, bool on) {
    if (esp->chip != ES_ESP32S3)
        return false;
    esp->usb.plugged = on;
    if (!on) { /* what is on its way is lost */
        esp->usb.in_at = esp->usb.in_count;
        esp->usb.taken_at = esp->usb.sent_at = NEVER;
    }
    schedule(esp);
    return true;
}

void es_usb_put(struct esp *esp, const uint8_t *bytes, size_t count) {
    struct usb_serial *usb = &esp->usb;
    if (!usb->plugged || count == 0)
        return;
    if (usb->in_at == usb->in_count)
        usb->in_at = usb->in_count = 0;
    (void)chip_grow(&usb->in, &usb->in_room, usb->in_count + count, 1);
    memcpy(usb->in + usb->in_count, bytes, count);
    usb->in_count += count;
    schedule(esp);
}

size_t es_usb_get(struct esp *esp, uint8_t *bytes, size_t size) {
    struct usb_serial *usb = &esp->usb;
    const size_t count = usb->out_count < size ? usb->out_count : size;
    if (count == 0)
        return 0;
    memcpy(bytes, usb->out, count);
    memmove(usb->out, usb->out + count, usb->out_count - count);
    usb->out_count -= count;
    return count;
}
