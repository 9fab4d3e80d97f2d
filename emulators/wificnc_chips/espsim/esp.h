/* SPDX-License-Identifier: MIT
 * The inside of the virtual chip, for the files of this folder only.
 *
 *   cpu.c        the loop over decoded instructions; instructions.def is its table
 *   decode.c     bytes -> struct op; pipeline.c: its cycles
 *   window.c     register windows: overflow, underflow, entry, retw
 *   exception.c  exceptions, interrupts, reset
 *   special.c    special and user registers
 *   fpu.c mac.c  floating point; the multiplier's accumulator
 *   bus.c        addresses -> memories, registers of peripherals
 *   load.c       ELF files and images
 *   boot.c       from a flash chip to the application that is to start
 *   digest.c     MD5, CRC-32
 *   rom.c        functions of the boot ROM, done by this computer; rom_text.c, rom_system.c: what they do
 *   flash.c mmu.c spi.c   the flash chip, its pages in the address space, its commands
 *   cache.c      which of its lines the caches have
 *   dport.c      caches on and off; registers that only keep what is written
 *   watchdog.c rtc.c   what resets the chip
 *   systimer.c   the S3's system timer
 *   efuse.c sha.c   what the chip is; random numbers; SHA-256
 *   gpio.c timer.c matrix.c uart.c usb_serial.c   the peripherals
 *   parts.c      those that make or take signals:
 *   ledc.c mcpwm.c rmt.c i2s.c pcnt.c spi_master.c spi_s3.c gdma.c
 *   shift.c w5500.c   chips outside
 *   cores.c      two cores that take turns
 *   chip.c       time */
#ifndef WIFICNC_ESPSIM_ESP_H
#define WIFICNC_ESPSIM_ESP_H

#include "espsim.h"
#include "parts.h"

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "memories have the chip's order of bytes");

#define NEVER UINT64_MAX

enum {
    PAGE_BITS = 12,
    PAGE = 1 << PAGE_BITS,
    PAGES = 1 << (32 - PAGE_BITS),
    PHYSICAL = 64, /* address registers */
    LEVELS = 8,
    TIMERS = 3,
    MEMORIES = 12,
    BLOCKS = 64,
    CORES = 2,
    SOURCES = 128, /* of interrupts */
    ROM_DEPTH = 8,
    ANSWERS = 16,
    UARTS = 3,
    UART_FIFO = 128,
    UART_WORDS = 33,
    MMU_ENTRIES = 2048,
    SEGMENTS_MAX = 16,
    WATCHDOGS = 3,
    WATCHDOG_RTC = 2,
    RTC_WORDS = 1024,
    EFUSE_WORDS = 128,
    KEPT = 24,
    KEPT_WORDS = 1024,
    CACHES = 2,
    CACHE_CODE = 0, /* of the S3 */
    CACHE_DATA = 1,
    CACHE_LINES = 4096,
    CACHE_SETS = 1024,
    GRAIN = 16, /* bytes; the shortest line */
    TAKEN = 2,  /* cycles of a jump, and of a branch that is taken, but for its own */
    BUS = 12,   /* cycles of an access to a register of a peripheral */
};

/* PS */
enum {
    PS_LEVEL = 15,
    PS_EXCM = 1 << 4,
    PS_UM = 1 << 5,
    PS_OWB = 0xF00,
    PS_OWB_SHIFT = 8,
    PS_CALLINC = 3 << 16,
    PS_CALLINC_SHIFT = 16,
    PS_WOE = 1 << 18,
    EXCM_LEVEL = 3, /* what PS.EXCM holds off */
};

enum cause {
    CAUSE_ILLEGAL = 0,
    CAUSE_SYSCALL = 1,
    CAUSE_LOAD_STORE = 3,
    CAUSE_LEVEL1 = 4,
    CAUSE_ALLOCA = 5,
    CAUSE_DIVIDE = 6,
    CAUSE_UNALIGNED = 9,
    CAUSE_NO_FPU = 32,
};

