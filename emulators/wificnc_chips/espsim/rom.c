/* SPDX-License-Identifier: MIT
 * The boot ROM: its functions (rom.def) are called by address, and this computer does what they do. A call
 * from windowed code finds its arguments where ENTRY would have made them a2 to a7; no window moves. */
#include "rom.h"
#include "romcode/code.h"

#include <math.h>
#include <string.h>

enum { ROM_BASE = 0x40000000, ROM_END = ROM_CODE, VECTORS = 0x400 };

static const struct answer *answer_at(const struct esp *esp, uint32_t address) {
    for (unsigned i = 0; i < esp->answer_count; i++)
        if (esp->answer[i].address == address)
            return &esp->answer[i];
    return NULL;
}

bool rom_has(const struct esp *esp, uint32_t address) {
    return (address >= ROM_BASE + VECTORS && address < ROM_END) || answer_at(esp, address) != NULL;
}

bool es_answer(struct esp *esp, uint32_t address, uint32_t value) {
    if (esp->answer_count == ANSWERS)
        return false;
    esp->answer[esp->answer_count++] = (struct answer){address, value};
    cpu_forget(esp, address, 1);
    return true;
}

/* ---- arguments ---- */

static unsigned first_register(const struct esp *esp) {
    return 4 * ((esp->cpu->ps & PS_CALLINC) >> PS_CALLINC_SHIFT);
}

static uint32_t word(const struct esp *esp, unsigned number) {
    return esp->cpu->a[(first_register(esp) + 2 + number) & 15];
}

/* Beyond six they are on the caller's stack. */
uint32_t rom_word(struct esp *esp, unsigned number) {
    return number < 6 ? word(esp, number) : bus_load(esp, esp->cpu->a[1] + 4 * (number - 6), 4);
}

static uint64_t pair(const struct esp *esp, unsigned number) {
    return word(esp, number) | (uint64_t)word(esp, number + 1) << 32;
}

static double rom_double(uint64_t bits) {
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static float rom_float(uint32_t bits) {
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static void put(struct esp *esp, unsigned number, uint32_t value) {
    esp->cpu->a[(first_register(esp) + 2 + number) & 15] = value;
}

static void put_pair(struct esp *esp, uint64_t value) {
    put(esp, 0, (uint32_t)value);
    put(esp, 1, (uint32_t)(value >> 32));
}

static void put_double(struct esp *esp, double value) {
    uint64_t bits = 0x7FF8000000000000u;
    if (!isnan(value))
        memcpy(&bits, &value, sizeof bits);
    put_pair(esp, bits);
}

static void put_float(struct esp *esp, float value) {
    uint32_t bits = 0x7FC00000u;
    if (!isnan(value))
        memcpy(&bits, &value, sizeof bits);
    put(esp, 0, bits);
}

/* ---- arithmetic: out of range becomes the nearest that is in it, no number 0 ---- */

static int64_t rom_integer(double value, double low, double end) {
    if (isnan(value))
        return 0;
    if (value < low)
        return (int64_t)low;
    if (value >= end)
        return end == 0x1p63 ? INT64_MAX : (int64_t)(end - 1);
    return (int64_t)value;
}

static uint64_t rom_unsigned(double value) {
    return value >= 0x1p64 ? UINT64_MAX : value > 0 ? (uint64_t)value : 0;
}

static uint64_t rom_divided(int64_t n, int64_t d) {
    return d == 0 ? 0 : d == -1 ? 0u - (uint64_t)n : (uint64_t)(n / d);
}

/* ---- memory: by words where they are aligned, as registers and IRAM take no bytes ---- */

static bool works(const struct esp *esp) {
    return esp->stop != ES_FAULT && !esp->cpu->broken;
}

static uint32_t piece(uint32_t places, uint32_t left) {
    return (places & 3) == 0 && left >= 4 ? 4 : 1;
}

static void rom_move(struct esp *esp, uint32_t to, uint32_t from, uint32_t count) {
    const bool backwards = to > from && to - from < count;
    for (uint32_t i = 0, size; i < count && works(esp); i += size) {
        const uint32_t at = backwards ? count - i : i;
        size = backwards ? piece((to + at) | (from + at), at) : piece((to + at) | (from + at), count - at);
        const uint32_t place = backwards ? at - size : at;
        bus_store(esp, to + place, bus_load(esp, from + place, size), size);
    }
}

static void rom_fill(struct esp *esp, uint32_t to, uint32_t value, uint32_t count) {
    for (uint32_t i = 0, size; i < count && works(esp); i += size) {
        size = piece(to + i, count - i);
        bus_store(esp, to + i, size == 4 ? (value & 255) * 0x01010101u : value & 255, size);
    }
}

static uint32_t rom_compare(struct esp *esp, uint32_t a, uint32_t b, uint32_t count, bool is_text) {
    for (uint32_t i = 0; i < count && esp->stop != ES_FAULT; i++) {
        const uint32_t x = bus_load(esp, a + i, 1), y = bus_load(esp, b + i, 1);
        if (x != y)
            return x - y;
        if (is_text && x == 0)
            return 0;
    }
    return 0;
}

static uint32_t rom_length(struct esp *esp, uint32_t text, uint32_t most) {
    uint32_t length = 0;
    while (length < most && esp->stop != ES_FAULT && bus_load(esp, text + length, 1) != 0)
        length++;
    return length;
}

/* ---- the table ---- */

#define W(n)                 word(esp, n)
#define X                    pair(esp, 0)
#define Y                    pair(esp, 2)
#define D                    rom_double(X)
#define E                    rom_double(Y)
#define RETURN(value)        put(esp, 0, value)
#define RETURN_PAIR(value)   put_pair(esp, value)
#define QUOTIENT(n, d)       ((uint32_t)rom_divided((int32_t)(n), (int32_t)(d)))
#define RETURN_DOUBLE(value) put_double(esp, value)
#define RETURN_FLOAT(value)  put_float(esp, value)

#define ROM(name, on_esp32, on_s3, cost, ...)                                                                \
    static uint64_t cost_##name(const struct esp *esp) {                                                     \
        (void)esp;                                                                                           \
        return (cost);                                                                                       \
    }                                                                                                        \
    static void call_##name(struct esp *esp) {                                                               \
        (void)esp;                                                                                           \
        __VA_ARGS__;                                                                                         \
    }
