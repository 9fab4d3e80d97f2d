/* SPDX-License-Identifier: MIT
 * State of the peripherals that make or take signals by themselves: after esp.h's constants, for its struct.
 */
#ifndef WIFICNC_ESPSIM_PARTS_H
#define WIFICNC_ESPSIM_PARTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    SIGNALS = 256,
    I2S_FIFO = 64,
    RMT_CHANNELS = 8,
    RMT_WORDS = 512,
    LEDC_CHANNELS = 16,
    LEDC_TIMERS = 8,
    MCPWM_TIMERS = 3,
    PCNT_UNITS = 8,
    PCNT_INPUTS = 4,
    SPI_HOSTS = 2,
    SPI_BYTES_MAX = 8192,
    W5500_MEMORY = 16384,
    USB_PACKET = 64,
    GDMA_CHANNELS = 5,
    GDMA_WORDS = 48,
    GDMA_REST = 20,
    USB_WORDS = 33,
};

/* A chain of 74HC595 at three pins. */
struct shift {
    bool is_wired;
    uint8_t clock, data, latch;
    uint32_t chain, shown; /* bit 0 was shifted in last */
};

/* The ESP32's I2S0, as a transmitter of words that the processor writes. */
struct i2s {
    uint32_t word[64];
    uint32_t fifo[I2S_FIFO], first, count;
    uint32_t sent, raw;
    bool runs;
    uint64_t frame;  /* when the present one began */
    uint32_t cycles; /* of a bit */
    unsigned done;   /* bits of the frame that the chain has */
};

/* @param at  word in its memory; @param second  half of it */
struct rmt_channel {
    uint32_t conf0, conf1, limit, sent;
    bool plays, level, second;
    uint32_t at;
    uint64_t due;
};
struct rmt {
    struct rmt_channel channel[RMT_CHANNELS];
    uint32_t memory[RMT_WORDS], raw, enabled, conf, rest[64];
    uint64_t due;
};

/* Times in 1/256 cycles: the divider has a fraction. */
struct ledc_timer {
    uint32_t conf, taken; /* as it is written; as the present period has it */
    bool runs;
    uint64_t tick, began; /* of a count; the present period */
    uint32_t bits, count; /* of the counter; up to which all is done */
};
struct ledc_channel {
    uint32_t conf0, hpoint, duty, conf1;      /* as they are written */
    uint32_t rises, falls, shown_duty, carry; /* of the present period; sixteenths of a count */
    bool level, changes;
};
struct ledc {
    struct ledc_timer timer[LEDC_TIMERS];
    struct ledc_channel channel[LEDC_CHANNELS];
    uint32_t raw, enabled, conf;
    uint64_t due;
};

/* Times in half cycles of 240 MHz: its clock is 160 MHz. */
struct mcpwm_timer {
    bool runs;
    uint32_t tick, last; /* of a count; the period's last count */
    uint64_t began;      /* the present period */
    uint32_t count;      /* up to which all is done */
};
struct mcpwm_operator {
    uint32_t compare[2]; /* that count in the present period */
    bool level[2];
};
struct mcpwm {
    uint32_t word[76];
    struct mcpwm_timer timer[MCPWM_TIMERS];
    struct mcpwm_operator operators[MCPWM_TIMERS];
    uint64_t due;
};

/* An input behind the filter. */
struct pcnt_input {
    bool level, seen; /* that counts; the pin's */
    uint64_t since;   /* when the pin changed, in APB cycles */
};
struct pcnt_unit {
    uint32_t conf[3], status;
    int16_t count;
    struct pcnt_input input[PCNT_INPUTS]; /* edge and level of channel 0, of channel 1 */
};
struct pcnt {
    struct pcnt_unit unit[PCNT_UNITS];
    uint32_t raw, enabled, control;
    uint64_t due;
};

/* SPI2 and SPI3, as masters. */
struct spi_host {
    uint32_t word[64], dma[24];
    uint32_t out_link, in_link; /* descriptors for the next transaction; 0: the buffer's words */
    bool works;
    uint64_t due;
    uint8_t out[SPI_BYTES_MAX], in[SPI_BYTES_MAX];
};

/* The S3's GDMA. @param link  the entry that is next, of the in half, of the out half; 0: not started */
struct gdma_channel {
    uint32_t word[GDMA_WORDS], link[2];
};
struct gdma {
    struct gdma_channel channel[GDMA_CHANNELS];
    uint32_t rest[GDMA_REST];
};

/* A W5500 at one of them. */
struct w5500 {
    bool is_wired, link;
    unsigned host, select;
    uint8_t common[64], socket[64]; /* of socket 0 */
    uint8_t tx[W5500_MEMORY], rx[W5500_MEMORY];
    uint16_t tx_read, rx_read, rx_write;
    uint8_t *sent; /* frames that have left: two bytes of length before each */
    size_t sent_count, sent_room;
};

/* The S3's USB-Serial-JTAG, and what a computer at it has sent and taken. */
struct usb_serial {
    bool plugged, is_full; /* is_full: the packet in tx waits for the computer */
    uint32_t word[USB_WORDS], raw, enabled;
    uint8_t rx[USB_PACKET], tx[USB_PACKET];
    uint32_t rx_count, rx_at, tx_count;
    uint64_t taken_at, sent_at, frame_at; /* when it has taken a packet, has sent one; the next SOF */
    uint8_t *in, *out;
    size_t in_count, in_at, in_room, out_count, out_room;
};

#endif
