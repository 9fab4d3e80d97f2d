/* SPDX-License-Identifier: MIT
 * Parameters of a program, found by linear search: a line names a few of at most some hundred. */
#include "gcode/params.h"

#include <string.h>

void params_clear(struct params *params) {
    struct param_numbered *const numbered = params->numbered;
    struct param_named *const named = params->named;
    const uint16_t numbered_room = params->numbered_room, named_room = params->named_room;

    memset(params, 0, sizeof *params);
    params->numbered = numbered;
    params->numbered_room = numbered_room;
    params->named = named;
    params->named_room = named_room;
}

/* A local name belongs to the call that set it, so that a subroutine neither sees nor changes its caller's.
 */
static uint8_t level_of(const struct params *params, const struct param_ref *ref) {
    return ref->name[0] == '_' ? (uint8_t)PARAMS_GLOBAL : params->level;
}

static double *find_named(const struct params *params, const struct param_ref *ref) {
    const uint8_t level = level_of(params, ref);

    for (unsigned i = 0; i < params->named_count; i++) {
        struct param_named *named = &params->named[i];

        if (named->level == level && memcmp(named->name, ref->name, ref->length) == 0 &&
            named->name[ref->length] == '\0')
            return &named->value;
    }
    return NULL;
}

/* NULL: it has no place yet. #1 .. #30 always have theirs. */
static double *find(struct params *params, const struct param_ref *ref) {
    if (ref->name != NULL)
        return find_named(params, ref);
    if (ref->number <= PARAMS_LOCAL)
        return &params->local[ref->number - 1];
    for (unsigned i = 0; i < params->numbered_count; i++) {
        if (params->numbered[i].number == ref->number)
            return &params->numbered[i].value;
    }
    return NULL;
}

enum status params_get(const struct params *params, const struct param_ref *ref, double *value) {
    const double *found = find((struct params *)params, ref);

    /* A number that no one set is 0, a name that no one set is rather a typing error: as in LinuxCNC. */
    if (found == NULL && ref->name != NULL)
        return STATUS_PARAMETER_UNSET;
    *value = found != NULL ? *found : 0.0;
    return STATUS_OK;
}

static double *add_named(struct params *params, const struct param_ref *ref) {
    struct param_named *named = &params->named[params->named_count];

    if (params->named_count == params->named_room)
        return NULL;
    params->named_count++;
    named->level = level_of(params, ref);
    memcpy(named->name, ref->name, ref->length);
    named->name[ref->length] = '\0';
    return &named->value;
}

static double *add_numbered(struct params *params, uint16_t number) {
    struct param_numbered *numbered = &params->numbered[params->numbered_count];

    if (params->numbered_count == params->numbered_room)
        return NULL;
    params->numbered_count++;
    numbered->number = number;
    return &numbered->value;
}

enum status params_set(struct params *params, const struct param_set *sets, size_t count) {
    const uint16_t numbered_before = params->numbered_count, named_before = params->named_count;

    for (size_t i = 0; i < count; i++) { /* places first: what is new vanishes again if one finds none */
        const struct param_ref *ref = &sets[i].ref;

        if (find(params, ref) != NULL)
            continue;
        if ((ref->name != NULL ? add_named(params, ref) : add_numbered(params, ref->number)) == NULL) {
            params->numbered_count = numbered_before;
            params->named_count = named_before;
            return STATUS_PARAMETER_ROOM;
        }
    }
    for (size_t i = 0; i < count; i++)
        *find(params, &sets[i].ref) = sets[i].value;
    return STATUS_OK;
}

void params_enter(struct params *params) {
    params->level++;
}

/* The names of the subroutine are gone, those of its callers and the global ones move together. */
void params_leave(struct params *params) {
    unsigned kept = 0;

    for (unsigned i = 0; i < params->named_count; i++) {
        if (params->named[i].level != params->level)
            params->named[kept++] = params->named[i];
    }
    params->named_count = (uint16_t)kept;
    params->level--;
}
