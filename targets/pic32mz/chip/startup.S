/* SPDX-License-Identifier: MIT
 * From reset to main(), the interrupt vectors, and the general exception.
 *
 * Every interrupt level has a shadow register set of its own (PRISS in interrupts.c), so a vector saves no
 * general register. What it costs is written at each macro. Plain C functions do the work: no compiler needs
 * to know what an interrupt is. */

#define INDEX     $0
#define ENTRY_LO0 $2
#define ENTRY_LO1 $3
#define PAGE_MASK $5
#define ENTRY_HI  $10
#define STATUS  $12
#define SRSCTL  $12, 2
#define INTCTL  $12, 1
#define CAUSE   $13
#define EPC     $14
#define EBASE   $15, 1
#define CONFIG  $16
#define CONFIG1 $16, 1
#define COMPARE $11
#define TAG_LO  $28
#define DTAG_LO $28, 2

#define STATUS_START 0x24400000 /* CU1, FR, BEV: floating point with 32 registers of 64 bits */
#define STATUS_RUN   0x24000000
#define CAUSE_IV     0x00800000
#define FCSR_FLUSH   0x01000000 /* FS: denormal results are 0, and no exception asks software for them */

#define TLB_ENTRIES 16

#define RDPGPR_A1_RA 0x415F2800 /* rdpgpr $a1, $ra */
#define RDPGPR_SP_SP 0x415DE800 /* rdpgpr $sp, $sp: LLVM's assembler does not know it for MIPS32 */

    .set noreorder
    .set noat

/* ---- reset: all that lies in boot flash is 16 bytes that work at any address, because a bootloader keeps the boot
 * flash for itself and has a place for no more than that (docs/pic32mz.md) ---- */

#define KSEG1_BIT 0x20000000

    .section .reset, "ax", @progbits
    .globl _reset
    .ent _reset
_reset:
    la      $t0, _prepare + KSEG1_BIT /* not through caches that hold rubbish */
    jr      $t0
    nop
    .end _reset

    .section .text.start, "ax", @progbits
    .ent _prepare
_prepare:
    mfc0    $t0, STATUS
    srl     $t0, $t0, 19
    andi    $t0, $t0, 1
    bnez    $t0, _nmi /* Status.NMI: no reset, though it begins at the same address */
    nop
    li      $t0, STATUS_START
    mtc0    $t0, STATUS
    ehb
    mtc0    $zero, CAUSE
    mtc0    $zero, COMPARE

    /* caches hold rubbish: invalidate every line by its index (16 KB and 4 KB, lines of 16 bytes) */
    mtc0    $zero, TAG_LO
    mtc0    $zero, DTAG_LO
    lui     $t0, 0x8000
    addiu   $t1, $t0, 0x4000
1:  cache   8, 0($t0)
    addiu   $t0, $t0, 16
    bne     $t0, $t1, 1b
    nop
    lui     $t0, 0x8000
    addiu   $t1, $t0, 0x1000
1:  cache   9, 0($t0)
    addiu   $t0, $t0, 16
    bne     $t0, $t1, 1b
    nop
    mfc0    $t0, CONFIG
    ori     $t0, $t0, 7 /* K0 = 3: KSEG0 is cached, write back */
    xori    $t0, $t0, 4
    mtc0    $t0, CONFIG
    ehb
    la      $t0, _start
    jr      $t0
    nop
_nmi: /* caches, RAM and pins are those of the program that was interrupted; it does not continue */
    la      $sp, _stack_top
    la      $t0, lost_clock
    jr      $t0
    addiu   $sp, $sp, -16
    .end _prepare

    .globl _start
    .ent _start
_start:
    la      $sp, _stack_top
    move    $fp, $zero
    /* .data from flash, then .bss */
    la      $t0, _data_lma
    la      $t1, _data_start
    la      $t2, _data_end
1:  beq     $t1, $t2, 2f
    nop
    lw      $t3, 0($t0)
    sw      $t3, 0($t1)
    addiu   $t0, $t0, 4
    b       1b
    addiu   $t1, $t1, 4
2:  la      $t1, _bss_start
    la      $t2, _bss_end
1:  beq     $t1, $t2, 2f
    nop
    sw      $zero, 0($t1)
    b       1b
    addiu   $t1, $t1, 4
2:
    /* The TLB holds rubbish: 16 entries that map nothing, each for a page of KSEG0, where no one asks it. Then a NULL
     * pointer traps. */
    mtc0    $zero, ENTRY_LO0
    mtc0    $zero, ENTRY_LO1
    mtc0    $zero, PAGE_MASK
    lui     $t0, 0x8000
    move    $t1, $zero
    li      $t2, TLB_ENTRIES
