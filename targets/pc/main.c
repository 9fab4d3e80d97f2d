/* SPDX-License-Identifier: MIT
 * The serving controller as a program. `wificnc serve` builds, runs and explains it; by itself it speaks in
 * lines of tab-separated words on stdout:
 *
 *   tcp ADDRESS | wmc3 ADDRESS | control ADDRESS | pty DEVICE   a door is open
 *   pendant ADDRESS or DEVICE          so is a pendant's
 *   ready                              it serves
 *   client WHAT NAME                   a client was connected, became owner, ...
 *   failed STAGE ERROR TEXT            it cannot; exit code 1
 *
 * Options, each with a value but --io-module: --timer-hz --step-pulse-ns --dir-setup-ns --max-step-rate-hz
 * --axes --ganged --switchless --home-axes --missing-outputs --speed (0: as fast as it can) --host --port
 * --wmc3 --control --pty --spindle-bus --bus-port --store --set --restart --restart-address (struct
 * host_board: it has just restarted by itself), of a pendant --pendant-serial --pendant-pty --pendant-tcp
 * --pendant-baud
 * --pendant-kind; and --parent: end when stdin does. The access key of network clients is in WIFICNC_KEY,
 * because arguments can be read by everyone.
 */
#include "host_device.h"
#include "port.h"
#include "serve.h"

#include <errno.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LINES_MAX = 256, USAGE = 2 };

/* Of the controller's settings, and of what hands do before anyone connects; NULL-terminated. */
struct lines {
    const char *settings[LINES_MAX + 1];
    const char *hands[LINES_MAX + 1];
};

static void say(const char *format, ...) {
    char line[512];
    va_list arguments;
    va_start(arguments, format);
    int size = vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    if (size >= 0)
        port_say(line, (size_t)size < sizeof line ? (size_t)size : sizeof line);
}

static void say_listens(void *ctx, const char *kind, const char *where) {
    (void)ctx;
    say("%s\t%s\n", kind, where);
}

static void say_client(void *ctx, const char *what, const char *who) {
    (void)ctx;
    say("client\t%s\t%s\n", what, who);
}

static int say_failure(const struct serve_failure *failure) {
    static const char *const stages[] = {
        [SERVE_MEMORY] = "memory",   [SERVE_BOARD] = "board",    [SERVE_STORE] = "store",
        [SERVE_SETTING] = "setting", [SERVE_HANDS] = "hands",    [SERVE_TCP] = "tcp",
        [SERVE_CONTROL] = "control", [SERVE_PTY] = "pty",        [SERVE_WIRE] = "wmc3",
        [SERVE_BUS] = "bus",         [SERVE_PENDANT] = "pendant"};
    const char *text = failure->detail != NULL ? failure->detail : port_error_text(failure->error);
    say("failed\t%s\t%d\t%s\n", stages[failure->stage], failure->error, text);
    return 1;
}

/* ---- options ---- */

static bool read_number(const char *text, uint32_t *out) {
    char *end;
    unsigned long number = strtoul(text, &end, 10);
    *out = (uint32_t)number;
    return *text != '\0' && *end == '\0' && number <= UINT32_MAX;
}

static bool read_count(const char *value, uint8_t *out) {
    uint32_t count = 0;
    bool good = read_number(value, &count) && count <= UINT8_MAX;
    *out = good ? (uint8_t)count : 0;
    return good;
}

static bool read_short(const char *value, uint16_t *out) {
    uint32_t number = 0;
    bool good = read_number(value, &number) && number <= UINT16_MAX;
    *out = good ? (uint16_t)number : 0;
    return good;
}

static bool read_axes(const char *value, axis_mask_t *out) {
    uint32_t axes = 0;
    bool good = read_number(value, &axes) && axes < 1u << AXIS_COUNT;
    *out = good ? (axis_mask_t)axes : 0;
    return good;
}

