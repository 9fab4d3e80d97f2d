/* SPDX-License-Identifier: MIT
 * MCPWM0 as far as timers that count up, comparators and generators go (technical reference manuals, chapter
 * Motor Control PWM). Its clock is 160 MHz. A timer counts from 0 to its period's last count; at a count it
 * makes an event, and each generator does what it is set to do at that event. Where two events meet, the one
 * of the higher priority counts: the last count, comparator B, comparator A, zero. Other ways to count,
 * synchronisation, dead time, carrier, fault handling and capture are not emulated. */
#include "esp.h"

#include <string.h>

/* Words. */
enum { CLOCK = 0, TIMER = 1, TIMER_WORDS = 4, TIMER_OF = 14, OPERATOR = 15, OPERATOR_WORDS = 14 };
enum { FAULTS = 57, CAPTURE = 58, CAPTURE_CHANNEL = 60, UPDATE = 67, ENABLED = 68, RAW, STATUS, CLEAR };
enum { T_CONFIG = 0, T_MODE, T_SYNC, T_STATUS };
enum { O_METHODS = 0, O_COMPARE, O_FORCE = 4, O_GENERATOR, O_DEAD_TIME = 7, O_CARRIER = 10, O_FAULTS };
enum { STOP_EMPTY, STOP_FULL, RUN, RUN_TO_EMPTY, RUN_TO_FULL };
enum { MODE_UP = 1, COUNTS_MAX = 65535 };
enum { AT_ZERO = 1 << 0, AT_LAST = 1 << 1, BYPASSES = 3 << 15, FAULT_SOURCES = 0xEE };
enum { LOW = 1, HIGH = 2, TOGGLE = 3 };
enum { INT_STOP = 0, INT_ZERO = 3, INT_LAST = 6, INT_A = 15, INT_B = 18 };
enum { HALF_CYCLES = 3 }; /* of 480 MHz, in one of 160 MHz */

static uint32_t *timer_word(struct mcpwm *m, unsigned timer, unsigned word) {
    return &m->word[TIMER + TIMER_WORDS * timer + word];
}

static uint32_t *operator_word(struct mcpwm *m, unsigned number, unsigned word) {
    return &m->word[OPERATOR + OPERATOR_WORDS * number + word];
}

static unsigned timer_of(const struct mcpwm *m, unsigned number) {
    return m->word[TIMER_OF] >> 2 * number & 3;
}

static uint64_t now_of(const struct esp *esp) {
    return 2 * esp->cycles;
}

static uint64_t cycle_of(uint64_t half_cycles) {
    return (half_cycles + 1) / 2;
}

/* ---- outputs ---- */

static void show(struct esp *esp, uint64_t at, unsigned number, unsigned output) {
    struct mcpwm *m = &esp->mcpwm;
    const uint32_t forced = *operator_word(m, number, O_FORCE) >> (6 + 2 * output) & 3;
    const bool level = forced == 0 ? m->operators[number].level[output] : forced == HIGH;
    const unsigned first = esp->chip == ES_ESP32 ? 32 : 160;
    gpio_signal(esp, cycle_of(at), first + 2 * number + output, level);
}

static void act(struct esp *esp, uint64_t at, unsigned number, unsigned output, uint32_t action) {
    bool *level = &esp->mcpwm.operators[number].level[output];
    if (action == 0)
        return;
    *level = action == TOGGLE ? !*level : action == HIGH;
    show(esp, at, number, output);
}

/* What the events of this count want of an output: bits 0 to 7 of GENx. */
static uint32_t action_at(uint32_t generator, const uint32_t compare[2], uint32_t count, uint32_t last) {
    uint32_t found = 0;
    if (count == 0 && (generator & 3) != 0)
        found = generator & 3;
    for (unsigned i = 0; i < 2; i++)
        if (count == compare[i] && (generator >> (4 + 2 * i) & 3) != 0)
            found = generator >> (4 + 2 * i) & 3;
    if (count == last && (generator >> 2 & 3) != 0)
        found = generator >> 2 & 3;
    return found;
}

/* A comparator takes its new value immediately, or at events of its timer. */
static void take_compares(struct mcpwm *m, unsigned number, uint32_t event) {
    for (unsigned i = 0; i < 2; i++) {
        const uint32_t methods = *operator_word(m, number, O_METHODS) >> 4 * i & 15;
        if (methods == 0 || (methods & event) != 0)
            m->operators[number].compare[i] = *operator_word(m, number, O_COMPARE + i) & 0xFFFF;
    }
}

static void operate(struct esp *esp, uint64_t at, unsigned number, uint32_t count, uint32_t last) {
    struct mcpwm *m = &esp->mcpwm;
    const struct mcpwm_operator *op = &m->operators[number];
    take_compares(m, number, (count == 0 ? AT_ZERO : 0) | (count == last ? AT_LAST : 0));
    for (unsigned i = 0; i < 2; i++) {
        if (count == op->compare[i])
            m->word[RAW] |= 1u << ((i == 0 ? INT_A : INT_B) + number);
        act(esp, at, number, i,
            action_at(*operator_word(m, number, O_GENERATOR + i), op->compare, count, last));
    }
}

