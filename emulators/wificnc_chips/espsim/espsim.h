/* SPDX-License-Identifier: MIT
 * A virtual ESP32 or ESP32-S3: both cores, and the peripherals that the step engine uses.
 *
 * Instruction-exact, not cycle-exact: an instruction takes the cycles of a model (es_timing()) of 1/240 us,
 * and time goes from event to event. One thread a chip; many chips may live in one process. Whatever is not
 * emulated stops the chip with ES_FAULT and a sentence that names the address and the function. */
#ifndef WIFICNC_ESPSIM_H
#define WIFICNC_ESPSIM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct esp;

enum es_chip { ES_ESP32, ES_ESP32S3 };

enum { ES_CPU_HZ = 240000000, ES_APB_HZ = 80000000, ES_PINS = 64, ES_SHIFT_FIRST = 64 };

/** Why es_run() came back. */
enum es_stop {
    ES_TIME,  /* the time asked for has come */
    ES_FAULT, /* es_fault() is what is wrong; the chip stays stopped */
    ES_PLACE, /* the program is at the address of es_stop_at() */
    ES_DARK,  /* es_cut_power() struck: es_boot() is the next power-on */
};

/** A chip after a reset, its memories empty. @return NULL: no memory */
struct esp *es_create(enum es_chip chip);
void es_destroy(struct esp *esp);

/** Load a program and set the program counter to its entry: an ELF file; an application image of ESP-IDF (as
 * esptool makes it), which goes into a flash chip; or a merged image of a whole flash chip, from which
 * es_boot() starts. Register windows are as after a reset.
 * @return false: es_fault() is what is wrong, and nothing was loaded */
bool es_load(struct esp *esp, const uint8_t *bytes, size_t count);

/** Whether instructions cost what the model of pipeline, caches and bus says, as at first; else each takes
 * one cycle. Before anything runs. */
void es_timing(struct esp *esp, bool on);

/** What a bootloader sets up, for a program without one: flash is read by DIO at 40 or 80 MHz, and an
 * ESP32-S3's cache for code is this large; an ESP32's are 32 KB. Before anything runs.
 * @return false: there is no such configuration */
bool es_flash_configure(struct esp *esp, unsigned mhz, uint32_t code_cache);

/** Let it work until this cycle. */
enum es_stop es_run(struct esp *esp, uint64_t until_cycle);

/** Stop with ES_PLACE before this instruction, as often as it comes. One at a time. */
void es_stop_at(struct esp *esp, uint32_t address);

/** Cycles and instructions since es_create(). A cycle of a function of the boot ROM counts as an instruction.
 */
uint64_t es_cycles(const struct esp *esp);
uint64_t es_instructions(const struct esp *esp);

/** Resets that were no power-on. @param by  what caused the last one, or "" */
unsigned es_resets(const struct esp *esp, const char **by);

/** What stopped it, or "". */
const char *es_fault(const struct esp *esp);

/** What the program has set up that has no effect here: a line each. */
const char *es_notes(const struct esp *esp);

/** Address of a symbol of the ELF file. @return 0: it has none of this name */
uint32_t es_symbol(const struct esp *esp, const char *name);

/** Take names of functions from an ELF file, for an image without them. @return false: it is no ELF file for
 * Xtensa */
bool es_symbols(struct esp *esp, const uint8_t *bytes, size_t count);

/** The function at this address is not executed: a call returns this value, in no more than a cycle. For what
 * has no emulated hardware, as a radio. @return false: there are too many of them */
bool es_answer(struct esp *esp, uint32_t address, uint32_t value);

/* ---- memory, as a debugger sees it: registers of peripherals are no part of it ---- */

bool es_write(struct esp *esp, uint32_t address, const uint8_t *bytes, size_t count);
bool es_read(const struct esp *esp, uint32_t address, uint8_t *bytes, size_t count);

/* ---- the processor ---- */

struct es_cpu {
    uint32_t a[16]; /* of the present window */
    uint32_t f[16]; /* bits of the floating-point registers */
    uint32_t pc, ps, sar, br, acclo, acchi, scompare1;
    uint32_t lbeg, lend, lcount;
    uint32_t windowbase, windowstart;
    uint32_t epc1, exccause, excvaddr, vecbase, cpenable, intenable, interrupt;
};
/** @param core  0 or 1 */
void es_cpu_get(const struct esp *esp, unsigned core, struct es_cpu *out);
/** Of core 0. The field interrupt is ignored. */
void es_cpu_set(struct esp *esp, const struct es_cpu *in);
/** A physical register of core 0's 64, whatever window it is in. @param number  0 .. 63 */
uint32_t es_physical(struct esp *esp, unsigned number);