/* Interrupts inside of the processor (core-isa.h of both chips: the same). */
enum {
    INTERRUPT_TIMER0 = 6,
    INTERRUPT_SOFTWARE0 = 7,
    INTERRUPT_PROFILING = 11,
    INTERRUPT_TIMER1 = 15,
    INTERRUPT_TIMER2 = 16,
    INTERRUPT_SOFTWARE1 = 29,
};
#define INTERRUPTS_SOFTWARE (1u << INTERRUPT_SOFTWARE0 | 1u << INTERRUPT_SOFTWARE1)
#define INTERRUPTS_EDGE     (1u << 10 | 1u << 22 | 1u << 28 | 1u << 30)
#define INTERRUPTS_INSIDE                                                                                    \
    (INTERRUPTS_SOFTWARE | 1u << INTERRUPT_TIMER0 | 1u << INTERRUPT_TIMER1 | 1u << INTERRUPT_TIMER2 |        \
     1u << INTERRUPT_PROFILING)

/* A function of the boot ROM that works. @param left  cycles */
struct rom_work {
    uint32_t address, stack;
    uint64_t left;
};

struct cpu {
    uint32_t a[16]; /* of the present window; the others lie in `physical` */
    uint32_t f[16];
    uint32_t pc, next; /* the present instruction, and the one after it */
    bool broken;       /* the present instruction met an exception */
    bool waits;        /* WAITI: until an interrupt */
    uint32_t physical[PHYSICAL];
    uint32_t window_base, window_start;
    uint32_t ps, sar, br, acclo, acchi, scompare1, m[4];
    uint32_t lbeg, lend, lcount;
    uint32_t epc[LEVELS], eps[LEVELS], excsave[LEVELS], depc;
    uint32_t exccause, excvaddr, debugcause, vecbase, cpenable;
    uint32_t intenable, latched, lines; /* interrupts: latched ones, and what the matrix says */
    uint32_t ccount_from;               /* CCOUNT at cycle 0 */
    uint32_t ccompare[TIMERS];
    uint64_t timer_at[TIMERS]; /* cycle of the next match */
    uint32_t misc[4], memctl, atomctl, threadptr, fcr, fsr, expstate, f64[3];

    unsigned number;
    bool runs;       /* it has a clock, is out of reset, and nothing stalls it */
    uint64_t cycles; /* its time, while the other one runs */
    uint64_t idle;   /* cycles of it in which it waits for an interrupt, or has no clock */
    uint64_t instructions, misses, missing; /* missing: cycles of the misses */
    uint64_t bus_free;                      /* its last access to a register has ended */
    unsigned spent;                         /* cycles of the present instruction */
    struct rom_work rom_work[ROM_DEPTH];
    unsigned rom_depth;
    uint64_t began[LEVELS];
};

/* An instruction, decoded. */
struct op {
    uint8_t kind, size; /* size: bytes */
    uint8_t top;        /* the greatest register it uses, in fours: 0 .. 3 */
    uint8_t r, s, t;
    uint8_t cycles;
    uint16_t other;
    int32_t imm; /* operand, distance, or the address it goes to */
};

struct memory {
    const char *name;
    uint32_t base, size;
    uint8_t *bytes;
    bool words_only; /* the instruction bus: aligned words, and the only place of code */
    bool constant;
};

/* Registers of a peripheral. @param offset  from its first */
struct block {
    const char *name;
    uint32_t base, size;
    uint32_t (*load)(struct esp *, uint32_t offset); /* NULL: `words` has it */
    void (*store)(struct esp *, uint32_t offset, uint32_t value);
    uint32_t *words;
};

/* A timer of a timer group: where it stood at a moment, and since then it counts. */
struct timer {
    uint32_t config, load_low, load_high, alarm_low, alarm_high, latched_low, latched_high;
    uint64_t since, from; /* cycle at which the counter was `from` */
    uint64_t alarm_at;
};
struct timer_group {
    struct timer timer[3]; /* two, and the ESP32's LACT, from which esp_timer has the time */
    uint32_t enabled, raw; /* interrupts */
    uint32_t calibration[2];
};

struct sha {
    uint32_t text[32], state[8], mode;
};

/* The S3's system timer: two counters of 16 MHz, three alarms. */
struct systimer {
    uint32_t config, load[2][2], target[3][2], target_config[3], value[2][2], enabled,
        raw;                    /* [..][2]: high, low */
    uint64_t from[2], since[2]; /* a counter was `from` at cycle `since` */
    uint64_t alarm_at[3];
};

struct watchdog {
    uint32_t config[6], key;
    unsigned stage;
    uint64_t since, due; /* begin and end of the stage */
};

