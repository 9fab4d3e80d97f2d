/* SPDX-License-Identifier: MIT
 * The inside of the virtual chip, for the files of this folder only.
 *
 *   cpu.c     instructions            loop.def is their loop, the other *.def are its tables
 *   rare.c  instructions that are rare or long
 *   exception.c  exceptions, interrupts, reset
 *   bus.c     addresses -> RAM, flash, registers
 *   sfr.c     the registers: SET, CLR, INV, what may be written when
 *   evic.c timer.c uart.c port.c nvm.c system.c   the peripherals
 *   bench.c   motors, switches and a probe at the pins
 *   chip.c    time */
#ifndef WIFICNC_MZSIM_CHIP_H
#define WIFICNC_MZSIM_CHIP_H

#include "mzsim.h"

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "memories are arrays of words");

#define NEVER UINT64_MAX

enum {
    RAM_SIZE = 512 << 10,
    BOOT_SIZE = 0x10000, /* lower boot alias */
    REGISTER_SETS = 8,
    TLB_ENTRIES = 16,
    SFR_SLOTS = 0x10000, /* registers lie 16 bytes apart in 1 MB */
    SFR_MAX = 640,
    IRQ_COUNT = 216,
    PORTS = 7,
    TIMERS = 10, /* 2 .. 9 are used */
    COMPARES = 10,
    EDGES_MAX = 1 << 16,
    DRIVES_MAX = 1 << 12,
    UART_FIFO = 8,
};

#define FLASH_BASE 0x1D000000u
#define BOOT_BASE  0x1FC00000u
#define SFR_BASE   0x1F800000u

/* CP0 Status and Cause */
enum {
    STATUS_IE = 1 << 0,
    STATUS_EXL = 1 << 1,
    STATUS_ERL = 1 << 2,
    STATUS_NMI = 1 << 19,
    STATUS_BEV = 1 << 22,
    STATUS_FR = 1 << 26,
    STATUS_CU1 = 1 << 29,
};
enum exception_code {
    EXCEPTION_INTERRUPT = 0,
    EXCEPTION_TLB_LOAD = 2,
    EXCEPTION_TLB_STORE = 3,
    EXCEPTION_ADDRESS_LOAD = 4,
    EXCEPTION_ADDRESS_STORE = 5,
    EXCEPTION_SYSCALL = 8,
    EXCEPTION_BREAK = 9,
    EXCEPTION_RESERVED = 10,
    EXCEPTION_COPROCESSOR = 11,
    EXCEPTION_OVERFLOW = 12,
    EXCEPTION_TRAP = 13,
};

/** Numbers of interrupts that peripherals raise. */
enum {
    IRQ_CORE_TIMER = 0,
    IRQ_OC1 = 7, /* OCn = 2 + 5n, TIMERn = -1 + 5n for n < 6 */
    IRQ_CHANGE = 118,
    IRQ_U2_RX = 146,
    IRQ_U2_TX = 147,
    IRQ_U3_RX = 158,
    IRQ_U3_TX = 159,
    IRQ_NVM = 167,
};

struct cpu {
    uint32_t *r; /* the register set in use */
    uint32_t pc, next_pc;
    uint32_t at;        /* address of the present instruction */
    bool in_slot, slot; /* the present instruction, the next one lies in a delay slot */
    bool waits;         /* WAIT: until an interrupt */
    bool linked;        /* LL */
    bool broken;        /* the present instruction met an exception */
    uint32_t hi, lo, fcsr;
    uint32_t status, cause, epc, error_epc, ebase, intctl, srsctl, config, compare, bad_address;
    uint32_t tlb_index, tlb_low[2], tlb_mask, tlb_high;
    uint32_t tlb[TLB_ENTRIES]; /* pages that entries are for, none of them valid */
    uint32_t tlb_written;      /* bit for each: a power-on leaves it unknown */
    uint64_t f[32];
    uint32_t set[REGISTER_SETS][32];
};

/* An instruction, decoded. Kinds are the main opcodes, or one for each of SPECIAL and REGIMM, or these. */
enum { OP_UNKNOWN = 0, OP_RESERVED = 254, OP_LEAVE = 255 };
struct op {
    uint32_t word;
    uint8_t kind, rs, rt, rd;
};

