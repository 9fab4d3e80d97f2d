/* SPDX-License-Identifier: MIT
 * The HAL component: a LinuxCNC userspace program that halcompile builds. It reads what LinuxCNC's realtime
 * `sampler` has seen in each servo period, and streams it to a controller. docs/linuxcnc.md describes options
 * and pins. */
#define _GNU_SOURCE
#include "link.h"
#include "module.h"
#include "network.h"

#include "base/version.h"

#include <hal.h>
#include <rtapi.h>

#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static const double RETRY_S = 1.0;
static const double CONNECT_S = 1.0; /* TCP may take this long */
static const double FIRST_S = 3.0;   /* LinuxCNC waits this long for a controller, then continues without */
static const double SERVO_MAX_S = 0.01;
enum {
    SAMPLER_KEY = 0x48534130, /* of sampler's first stream; the others' follow */
    SAMPLES_MAX = 5000,       /* immediately */
};

struct program {
    const char *name, *address;
    int component, sampler;
    bool is_ready, is_lost;
    hal_stream_t samples;
    struct pins *pins; /* in HAL's memory */
    struct network network;
    struct link_options options;
    struct peer *peer; /* of one of these two */
    struct link link;
    bool is_module; /* `module` and its pins instead of `link` and its */
    struct module_pins *module_pins;
    struct module module;
    const char *broken; /* what the sockets say */
    char key[128];      /* of --key-file */
};

static volatile sig_atomic_t ends;

static void end(int signal) {
    (void)signal;
    ends = 1;
}