struct gpio {
    bool watched; /* some pin may interrupt */
    uint32_t out[2], enable[2], inverts[2], foreign[2], pulls[2], driven[2], drive[2], level[2];
    uint32_t io_mux[64];
    uint32_t status[2], pin[ES_PINS], routed[ES_PINS], input[SIGNALS];
    uint32_t signal[2], lets_out[2], listened[2]; /* pins: that peripherals make high, and let out */
    uint32_t emulated[SIGNALS / 32], high[SIGNALS / 32];
    uint64_t pins_of[SIGNALS];
};

struct uart {
    uint32_t word[UART_WORDS], raw;
    uint8_t rx[UART_FIFO], tx[UART_FIFO];
    uint32_t rx_count, tx_count, taken; /* taken: bytes that were read since the FIFO was reset */
    uint64_t tx_at, rx_at, timeout_at;  /* when a byte has gone, has come, and none has come for long */
    uint8_t *in, *out;
    size_t in_count, in_at, in_room, out_count, out_room;
};

/* The flash chip. */
struct flash {
    uint8_t *bytes;
    uint32_t size;
    uint8_t status[2];
    bool write_enabled;
    uint64_t busy_until;
    uint32_t operations, cut_at; /* writes and erases; at which of them the power goes; 0: at none */
    int torn;
};

/* What goes over its wires. */
struct flash_command {
    uint8_t code;
    uint32_t address;
    const uint8_t *out;
    uint8_t *in;
    uint32_t out_count, in_count;
};

struct mmu {
    bool is_used, visible; /* pages are mapped by it; the cache is on */
    uint32_t entry[MMU_ENTRIES], app_entry[MMU_ENTRIES];
    struct op **waiting; /* of each page: its instructions, while the cache is off */
};

/* Lines by their addresses; 0: none. @param oldest  way of a set that is replaced next */
struct cache {
    unsigned line_bits, ways, sets;
    uint32_t tag[CACHE_LINES];
    uint8_t oldest[CACHE_SETS];
};

struct spi {
    uint32_t word[256];
};

/* A piece of a program: where in the file it is and where it goes. */
struct piece {
    uint32_t address;
    size_t at, count;
};

/* An application's image of ESP-IDF. @param size  with its checksum and hash */
struct image {
    struct piece piece[SEGMENTS_MAX];
    unsigned count;
    uint32_t entry;
    size_t size;
};

/* What holds core 1. */
struct app_core {
    uint32_t control, boot; /* APPCPU_CTRL_A to C as one word of the S3's bits; where it begins */
    bool has_begun;
    uint32_t stalled[CORES]; /* SW_STALL of RTC_CNTL, both parts, of each core */
};

/* A function that is not executed. */
struct answer {
    uint32_t address, value;
};

struct symbol {
    uint32_t address, size;
    char *name;
};

struct esp {
    enum es_chip chip;
    struct cpu core[CORES], *cpu; /* cpu: the one that runs */
    uint64_t cycles, limit, next_event;
    unsigned turns;
    bool in_rom; /* a function of the boot ROM works, which is not repeated */
    bool look;   /* who interrupts, or when something happens next, may have changed */
    enum es_stop stop;
    char fault[256];
    uint32_t stop_at;
    bool stops, passes; /* stop_at holds; the next instruction may be at it */

    struct memory memory[MEMORIES];
    unsigned memory_count;
    struct block block[BLOCKS];
    unsigned block_count;
    uint8_t **read, **write, **words;    /* of each page: its bytes, where such an access is possible */
    uint8_t **plain_read, **plain_words; /* where it costs nothing, too: no cached flash */
    uint8_t **lines[CORES], *line_flags[CORES];
    struct op **code; /* of each page: its instructions, one for each byte */

    struct gpio gpio;
    struct timer_group group[2];
    struct watchdog watchdog[WATCHDOGS];
    uint32_t rtc[RTC_WORDS];
    struct systimer systimer;
    struct sha sha;
    uint32_t efuse[EFUSE_WORDS], random;
    uint8_t analog[256][16]; /* registers behind the internal I2C bus */
    struct uart uart[UARTS];
    struct usb_serial usb;
    uint8_t route[CORES][SOURCES]; /* the interrupt of a source */
    uint32_t source[CORES][SOURCES / 32];
    struct app_core app;
    struct flash flash;
    struct mmu mmu;
    struct spi spi[2];
    struct cache cache[CACHES];
    bool timed;                    /* es_timing() */
    unsigned taken;                /* TAKEN, or 0 */
    uint64_t flash_free, bus_free; /* no line comes; no core accesses a register */
    uint32_t held_in_reset;        /* peripherals */
    uint32_t cache_control[CORES], kept[KEPT][KEPT_WORDS];

