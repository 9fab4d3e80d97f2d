/* SPDX-License-Identifier: MIT
 * Start of tests/xtensa/vector/main.c in qemu-system-xtensa -M sim -cpu dc233c, a core with register windows and an
 * interrupt of level 5: reset, the window handlers that the ABI prescribes, and the vector of level 5 as ESP-IDF has it. */
    .section .reset,"ax"
    .global reset
reset:
    j begin
    .balign 4
main_address:
    .4byte boot
begin:
    l32r a0, main_address
    jx a0

    .section .boot,"ax"
    .balign 4
stack_address:
    .4byte 0x03000000
program_address:
    .4byte main
first_ps:
    .4byte 0x00040020 /* WOE, UM; nothing held off */
    .balign 4
boot:
    movi a2, 0
    wsr.windowbase a2
    rsync
    movi a2, 1
    wsr.windowstart a2
    rsync
    movi a2, 0x2a
    .byte 0x20, 0x63, 0x13 /* wsr.atomctl a2: compare-and-swap works in uncached memory, too */
    l32r a1, stack_address
    l32r a2, first_ps
    wsr.ps a2
    rsync
    movi a0, 0
    l32r a8, program_address
    callx8 a8
    mov a2, a10
    j leave

/* a2: the exit code, of a program that ends or of one that went astray */
    .balign 4
leave:
    mov a3, a2
    movi a2, 1
    .byte 0x00, 0x51, 0x00 /* simcall */

    .section .vectors,"ax"
    .org 0x000
    s32e a0, a5, -16
    s32e a1, a5, -12
    s32e a2, a5, -8
    s32e a3, a5, -4
    rfwo
    .org 0x040
    l32e a0, a5, -16
    l32e a1, a5, -12
    l32e a2, a5, -8
    l32e a3, a5, -4
    rfwu
    .org 0x080
    s32e a0, a9, -16
    l32e a0, a1, -12
    s32e a1, a9, -12
    s32e a2, a9, -8
    s32e a3, a9, -4
    s32e a4, a0, -32
    s32e a5, a0, -28
    s32e a6, a0, -24
    s32e a7, a0, -20
    rfwo
    .org 0x0c0
    l32e a0, a9, -16
    l32e a1, a9, -12
    l32e a2, a9, -8
    l32e a7, a1, -12
    l32e a3, a9, -4
    l32e a4, a7, -32
    l32e a5, a7, -28
    l32e a6, a7, -24
    l32e a7, a7, -20
    rfwu
    .org 0x100
    s32e a0, a13, -16
    l32e a0, a1, -12
    s32e a1, a13, -12
    s32e a2, a13, -8
    s32e a3, a13, -4
    s32e a4, a0, -48
    s32e a5, a0, -44
    s32e a6, a0, -40
    s32e a7, a0, -36
    s32e a8, a0, -32
    s32e a9, a0, -28
    s32e a10, a0, -24
    s32e a11, a0, -20
    rfwo
    .org 0x140
    l32e a0, a13, -16
    l32e a1, a13, -12
    l32e a2, a13, -8
    l32e a11, a1, -12
    l32e a3, a13, -4
    l32e a4, a11, -48
    l32e a5, a11, -44
    l32e a6, a11, -40
    l32e a7, a11, -36
    l32e a8, a11, -32
    l32e a9, a11, -28
    l32e a10, a11, -24
    l32e a11, a11, -20
    rfwu
    .org 0x240
    wsr.excsave5 a0
    call0 xt_highint5
    .org 0x300 /* kernel, user and double exceptions: there are none */
    movi a2, 90
    j leave
    .org 0x340
    movi a2, 91
    j leave
    .org 0x3c0
    movi a2, 92
    j leave

/* n + (n-1) + ... + 1 by recursion: one window of 4, and one of 12 registers for each step. */
    .text
    .balign 4
sum_by_4_address:
    .4byte sum_by_4
sum_by_12_address:
    .4byte sum_by_12
    .global sum_by_4
    .balign 4
sum_by_4:
    entry a1, 32
    beqz a2, 1f
    addi a6, a2, -1
    mov a3, a2
    l32r a4, sum_by_4_address
    callx4 a4
    add a2, a6, a3
1:  retw
    .global sum_by_12
    .balign 4
sum_by_12:
    entry a1, 64
    beqz a2, 1f
    addi a14, a2, -1
    mov a11, a2
    mov a9, a2
    l32r a12, sum_by_12_address
    callx12 a12
    add a2, a14, a11
    add a2, a2, a9
    sub a2, a2, a9
1:  retw

/* How often a loop of n loops, and 3 n from the multiplier's accumulator. */
    .global loops
    .balign 4
loops:
    entry a1, 32
    movi a3, 0
    loop a2, 1f
    addi a3, a3, 1
    addi a4, a3, 0
1:  mov a2, a3
    retw
    .global accumulates
    .balign 4
accumulates:
    entry a1, 32
    movi a3, 3
    movi a4, 0
    wsr.acclo a4
    wsr.acchi a4
1:  mula.aa.ll a3, a4
    movi a4, 1
    addi a2, a2, -1
    bgez a2, 1b
    rsr.acclo a2
    retw
