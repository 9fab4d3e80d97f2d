/* SPDX-License-Identifier: MIT */
#include "net/page.h"

#include "base/version.h"
#include "net/network.h"
#include "net_http.h"
#include "page_files.h"
#include "pin_config.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The assembler takes the files as they are; constants of the program, they stay in flash. */
#define EMBED(number, path, type, tag, file, size, forever)                                                  \
    __asm__(".pushsection .rodata\npage_file_" #number ":\n.incbin \"" file "\"\n.popsection");              \
    extern const uint8_t page_file_##number[];
#define ROW(number, path, type, tag, file, size, forever)                                                    \
    {path, type, tag, {page_file_##number, size}, {NULL, 0}, forever},

#define ABOUT                                                                                                \
    "{\"name\": \"%s\", \"version\": \"" VERSION_TEXT "\", \"board\": \"" BOARD_ID                           \
    "\", \"digest\": \"%s\", "                                                                               \
    "\"axes\": %u}"

#define SILENT_US 5000000u /* a silent connection holds one of four places */

PAGE_FILES(EMBED)

static const struct net_http_file files[PAGE_FILE_COUNT + 1] = {PAGE_FILES(ROW){0}};

static struct net_http http = {.listener = -1};

static void connect(void *ctx, const struct net_stream *stream, const char *who) {
    (void)net_hub_connect(ctx, stream, who);
}

static uint64_t owner(void *ctx) {
    return ((const struct net_hub *)ctx)->owner_peer;
}

bool page_start(struct net_hub *hub, const char *host, const struct page_names *names, const char *port,
                int *error) {
    static struct net_http_site site = {
        .files = files, .count = PAGE_FILE_COUNT, .connect = connect, .owner = owner, .silent_us = SILENT_US};
    const char *digest = names->digest != NULL ? names->digest : "";
    const size_t size = sizeof ABOUT + strlen(names->own) + strlen(digest);
    char *about = malloc(size);
    *error = ENOMEM;
    if (about == NULL)
        return false;
    snprintf(about, size, ABOUT, names->own, digest, (unsigned)BOARD_AXIS_COUNT);
    site.about = about;
    site.name = names->own;
    site.names = names->others;
    site.network = names->network;
    site.portal = names->portal;
    site.setup = names->setup;
    site.has_pins = names->has_pins;
    site.update = names->update;
    site.updates = names->updates;
    site.ctx = hub;
    char address[NET_ADDRESS_SIZE];
    return net_http_open(&http, &site, host, port, address, error);
}

bool page_poll(uint32_t now_us) {
    return net_http_poll(&http, now_us);
}
