/* SPDX-License-Identifier: MIT
 * The inside of a host controller, shared by host.c (time) and host_hal.c (pins). No one else looks here. */
#ifndef WIFICNC_PC_INNER_H
#define WIFICNC_PC_INNER_H

#include "hal/hal.h"
#include "hal/hal_step.h"
#include "host.h"
#include "host_bus.h"
#include "host_drivers.h"
#include "machine/dial.h"
#include "machine/motor_drivers.h"
#include "machine/parts.h"
#include "machine/vfd_spindle.h"
#include "output_log.h"
#include "tasks.h"
#include "virtual.h"

enum { WAITING_SIZE = 16 * RX_SIZE };

struct hal {
    struct hal_step step;
    uint32_t timer_hz;
    uint32_t timer_mhz_q8; /* ticks per us, 24.8 */
    struct virtual_machine virtual_machine;
    struct virtual_outputs outputs_set; /* spindle and coolant as the controller wants them */
    bool keeps_duty;                    /* the duty is that of the step interrupt */
    struct output_log output_log;
    uint64_t output_period_ticks,
        outputs_due_ticks; /* 0: the pins follow immediately; when they follow next */
    struct hal_ganged ganged;
    struct hal_pump pump;
    struct hal_dial dial;
    struct host_bus bus;
    struct host_drivers drivers;
    uint16_t switchless;             /* as in struct host_board */
    const struct settings *settings; /* $88: counts of the encoder, unless hands say otherwise */
    uint64_t switch_ticks;           /* when the switch timer's time is over; UINT64_MAX: it rests */
    enum hal_probe watched;          /* the line that the step ISR looks at ... */
    bool probe_high;                 /* ... and the level that it watches for */
};

/** Who looks on; NULL functions: no one. */
struct host_observer {
    void *ctx;
    void (*looked)(void *ctx, bool controller); /* the tasks that were due have looked; was it one of them? */
    void (*put)(void *ctx, uint8_t byte, bool lossy);         /* the controller has got a byte, or lost it */
    void (*asked)(void *ctx);                                 /* a remote host has sent a packet */
    void (*said)(void *ctx, const char *bytes, size_t count); /* it said this */
    void (*dropped)(void *ctx, uint32_t lines); /* it will not answer the newest of what it has got */
};

struct host {
    struct machine machine;
    struct host_observer observer;
    struct hal hal;
    struct machine_vfd vfd;
    struct machine_drivers drivers;
    struct machine_dial dial;
    struct hal_restart restart; /* of this start */
    struct trace trace;
    struct tasks tasks;
    char waiting[WAITING_SIZE]; /* bytes that arrived while the reader was stalled */
    size_t waiting_count;
    const struct trace_event *seen; /* the true position counts every edge before this one */
    uint64_t timer_events;
    uint64_t alarm_ticks; /* when the last alarm came */
    bool alarm_seen;
    int input_follows;
    host_segment_watcher *watch; /* NULL: no one looks */
    void *watch_ctx;
    uint32_t watched;               /* batches of segments seen so far */
    struct host_published *planned; /* segments that may still be replaced; host_watch.c */
    uint32_t planned_count, planned_size;
    bool paced;       /* the wall clock leads */
    char *store_path; /* NULL: nothing is kept */
    struct device_board device;
    char *out; /* what the controller said and no one has read yet */
    size_t out_count, out_size;
};

/** Look at what the last poll has published, and show what is stepped. */
void host_show_segments(struct host *host);

/** Analog inputs and outputs of the virtual machine. */
extern const struct hal_analog host_analog;

/** The encoder of its spindle. */
extern const struct hal_encoder host_encoder;

/** The dial that struct host_board describes. */
struct hal_dial host_dial(unsigned code);

/** Its charge pump. */
struct hal_pump host_pump(const struct host_board *board);

/** What it has restarted by, for struct machine_board. */
const struct hal_restart *host_restart(struct host *host, const struct host_board *board);

/** Its servo output. */
extern const struct hal_servo host_servo;

/** When inputs change or the switch timer's time is over, without a step; or UINT64_MAX. */
uint64_t host_next_edge_ticks(const struct host *host);

/** Let the true position and the inputs follow the edges since the last call.
 *  @return true when a level changed: the controller must look before time continues. */
bool host_follow_edges(struct host *host);

#endif
