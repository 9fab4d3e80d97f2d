/* SPDX-License-Identifier: MIT
 * What tests need of the component's insides, for Python's ctypes. */
#include "link.h"
#include "module.h"

#include <stdlib.h>

struct link *component_link(void) {
    return calloc(1, sizeof(struct link));
}

struct peer *component_peer(struct link *link) {
    return &link->peer;
}

struct pins *component_pins(unsigned joints) {
    struct pins *pins = calloc(1, sizeof *pins);
    if (pins != NULL)
        pins->joints = joints;
    return pins;
}

bool component_is_open(const struct link *link) {
    return link->is_open;
}

struct encoder *component_encoder(void) {
    return calloc(1, sizeof(struct encoder));
}

struct module *component_module(void) {
    return calloc(1, sizeof(struct module));
}

struct module_pins *component_module_pins(void) {
    return calloc(1, sizeof(struct module_pins));
}

struct peer *component_module_peer(struct module *module) {
    return &module->peer;
}
