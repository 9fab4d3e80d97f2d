/* SPDX-License-Identifier: MIT
 * The beam rule. Whatever is not named here is dark: the beam needs the state Run, M3 or M4, and a span of
 * cutting motion (SEGMENT_CUT) that the step interrupt executes at this moment. */
#include "machine/laser.h"

#include "machine/inner.h"

#include <stddef.h>

#define LOAD(field) __atomic_load_n(&(field), __ATOMIC_ACQUIRE)

/* The span that the step interrupt executes. It may end between two reads; then the ring's tail has moved, and
 * we look again. @return false: nothing is executed, or it is no cut */
static bool is_cutting(const struct step *step, uint32_t *line) {
    for (;;) {
        if (!LOAD(step->active))
            return false;
        uint32_t tail = LOAD(step->ring.index.tail);
        const struct span *span = &step->ring.slots[tail & (SPAN_RING_SIZE - 1)];
        uint16_t flags = LOAD(span->flags);
        *line = LOAD(span->line);
        if (LOAD(step->ring.index.tail) == tail)
            return (flags & (SEGMENT_CUT | SEGMENT_DWELL)) == SEGMENT_CUT;
    }
}

/* M4: part of the power that the speed asks for, so that corners are not burnt. The speed is that of the
 * motion emitted last, a few ms ahead of the pins. */
static float part_at_speed(const struct machine *machine, float feed_mm_s) {
    float asked_mm_s = feed_mm_s * (float)machine_feed_pct(machine) * 0.01f;
    float part = asked_mm_s > 0.0f ? machine_speed_mm_s(machine) / asked_mm_s : 0.0f;
    return part > 1.0f ? 1.0f : part;
}

float laser_rpm(const struct machine *machine) {
    uint32_t line;
    if (machine->state != MACHINE_RUN || machine->outputs.spindle == SPINDLE_OFF ||
        !is_cutting(&machine->step, &line))
        return 0.0f;
    if (machine->motion.ring.owner == RING_OWNER_HOST) /* it plans the speed, so it scales S by it */
        return machine->outputs.rpm;
    const struct line_note *note = notes_find(&machine->notes, line);
    if (note == NULL)
        return 0.0f;
    return machine->outputs.spindle == SPINDLE_CW ? note->rpm
                                                  : note->rpm * part_at_speed(machine, note->feed_mm_s);
}
