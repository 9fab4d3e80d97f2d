/* SPDX-License-Identifier: MIT
 * Ports A to G: levels of the pins, pulls, and change notice by edges. A pin that is analogue (ANSEL) reads
 * 0. */
#include "chip.h"

#include <stdio.h>
#include <string.h>

enum { CN_ON = 1 << 15, CN_EDGES = 1 << 11 };

/* Pins with an ANx name, DS60001320, pin names of the 100-pin package. */
static const uint16_t analogue[PORTS] = {0x0623, 0xFFFF, 0x001E, 0xC000, 0x03F0, 0x3000, 0x83C0};

static void record(struct chip *chip, unsigned pin, bool level) {
    bench_edge(chip, pin, level);
    if (!chip->record_edges ||
        !chip_grow(&chip->edges, &chip->edge_room, chip->edge_count + 1, sizeof *chip->edges))
        return;
    chip->edges[chip->edge_count++] =
        (struct mz_edge){.cycle = chip->cycles, .pin = (uint8_t)pin, .level = level};
}

static uint16_t levels(const struct port *port) {
    uint32_t tris = port->tris->value, lat = port->lat->value;
    uint32_t pulled = port->cnpu->value & ~port->cnpd->value;
    uint32_t outside = (port->drive & port->driven) | (pulled & ~(uint32_t)port->driven);
    lat = (lat & ~(uint32_t)port->function) | (port->function_level & port->function);
    return (uint16_t)((outside & tris) | (lat & ~tris));
}

static void notice(struct chip *chip, struct port *port, uint16_t changed) {
    uint32_t rising = changed & port->level & port->cnen->value;
    uint32_t falling = changed & ~(uint32_t)port->level & port->cnne->value;
    if ((port->cncon->value & CN_ON) == 0 || ((rising | falling) & ~port->ansel->value) == 0)
        return;
    port->cnf->value |= (rising | falling) & ~port->ansel->value;
    evic_raise(chip, IRQ_CHANGE + (unsigned)(port - chip->port));
}

void port_update(struct chip *chip, unsigned number) {
    struct port *port = &chip->port[number];
    uint16_t now = levels(port), changed = now ^ port->level;
    port->level = now;
    if (changed == 0)
        return;
    notice(chip, port, changed);
    for (unsigned bit = 0; bit < 16; bit++)
        if ((changed >> bit & 1) != 0 && (port->tris->value >> bit & 1) == 0)
            record(chip, number * 16 + bit, (now >> bit & 1) != 0);
}

void port_function(struct chip *chip, unsigned pin, bool level) {
    struct port *port = &chip->port[pin / 16];
    uint16_t bit = (uint16_t)(1u << pin % 16);
    port->function_level = (uint16_t)(level ? port->function_level | bit : port->function_level & ~bit);
    if ((port->function & bit) != 0)
        port_update(chip, pin / 16);
}

/* ---- registers ---- */

static void written(struct chip *chip, struct sfr *sfr, uint32_t before) {
    (void)before;
    port_update(chip, sfr->unit);
}

static void written_cncon(struct chip *chip, struct sfr *sfr, uint32_t before) {
    (void)before;
    if ((sfr->value & CN_ON) != 0 && (sfr->value & CN_EDGES) == 0)
        chip_fault(chip, "%s: change notice by comparison is not modelled", sfr->name);
}

static uint32_t read_port(struct chip *chip, struct sfr *sfr) {
    const struct port *port = &chip->port[sfr->unit];
    return port->level & ~port->ansel->value;
}

/* RPnR: what a pin puts out. Table 12-22 has other functions; the firmware uses these. */
static void written_rpr(struct chip *chip, struct sfr *sfr, uint32_t before) {
    unsigned pin = sfr->unit;
    struct port *port = &chip->port[pin / 16];
    bool known = (pin == 14 && sfr->value == 1) || (pin == 30 && sfr->value == 2) ||
                 ((pin == 53 || pin == 67) && sfr->value == 12) || sfr->value == 0;
    (void)before;
    if (!known)
        chip_fault(chip, "%s = %u is not modelled", sfr->name, (unsigned)sfr->value);
    const uint16_t bit = (uint16_t)(1u << pin % 16);
    port->function = (uint16_t)(sfr->value != 0 ? port->function | bit : port->function & ~bit);
    port_update(chip, pin / 16);
}

static struct sfr *add(struct chip *chip, const char *what, unsigned number, uint32_t offset,
                       uint32_t at_reset) {
    char name[12];
    snprintf(name, sizeof name, "%s%c", what, (char)('A' + number));
    struct sfr *sfr = sfr_add(chip, name, 0x1F860000 + 0x100 * number + offset, at_reset, 0xFFFF);
    sfr->unit = number;
    sfr->written = written;
    return sfr;
}

void port_create(struct chip *chip) {
    static const unsigned routed[] = {14, 30, 53, 67};
    for (unsigned i = 0; i < PORTS; i++) {
        struct port *port = &chip->port[i];
        port->ansel = add(chip, "ANSEL", i, 0x00, analogue[i]);
        port->tris = add(chip, "TRIS", i, 0x10, 0xFFFF);
        port->port = add(chip, "PORT", i, 0x20, 0);
        port->lat = add(chip, "LAT", i, 0x30, 0);
        port->cnpu = add(chip, "CNPU", i, 0x50, 0);
        port->cnpd = add(chip, "CNPD", i, 0x60, 0);
        port->cncon = add(chip, "CNCON", i, 0x70, 0);
        port->cnen = add(chip, "CNEN", i, 0x80, 0);
        port->cnne = add(chip, "CNNE", i, 0xA0, 0);
        port->cnf = add(chip, "CNF", i, 0xB0, 0);
        port->port->read = read_port;
        port->port->writable = 0;
        port->cncon->written = written_cncon;
    }
    for (unsigned i = 0; i < sizeof routed / sizeof routed[0]; i++) {
        char name[12];
        snprintf(name, sizeof name, "RPR%u", routed[i]);
        struct sfr *sfr = sfr_add(chip, name, 0x1F801500 + 4 * routed[i], 0, 0xF);
        sfr->unit = routed[i];
        sfr->written = written_rpr;
        sfr->plain = true;
    }
}

void port_reset(struct chip *chip) {
    for (unsigned i = 0; i < PORTS; i++) {
        chip->port[i].function = chip->port[i].function_level = 0;
        chip->port[i].level = levels(&chip->port[i]);
    }
}

void mz_pin_drive(struct chip *chip, unsigned pin, int level) {
    struct port *port = &chip->port[pin / 16];
    uint16_t bit = (uint16_t)(1u << pin % 16);
    if (pin >= MZ_PIN_COUNT)
        return;
    port->driven = (uint16_t)(level < 0 ? port->driven & ~bit : port->driven | bit);
    port->drive = (uint16_t)(level > 0 ? port->drive | bit : port->drive & ~bit);
    port_update(chip, pin / 16);
    chip_look(chip);
}

int mz_pin_level(const struct chip *chip, unsigned pin) {
    return pin < MZ_PIN_COUNT ? chip->port[pin / 16].level >> pin % 16 & 1 : 0;
}

void mz_record_edges(struct chip *chip, bool on) {
    chip->record_edges = on;
}

size_t mz_edges(struct chip *chip, struct mz_edge *out, size_t room) {
    size_t count = chip->edge_count < room ? chip->edge_count : room;
    memcpy(out, chip->edges, count * sizeof *out);
    memmove(chip->edges, chip->edges + count, (chip->edge_count - count) * sizeof *out);
    chip->edge_count -= count;
    return count;
}