/* What is no number of the machine. */
static bool take_parts(struct host_board *board, const char *name, const char *value) {
    static struct device_board device;
    if (strcmp(name, "--device") == 0) {
        board->device = &device;
        return host_device_parse(value, &device);
    }
    if (strcmp(name, "--spindle-bus") == 0)
        return read_count(value, &board->spindle_bus);
    for (unsigned motor = 0; motor < MOTOR_COUNT * AXIS_COUNT; motor++) {
        char driver[] = "--driver-x2";
        driver[sizeof driver - 3] = "xyzabc"[motor % AXIS_COUNT];
        driver[sizeof driver - 2] = motor < AXIS_COUNT ? '\0' : '2';
        if (strcmp(name, driver) == 0)
            return read_number(value, &board->driver[motor]);
    }
    if (strcmp(name, "--pump-hz") == 0)
        return read_short(value, &board->pump_hz);
    if (strcmp(name, "--pump-clock-hz") == 0)
        return read_number(value, &board->pump_clock_hz);
    if (strcmp(name, "--pump-ticks-min") == 0)
        return read_number(value, &board->pump_ticks_min);
    if (strcmp(name, "--pump-ticks-max") == 0)
        return read_number(value, &board->pump_ticks_max);
    return false;
}

static bool take_board(struct host_board *board, const char *name, const char *value) {
    uint32_t axes = 0;
    if (strcmp(name, "--timer-hz") == 0)
        return read_number(value, &board->timer_hz);
    if (strcmp(name, "--step-pulse-ns") == 0)
        return read_number(value, &board->step_pulse_ns);
    if (strcmp(name, "--default-pulse-us") == 0)
        return read_count(value, &board->default_pulse_us);
    if (strcmp(name, "--step-spread-ns") == 0)
        return read_number(value, &board->step_spread_ns);
    if (strcmp(name, "--step-grid-ns") == 0)
        return read_number(value, &board->step_grid_ns);
    if (strcmp(name, "--look-ahead") == 0)
        return read_short(value, &board->look_ahead);
    if (strcmp(name, "--laser-marks") == 0)
        return read_short(value, &board->laser_marks);
    if (strcmp(name, "--dir-setup-ns") == 0)
        return read_number(value, &board->dir_setup_ns);
    if (strcmp(name, "--max-step-rate-hz") == 0)
        return read_number(value, &board->max_step_rate_hz);
    if (strcmp(name, "--ganged") == 0)
        return read_axes(value, &board->ganged);
    if (strcmp(name, "--switchless") == 0)
        return read_short(value, &board->switchless);
    if (strcmp(name, "--home-axes") == 0)
        return read_axes(value, &board->home_axes);
    if (strcmp(name, "--missing-outputs") == 0)
        return read_count(value, &board->missing_outputs);
    if (strcmp(name, "--analog") == 0) {
        board->analog = strcmp(value, "1") == 0;
        return true;
    }
    if (strcmp(name, "--digital-inputs") == 0)
        return read_count(value, &board->digital_inputs);
    if (strcmp(name, "--digital-outputs") == 0)
        return read_count(value, &board->digital_outputs);
    if (strcmp(name, "--tasks") == 0)
        return read_count(value, &board->tasks);
    if (strcmp(name, "--toolsetter") == 0) {
        board->toolsetter = strcmp(value, "1") == 0;
        return true;
    }
    if (strcmp(name, "--encoder") == 0) {
        board->encoder = strcmp(value, "1") == 0;
        return true;
    }
    if (strcmp(name, "--dial") == 0)
        return read_count(value, &board->dial);
    if (strcmp(name, "--restart") == 0)
        return read_count(value, &board->restart);
    if (strcmp(name, "--restart-address") == 0)
        return read_number(value, &board->restart_address);
    if (strcmp(name, "--axes") != 0 || !read_number(value, &axes) || axes > AXIS_COUNT)
        return false;
    board->axis_count = (uint8_t)axes;
    return true;
}

/* @return false: there are too many */
static bool add_line(const char **lines, const char *line) {
    size_t count = 0;
    while (lines[count] != NULL)
        count++;
    lines[count] = line;
    return count < LINES_MAX;
}

