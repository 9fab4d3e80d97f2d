/* SPDX-License-Identifier: MIT
 * Who asks for status reports, by `?` or at an interval of its own, and who gets them. */
#include "net_hub_inner.h"
#include "net_line.h"

enum { AUTO_REPORT = 0x8C, US_PER_MS = 1000 };

/* Automatic reports wait for a client that has so many bytes to read. */
enum { UNREAD_MAX = 2 * NET_LINE_SIZE };

enum { INTERVAL_TEXT_SIZE = 12 }; /* $RI=60000, and some more */

static const char interval_line[] = "$RI=";

bool net_hub_may_ask(const struct net_hub *hub, const struct net_client *client) {
    return client != hub->owner || client->out.count < hub->sizes.out / 2;
}

/* ---- lines and bytes that set the interval ---- */

bool net_hub_toggle_reports(const struct net_hub *hub, struct net_client *client, uint8_t byte) {
    if (byte != AUTO_REPORT)
        return false;
    report_interval_toggle(&client->reports);
    client->reported_us = hub->now_us;
    return true;
}

/* The line as the controller would read it: without blanks and control characters, in letters of any case.
 * One that does not fit is no number. @return what follows `$RI=`; NULL: it is another line */
static const char *interval_text(const char *line, size_t size, char text[INTERVAL_TEXT_SIZE]) {
    size_t count = 0, begin = 0;
    while (begin < size && (uint8_t)line[begin] <= ' ')
        begin++;
    if (begin == size || line[begin] != interval_line[0])
        return NULL;
    for (size_t i = begin; i < size && count < INTERVAL_TEXT_SIZE - 1; i++)
        if ((uint8_t)line[i] > ' ')
            text[count++] = (char)net_line_upper(line[i]);
    text[count] = '\0';
    return net_line_begins(text, count, interval_line) ? text + sizeof interval_line - 1 : NULL;
}

static enum status set_interval(const struct net_hub *hub, struct net_client *client, const char *text) {
    const enum status status = report_interval_set(&client->reports, text);
    if (status == STATUS_OK)
        client->reported_us = hub->now_us;
    return status;
}

bool net_hub_take_interval(const struct net_hub *hub, struct net_client *client, const char *line,
                           size_t size) {
    char text[INTERVAL_TEXT_SIZE];
    const char *interval = interval_text(line, size, text);
    return interval != NULL && set_interval(hub, client, interval) == STATUS_OK;
}

bool net_hub_answer_reports(struct net_hub *hub, struct net_client *client, const char *line, size_t size) {
    char text[INTERVAL_TEXT_SIZE];
    const char *interval = interval_text(line, size, text);
    if (interval == NULL)
        return false;
    const enum status status = set_interval(hub, client, interval);
    if (status == STATUS_OK)
        net_hub_say(hub, client, "ok\r\n", 4);
    else
        net_hub_refuse(hub, client, status, NULL);
    return true;
}

void net_hub_end_reports(struct net_hub *hub) {
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++)
        client->reports = (struct report_interval){.on_ms = 0};
}

/* ---- requests ---- */

static bool has_read(const struct net_client *client) {
    return client->out.count < UNREAD_MAX;
}

/* One that is late is not made up for. @return true: it is due now */
static bool note_due(const struct net_hub *hub, struct net_client *client) {
    const uint32_t every_us = client->reports.on_ms * (uint32_t)US_PER_MS,
                   passed_us = hub->now_us - client->reported_us;
    if (!net_hub_is_open(client) || every_us == 0 || passed_us < every_us || !has_read(client))
        return false;
    client->reported_us = passed_us < 2 * every_us ? client->reported_us + every_us : hub->now_us;
    client->is_due = true;
    return true;
}

bool net_hub_want_report(struct net_client *client, uint8_t byte) {
    client->asks |= byte == '?';
    client->asks_all |= byte == FULL_STATUS;
    return byte == '?' || byte == FULL_STATUS;
}

void net_hub_ask(struct net_hub *hub) {
    bool asks = false, all = false, due = false;
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++) {
        due |= note_due(hub, client);
        if (!net_hub_may_ask(hub, client))
            continue;
        asks |= client->asks;
        all |= client->asks_all;
        client->asks = client->asks_all = false;
    }
    hub->asked |= asks || all;
    hub->asked_for_due |= due;
    if (asks || all || due)
        hub->ops->put(hub->ctx, all ? "\x87" : "?", 1);
}

/* ---- reports ---- */

bool net_hub_gets_report(const struct net_hub *hub, const struct net_client *client) {
    if (!net_hub_may_ask(hub, client))
        return false;
    if (hub->asked || !hub->asked_for_due)
        return true;
    return client->is_due && has_read(client);
}

void net_hub_end_report(struct net_hub *hub) {
    hub->asked = hub->asked_for_due = false;
    for (struct net_client *client = hub->client; client < hub->client + NET_CLIENTS; client++)
        client->is_due = false;
}
