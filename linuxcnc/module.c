/* SPDX-License-Identifier: MIT */
#include "module.h"

#include "wire/bytes.h"
#include "words_gen.h"

#include <stdio.h>

static const double AGAIN_S = 0.5; /* a refusal is reported again */
static const double STAY_S = 60.0; /* requests keep no reports coming; and there is no jog to end */
enum { NO_PIN = 0xFF };

int module_make_pins(struct module_pins *pins, pin_maker make, void *ctx) {
    const struct {
        const char *name;
        enum pin_direction direction;
        pin_BIT *at;
        unsigned count;
    } rows[] = {
        {"channel-%02u-in", PIN_OUT, pins->in, MODULE_CHANNELS},
        {"channel-%02u-in-not", PIN_OUT, pins->in_not, MODULE_CHANNELS},
        {"channel-%02u-out", PIN_IN, pins->out, MODULE_CHANNELS},
        {"estop", PIN_IN, &pins->estop, 1},
        {"reset", PIN_IN, &pins->reset, 1},
        {"connected", PIN_OUT, &pins->connected, 1},
        {"estop-ok", PIN_OUT, &pins->estop_ok, 1},
        {"estopped", PIN_OUT, &pins->estopped, 1},
        {"fault", PIN_OUT, &pins->fault, 1},
    };
    for (unsigned row = 0; row < sizeof rows / sizeof *rows; row++) {
        for (unsigned number = 0; number < rows[row].count; number++) {
            char name[PIN_NAME_MAX];
            snprintf(name, sizeof name, rows[row].name, number);
            int wrong = make(ctx, name, PIN_BIT, rows[row].direction, (void **)&rows[row].at[number]);
            if (wrong != 0)
                return wrong;
        }
    }
    return 0;
}

// ---- what its channels are ----

static void ask_key(struct module *module, unsigned key) {
    uint8_t payload[WIRE_CONFIG_GET_SIZE];
    wire_put_config_get(payload, &(struct wire_config_get){.key = (uint16_t)key});
    peer_ask(&module->peer, WIRE_CONFIG_GET, payload, sizeof payload);
    module->asks++;
}

static const char *greet_module(void *owner, const struct wire_handshake_response *hello) {
    struct module *module = owner;
    unsigned count = hello->io_channels < MODULE_CHANNELS ? hello->io_channels : MODULE_CHANNELS;
    if ((hello->capabilities & WIRE_CAPABILITY_IO_MODULE) == 0)
        return "this is a motion controller, no I/O module: leave --io-module out";
    module->outputs = (uint16_t)((1u << count) - 1);
    ask_key(module, KEY_IO_DIRECTION_MASK);
    ask_key(module, KEY_IO_FAULT_MASK);
    for (unsigned number = 0; number < count; number++)
        ask_key(module, KEY_IO_PIN + number);
    return NULL;
}

static void take_key(struct module *module, const uint8_t *payload) {
    struct wire_config_value value;
    wire_get_config_value(payload, &value);
    unsigned number = value.key - (unsigned)KEY_IO_PIN;
    if (value.key == KEY_IO_DIRECTION_MASK)
        module->outputs &= get_u16(value.value);
    else if (value.key == KEY_IO_FAULT_MASK)
        module->outputs &= (uint16_t)~get_u16(value.value);
    else if (number < MODULE_CHANNELS && get_u8(value.value) == NO_PIN)
        module->outputs &= (uint16_t)~(1u << number);
    module->asks -= module->asks > 0;
}

// ---- outputs ----

static void refuse(struct module *module, uint8_t reason) {
    if (reason != WIRE_REFUSAL_NONE && module->refusal != reason)
        peer_say(&module->peer, "the module refuses to switch its outputs: %s", peer_refusal(reason));
    module->refusal = reason;
    module->is_said = reason == WIRE_REFUSAL_NONE;
    *module->pins->fault = reason != WIRE_REFUSAL_NONE;
}

static void say_channels(struct module *module) {
    uint16_t on = 0;
    for (unsigned number = 0; number < MODULE_CHANNELS; number++)
        on |= (uint16_t)(*module->pins->out[number] << number);
    on &= module->outputs;
    module->is_said =
        module->is_said && !peer_is_locked(&module->peer); /* its outputs are safe now, and not ours */
    bool again = !module->is_said && module->peer.now_s - module->said_s >= AGAIN_S;
    if (module->asks > 0 || module->is_asked || module->outputs == 0 || peer_is_locked(&module->peer) ||
        (on == module->said && !again))
        return;
    uint8_t payload[WIRE_CHANNEL_OUTPUTS_SIZE];
    wire_put_channel_outputs(payload, &(struct wire_channel_outputs){.channels = module->outputs, .on = on});
    peer_ask(&module->peer, WIRE_CHANNEL_OUTPUTS, payload, sizeof payload);
    module->is_asked = true; /* one at a time: what changes meanwhile is reported behind its answer */
    module->said = on;
    module->said_s = module->peer.now_s;
}

static void answer_module(void *owner, const struct control_answer *answer) {
    struct module *module = owner;
    if (answer->request == WIRE_CONFIG_GET && answer->type == WIRE_CONFIG_VALUE) {
        take_key(module, answer->payload);
    } else if (answer->request == WIRE_CHANNEL_OUTPUTS) {
        struct wire_refused refused = {.reason = WIRE_REFUSAL_NONE};
        if (answer->type == WIRE_REFUSED)
            wire_get_refused(answer->payload, &refused);
        module->is_asked = false;
        refuse(module, refused.reason);
    }
}

// ---- inputs ----

static void report_module(void *owner) {
    struct module *module = owner;
    const struct wire_status *status = &module->peer.status;
    for (unsigned number = 0; number < MODULE_CHANNELS; number++) {
        *module->pins->in[number] = (status->io_inputs >> number & 1) != 0;
        *module->pins->in_not[number] = (status->io_inputs >> number & 1) == 0;
    }
    *module->pins->connected = true;
    *module->pins->estopped = peer_is_locked(&module->peer);
    *module->pins->estop_ok = !peer_is_locked(&module->peer);
}

static void datagram_module(void *owner, const struct wire_header *header, const uint8_t *payload) {
    (void)owner;
    (void)header;
    (void)payload;
}

// ---- all of it ----

void module_begin(struct module *module, struct module_pins *pins, const struct peer_world *world,
                  const char *key, double now_s) {
    const struct peer_owner owner = {module, greet_module, answer_module, report_module, datagram_module};
    *module = (struct module){.pins = pins, .said_s = now_s - AGAIN_S};
    peer_begin(&module->peer, world, &owner, key, now_s);
    module->peer.was_reset = *pins->reset;
}

const char *module_tick(struct module *module, double now_s) {
    if (!peer_tick(&module->peer, now_s))
        return module->peer.lost;
    peer_stop_and_reset(&module->peer, *module->pins->estop, *module->pins->reset);
    say_channels(module);
    if (now_s - module->peer.registered_s >= STAY_S)
        peer_register(&module->peer);
    return module->peer.lost;
}

void module_lose(struct module_pins *pins) {
    *pins->connected = *pins->estop_ok = false;
}