static bool take_pendant(struct serve_pendant_options *pendant, const char *name, const char *value) {
    if (strcmp(name, "--pendant-serial") == 0)
        pendant->serial = value;
    else if (strcmp(name, "--pendant-pty") == 0)
        pendant->pty_link = value;
    else if (strcmp(name, "--pendant-tcp") == 0)
        pendant->tcp_port = value;
    else if (strcmp(name, "--pendant-baud") == 0)
        return read_number(value, &pendant->baud);
    else if (strcmp(name, "--pendant-kind") == 0)
        pendant->kind = strcmp(value, "mpg") == 0 ? NET_PENDANT_MPG : NET_PENDANT_TERMINAL;
    else
        return false;
    return true;
}

static bool take_option(struct serve_options *options, struct lines *lines, const char *name,
                        const char *value) {
    char *end;
    if (strcmp(name, "--host") == 0) {
        options->tcp_host = value;
    } else if (strcmp(name, "--port") == 0) {
        options->tcp_port = value;
    } else if (strcmp(name, "--wmc3") == 0) {
        options->wire_address = value;
    } else if (strcmp(name, "--control") == 0) {
        options->control_port = value;
    } else if (strcmp(name, "--pty") == 0) {
        options->pty_link = value;
    } else if (strcmp(name, "--bus-port") == 0) {
        options->spindle_bus = value;
    } else if (strncmp(name, "--pendant", 9) == 0) {
        return take_pendant(&options->pendant, name, value);
    } else if (strcmp(name, "--store") == 0) {
        options->store = value;
    } else if (strcmp(name, "--speed") == 0) {
        options->speed = strtod(value, &end);
        return *end == '\0' && options->speed >= 0.0 && options->speed <= 1e6;
    } else if (strcmp(name, "--set") == 0) {
        return add_line(lines->settings, value);
    } else if (strcmp(name, "--hands") == 0) {
        return add_line(lines->hands, value);
    } else {
        return strncmp(name, "--device", 8) == 0 || strncmp(name, "--pump", 6) == 0 ||
                       strncmp(name, "--driver-", 9) == 0 || strcmp(name, "--spindle-bus") == 0
                   ? take_parts(&options->board, name, value)
                   : take_board(&options->board, name, value);
    }
    return true;
}

static bool read_options(int argc, char **argv, struct serve_options *options, struct lines *lines) {
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--parent") == 0) {
            options->stop_fd[1] = port_parent_fd();
            continue;
        }
        if (strcmp(argv[i], "--io-module") == 0) {
            options->io_module = true;
            continue;
        }
        if (i + 1 == argc || !take_option(options, lines, argv[i], argv[i + 1])) {
            fprintf(stderr, "not an option, or its value is missing or wrong: %s\n", argv[i]);
            return false;
        }
        i++;
    }
    if (options->tcp_host != NULL && options->tcp_port == NULL)
        fprintf(stderr, "--host needs --port\n");
    return options->tcp_host == NULL || options->tcp_port != NULL;
}

#ifndef PIO_UNIT_TESTING /* there main() is the test's */
int main(int argc, char **argv) {
    static struct lines lines; /* 4 KB are too much for a frame */
    struct serve_failure failure;
    const char *key = getenv("WIFICNC_KEY");
    struct serve_options options = {
        .board = {.timer_hz = 20000000,
                  .step_pulse_ns = 1000,
                  .dir_setup_ns = 500,
                  .max_step_rate_hz = 500000,
                  .axis_count = 3},
        .speed = 1.0,
        .key = key != NULL ? key : "",
        .settings = lines.settings,
        .hands = lines.hands,
        .stop_fd = {-1, -1},
        .events = {.listens = say_listens, .client = say_client},
    };
    argv = port_start(argv);
    if (argv == NULL)
        return say_failure(&(struct serve_failure){.stage = SERVE_MEMORY, .error = ENOMEM});
    if (!read_options(argc, argv, &options, &lines))
        return USAGE;
    int error = port_catch_requests(&options.stop_fd[0]);
    if (error != 0)
        return say_failure(&(struct serve_failure){.stage = SERVE_MEMORY, .error = error});
    struct serve *serve = serve_create(&options, &failure);
    if (serve == NULL)
        return say_failure(&failure);
    say("ready\n");
    error = serve_run(serve);
    serve_destroy(serve);
    return error != 0 ? say_failure(&(struct serve_failure){.stage = SERVE_MEMORY, .error = error}) : 0;
}
#endif
