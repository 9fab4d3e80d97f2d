/* SPDX-License-Identifier: MIT */
#include "app/io_module.h"

#include "pin_config.h"

void io_module_start(struct io_module *module, const struct nvs_store *store,
                     const struct session_options *options, const struct session_ops *ops) {
    struct session_module *device = &module->device;
    *device = (struct session_module){.axis_count = BOARD_AXIS_COUNT};
    if (store->ops != NULL)
        device->store = (struct store){.ops = &nvs_hal_store, .ctx = store};
    settings_defaults(&device->settings);
    struct store_lost lost; /* a module does not move; what could be read is in force */
    (void)store_load_settings(&device->store, &device->settings, BOARD_AXIS_COUNT, &lost);
    session_init_module(module->session, device, options, ops, module->wire);
    module->has_wire = net_wire_open(module->wire, "0.0.0.0", module->session) == 0;
}

void io_module_round(struct io_module *module) {
    if (module->has_wire)
        net_wire_round(module->wire);
    session_poll(module->session);
}

/* For an update: outputs go to their safe state first, and no command acts until io_module_unlock(). A
 * lock of an e-stop from before is kept. */
void io_module_lock(struct io_module *module) {
    module->locked = module->channels->locked;
    channels_safe(module->channels);
    module->channels->locked = true;
}

void io_module_unlock(struct io_module *module) {
    module->channels->locked = module->locked;
}