/* ---- timers ---- */

static void stop(struct mcpwm *m, unsigned number) {
    m->timer[number].runs = false;
    m->word[RAW] |= 1u << (INT_STOP + number);
}

static uint32_t command_of(struct mcpwm *m, unsigned number) {
    return *timer_word(m, number, T_MODE) & 7;
}

static void reach(struct esp *esp, unsigned number, uint64_t at) {
    struct mcpwm *m = &esp->mcpwm;
    struct mcpwm_timer *timer = &m->timer[number];
    const uint32_t command = command_of(m, number);
    for (unsigned op = 0; op < MCPWM_TIMERS; op++)
        if (timer_of(m, op) == number)
            operate(esp, at, op, timer->count, timer->last);
    if (timer->count == 0) {
        m->word[RAW] |= 1u << (INT_ZERO + number);
        if (command == STOP_EMPTY || command == RUN_TO_EMPTY)
            stop(m, number);
    }
    if (timer->count == timer->last) {
        m->word[RAW] |= 1u << (INT_LAST + number);
        if (command == STOP_FULL || command == RUN_TO_FULL)
            stop(m, number);
    }
}

/* The next count at which something happens; one more than the last: zero again. */
static uint32_t next_count(const struct mcpwm *m, unsigned number) {
    const struct mcpwm_timer *timer = &m->timer[number];
    const uint32_t end = timer->count > timer->last ? COUNTS_MAX : timer->last;
    uint32_t next = timer->count < timer->last ? timer->last : end + 1;
    for (unsigned op = 0; op < MCPWM_TIMERS; op++)
        for (unsigned i = 0; i < 2 && timer_of(m, op) == number; i++) {
            const uint32_t count = m->operators[op].compare[i];
            if (count > timer->count && count < next && count <= end)
                next = count;
        }
    return next;
}

static uint64_t time_of(const struct mcpwm_timer *timer, uint32_t count) {
    return timer->began + (uint64_t)count * timer->tick;
}

static uint64_t next_of(const struct mcpwm *m, unsigned number) {
    return m->timer[number].runs ? time_of(&m->timer[number], next_count(m, number)) : NEVER;
}

static void advance(struct esp *esp, unsigned number) {
    struct mcpwm *m = &esp->mcpwm;
    struct mcpwm_timer *timer = &m->timer[number];
    for (uint64_t at; (at = next_of(m, number)) <= now_of(esp);) {
        const uint32_t count = next_count(m, number);
        timer->count = count;
        if (count > timer->last && (count == COUNTS_MAX + 1 || count == timer->last + 1)) {
            timer->began = at;
            timer->count = 0;
            timer->last = *timer_word(m, number, T_CONFIG) >> 8 & 0xFFFF;
        }
        reach(esp, number, at);
    }
}

static void schedule(struct esp *esp) {
    struct mcpwm *m = &esp->mcpwm;
    uint64_t next = NEVER;
    for (unsigned i = 0; i < MCPWM_TIMERS; i++)
        next = next_of(m, i) < next ? next_of(m, i) : next;
    m->due = next == NEVER ? NEVER : cycle_of(next);
    matrix_set(esp, esp->chip == ES_ESP32 ? 39 : 31, (m->word[RAW] & m->word[ENABLED]) != 0);
}

void mcpwm_event(struct esp *esp) {
    for (unsigned i = 0; i < MCPWM_TIMERS; i++)
        advance(esp, i);
    schedule(esp);
}

/* ---- registers ---- */

/* The divider counts from here on: a new one is taken where the timer starts. */
static void start(struct esp *esp, unsigned number) {
    struct mcpwm *m = &esp->mcpwm;
    struct mcpwm_timer *timer = &m->timer[number];
    const uint32_t mode = *timer_word(m, number, T_MODE) >> 3 & 3;
    const uint32_t prescale = (*timer_word(m, number, T_CONFIG) & 0xFF) + 1;
    if (mode == 0)
        return; /* frozen */
    if (mode != MODE_UP) {
        chip_fault(esp, "timer %u of MCPWM0 counts in mode %u, which is not emulated", number, mode);
        return;
    }
    timer->tick = HALF_CYCLES * ((m->word[CLOCK] & 0xFF) + 1) * prescale;
    timer->last = *timer_word(m, number, T_CONFIG) >> 8 & 0xFFFF;
    timer->began = now_of(esp) - (uint64_t)timer->count * timer->tick;
    timer->runs = true;
}