    struct shift shift;
    struct i2s i2s;
    struct rmt rmt;
    struct ledc ledc;
    struct mcpwm mcpwm;
    struct pcnt pcnt;
    struct spi_host spi_host[SPI_HOSTS];
    struct gdma gdma;
    struct w5500 w5500;

    bool record_edges;
    struct es_edge *edges;
    size_t edge_count, edge_room;

    struct answer answer[ANSWERS];
    unsigned answer_count;
    struct symbol *symbols;
    size_t symbol_count, symbol_room;

    struct es_level level[LEVELS];
    char notes[1024]; /* lines */

    bool runs_bootloader;
    bool resets; /* at the end of this instruction */
    uint32_t reset_cause;
    const char *reset_by;
    unsigned reset_count, resets_in_a_row;
    uint64_t reset_at;
};

#define INLINE static inline __attribute__((always_inline))

/* chip.c */
void chip_fault(struct esp *esp, const char *format, ...) __attribute__((format(printf, 2, 3)));
void chip_note(struct esp *esp, const char *format, ...) __attribute__((format(printf, 2, 3)));
/** This start follows a reset of the processors alone: what works by itself next to them has kept its state.
 */
bool chip_keeps_outputs(const struct esp *esp);
void chip_look(struct esp *esp); /* after anything that may change who interrupts, or when */
bool chip_grow(void *array, size_t *room, size_t count, size_t size);
const char *chip_place(const struct esp *esp, uint32_t address,
                       char text[96]); /* "function+12", or the address */
uint32_t chip_ccount(const struct esp *esp);
/** Soon. @param cause  as the boot ROM numbers it */
void chip_reset(struct esp *esp, unsigned cause, const char *by);
void chip_power_on(struct esp *esp);

/* cores.c: whose turn it is */
void cores_create(struct esp *esp);
bool cores_turn(struct esp *esp, uint64_t until); /* esp->cpu becomes the core that is behind */
uint64_t cores_limit(const struct esp *esp);      /* how far it may go before the other one follows */
bool cores_wait(struct esp *esp);  /* the other core is behind: end the turn. @return whether it is */
bool cores_retry(struct esp *esp); /* the same in an instruction, which is then for a later turn;
                                     not in a function of the boot ROM, which has waited */
void cores_reset_app(struct esp *esp);
void cores_hold(struct esp *esp); /* what lets core 1 run may have changed */

/* cpu.c */
void cpu_run(struct esp *esp);
void cpu_forget(struct esp *esp, uint32_t address, size_t count); /* code there has changed */
void cpu_forget_all(struct esp *esp);
/* decode.c, pipeline.c */
unsigned decode_registers(unsigned kind); /* IR, IS, IT: fields that name address registers */
unsigned pipeline_cycles(struct esp *esp, const struct op *op, uint32_t pc);
void decode(struct op *op, uint32_t word, uint32_t pc);
/* window.c */
unsigned window_room(const struct cpu *cpu); /* registers that are free, in fours: 0 .. 3 */
void window_rotate(struct cpu *cpu, int by);
void window_overflow(struct esp *esp, unsigned top);
void window_entry(struct esp *esp, const struct op *op);
void window_return(struct esp *esp);
void window_movsp(struct esp *esp, const struct op *op);
void window_handled(struct esp *esp, bool underflow);
/* exception.c */
void cpu_reset(struct esp *esp, struct cpu *cpu);
void cpu_start(struct esp *esp, struct cpu *cpu, uint32_t entry, uint32_t stack_end);
void cpu_exception(struct esp *esp, enum cause cause);
void cpu_exception_at(struct esp *esp, enum cause cause, uint32_t address);
void cpu_debug(struct esp *esp, uint32_t cause);
void cpu_vector(struct esp *esp, uint32_t offset);
void cpu_return(struct esp *esp);                      /* RFE */
void cpu_return_double(struct esp *esp);               /* RFDE */
void cpu_return_from(struct esp *esp, unsigned level); /* RFI */
bool cpu_interrupt(struct esp *esp);                   /* take one, if one asks and may. @return whether */
void cpu_check(struct esp *esp);                       /* an interrupt that asks may be allowed now */
bool cpu_sleeps(const struct cpu *cpu);                /* until an interrupt */
uint32_t cpu_interrupts(const struct cpu *cpu);        /* INTERRUPT */
/* special.c */
void special_read(struct esp *esp, const struct op *op);
void special_write(struct esp *esp, const struct op *op);
void special_exchange(struct esp *esp, const struct op *op);
void special_user_read(struct esp *esp, const struct op *op);
void special_user_write(struct esp *esp, const struct op *op);
void special_timers(struct esp *esp); /* let happen what is due */
uint64_t special_next(const struct esp *esp);
/* fpu.c, mac.c */
void fpu_arithmetic(struct esp *esp, const struct op *op);
void fpu_unary(struct esp *esp, const struct op *op);
void fpu_compare(struct esp *esp, const struct op *op);
void mac_execute(struct esp *esp, const struct op *op);
/* bus.c: size 1, 2 or 4 bytes */
bool bus_create(struct esp *esp);
void bus_destroy(struct esp *esp);
void bus_add(struct esp *esp, const struct block *block);
uint32_t bus_load(struct esp *esp, uint32_t address, unsigned size);
void bus_store(struct esp *esp, uint32_t address, uint32_t value, unsigned size);
bool bus_fetch(struct esp *esp, uint32_t address, uint32_t *word); /* 4 bytes, or those that there are */
const char *bus_missing(const struct esp *esp, uint32_t address,
                        const char *otherwise);                            /* why there is nothing */
