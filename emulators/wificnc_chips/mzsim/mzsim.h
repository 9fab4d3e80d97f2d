/* SPDX-License-Identifier: MIT
 * A virtual PIC32MZ2048EFH100 that runs the real image: what is outside of the chip.
 *
 * Instruction-exact, not cycle-exact: every instruction takes one cycle of the CPU, and time goes from event
 * to event. There are no caches, no flash wait states, no bus stalls. One thread a chip; many chips may live
 * in one process. Everything that a chip would silently get wrong stops it with MZ_FAULT and a sentence. */
#ifndef WIFICNC_MZSIM_H
#define WIFICNC_MZSIM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct chip;

enum { MZ_BACKUP_HZ = 8000000 };
enum { MZ_CPU_HZ = 200000000, MZ_PIN_COUNT = 112, MZ_FLASH_SIZE = 2 << 20, MZ_AXES = 6 };

/** Why mz_run() came back. */
enum mz_stop {
    MZ_TIME,  /* the time asked for has come */
    MZ_FAULT, /* mz_fault() says what is wrong; the chip goes no further */
    MZ_DARK,  /* mz_cut_power() struck: mz_reset() is the next power-on */
};

/** A chip without power, its flash blank. @return NULL: no memory */
struct chip *mz_create(void);
void mz_destroy(struct chip *chip);

/** Write a piece of an image to flash or boot flash, as a programmer does. @param address  physical
 *  @return false: there is no flash for it */
bool mz_program(struct chip *chip, uint32_t address, const uint8_t *bytes, size_t count);

/** Program flash, MZ_FLASH_SIZE bytes, as it is now. For what must outlive a power cut, and to look at. */
const uint8_t *mz_flash(const struct chip *chip);

/** Power-on. RAM keeps its contents; time continues. */
void mz_reset(struct chip *chip);

/** A reset by another cause: the reset pin, a brown-out, the deadman timer. RAM keeps its contents. @param
 * causes bits of RCON (Register 6-1), which stay set until the program clears them */
void mz_reset_by(struct chip *chip, uint32_t causes);

/** The oscillator stops, or works again. The clock monitor goes over to MZ_BACKUP_HZ and raises an NMI; every
 * other clock is slower by as much, so that a cycle is 125 ns, and bytes of the console at a wrong rate are
 * rubbish. */
void mz_oscillator(struct chip *chip, bool works);

/** Cycles since mz_create(). */
uint64_t mz_cycles(const struct chip *chip);
uint64_t mz_instructions(const struct chip *chip);

/** The CPU alone is so many times as fast, and what it takes of time is less; no chip is. A cycle lasts
 * 5 ns / factor from now on. [before the first mz_run()] @param factor  1 .. 100 */
void mz_cpu_speed(struct chip *chip, uint32_t factor);

/** What time costs, in cycles of the CPU, beyond mzsim's one cycle an instruction. */
enum { MZ_TIMING_UNITS = 4 };
struct mz_timing {
    uint32_t instruction; /* quarters of a cycle, 4 or more: each instruction */
    uint32_t fetch_miss;  /* a line of code that is not in the instruction cache */
    uint32_t fetch_next;  /* ... when it follows the line fetched before: prefetched */
    uint32_t data_miss;   /* a line of data that is not in the data cache; twice when it evicts a dirty one */
    uint32_t uncached;    /* a load or store of memory past the caches */
    uint32_t sfr_load, sfr_store; /* a register of a peripheral */
    uint32_t interrupt;           /* from a request to the first instruction of its vector */
};

/** Count time like this. A cycle of mz_cycles() and all others is a quarter of the CPU's from now on, and
 * instructions of vectors are such times. [before the first mz_run(); not with mz_cpu_speed()] */
void mz_set_timing(struct chip *chip, const struct mz_timing *cost);

/** Let it work until this time. */
enum mz_stop mz_run(struct chip *chip, uint64_t until_cycle);

/** What stopped it, or "". */
const char *mz_fault(const struct chip *chip);

/** How often the chip has reset itself (software, watchdog). */
uint32_t mz_resets(const struct chip *chip);

/* ---- UART 3 ---- */

/** Bytes for the receiver, one after the other at the speed that its divider says, or `factor` times that.
 * @return bytes taken */
size_t mz_uart_put(struct chip *chip, const uint8_t *bytes, size_t count);
/** The same, each byte without its stop bit: noise, a break (a 0), another baud rate. */
size_t mz_uart_put_unframed(struct chip *chip, const uint8_t *bytes, size_t count);
void mz_uart_speed(struct chip *chip, uint32_t factor);
size_t mz_uart_waiting(const struct chip *chip);

/** What the transmitter has sent. @return bytes copied */
size_t mz_uart_get(struct chip *chip, uint8_t *bytes, size_t size);

/* ---- UART 2: the bus of a spindle drive ---- */