/* ---- pins ---- */

/** Drive a pin from outside. @param level  0, 1, or -1: nothing drives it, and it reads 0 */
void es_pin_drive(struct esp *esp, unsigned pin, int level);
int es_pin_level(const struct esp *esp, unsigned pin);

/** A change of an output pin. Recorded from es_record_edges() on. */
struct es_edge {
    uint64_t cycle;
    uint8_t pin, level;
};
void es_record_edges(struct esp *esp, bool on);
/** Take edges, oldest first. @return how many */
size_t es_edges(struct esp *esp, struct es_edge *out, size_t room);

/** Wire a chain of 74HC595, 32 outputs, to these pins. Its outputs are recorded as pins ES_SHIFT_FIRST + 0 to
 * 31, of which 0 has the bit that came last. At power-on they show anything: here all are high. */
void es_shift_registers(struct esp *esp, unsigned clock, unsigned data, unsigned latch);
uint32_t es_shift_outputs(struct esp *esp);

/* ---- a W5500 at SPI2 or SPI3 ---- */

/** @param host  2 or 3. @param select  the host's select line, 0 to 2. @return false: there are no such ones
 */
bool es_w5500(struct esp *esp, unsigned host, unsigned select);
void es_w5500_link(struct esp *esp, bool up);
/** An Ethernet frame comes. @return false: dropped, as it is not for the chip or its buffer is full */
bool es_w5500_put(struct esp *esp, const uint8_t *frame, size_t count);
/** Take the oldest frame that was sent. @return its size; 0: none, or there is no room for it */
size_t es_w5500_get(struct esp *esp, uint8_t *frame, size_t room);

/* ---- UARTs 0 to 2 ---- */

/** Bytes for the receiver, one after the other at the speed of its divider. */
void es_uart_put(struct esp *esp, unsigned number, const uint8_t *bytes, size_t count);
/** Take what the transmitter has sent. @return bytes copied */
size_t es_uart_get(struct esp *esp, unsigned number, uint8_t *bytes, size_t size);

/* ---- USB-Serial-JTAG of an ESP32-S3 ---- */

/** A computer at the port, or none, as at first. @return false: this chip has no such port */
bool es_usb_plug(struct esp *esp, bool on);
/** Bytes that the computer sends, in packets; none while it is not there. */
void es_usb_put(struct esp *esp, const uint8_t *bytes, size_t count);
/** Take what the computer has received. @return bytes copied */
size_t es_usb_get(struct esp *esp, uint8_t *bytes, size_t size);

/* ---- flash ---- */

/** A blank flash chip. @param size  bytes: 1, 2, 4, 8 or 16 MB. @return false: es_fault() */
bool es_flash_create(struct esp *esp, size_t size);
/** Write bytes into it, as a programmer does. @return false: it has no room for them */
bool es_flash_write(struct esp *esp, uint32_t address, const uint8_t *bytes, size_t count);
/** @return its size; 0: none */
size_t es_flash(const struct esp *esp, const uint8_t **bytes);

/** A power-on: start the application that the flash chip's partition table and otadata name, as the
 * second-stage bootloader does. @return false: es_fault() */
bool es_boot(struct esp *esp);

/** From the next start on, run the bootloader that is in the flash chip instead. */
void es_run_bootloader(struct esp *esp, bool on);

/** Cut the power at the n-th write or erase from now, 1 = the next; 0: never. @param torn  0: before it, 1:
 * in its middle, half of its bytes are done, and half of the bits of the next one, 2: right behind it */
void es_cut_power(struct esp *esp, uint32_t nth, int torn);
uint32_t es_flash_operations(const struct esp *esp);

/* ---- measurements ---- */

/** Interrupts of a level, from the first instruction of its vector to its RFI. */
struct es_level {
    uint64_t count, cycles, most;
};
void es_level(const struct esp *esp, unsigned level, struct es_level *out);

/** What a core has done since es_create(). */
struct es_core {
    uint64_t cycles, idle; /* idle: of them, while it waited for an interrupt or had no clock */
    uint64_t instructions;
    uint64_t misses, missing; /* of the caches; cycles for which it waited for them */
};
/** @param core  0 or 1 */
void es_core(const struct esp *esp, unsigned core, struct es_core *out);

#endif
