/* SPDX-License-Identifier: MIT
 * Step events -> value change dump (IEEE 1364), for GTKWave, PulseView and their like.
 * Identifier codes: '!' + n is the step line of axis n, '!' + AXIS_COUNT + n its direction line, and the one
 * behind them all a laser's duty. */
#include "trace_write.h"

#include <string.h>

enum { FIRST_CODE = '!', NAME = 64, LINE = NAME + 32, EVENT = 4 * (1 + 20 + 1) + 3 * TRACE_SIGNALS * 3 + 32 };

static char *put_text(char *p, const char *text) {
    size_t size = strlen(text);
    memcpy(p, text, size);
    return p + size;
}

static char *put_level(char *p, char level, unsigned signal) {
    *p++ = level;
    *p++ = (char)(FIRST_CODE + signal);
    *p++ = '\n';
    return p;
}

/* One line per axis in mask: its level after the change. first is 0 for step lines, AXIS_COUNT for
 * directions. */
static char *put_levels(char *p, axis_mask_t mask, axis_mask_t levels, unsigned first) {
    for (unsigned axis = 0; axis < AXIS_COUNT; axis++)
        if (mask & 1u << axis)
            p = put_level(p, (levels & 1u << axis) != 0 ? '1' : '0', first + axis);
    return p;
}

/* Advances to t_ns; it never goes back. */
static char *put_time(char *p, struct trace_vcd *vcd, uint64_t t_ns) {
    if (t_ns <= vcd->now_ns)
        return p;
    vcd->now_ns = t_ns;
    *p++ = '#';
    p = trace_put_u64(p, t_ns);
    *p++ = '\n';
    return p;
}

/* End the pulses that are high before t_ns. A pulse that the next edge overtakes is shown cut short: too fast
 * a train must be seen. */
static char *put_fall(char *p, struct trace_vcd *vcd, uint64_t t_ns) {
    if (vcd->high_mask == 0)
        return p;
    p = put_time(p, vcd, vcd->fall_ns < t_ns ? vcd->fall_ns : t_ns - (t_ns > 0));
    p = put_levels(p, vcd->high_mask, 0, 0);
    vcd->high_mask = 0;
    return p;
}

static char *put_event(char *p, struct trace_vcd *vcd, const struct trace_event *event, uint64_t t_ns) {
    p = put_fall(p, vcd, t_ns);
    axis_mask_t turned = (axis_mask_t)((vcd->dir_mask ^ event->dir_mask) & vcd->shown_dir);
    if (turned != 0) {
        /* An event says only the direction of its step; the line has changed at least the setup time
         * before it. */
        p = put_time(p, vcd, t_ns > vcd->dir_setup_ns ? t_ns - vcd->dir_setup_ns : 0);
        p = put_levels(p, turned, event->dir_mask, AXIS_COUNT);
        vcd->dir_mask = event->dir_mask;
    }
    p = put_time(p, vcd, t_ns);
    vcd->high_mask = event->step_mask & vcd->shown_step;
    vcd->fall_ns = t_ns + vcd->pulse_ns;
    return put_levels(p, vcd->high_mask, vcd->high_mask, 0);
}

static void consume(void *ctx, const struct trace_event *events, size_t count) {
    struct trace_writer *writer = ctx;
    if (writer->error != 0)
        return;
    for (size_t i = 0; i < count; i++) {
        char *p = trace_writer_room(writer, EVENT);
        p = put_event(p, &writer->vcd, &events[i], trace_ns(writer, events[i].t_ticks));
        trace_writer_keep(writer, p);
    }
}

static char *put_duty(char *p, uint16_t duty) {
    *p++ = 'b';
    for (unsigned bit = 16; bit-- > 0;)
        *p++ = (duty >> bit & 1) != 0 ? '1' : '0';
    *p++ = ' ';
    *p++ = (char)(FIRST_CODE + TRACE_SIGNALS);
    *p++ = '\n';
    return p;
}

static void follow(void *ctx, uint64_t t_ticks, uint16_t duty) {
    struct trace_writer *writer = ctx;
    if (writer->error != 0)
        return;
    struct trace_vcd *vcd = &writer->vcd;
    uint64_t t_ns = trace_ns(writer, t_ticks);
    char *p = trace_writer_room(writer, EVENT);
    if (vcd->fall_ns < t_ns)
        p = put_fall(p, vcd, t_ns);
    trace_writer_keep(writer, put_duty(put_time(p, vcd, t_ns), duty));
}

static void finish(struct trace_writer *writer) {
    char *p = trace_writer_room(writer, EVENT);
    trace_writer_keep(writer, put_fall(p, &writer->vcd, UINT64_MAX));
}

static char *put_name(char *p, const char *name) {
    for (unsigned i = 0; i < NAME && name[i] != '\0'; i++) {
        char c = name[i];
        int plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
        *p++ = plain ? c : '_';
    }
    return p;
}

static void write_header(struct trace_writer *writer, const char *const names[TRACE_SIGNALS]) {
    char *p = trace_writer_room(writer, 256 + 2 * TRACE_SIGNALS * LINE);
    p = put_text(p, "$version WiFiCNC step trace $end\n$timescale 1 ns $end\n$scope module board $end\n");
    for (unsigned signal = 0; signal < TRACE_SIGNALS; signal++) {
        if (names[signal] == NULL)
            continue;
        p = put_text(p, "$var wire 1 ");
        *p++ = (char)(FIRST_CODE + signal);
        *p++ = ' ';
        p = put_name(p, names[signal]);
        p = put_text(p, " $end\n");
    }
    p = put_text(p, "$var reg 16 ");
    *p++ = (char)(FIRST_CODE + TRACE_SIGNALS);
    p = put_text(p, " duty $end\n");
    p = put_text(p, "$upscope $end\n$enddefinitions $end\n#0\n$dumpvars\n");
    p = put_levels(p, writer->vcd.shown_step, 0, 0);
    p = put_levels(p, writer->vcd.shown_dir, 0, AXIS_COUNT);
    p = put_duty(p, 0);
    trace_writer_keep(writer, put_text(p, "$end\n"));
}

struct trace_writer *trace_vcd_open(const char *path, uint32_t timer_hz, uint32_t step_pulse_ns,
                                    uint32_t dir_setup_ns, const char *const names[TRACE_SIGNALS],
                                    int *error) {
    struct trace_writer *writer = trace_writer_open(path, timer_hz, consume, error);
    if (writer == NULL)
        return NULL;
    writer->finish = finish;
    writer->follow = follow;
    struct trace_vcd *vcd = &writer->vcd;
    /* A pulse without a length would not be visible: both edges would have the same time. */
    vcd->pulse_ns = step_pulse_ns > 0 ? step_pulse_ns : 1;
    vcd->dir_setup_ns = dir_setup_ns;
    for (unsigned axis = 0; axis < AXIS_COUNT; axis++) {
        vcd->shown_step |= (axis_mask_t)((names[axis] != NULL) << axis);
        vcd->shown_dir |= (axis_mask_t)((names[AXIS_COUNT + axis] != NULL) << axis);
    }
    write_header(writer, names);
    return writer;
}
