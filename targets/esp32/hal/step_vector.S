/* SPDX-License-Identifier: MIT
 * Level 5's interrupt, which has one source: the step timer, on core 1. ESP-IDF's vector saves a0 in EXCSAVE_5 and calls
 * xt_highint5, which is weak there. A level above 3 is not held off by critical sections, by other interrupts, or by what
 * waits for the flash; in return nothing of FreeRTOS or ESP-IDF may be called.
 *
 * The processor may be anywhere: in the middle of a register window's overflow, too. PS.EXCM is set on entry, so windows
 * do not overflow and loops do not loop, and it stays set. a0 to a15 are then 16 plain registers, whoever's they are, and
 * code of the call0 ABI uses nothing else: nothing is spilled, the window does not move, and what comes back is what was.
 * step_interrupt() and what it calls are compiled so (step_interrupt.c, core/step/isr.c); they save a12 to a15 themselves.
 * Besides these there are SAR, and SCOMPARE1 of the exchange at a span's end. They use no loop registers, no multiplier's
 * accumulator and no float: tools/xtensa looks at every instruction. */

    .section .bss.step_vector,"aw",@nobits
    .balign 16
stack:
    .space 256
/* The argument of step_interrupt(), then a1 to a11, SAR, SCOMPARE1. */
saved:
    .global step_vector_argument
step_vector_argument:
    .space 64

    .section .iram1.step_vector,"ax"
    .balign 4
saved_address:
    .4byte saved

    .global xt_highint5
    .type xt_highint5,@function
    .balign 4
xt_highint5:
    l32r a0, saved_address
    s32i a1, a0, 4
    s32i a2, a0, 8
    s32i a3, a0, 12
    s32i a4, a0, 16
    s32i a5, a0, 20
    s32i a6, a0, 24
    s32i a7, a0, 28
    s32i a8, a0, 32
    s32i a9, a0, 36
    s32i a10, a0, 40
    s32i a11, a0, 44
    rsr.sar a2
    rsr.scompare1 a3
    s32i a2, a0, 48
    s32i a3, a0, 52
    l32i a2, a0, 0
    mov a1, a0
    call0 step_interrupt
    l32i a2, a1, 48
    l32i a3, a1, 52
    wsr.sar a2
    wsr.scompare1 a3
    l32i a2, a1, 8
    l32i a3, a1, 12
    l32i a4, a1, 16
    l32i a5, a1, 20
    l32i a6, a1, 24
    l32i a7, a1, 28
    l32i a8, a1, 32
    l32i a9, a1, 36
    l32i a10, a1, 40
    l32i a11, a1, 44
    l32i a1, a1, 4
    rsr.excsave5 a0
    rfi 5
    .size xt_highint5, . - xt_highint5