static double now_s(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

// ---- HAL ----

/* cppcheck-suppress constParameterCallback ; the type is fixed */
static int make_pin(void *ctx, const char *name, enum pin_type type, enum pin_direction direction,
                    void **at) {
    static const hal_type_t types[] = {[PIN_BIT] = HAL_BIT, [PIN_FLOAT] = HAL_FLOAT, [PIN_U32] = HAL_U32};
    static const hal_pin_dir_t directions[] = {[PIN_IN] = HAL_IN, [PIN_OUT] = HAL_OUT, [PIN_IO] = HAL_IO};
    const struct program *program = ctx;
    char full[HAL_NAME_LEN + 1];
    if ((size_t)snprintf(full, sizeof full, "%s.%s", program->name, name) >= sizeof full)
        return -ENAMETOOLONG;
    return hal_pin_new(full, types[type], directions[direction], at, program->component);
}

/* The pointers to pins are HAL's: it moves them when pins are linked. */
static int make_pins(struct program *program) {
    program->pins = hal_malloc(sizeof *program->pins);
    program->module_pins = hal_malloc(sizeof *program->module_pins);
    if (program->pins == NULL || program->module_pins == NULL)
        return -ENOMEM;
    if (program->is_module)
        return module_make_pins(program->module_pins, make_pin, program);
    *program->pins = (struct pins){.joints = program->options.joints};
    return pins_make(program->pins, make_pin, program);
}

/* What each record of the sampler is: positions, servo time, motion type. */
static int attach_samples(struct program *program) {
    if (program->is_module)
        return 0;
    char types[PIN_JOINTS + 3] = "";
    memset(types, 'f', program->options.joints + 1);
    types[program->options.joints + 1] = 's';
    int wrong =
        hal_stream_attach(&program->samples, program->component, SAMPLER_KEY + program->sampler, types);
    if (wrong != 0)
        fprintf(stderr,
                "%s: no sampler %d with cfg=%s (%s): `loadrt sampler depth=1000 cfg=%s` goes before it\n",
                program->name, program->sampler, types, strerror(-wrong), types);
    return wrong;
}

static bool read_sample(struct program *program, struct sample *sample) {
    union hal_stream_data data[PIN_JOINTS + 2];
    unsigned joints = program->options.joints, number;
    if (program->is_module || hal_stream_read(&program->samples, data, &number) < 0)
        return false;
    for (unsigned joint = 0; joint < joints; joint++)
        sample->command[joint] = data[joint].f;
    sample->servo_s = data[joints].f;
    sample->motion_type = data[joints + 1].s;
    return true;
}

// ---- the link's world ----

/* cppcheck-suppress constParameterCallback ; the type is fixed */
static void send_udp(void *ctx, const uint8_t *packet, size_t size) {
    const struct program *program = ctx;
    network_send_udp(&program->network, packet, size);
}

static void send_tcp(void *ctx, const uint8_t *bytes, size_t size) {
    struct program *program = ctx;
    if (!network_send_tcp(&program->network, bytes, size))
        program->broken = "the controller takes no requests";
}

/* Then there is time for several pins before it looks at them again. */
// Of the system; cannot fail for so few.
static void system_random(void *ctx, uint8_t *bytes, size_t count) {
    (void)ctx;
    if (getentropy(bytes, count) != 0)
        abort();
}

static void await_servo(void *ctx) {
    struct program *program = ctx;
    int before = hal_stream_depth(&program->samples);
    double end_s = now_s() + SERVO_MAX_S;
    while (hal_stream_depth(&program->samples) == before && now_s() < end_s) {
    }
}

/* cppcheck-suppress constParameterCallback ; the type is fixed */
static void say(void *ctx, const char *text) {
    const struct program *program = ctx;
    fprintf(stderr, "%s: %s\n", program->name, text);
}

static void hear_udp(void *ctx, const uint8_t *packet, size_t size) {
    struct program *program = ctx;
    peer_hear_udp(program->peer, packet, size, now_s());
}

static void hear_tcp(void *ctx, const uint8_t *bytes, size_t count) {
    struct program *program = ctx;
    peer_hear_tcp(program->peer, bytes, count, now_s());
}

// ---- the loop ----

/* The servo thread does not stop while there is no controller, and old samples are none of its. */
static void drop_samples(struct program *program) {
    struct sample sample;
    for (unsigned i = 0; i < SAMPLES_MAX && read_sample(program, &sample); i++) {
    }
}

static void be_ready(struct program *program) {
    if (!program->is_ready)
        hal_ready(program->component);
    program->is_ready = true;
}

/* @return NULL: connected; else why not */
static const char *await_connection(struct program *program) {
    const char *wrong = NULL;
    double end_s = now_s() + CONNECT_S;
    while (!ends && now_s() < end_s) {
        if (network_is_connected(&program->network, &wrong))
            return NULL;
        if (wrong != NULL)
            return wrong;
        network_wait(&program->network, LINK_TICK_S);
    }
    return "no controller there";
}

static const char *tick(struct program *program) {
    struct sample sample;
    const char *wrong = network_receive(&program->network, hear_udp, hear_tcp, program);
    if (wrong != NULL)
        return wrong;
    for (unsigned i = 0; i < SAMPLES_MAX && read_sample(program, &sample); i++)
        link_sample(&program->link, &sample, now_s());
    if (!program->is_module)
        link_note_lost_samples(&program->link, (uint32_t)hal_stream_num_overruns(&program->samples));
    wrong = program->is_module ? module_tick(&program->module, now_s()) : link_tick(&program->link, now_s());
    if (wrong == NULL && program->peer->is_known)
        be_ready(program);
    return wrong != NULL ? wrong : program->broken;
}

/* Look after what comes, and after the spindle, until the next tick. @return why the controller is gone */
static const char *rest(struct program *program, double due_s) {
    const char *wrong = NULL;
    for (double left_s; wrong == NULL && !ends && (left_s = due_s - now_s()) > 0.0;) {
        bool often = program->link.has_encoder;
        network_wait(&program->network, often ? fmin(left_s, LINK_SPINDLE_S) : left_s);
        wrong = network_receive(&program->network, hear_udp, hear_tcp, program);
        if (!program->is_module)
            link_follow_spindle(&program->link, now_s());
    }
    return wrong;
}

/* Until the controller is gone. @return why */
static const char *serve(struct program *program) {
    const struct peer_world world = {program, send_udp, send_tcp, system_random, await_servo, say};
    const char *wrong = NULL;
    double due_s = now_s();
    program->broken = NULL;
    drop_samples(program);
    if (program->is_module)
        module_begin(&program->module, program->module_pins, &world, program->options.key, now_s());
    else
        link_begin(&program->link, program->pins, &world, &program->options, now_s());
    while (!ends && (wrong = tick(program)) == NULL) {
        due_s = fmax(due_s + LINK_TICK_S, now_s());
        wrong = rest(program, due_s);
        if (wrong != NULL)
            break;
    }
    return wrong;
}

static void lose_pins(const struct program *program) {
    if (program->is_module)
        module_lose(program->module_pins);
    else
        link_lose(program->pins);
}

/* @param wrong  said once, until there is a controller again */
static void lose(struct program *program, const char *wrong, double begun_s) {
    lose_pins(program);
    if (!program->is_lost || program->peer->is_known)
        say(program, wrong);
    program->is_lost = true;
    program->peer->is_known = false;
    if (now_s() - begun_s >= FIRST_S)
        be_ready(program);
}

static void run(struct program *program) {
    double begun_s = now_s();
    while (!ends) {
        const char *wrong = network_open(&program->network, program->address);
        if (wrong == NULL)
            wrong = await_connection(program);
        if (wrong == NULL)
            wrong = serve(program);
        network_close(&program->network);
        if (!ends)
            lose(program, wrong, begun_s);
        for (double end_s = now_s() + RETRY_S; !ends && now_s() < end_s;) {
            struct timespec some = {.tv_nsec = (long)(1e9 * LINK_TICK_S)};
            nanosleep(&some, NULL);
            drop_samples(program);
        }
    }
    lose_pins(program); /* LinuxCNC may continue without us; signals keep their last values */
}

// ---- the command line ----

static void show_help(FILE *to) {
    fputs("usage: wificnc-hal --address IPV4 [option ...]\n"
          "The HAL component of WiFiCNC " VERSION_TEXT ": LinuxCNC plans, the controller steps.\n\n"
          "  --address IPV4    of the controller\n"
          "  --joints N        1 to 6, 3 if not said; joint n is the controller's axis n\n"
          "  --name NAME       of the component, before its pins; wificnc if not said\n"
          "  --key-file FILE   where `wificnc linuxcnc pair` has stored the access key; may be missing\n"
          "  --key KEY         access key, if the controller is locked; others see it in the list of "
          "processes,\n"
          "                    but not what the environment variable WIFICNC_KEY says\n"
          "  --queue-ms MS     motion that waits in the controller, 10 to 1000; 100 if not said\n"
          "  --run-up-s S      of a spindle without an encoder, until it is reported at speed; 0 if not "
          "said\n"
          "  --sampler N       which of sampler's records to read; 0 if not said\n"
          "  --io-module       it is an I/O module: its channels, and no motion\n\n"
          "docs/linuxcnc.md describes its pins and the HAL file around it.\n",
          to);
}

/* @return false: no number from `least` to `most` */
static bool number_of(const char *option, const char *text, bool is_whole, double least, double most,
                      double *number) {
    char *after;
    *number = strtod(text, &after);
    bool is_number = *text != '\0' && *after == '\0' && *number >= least && *number <= most;
    if (is_number && (!is_whole || *number == floor(*number)))
        return true;
    fprintf(stderr, "wificnc-hal: --%s %s: it is a %snumber from %g to %g\n", option, text,
            is_whole ? "whole " : "", least, most);
    return false;
}

/* One line. Where there is no file, the controller may need no key. */
static bool read_key(struct program *program, const char *path) {
    FILE *file = fopen(path, "r");
    if (file == NULL && errno == ENOENT)
        return true;
    if (file == NULL || fgets(program->key, sizeof program->key, file) == NULL) {
        fprintf(stderr, "wificnc-hal: --key-file %s: cannot read it\n", path);
        if (file != NULL)
            (void)fclose(file);
        return false;
    }
    (void)fclose(file);
    program->key[strcspn(program->key, "\r\n")] = '\0';
    program->options.key = program->key;
    return true;
}

static bool take_option(struct program *program, int option, const char *name, const char *text) {
    double number = 0.0;
    bool fine = true;
    switch (option) {
    case 'a':
        program->address = text;
        fine = network_is_address(text);
        if (!fine)
            fprintf(stderr, "wificnc-hal: --address %s: it is an IPv4 address, like 192.168.1.50\n", text);
        break;
    case 'm':
        program->is_module = true;
        break;
    case 'n':
        program->name = text;
        break;
    case 'k':
        program->options.key = text;
        break;
    case 'f':
        fine = read_key(program, text);
        break;
    case 'j':
        fine = number_of(name, text, true, 1, PIN_JOINTS, &number);
        program->options.joints = (unsigned)number;
        break;
    case 'q':
        fine = number_of(name, text, false, 10, 1000, &number);
        program->options.level_s = number / 1e3;
        break;
    case 'r':
        fine = number_of(name, text, false, 0, 3600, &number);
        program->options.run_up_s = number;
        break;
    default:
        fine = number_of(name, text, true, 0, 7, &number);
        program->sampler = (int)number;
    }
    return fine;
}

static bool parse(struct program *program, int argc, char **argv) {
    static const struct option options[] = {
        {"address", required_argument, NULL, 'a'},  {"name", required_argument, NULL, 'n'},
        {"key", required_argument, NULL, 'k'},      {"key-file", required_argument, NULL, 'f'},
        {"joints", required_argument, NULL, 'j'},   {"queue-ms", required_argument, NULL, 'q'},
        {"run-up-s", required_argument, NULL, 'r'}, {"sampler", required_argument, NULL, 's'},
        {"help", no_argument, NULL, 'h'},           {"version", no_argument, NULL, 'v'},
        {"io-module", no_argument, NULL, 'm'},      {NULL, 0, NULL, 0},
    };
    int which = 0;
    for (int option; (option = getopt_long(argc, argv, "", options, &which)) != -1;) {
        if (option == 'h' || option == 'v') {
            option == 'h' ? show_help(stdout) : (void)puts(VERSION_TEXT);
            exit(EXIT_SUCCESS);
        }
        if (option == '?' || !take_option(program, option, options[which].name, optarg))
            return false;
    }
    if (program->address != NULL && optind == argc)
        return true;
    if (program->address == NULL)
        fprintf(stderr, "wificnc-hal: --address is missing\n");
    else
        fprintf(stderr, "wificnc-hal: %s is behind the options, where nothing belongs\n", argv[optind]);
    return false;
}

int main(int argc, char **argv) {
    static struct program program = {
        .name = "wificnc",
        .network = {-1, -1, -1},
        .options = {.joints = 3, .level_s = 0.1, .key = ""},
    };
    const char *key = getenv("WIFICNC_KEY");
    if (key != NULL)
        program.options.key = key;
    if (!parse(&program, argc, argv)) {
        show_help(stderr);
        return EXIT_FAILURE;
    }
    struct sigaction action = {.sa_handler = end};
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    program.component = hal_init(program.name);
    if (program.component < 0) {
        fprintf(stderr,
                "%s: hal_init: %s. Is there a component of this name already? Restart LinuxCNC, or choose "
                "another --name\n",
                program.name, strerror(-program.component));
        return EXIT_FAILURE;
    }
    program.peer = program.is_module ? &program.module.peer : &program.link.peer;
    int wrong = attach_samples(&program);
    if (wrong == 0 && (wrong = make_pins(&program)) != 0)
        fprintf(stderr, "%s: cannot make its pins: %s\n", program.name, strerror(-wrong));
    if (wrong == 0)
        run(&program);
    if (program.samples.fifo != NULL)
        hal_stream_detach(&program.samples);
    hal_exit(program.component);
    return wrong == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