struct sfr {
    char name[12];
    uint32_t address; /* physical */
    uint32_t value, at_reset, writable;
    unsigned unit; /* number of the peripheral */
    bool locked;   /* by SYSKEY */
    bool plain;    /* has no CLR, SET, INV */
    void (*written)(struct chip *, struct sfr *, uint32_t before);
    uint32_t (*read)(struct chip *, struct sfr *);
};

/* A type B timer: where it stood at a moment, and since then it counts. */
struct timer {
    struct sfr *con, *tmr, *pr;
    uint64_t since; /* cycle at which the count was `from` */
    uint32_t from;
    uint64_t next; /* cycle of the next match or compare */
};

struct compare {
    struct sfr *con, *r, *rs;
    bool high;
};

struct uart {
    struct sfr *mode, *sta, *brg;
    uint8_t tx_fifo[UART_FIFO];
    uint16_t rx_fifo[UART_FIFO]; /* bit 8: the byte has a framing error */
    unsigned tx_count, rx_count;
    bool shifting;
    uint8_t shift;
    uint64_t tx_next, rx_next;
    uint16_t *in; /* as rx_fifo */
    uint8_t *out;
    size_t in_count, in_at, in_room, out_count, out_room;
    uint32_t factor;
    unsigned driver_pin; /* DE of a bus; 255: none */
};

struct port {
    struct sfr *ansel, *tris, *port, *lat, *cnpu, *cnpd, *cncon, *cnen, *cnne, *cnf;
    uint16_t driven, drive; /* from outside: which pins, and their levels */
    uint16_t level;         /* of all pins now */
    uint16_t function;      /* pins that a peripheral has (PPS) */
    uint16_t function_level;
};

struct drive {
    uint64_t cycle;
    uint8_t pin;
    int8_t level;
};

struct nvm {
    struct sfr *con, *key, *addr, *data[4];
    unsigned keys;    /* of the unlock sequence, right so far */
    uint64_t done_at; /* NEVER: idle */
    uint32_t operations, cut_at;
    int torn;
};

struct bench_axis {
    struct mz_axis wire;
    int32_t position;
    uint64_t rose, fell, turned;
};

struct bench {
    struct bench_axis axis[MZ_AXES];
    uint8_t step_axis[MZ_PIN_COUNT], dir_axis[MZ_PIN_COUNT]; /* axis of a pin, 255: none */
    uint8_t probe, setter;                                   /* pins */
    int32_t setter_at[3], setter_radius;
    int32_t surface;
    struct mz_pulses least;
    struct mz_step *steps;
    size_t count, room;
};

/* Lines of 16 bytes, four in a set: 16 KB of code, 4 KB of data. */
enum { CACHE_WAYS = 4, CODE_SETS = 256, DATA_SETS = 64 };
struct cache_line {
    uint32_t tag; /* 1 + number of the line; 0: empty */
    bool dirty;
};
struct cache {
    unsigned sets;
    struct cache_line line[CODE_SETS][CACHE_WAYS]; /* the newest of a set first */
};
struct timing {
    bool on;
    struct mz_timing cost;
    uint32_t fetched; /* line that missed last */
    struct cache code, data;
};

struct chip {
    struct cpu cpu;
    struct timing timing;
    uint64_t cycles, asleep; /* asleep: cycles without an instruction */
    uint64_t limit;          /* the CPU runs up to here without looking around */
    uint64_t next_event;
    uint32_t speed; /* mz_cpu_speed() */
    enum mz_stop stop;
    bool look; /* interrupts or events may have changed */
    char fault[160];
    uint32_t resets;
    uint32_t *ram, *flash, *boot;
    struct op *ops; /* of each word of flash; forgotten by chip_flash_changed() */
    /* registers */
    struct sfr sfr[SFR_MAX];
    unsigned sfr_count;
    uint16_t slot[SFR_SLOTS]; /* 1 + index of sfr[]; 0: none */
    uint32_t off[IRQ_COUNT];
    /* interrupts */
    struct sfr *ifs[7], *iec[7], *ipc[54], *priss;
    uint32_t level; /* that is asked for, 0 = none */
    unsigned irq;   /* who asks */
    struct mz_vector vectors[IRQ_COUNT];
    unsigned running[REGISTER_SETS]; /* nested interrupts: who, ... */
    uint64_t began[REGISTER_SETS];   /* ... and since which instruction */
    unsigned depth;
    /* peripherals */
    unsigned syskey;
    struct sfr *cfgcon, *pb2div, *pb3div, *rcon, *rswrst, *wdtcon, *osccon, *rnmicon;
    bool oscillator; /* works */
    uint64_t wdt_at, core_timer_at;
    struct timer timer[TIMERS];
    struct compare compare[COMPARES];
    struct uart uart, bus;
    struct port port[PORTS];
    struct nvm nvm;
    struct drive drives[DRIVES_MAX]; /* the next one last */
    unsigned drive_count;
    struct bench bench;
    struct mz_edge *edges;
    size_t edge_count, edge_room;
    bool record_edges;
};