uint8_t *bus_bytes(const struct esp *esp, uint32_t address, size_t count); /* NULL: no memory has them all */
bool bus_has(const struct esp *esp, uint32_t address, size_t count);       /* some memories have */
/* cache.c */
bool cache_create(struct esp *esp);
void cache_destroy(struct esp *esp);
void cache_reset(struct esp *esp);
/** A line comes. The core has waited for the other one: cores_wait(), cores_retry(). */
void cache_miss(struct esp *esp, uint32_t address);
void cache_flush(struct esp *esp, unsigned number); /* a core's of the ESP32; CACHE_CODE, CACHE_DATA */
void cache_invalidate(struct esp *esp, unsigned number, uint32_t from, uint32_t size);
bool cache_configure(struct esp *esp, unsigned number, uint32_t size, uint32_t ways, uint32_t line);
/* flash.c, mmu.c, spi.c */
bool flash_create(struct esp *esp, size_t size);
bool flash_is_busy(const struct esp *esp);
uint64_t flash_busy_cycles(const struct esp *esp);
void flash_do(struct esp *esp, const struct flash_command *command);
void mmu_create(struct esp *esp);
void mmu_destroy(struct esp *esp);
void mmu_begin(struct esp *esp);
void mmu_map(struct esp *esp, unsigned entry, uint32_t value);
unsigned mmu_entry(const struct esp *esp, uint32_t address);    /* that maps it */
bool mmu_has(const struct esp *esp, uint32_t address);          /* flash may be mapped there */
void mmu_show(struct esp *esp, bool visible);                   /* the cache is turned on or off */
void mmu_changed(struct esp *esp, uint32_t at, uint32_t count); /* bytes of the flash */
void spi_create(struct esp *esp);
/** As the bootloader sets SPI0 up. @param header  of an image: mode in its byte 2, frequency in byte 3 */
void spi_configure(struct esp *esp, const uint8_t *header);
void spi_set_divider(struct esp *esp, uint32_t divider, uint32_t number);
uint64_t spi_line_cycles(const struct esp *esp, unsigned bytes); /* until SPI0 has read them */
void dport_create(struct esp *esp);
void dport_cache(struct esp *esp, unsigned core, bool on); /* of the ESP32 */
/* load.c, boot.c */
extern const char *const chip_names[];
bool image_read(struct esp *esp, const uint8_t *bytes, size_t size, struct image *image);
enum { CAUSE_POWER_ON = 1, CAUSE_CPU_BY_GROUP_1 = 17 }; /* of a reset; the latter of the S3 */
bool boot_again(struct esp *esp);                       /* after a reset */
bool boot_is_merged(const uint8_t *bytes, size_t size);
bool boot_load_merged(struct esp *esp, const uint8_t *bytes, size_t size);
size_t boot_flash_size(const uint8_t *header);
bool boot_can_map(struct esp *esp, const struct image *image, uint32_t place);
bool boot_start(struct esp *esp, const struct image *image,
                uint32_t place); /* as the 2nd-stage bootloader does */