static void store_timer(struct esp *esp, unsigned number, unsigned word, uint32_t value) {
    struct mcpwm *m = &esp->mcpwm;
    struct mcpwm_timer *timer = &m->timer[number];
    *timer_word(m, number, word) = value;
    if (word == T_CONFIG && (value >> 24 & 3) == 0)
        timer->last = value >> 8 & 0xFFFF;
    else if (word == T_SYNC && (value & 3) != 0)
        chip_fault(esp, "synchronisation of timer %u of MCPWM0 is not emulated", number);
    else if (word == T_MODE && !timer->runs && command_of(m, number) >= RUN)
        start(esp, number);
    else if (word == T_MODE && timer->runs && (value >> 3 & 3) != MODE_UP)
        chip_fault(esp, "a change of how timer %u of MCPWM0 counts is not emulated", number);
}

/* A force that does not last: the bit toggles. */
static void force(struct esp *esp, unsigned number, uint32_t before, uint32_t value) {
    for (unsigned i = 0; i < 2; i++) {
        if (((before ^ value) >> (10 + 3 * i) & 1) != 0)
            act(esp, now_of(esp), number, i, value >> (11 + 3 * i) & 3);
        show(esp, now_of(esp), number, i);
    }
}

static void store_operator(struct esp *esp, unsigned number, unsigned word, uint32_t value) {
    struct mcpwm *m = &esp->mcpwm;
    const uint32_t before = *operator_word(m, number, word);
    *operator_word(m, number, word) = value;
    if (word == O_FORCE)
        force(esp, number, before, value);
    else if ((word == O_DEAD_TIME && (value & BYPASSES) != BYPASSES) || (word == O_CARRIER && (value & 1)) ||
             (word == O_FAULTS && (value & FAULT_SOURCES) != 0))
        chip_fault(esp, "%s of operator %u of MCPWM0 is not emulated",
                   word == O_DEAD_TIME ? "dead time"
                   : word == O_CARRIER ? "the carrier"
                                       : "fault handling",
                   number);
    take_compares(m, number, 0);
}

static void store(struct esp *esp, uint32_t offset, uint32_t value) {
    struct mcpwm *m = &esp->mcpwm;
    const unsigned word = offset / 4;
    mcpwm_event(esp);
    if (word >= OPERATOR && word < FAULTS)
        store_operator(esp, (word - OPERATOR) / OPERATOR_WORDS, (word - OPERATOR) % OPERATOR_WORDS, value);
    else if (word >= TIMER && word < TIMER + TIMER_WORDS * MCPWM_TIMERS)
        store_timer(esp, (word - TIMER) / TIMER_WORDS, (word - TIMER) % TIMER_WORDS, value);
    else if (word == CLEAR)
        m->word[RAW] &= ~value;
    else if ((word == FAULTS && (value & 7) != 0) ||
             (word >= CAPTURE && word < UPDATE && word != CAPTURE + 1 && (value & 1) != 0))
        chip_fault(esp, "%s of MCPWM0 is not emulated", word == FAULTS ? "fault detection" : "capture");
    else if (word != RAW && word != STATUS)
        m->word[word] = value;
    schedule(esp);
}

static uint32_t load(struct esp *esp, uint32_t offset) {
    struct mcpwm *m = &esp->mcpwm;
    const unsigned word = offset / 4, timer = (word - TIMER) / TIMER_WORDS;
    mcpwm_event(esp);
    if (word == STATUS)
        return m->word[RAW] & m->word[ENABLED];
    if (word == CLEAR)
        return 0;
    if (timer >= MCPWM_TIMERS || (word - TIMER) % TIMER_WORDS != T_STATUS)
        return m->word[word];
    const struct mcpwm_timer *t = &m->timer[timer];
    return t->runs ? (uint32_t)((now_of(esp) - t->began) / t->tick) : t->count;
}

void mcpwm_reset(struct esp *esp) {
    struct mcpwm *m = &esp->mcpwm;
    memset(m, 0, sizeof *m);
    m->due = NEVER;
    for (unsigned i = 0; i < MCPWM_TIMERS; i++) {
        *timer_word(m, i, T_CONFIG) = 255 << 8;
        *operator_word(m, i, O_FORCE) = 0x20;
        *operator_word(m, i, O_DEAD_TIME) = BYPASSES;
    }
    m->word[UPDATE] = 0x55;
    for (unsigned output = 0; output < 2 * MCPWM_TIMERS; output++)
        show(esp, now_of(esp), output / 2, output % 2);
}

void mcpwm_create(struct esp *esp) {
    if (!chip_keeps_outputs(esp))
        mcpwm_reset(esp);
    bus_add(esp, &(struct block){"MCPWM0", esp->chip == ES_ESP32 ? 0x3FF5E000 : 0x6001E000,
                                 sizeof esp->mcpwm.word, load, store, NULL});
    gpio_has_signals(esp, esp->chip == ES_ESP32 ? 32 : 160, 2 * MCPWM_TIMERS);
}
