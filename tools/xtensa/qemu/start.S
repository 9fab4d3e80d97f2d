/* SPDX-License-Identifier: MIT
 * Reset in qemu-system-xtensa, machine `sim`, core lx106 (call0 ABI): a stack, main(), and out. */
    .section .reset, "ax"
    .global _start
_start:
    j begin
    .align 4
literal_stack:
    .word __stack
literal_main:
    .word main
    .align 4
begin:
    l32r a1, literal_stack
    l32r a2, literal_main
    callx0 a2
    mov a3, a2 /* main()'s result is the exit code */
    movi a2, 1 /* SYS_exit of qemu's simcall */
    simcall