size_t mz_bus_put(struct chip *chip, const uint8_t *bytes, size_t count);
size_t mz_bus_get(struct chip *chip, uint8_t *bytes, size_t size);

/** Cycles of a byte at the format that is set. */
uint32_t mz_bus_byte_cycles(const struct chip *chip);

/** From now on this pin is DE: a byte that is sent while it is low, or arrives while it is high, is a fault.
 */
void mz_bus_driver(struct chip *chip, unsigned pin);

/* ---- pins: 16 * port (A = 0) + bit ---- */

/** Drive a pin from outside. @param level  0, 1, or -1: no one does, pulls decide */
void mz_pin_drive(struct chip *chip, unsigned pin, int level);

/** At a time: mz_pin_drive() then, in the order of times, and of calls for one time. @return false: 4,096
 * wait already, or there is no such pin */
bool mz_pin_drive_at(struct chip *chip, uint64_t cycle, unsigned pin, int level);

/** Level now, 0 or 1. */
int mz_pin_level(const struct chip *chip, unsigned pin);

/** Output pins only, in order. */
struct mz_edge {
    uint64_t cycle;
    uint8_t pin, level;
};
void mz_record_edges(struct chip *chip, bool on);
size_t mz_edges(struct chip *chip, struct mz_edge *out, size_t room);

/* ---- the machine at the pins ---- */

/** An axis. Pins of 255 are not there. Switches: the pin takes its active level while position <= low or
 * >= high. */
struct mz_axis {
    uint8_t step, dir, min_switch, max_switch;
    uint8_t min_active, max_active; /* levels */
    uint8_t has_low, has_high;
    int32_t low, high;
};
void mz_axis_set(struct chip *chip, unsigned axis, const struct mz_axis *wire);
int32_t mz_axis_position(const struct chip *chip, unsigned axis);
void mz_axis_place(struct chip *chip, unsigned axis, int32_t steps);

/** The probe pin goes low while Z <= z_steps. @param pin  255: none */
void mz_surface(struct chip *chip, unsigned pin, int32_t z_steps);

/** A tool setter: the pin goes low while Z <= at[2], and X and Y are no farther than this from at[0], at[1].
 * @param pin  255: none */
void mz_toolsetter(struct chip *chip, unsigned pin, const int32_t at[3], int32_t radius);

/** Rising step edges of one step event; direction bit 1 = the direction pin is high. */
struct mz_step {
    uint64_t cycle; /* of the first edge */
    uint8_t step, dir;
};
size_t mz_steps(struct chip *chip, struct mz_step *out, size_t room);

/** The shortest of each since mz_create(), cycles; UINT64_MAX: there was none. */
struct mz_pulses {
    uint64_t high, low; /* of a step line */
    uint64_t setup;     /* from a change of direction to the next rising step edge of that axis */
    uint64_t hold;      /* from a rising step edge to a change of that axis' direction */
};
void mz_pulses(const struct chip *chip, struct mz_pulses *out);

/* ---- faults from outside, and what is measured ---- */

/** Cut the power at the n-th flash operation from now, 1 = the next; 0: never. @param torn  0: before it, 1:
 * in the middle, half of its bits are done, 2: right behind it */
void mz_cut_power(struct chip *chip, uint32_t nth, int torn);
uint32_t mz_flash_operations(const struct chip *chip);

/** Of an interrupt, counted from its vector to its eret. */
struct mz_vector {
    uint64_t count, instructions, most;
};
void mz_vector(const struct chip *chip, unsigned irq, struct mz_vector *out);

/** All of the chip, of its memory and of the machine at its pins. Bytes that the receiver has not seen, and
 * bytes and records that were not taken, are no part of it. @return NULL: no memory */
struct mz_state;
struct mz_state *mz_save(const struct chip *chip);
/** As it was; its clock, too. @param state  of this very chip */
void mz_restore(struct chip *chip, const struct mz_state *state);
void mz_forget(struct mz_state *state);

/* ---- for tests of the CPU alone ---- */

/** What one instruction sees and leaves. */
struct mz_cpu {
    uint32_t r[32], hi, lo, pc, next_pc, fcsr;
    uint64_t f[32];
};
void mz_cpu_get(const struct chip *chip, struct mz_cpu *out);
void mz_cpu_set(struct chip *chip, const struct mz_cpu *in);
bool mz_ram_write(struct chip *chip, uint32_t physical, const uint8_t *bytes, size_t count);
bool mz_ram_read(const struct chip *chip, uint32_t physical, uint8_t *bytes, size_t count);

/** One instruction. */
enum mz_stop mz_step(struct chip *chip);

/** A register as the CPU reads and writes it, for tests of peripherals. @param address  KSEG1 */
uint32_t mz_sfr_read(struct chip *chip, uint32_t address);
void mz_sfr_write(struct chip *chip, uint32_t address, uint32_t value);

#endif
