/* SPDX-License-Identifier: MIT
 * A plugin of QEMU (7.2 or later) that counts executed instructions: of each part of a program, and of the
 * longest call of some functions. Usage: -plugin libcount.so,table=FILE
 *
 * The table has a line for each function: "START END PART WATCHED", addresses in hex, PART a number below 64,
 * WATCHED 1 for a function whose longest call is wanted. Code that is in no line (the C library, division)
 * counts for the part that called it. A function calls only its own part and those with lower numbers, so a
 * watched call ends when one with a higher number runs. At the end stderr gets "part N INSTRUCTIONS" and
 * "call START LONGEST" lines. */
#include <inttypes.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* QEMU's interface to plugins, version 1. */
struct qemu_plugin_tb;
typedef uint64_t plugin_id;
__attribute__((visibility("default"))) int qemu_plugin_version = 1;
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *tb);
uint64_t qemu_plugin_tb_vaddr(const struct qemu_plugin_tb *tb);
void qemu_plugin_register_vcpu_tb_trans_cb(plugin_id id, void (*cb)(plugin_id id, struct qemu_plugin_tb *tb));
void qemu_plugin_register_vcpu_tb_exec_cb(struct qemu_plugin_tb *tb, void (*cb)(unsigned cpu, void *data),
                                          int flags, void *data);
void qemu_plugin_register_atexit_cb(plugin_id id, void (*cb)(plugin_id id, void *data), void *data);

enum { PARTS = 64, FUNCTIONS_MAX = 8192 };

struct function {
    uint64_t start, end;
    int part;
    bool watched;
    uint64_t longest;
};

struct block {
    uint32_t instructions;
    int part;                /* -1: in no line of the table */
    struct function *enters; /* a watched function that begins here */
};

static struct function functions[FUNCTIONS_MAX];
static size_t function_count;
static uint64_t counts[PARTS];
static int current;
static struct function *called;
static uint64_t call_count;

static void read_table(const char *name) {
    FILE *file = fopen(name, "r");
    if (file == NULL) {
        perror(name);
        exit(1);
    }
    struct function *f = functions;
    int watched;
    while (f < &functions[FUNCTIONS_MAX] &&
           fscanf(file, "%" SCNx64 " %" SCNx64 " %d %d", &f->start, &f->end, &f->part, &watched) == 4) {
        f->watched = watched != 0;
        f++;
    }
    function_count = (size_t)(f - functions);
    fclose(file);
}

static void on_run(unsigned cpu, void *data) {
    const struct block *block = data;
    (void)cpu;
    if (block->part >= 0)
        current = block->part;
    if (called != NULL && block->part > called->part) {
        called->longest = call_count > called->longest ? call_count : called->longest;
        called = NULL;
    }
    if (called == NULL && block->enters != NULL) {
        called = block->enters;
        call_count = 0;
    }
    counts[current] += block->instructions;
    call_count += block->instructions;
}

static void on_translate(plugin_id id, struct qemu_plugin_tb *tb) {
    (void)id;
    struct block *block = malloc(sizeof *block);
    uint64_t at = qemu_plugin_tb_vaddr(tb);
    *block = (struct block){.instructions = (uint32_t)qemu_plugin_tb_n_insns(tb), .part = -1};
    for (struct function *f = functions; f < &functions[function_count]; f++) {
        if (at < f->start || at >= f->end)
            continue;
        block->part = f->part;
        block->enters = f->watched && at == f->start ? f : NULL;
    }
    qemu_plugin_register_vcpu_tb_exec_cb(tb, on_run, 0, block);
}

static void on_exit_print(plugin_id id, void *data) {
    (void)id;
    (void)data;
    for (int part = 0; part < PARTS; part++)
        if (counts[part] > 0)
            fprintf(stderr, "part %d %" PRIu64 "\n", part, counts[part]);
    for (struct function *f = functions; f < &functions[function_count]; f++)
        if (f->watched)
            fprintf(stderr, "call %" PRIx64 " %" PRIu64 "\n", f->start, f->longest);
}

__attribute__((visibility("default"))) int qemu_plugin_install(plugin_id id, const void *info, int argc,
                                                               char **argv) {
    (void)info;
    for (int n = 0; n < argc; n++)
        if (strncmp(argv[n], "table=", 6) == 0)
            read_table(argv[n] + 6);
    qemu_plugin_register_vcpu_tb_trans_cb(id, on_translate);
    qemu_plugin_register_atexit_cb(id, on_exit_print, NULL);
    return 0;
}
