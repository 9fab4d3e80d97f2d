/* SPDX-License-Identifier: MIT */
#include "chip/interrupts.h"

extern void _vector_step(void), _vector_pulse_end(void), _vector_edge(void), _vector_switch_timer(void);
extern void _vector_uart_rx(void), _vector_uart_tx(void), _vector_tick(void), _vector_pump(void);
extern void _vector_bus_rx(void), _vector_bus_tx(void);
extern const char _exception_base[];

static void route(unsigned irq, void (*vector)(void), unsigned level, unsigned order) {
    /* Four interrupts in an IPC register, 8 bits each: priority in bits 4..2, order among equals in bits
     * 1..0. */
    unsigned shift = irq % 4 * 8;
    OFF(irq) = (uint32_t)(uintptr_t)vector - (uint32_t)(uintptr_t)_exception_base;
    SFR_CLR(IPC_ADDRESS(irq / 4)) = 0x1Fu << shift;
    SFR_SET(IPC_ADDRESS(irq / 4)) = (level << 2 | order) << shift;
    interrupt_clear(irq);
}

void interrupts_stop_all(void) {
    for (unsigned word = 0; word < IRQ_WORDS; word++)
        SFR(IEC_ADDRESS(word)) = 0;
}

void interrupts_init(void) {
    route(IRQ_T4, _vector_step, LEVEL_STEP, ORDER_STEP);
    route(IRQ_OC1, _vector_pulse_end, LEVEL_STEP, ORDER_PULSE_END);
    for (unsigned port = 0; port < PORT_COUNT; port++)
        route(IRQ_CHANGE_A + port, _vector_edge, LEVEL_STEP, ORDER_EDGE);
    route(IRQ_T8, _vector_switch_timer, LEVEL_STEP, ORDER_EDGE);
    route(IRQ_U3_RX, _vector_uart_rx, LEVEL_UART, 1);
    route(IRQ_U3_TX, _vector_uart_tx, LEVEL_UART, 0);
    route(IRQ_U2_RX, _vector_bus_rx, LEVEL_UART, 1);
    route(IRQ_U2_TX, _vector_bus_tx, LEVEL_UART, 0);
    route(IRQ_T9, _vector_pump, LEVEL_PUMP, 0);
    route(IRQ_CORE_TIMER, _vector_tick, LEVEL_TICK, 0);
    PRISS = LEVEL_STEP << 4 * LEVEL_STEP | LEVEL_UART << 4 * LEVEL_UART | LEVEL_PUMP << 4 * LEVEL_PUMP |
            LEVEL_TICK << 4 * LEVEL_TICK;
    SFR_SET(INTCON_ADDRESS) = INTCON_MVEC;
    __asm__ volatile("ei\n\tehb" : : : "memory");
}
