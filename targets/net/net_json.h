/* SPDX-License-Identifier: MIT
 * JSON (RFC 8259) as the page and the controller exchange it: one object of texts, numbers and truth values.
 * [task] Pure. */
#ifndef WIFICNC_NET_JSON_H
#define WIFICNC_NET_JSON_H

#include <stdbool.h>
#include <stddef.h>

enum { NET_JSON_NAME = 16, NET_JSON_VALUE = 80 };

/** A member. @param value  a text without its quotes and escapes, in UTF-8; of others what is written, as
 * "true" @param is_text  it was in quotes @return false: not this one, end */
typedef bool net_json_member(void *ctx, const char *name, const char *value, bool is_text);

/** @return false: this is no such object, a name or value is too long, or a member was refused */
bool net_json_read(const char *json, net_json_member *member, void *ctx);

/** A text in quotes, escaped. @return bytes without the NUL; 0: no room */
size_t net_json_put_text(char *out, size_t size, const char *text);

#endif