/* chip.c */
void chip_fault(struct chip *chip, const char *format, ...) __attribute__((format(printf, 2, 3)));
void chip_look(struct chip *chip);     /* after anything that may change who interrupts, or when */
void chip_catch_up(struct chip *chip); /* let happen what is due */
void chip_flash_changed(struct chip *chip, uint32_t offset, size_t count);
void chip_restart(struct chip *chip, uint32_t why);
bool chip_grow(void *array, size_t *room, size_t count, size_t size);

/* cpu.c */
void cpu_run(struct chip *chip);
/* exception.c */
void cpu_reset(struct chip *chip);
void cpu_interrupt(struct chip *chip);
void cpu_nmi(struct chip *chip);
void cpu_exception(struct chip *chip, enum exception_code code, uint32_t vector);
/* fpu.c */
void cpu_cop1(struct chip *chip, uint32_t word);
bool cpu_fpu_usable(struct chip *chip);
/* cop0.c */
void cpu_cop0(struct chip *chip, uint32_t word);

/* bus.c: size 1, 2 or 4 bytes; a virtual address, aligned */
uint32_t bus_load(struct chip *chip, uint32_t address, unsigned size);
void bus_store(struct chip *chip, uint32_t address, uint32_t value, unsigned size);
uint32_t bus_fetch(struct chip *chip, uint32_t address);

/* sfr.c */
struct sfr *sfr_add(struct chip *chip, const char *name, uint32_t address, uint32_t at_reset,
                    uint32_t writable);
uint32_t sfr_load(struct chip *chip, uint32_t physical, unsigned size);
void sfr_store(struct chip *chip, uint32_t physical, uint32_t value, unsigned size);
void sfr_reset(struct chip *chip);

/* evic.c */
void evic_create(struct chip *chip);
void evic_raise(struct chip *chip, unsigned irq);
void evic_update(struct chip *chip);

/* Each peripheral: its registers; its state after a reset; when something happens next; let it happen. */
void timers_create(struct chip *chip);
void timers_reset(struct chip *chip);
uint64_t timers_next(const struct chip *chip);
void timers_event(struct chip *chip);
void uart_create(struct chip *chip);
void uart_reset(struct chip *chip);
uint64_t uart_next(const struct chip *chip);
void uart_event(struct chip *chip);
uint32_t uart_lines(const struct chip *chip); /* bit 0: rx asks, bit 1: tx asks; 2 and 3 of the bus */
void port_create(struct chip *chip);
void port_reset(struct chip *chip);
void port_update(struct chip *chip, unsigned port);
void port_function(struct chip *chip, unsigned pin, bool level);
void nvm_create(struct chip *chip);
void nvm_reset(struct chip *chip);
void nvm_event(struct chip *chip);
bool nvm_key(struct chip *chip, const struct sfr *sfr, uint32_t value);
void system_create(struct chip *chip);
void system_reset(struct chip *chip);
void system_event(struct chip *chip);
uint64_t system_next(const struct chip *chip);
bool system_is_on_backup(const struct chip *chip); /* MZ_BACKUP_HZ, not MZ_CPU_HZ */
void system_set_compare(struct chip *chip, uint32_t value);
uint32_t system_bus_cycles(const struct chip *chip, const struct sfr *pbdiv); /* in a tick of a bus */
uint32_t system_count(const struct chip *chip);                               /* CP0 Count */

/* timing.c: what an access costs, in units of chip->cycles */
uint64_t timing_fetch(struct chip *chip, uint32_t address);
uint64_t timing_data(struct chip *chip, uint32_t address, bool writes);
void timing_register(struct chip *chip, bool writes);
void timing_interrupt(struct chip *chip);

/* bench.c */
void bench_create(struct chip *chip);
void bench_edge(struct chip *chip, unsigned pin, bool level);

#endif