1:  mtc0    $t0, ENTRY_HI
    mtc0    $t1, INDEX
    ehb
    tlbwi
    addiu   $t1, $t1, 1
    bne     $t1, $t2, 1b
    addiu   $t0, $t0, 0x2000
    ehb
    la      $t0, _exception_base
    mtc0    $t0, EBASE
    ehb
    li      $t0, 0x20 /* VS must not be 0, although each vector has an address of its own (OFFx) */
    mtc0    $t0, INTCTL
    li      $t0, CAUSE_IV
    mtc0    $t0, CAUSE
    li      $t0, STATUS_RUN
    mtc0    $t0, STATUS
    ehb
    li      $t0, FCSR_FLUSH
    ctc1    $t0, $31
    jal     main
    nop
1:  b       1b
    nop
    .end _start

/* ---- general exception: a bug, a broken flash or RAM. fault() notes it and resets the chip ---- */

    .section .gen_excpt, "ax", @progbits
    .globl _general_exception
    .ent _general_exception
_general_exception:
    mfc0    $a0, EPC
    .word   RDPGPR_A1_RA
    mfc0    $a2, CAUSE
    la      $sp, _stack_top
    la      $k0, fault
    jr      $k0
    addiu   $sp, $sp, -16
    .end _general_exception

/* An address that nothing is mapped to (TLB refill), and a cache error: their vectors are elsewhere. */
    .section .tlb_excpt, "ax", @progbits
    la      $k0, _general_exception
    jr      $k0
    nop
    .section .cache_excpt, "ax", @progbits
    la      $k0, _general_exception
    jr      $k0
    nop

/* ---- interrupts of the highest level in use: nothing can interrupt them ---- */

/* 6 instructions and the handler's, which must use neither floating point nor HI and LO. */
    .macro VECTOR_TOP name, handler
    .globl \name
    .ent \name
\name:
    .word   RDPGPR_SP_SP
    jal     \handler
    addiu   $sp, $sp, -16
    ehb
    eret
    .end \name
    .endm

/* The same for handlers that multiply. */
    .macro VECTOR_TOP_MULTIPLIES name, handler
    .globl \name
    .ent \name
\name:
    .word   RDPGPR_SP_SP
    mfhi    $k0
    mflo    $k1
    addiu   $sp, $sp, -24
    sw      $k0, 16($sp)
    jal     \handler
    sw      $k1, 20($sp)
    lw      $k0, 16($sp)
    lw      $k1, 20($sp)
    mthi    $k0
    mtlo    $k1
    ehb
    eret
    .end \name
    .endm

/* Lower levels: a higher one may come in between, which takes EPC, Status and SRSCtl. No floating point. */
    .macro VECTOR_LOW name, handler
    .globl \name
    .ent \name
\name:
    .word   RDPGPR_SP_SP
    mfc0    $k0, EPC
    mfc0    $k1, STATUS
    addiu   $sp, $sp, -40
    sw      $k0, 36($sp)
    sw      $k1, 32($sp)
    mfc0    $k0, SRSCTL
    sw      $k0, 28($sp)
    mfhi    $k0
    sw      $k0, 24($sp)
    mflo    $k0
    sw      $k0, 20($sp)
    mfc0    $k0, CAUSE
    srl     $k0, $k0, 10
    ins     $k1, $k0, 10, 6  /* IPL = RIPL: this level and those below wait */
    ins     $k1, $zero, 1, 4 /* EXL, ERL, UM */
    mtc0    $k1, STATUS
    jal     \handler
    ehb
    di
    ehb
    lw      $k0, 20($sp)
    mtlo    $k0
    lw      $k0, 24($sp)
    mthi    $k0
    lw      $k0, 28($sp)
    lw      $k1, 36($sp)
    mtc0    $k1, EPC
    lw      $k1, 32($sp)
    mtc0    $k1, STATUS /* EXL is set in it */
    mtc0    $k0, SRSCTL
    ehb
    eret
    .end \name
    .endm

    .section .vectors, "ax", @progbits
    VECTOR_TOP _vector_step, on_step_timer
    VECTOR_TOP _vector_pulse_end, on_pulse_end
    VECTOR_TOP_MULTIPLIES _vector_edge, on_edge
    VECTOR_TOP_MULTIPLIES _vector_switch_timer, on_switch_timer
    VECTOR_LOW _vector_uart_rx, on_uart_rx
    VECTOR_LOW _vector_uart_tx, on_uart_tx
    VECTOR_LOW _vector_bus_rx, on_bus_rx
    VECTOR_LOW _vector_bus_tx, on_bus_tx
    VECTOR_LOW _vector_pump, on_pump_timer
    VECTOR_LOW _vector_tick, on_tick
