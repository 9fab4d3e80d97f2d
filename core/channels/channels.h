/* SPDX-License-Identifier: MIT
 * The channels of an I/O expansion module: up to 16 lines, each an input or an output. [task]
 *
 *   lines -> ops.read() -> invert -> debounce -> channels_inputs()
 *   channels_set(), channels_safe() -> invert -> ops.write() -> lines
 *
 * A channel is on or off; its line is high when it is on, or low when it is inverted. The safe state of the
 * outputs is a setting, all off by default; they are in it from the moment their lines are driven.
 *
 * The configuration is numbers that the target keeps (protocol/nvs.toml). What decides about lines acts all
 * immediately, by channels_apply(): a half set configuration never drives anything. */
#ifndef WIFICNC_CHANNELS_CHANNELS_H
#define WIFICNC_CHANNELS_CHANNELS_H

#include "base/debounce.h"
#include "channels/channels_gen.h"

#include <stdbool.h>

enum { CHANNELS_MAX = 16, CHANNELS_NO_PIN = 0xFF, CHANNELS_MODE_MODULE = 1 };

/** Masks: bit n = channel n. */
struct channels_wiring {
    uint8_t pin[CHANNELS_MAX]; /* CHANNELS_NO_PIN: none */
    uint16_t outputs;          /* driven; all others with a pin are inputs */
    uint16_t pull_up;          /* of inputs */
};

/** What a target supplies. */
struct channels_ops {
    /** Whether this board has that pin free, and it can be an input or an output. */
    bool (*can)(void *ctx, uint8_t pin, bool output);
    /** Make the lines so, and let go of those before. An output has its level before it is driven.
     *  @param levels  of the outputs, 1 = high */
    void (*wire)(void *ctx, const struct channels_wiring *wiring, uint16_t levels);
    /** Levels of the lines now, 1 = high; of channels without a pin anything. */
    uint16_t (*read)(void *ctx);
    /** Levels of the outputs, 1 = high. Takes effect immediately. */
    void (*write)(void *ctx, uint16_t levels);
    /** Also store the value. @return false: not kept */
    bool (*keep)(void *ctx, const struct channels_config *config);
};

struct channels {
    const struct channels_ops *ops;
    void *ctx;
    struct channels_config config; /* as it was set */
    bool locked;                   /* e-stop: the outputs stay safe */
    struct channels_wiring wiring; /* at work */
    uint16_t inputs;               /* those of them that are inputs */
    uint16_t invert;               /* at work */
    uint16_t faults;               /* left out */
    uint16_t outputs;              /* that are on */
    struct debounce debounce;
};

/** All values at their defaults, nothing is wired. @param ops  lives as long */
void channels_init(struct channels *channels, const struct channels_ops *ops, void *ctx);

/** Set a value of the configuration. @param index  CHANNELS_... of channels_gen.h
 *  @return false and nothing changed: out of its range */
bool channels_set_value(struct channels *channels, unsigned index, uint32_t value);

/** @return index of the value with this key of the binary protocol, or CHANNELS_VALUES: none */
unsigned channels_find(uint16_t wire);

/** What was set says that this device is an I/O module; it counts at the start. */
bool channels_are_chosen(const struct channels *channels);

/** Channels of the configuration that cannot be: the pin is not free or cannot do it, or a lower channel has
 * it. */
uint16_t channels_faults(const struct channels *channels);

/** Wire the lines as the configuration says, without its faults. Outputs that were outputs of the same pin
 * stay as they are, others are in the safe state. */
void channels_apply(struct channels *channels);

/** Every ms or so. @param now_us  wraps */
void channels_poll(struct channels *channels, uint32_t now_us);

/** No input waits for the end of its bouncing. */
bool channels_are_quiet(const struct channels *channels);

/** Inputs that are on. */
uint16_t channels_inputs(const struct channels *channels);

/** Switch the outputs of a mask; channels of it that are not outputs are left out. Nothing while locked.
 */
void channels_set(struct channels *channels, uint16_t mask, uint16_t on);

/** [any] Levels of the outputs' lines in the safe state, 1 = high. */
static inline __attribute__((always_inline)) uint16_t channels_safe_levels(const struct channels *channels) {
    return (uint16_t)((channels->config.value[CHANNELS_IO_SAFE] ^ channels->invert) &
                      channels->wiring.outputs);
}

/** All outputs to the safe state. */
void channels_safe(struct channels *channels);

#endif