#include "rom.def"
#undef ROM

struct function {
    uint32_t address[2];
    uint64_t (*cost)(const struct esp *);
    void (*call)(struct esp *);
};

static const struct function functions[] = {
#define ROM(name, on_esp32, on_s3, cost, ...) {{on_esp32, on_s3}, cost_##name, call_##name},
#include "rom.def"
#undef ROM
};

static const struct function *function_at(const struct esp *esp, uint32_t address) {
    for (size_t i = 0; i < sizeof functions / sizeof functions[0]; i++)
        if (functions[i].address[esp->chip] == address)
            return &functions[i];
    return NULL;
}

/* The newest call, when it is this one: an interrupt may have come in the middle of it, and called others. */
static struct rom_work *work_of(struct esp *esp, const struct function *function) {
    struct rom_work *newest = &esp->cpu->rom_work[esp->cpu->rom_depth - 1];
    const uint32_t stack = esp->cpu->a[1];
    if (esp->cpu->rom_depth != 0 && newest->address == esp->cpu->pc && newest->stack == stack)
        return newest;
    if (esp->cpu->rom_depth == ROM_DEPTH) {
        chip_fault(esp, "functions of the boot ROM have interrupted each other %d deep", ROM_DEPTH);
        return NULL;
    }
    newest = &esp->cpu->rom_work[esp->cpu->rom_depth++];
    *newest = (struct rom_work){.address = esp->cpu->pc, .stack = stack, .left = function->cost(esp)};
    return newest;
}

void rom_call(struct esp *esp) {
    struct cpu *cpu = esp->cpu;
    const uint32_t back = cpu->a[first_register(esp)];
    const struct function *function = function_at(esp, cpu->pc);
    const struct answer *answer = answer_at(esp, cpu->pc);
    char text[96];
    if (answer != NULL) {
        put(esp, 0, answer->value);
        cpu->next = (back & 0x3FFFFFFFu) | (cpu->pc & 0xC0000000u);
        esp->cycles++;
        cpu->instructions++;
        return;
    }
    if (function == NULL) {
        chip_fault(esp, "the boot ROM's function at %08x, called before %s, is not emulated", cpu->pc,
                   chip_place(esp, (back & 0x3FFFFFFFu) | 0x40000000u, text));
        return;
    }
    struct rom_work *work = work_of(esp, function);
    if (work == NULL)
        return;
    const uint64_t room = esp->limit > esp->cycles ? esp->limit - esp->cycles : 0;
    const uint64_t spent = work->left < room ? work->left : room;
    esp->cycles += spent;
    cpu->instructions += spent;
    work->left -= spent;
    if (work->left != 0 || cores_wait(esp))
        return;
    esp->cpu->rom_depth--;
    cpu->next = (back & 0x3FFFFFFFu) | (cpu->pc & 0xC0000000u);
    esp->in_rom = true;
    function->call(esp);
    esp->in_rom = false;
}