/* rom.c */
bool rom_has(const struct esp *esp, uint32_t address);
void rom_call(struct esp *esp);
/* peripherals: their registers, when something happens next, let it happen */
void gpio_create(struct esp *esp);
void io_mux_create(struct esp *esp);
void gpio_pulls(struct esp *esp); /* they may have changed */
/** An edge of a pin of the chip, or of a register outside. */
void gpio_record(struct esp *esp, uint64_t cycle, unsigned pin, bool level);
/** Signals of the matrix that a peripheral here makes. */
void gpio_has_signals(struct esp *esp, unsigned first, unsigned count);
void gpio_signal(struct esp *esp, uint64_t cycle, unsigned signal, bool level);
bool gpio_is_routed(const struct esp *esp, unsigned pin, unsigned signal);
/** The level of a signal that goes in. */
bool gpio_input(const struct esp *esp, unsigned signal);
/** pcnt_pins() and shift_pins() want to know of this pin. */
void gpio_listen(struct esp *esp, unsigned pin);
/* parts.c */
void parts_create(struct esp *esp);
uint64_t parts_next(const struct esp *esp);
void parts_event(struct esp *esp);
/* spi_master.c, w5500.c */
void spi_master_create(struct esp *esp);
uint64_t spi_master_next(const struct esp *esp);
void spi_master_event(struct esp *esp);
/* spi_s3.c, gdma.c: of the S3 */
void spi_s3_create(struct esp *esp);
void spi_s3_event(struct esp *esp);
void gdma_create(struct esp *esp);
/** What a peripheral's transaction takes from its list, or puts into it. @return bytes moved */
size_t gdma_move(struct esp *esp, unsigned peripheral, bool out, uint8_t *bytes, size_t count);
/** A frame of SPI, from the select line's fall to its rise. */
void w5500_exchange(struct esp *esp, const uint8_t *out, uint8_t *in, size_t count);
/* shift.c */
void shift_sync(struct esp *esp); /* what has left a peripheral until now is in the registers */
void shift_pins(struct esp *esp, uint64_t cycle, unsigned bank, uint32_t changed);
void shift_bits(struct esp *esp, uint32_t bits, unsigned count);
void shift_show(struct esp *esp, uint64_t cycle); /* the latch rises */
/* i2s.c, rmt.c, ledc.c, mcpwm.c, pcnt.c */
void i2s_create(struct esp *esp);
void i2s_reset(struct esp *esp); /* by its bit of DPORT, as by that of the chip */
void i2s_sync(struct esp *esp);
uint64_t i2s_next(const struct esp *esp);
void rmt_create(struct esp *esp);
void rmt_event(struct esp *esp);
void ledc_create(struct esp *esp);
void ledc_event(struct esp *esp);
void mcpwm_create(struct esp *esp);
void mcpwm_reset(struct esp *esp); /* the same */
void mcpwm_event(struct esp *esp);
void pcnt_create(struct esp *esp);
void pcnt_pins(struct esp *esp, uint64_t cycle);
void pcnt_routed(struct esp *esp, unsigned signal);
void pcnt_event(struct esp *esp);
void timers_create(struct esp *esp);
uint64_t timers_next(const struct esp *esp);
void timers_event(struct esp *esp);
void timers_watchdog(struct esp *esp, unsigned group); /* its watchdog's interrupt */
void watchdogs_create(struct esp *esp);
uint64_t watchdogs_next(const struct esp *esp);
void watchdogs_event(struct esp *esp);
uint32_t watchdog_load(const struct esp *esp, unsigned number, unsigned word);
void watchdog_store(struct esp *esp, unsigned number, unsigned word, uint32_t value);
void rtc_create(struct esp *esp);
void systimer_create(struct esp *esp);
uint64_t systimer_next(const struct esp *esp);
void systimer_event(struct esp *esp);
void efuse_create(struct esp *esp);
void sha_create(struct esp *esp);
uint8_t efuse_crc8(const uint8_t *bytes, size_t count);
void matrix_create(struct esp *esp);
void matrix_set(struct esp *esp, unsigned source, bool active); /* for both cores */
void matrix_set_core(struct esp *esp, unsigned core, unsigned source, bool active);
void matrix_update(struct esp *esp);
void uart_create(struct esp *esp);
uint64_t uart_next(const struct esp *esp);
void uart_event(struct esp *esp);
void uart_print(struct esp *esp, unsigned number, uint8_t byte); /* as if sent, in no time */
void usb_serial_create(struct esp *esp);
uint64_t usb_serial_next(const struct esp *esp);
void usb_serial_event(struct esp *esp);

#endif
