/* SPDX-License-Identifier: MIT */
#include "host_module.h"

#include "host_inner.h"
#include "host_store.h"

#include <stdio.h>
#include <string.h>

enum { KEY_CHANNELS = HOST_STORE_KEYS - 1, CHANNELS_VERSION = 1 }; /* the machine's keys are small numbers */

/* ---- virtual pins ---- */

static bool can(void *ctx, uint8_t pin, bool output) {
    (void)ctx;
    return pin < (output ? MODULE_INPUT_PINS : MODULE_PINS);
}

static void write_levels(void *ctx, uint16_t levels) {
    struct host_module *module = ctx;
    module->level = 0;
    for (unsigned n = 0; n < CHANNELS_MAX; n++)
        if ((module->wiring.outputs >> n & 1) != 0)
            module->level |= (uint64_t)(levels >> n & 1) << module->wiring.pin[n];
}

static void wire(void *ctx, const struct channels_wiring *wiring, uint16_t levels) {
    struct host_module *module = ctx;
    module->wiring = *wiring;
    module->driven = 0;
    for (unsigned n = 0; n < CHANNELS_MAX; n++)
        if ((wiring->outputs >> n & 1) != 0)
            module->driven |= (uint64_t)1 << wiring->pin[n];
    write_levels(ctx, levels);
}

/* A line that no one holds is where its pull-up brings it. */
/* cppcheck-suppress constParameterCallback ; the type of ops->read is fixed */
static uint16_t read_levels(void *ctx) {
    const struct host_module *module = ctx;
    unsigned levels = 0;
    for (unsigned n = 0; n < CHANNELS_MAX; n++) {
        uint8_t pin = module->wiring.pin[n];
        if (pin == CHANNELS_NO_PIN)
            continue;
        bool open = module->hold[pin] == MODULE_OPEN;
        bool high = open ? (module->wiring.pull_up >> n & 1) != 0 : module->hold[pin] == MODULE_HIGH;
        levels |= high ? 1u << n : 0;
    }
    return (uint16_t)levels;
}

/* cppcheck-suppress constParameterCallback ; the type of ops->keep is fixed */
static bool keep(void *ctx, const struct channels_config *config) {
    const struct host_module *module = ctx;
    return store_save(&module->device.store, KEY_CHANNELS, CHANNELS_VERSION, config, sizeof *config);
}

/* ---- start ---- */

void host_module_init(struct host_module *module, struct host *host) {
    static const struct channels_ops ops = {
        .can = can, .wire = wire, .read = read_levels, .write = write_levels, .keep = keep};
    const struct machine_board *board = &host->machine.board;
    struct channels_config kept;
    *module = (struct host_module){.device = {.hal = &host->hal,
                                              .settings = host->machine.settings,
                                              .store = {.ops = board->store, .ctx = board->store_ctx},
                                              .axis_count = board->axis_count}};
    channels_init(&module->channels, &ops, module);
    enum store_result found =
        store_load(&module->device.store, KEY_CHANNELS, CHANNELS_VERSION, &kept, sizeof kept);
    module->blank = found != STORE_FOUND;
    for (unsigned index = 0; index < CHANNELS_VALUES && !module->blank; index++)
        (void)channels_set_value(&module->channels, index, kept.value[index]);
}

void host_module_start(struct host_module *module) {
    uint16_t *value = module->channels.config.value;
    value[CHANNELS_DEVICE_MODE] = CHANNELS_MODE_MODULE;
    /* Without a stored configuration each channel has the pin of its number, to try a module without
     * writing one first. */
    if (module->blank) {
        value[CHANNELS_IO_COUNT] = CHANNELS_MAX;
        for (unsigned n = 0; n < CHANNELS_MAX; n++)
            value[CHANNELS_IO_PIN_0 + n] = (uint16_t)n;
    }
    channels_apply(&module->channels);
}

/* ---- hands ---- */

bool host_module_hold(struct host_module *module, unsigned pin, enum module_hold hold) {
    if (pin >= MODULE_PINS)
        return false;
    module->hold[pin] = (uint8_t)hold;
    return true;
}

bool host_module_line(struct host_module *module, const char *line, char *answer, size_t size) {
    static const char *const holds[] = {[MODULE_OPEN] = "open", [MODULE_LOW] = "low", [MODULE_HIGH] = "high"};
    char word[8] = "", level[8] = "";
    unsigned pin = MODULE_PINS;
    int count = sscanf(line, "%7s %u %7s", word, &pin, level);
    if (count == 1 && strcmp(word, "pins") == 0) {
        snprintf(answer, size, "driven 0x%016llx level 0x%016llx\n", (unsigned long long)module->driven,
                 (unsigned long long)module->level);
        return true;
    }
    if (strcmp(word, "pin") != 0)
        return false;
    for (int hold = MODULE_OPEN; hold <= MODULE_HIGH; hold++)
        if (count == 3 && strcmp(level, holds[hold]) == 0 &&
            host_module_hold(module, pin, (enum module_hold)hold)) {
            snprintf(answer, size, "ok\n");
            return true;
        }
    snprintf(answer, size, "error: pin N high, low or open; N is 0 .. %d\n", MODULE_PINS - 1);
    return true;
}
