/* SPDX-License-Identifier: MIT
 * M62 .. M68. */
#include "gcode/resolve.h"

#define ANALOG_MAX_PCT 100.0

/* The number of an input or output, of which there are so many. */
static enum status take_port(struct resolver *r, char letter, unsigned count, enum gcode_port kind) {
    double number;

    if (!resolve_take(r, letter, &number))
        return STATUS_VALUE_MISSING;
    if (number < 0.0)
        return STATUS_NEGATIVE;
    if (number >= (double)count)
        return STATUS_NO_PORT;
    r->out->port = (int8_t)number;
    r->out->port_kind = kind;
    return number == r->out->port ? STATUS_OK : STATUS_NOT_INTEGER;
}

static enum status set_digital(struct resolver *r, unsigned value) {
    r->out->port_on = (value & OUTPUT_ON) != 0;
    return take_port(r, 'P', r->state->ports.digital_out, PORT_DIGITAL_OUT);
}

static enum status set_analog(struct resolver *r) {
    const enum status status = take_port(r, 'E', r->state->ports.analog_out, PORT_ANALOG_OUT);
    double percent;

    if (status != STATUS_OK)
        return status;
    if (!resolve_take(r, 'Q', &percent))
        return STATUS_VALUE_MISSING;
    r->out->port_pct = (float)percent;
    return percent <= ANALOG_MAX_PCT ? STATUS_OK : STATUS_ANALOG_RANGE;
}

/* Q without a wait means nothing, and is not an error either. */
static enum status wait_for_input(struct resolver *r) {
    const bool analog = (r->unused & WORD_BIT('E')) != 0;
    const struct gcode_ports *ports = &r->state->ports;
    double mode = WAIT_NOT, seconds = 0.0;
    enum status status;

    if (analog && (r->unused & WORD_BIT('P')) != 0)
        return STATUS_WORDS_UNUSED;
    status = analog ? take_port(r, 'E', ports->analog_in, PORT_ANALOG_IN)
                    : take_port(r, 'P', ports->digital_in, PORT_DIGITAL_IN);
    if (status != STATUS_OK)
        return status;
    resolve_take(r, 'L', &mode);
    resolve_take(r, 'Q', &seconds);
    /* An analog input is only read: a wait would need a level to compare with. */
    if (mode < 0.0 || mode > (double)(analog ? WAIT_NOT : WAIT_LOW) || (mode > 0.0 && seconds <= 0.0))
        return STATUS_WAIT_WORDS;
    r->out->wait = (enum gcode_wait)mode;
    r->out->wait_s = (float)seconds;
    return mode == (double)r->out->wait ? STATUS_OK : STATUS_NOT_INTEGER;
}

enum status resolve_port(struct resolver *r) {
    const unsigned value = r->block->value[GROUP_PORT];

    r->out->port_sync = (value & OUTPUT_SYNC) != 0;
    if (value == INPUT_WAIT)
        return wait_for_input(r);
    return (value & OUTPUT_ANALOG) != 0 ? set_analog(r) : set_digital(r, value);
}
