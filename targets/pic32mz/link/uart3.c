/* SPDX-License-Identifier: MIT */
#include "link/uart3.h"

#include "base/ring.h"
#include "chip/clock.h"
#include "chip/interrupts.h"
#include "chip/system.h"
#include "pin_config.h"

#define BAUD         115200u
#define CLOCKS_A_BIT 4u /* BRGH = 1 */
#define BRG_OF(hz)   (((hz) + CLOCKS_A_BIT * BAUD / 2u) / (CLOCKS_A_BIT * BAUD) - 1u)
#define BRG          BRG_OF(CLOCK_BUS_HZ)

/* Tables 12-21 and 12-22 */
#define RPA14_IS_U3TX 1u
#define U3RX_IS_RPF5  2u
#define PIN_RA14      (16u * 0u + 14u)
#define PIN_RF5       (16u * 5u + 5u)

_Static_assert(PIN_SERIAL_TX == PIN_RA14 && PIN_SERIAL_RX == PIN_RF5, "other pins have other PPS numbers");

static struct {
    struct rx *rx;
    struct ring index; /* the task fills, the transmit interrupt empties */
    uint8_t out[UART_OUT_SIZE];
} uart;

void uart_init(struct rx *rx) {
    uart.rx = rx;
    RPR(PIN_SERIAL_TX) = RPA14_IS_U3TX;
    U3RXR = U3RX_IS_RPF5;
    U3MODE = UMODE_BRGH;
    U3BRG = BRG;
    U3STA = USTA_TX_EMPTY | USTA_URXEN | USTA_UTXEN;
    U3MODE = UMODE_BRGH | UMODE_ON;
    interrupt_clear(IRQ_U3_RX);
    interrupt_enable(IRQ_U3_RX);
}

/* The flag is set as long as bytes wait, so it is cleared after them. USTA_FERR belongs to the byte that is
 * read next: one without its stop bit means nothing, not even a real-time command. An overrun has lost what
 * came after the eight bytes of the FIFO. */
void on_uart_rx(void) {
    uint32_t status;
    while (((status = U3STA) & USTA_URXDA) != 0) {
        const uint8_t byte = (uint8_t)U3RXREG;
        if ((status & USTA_FERR) == 0)
            rx_put_or_lose(uart.rx, byte);
        else
            rx_gap(uart.rx, RX_UNFRAMED);
    }
    if ((status & USTA_OERR) != 0) {
        SFR_CLR(U3STA_ADDRESS) = USTA_OERR;
        rx_gap(uart.rx, RX_OVERRUN);
    }
    interrupt_clear(IRQ_U3_RX);
}

void on_uart_tx(void) {
    while (ring_held(&uart.index) > 0 && (U3STA & USTA_UTXBF) == 0) {
        U3TXREG = uart.out[uart.index.tail % UART_OUT_SIZE];
        ring_pop(&uart.index);
    }
    interrupt_clear(IRQ_U3_TX);
    if (ring_held(&uart.index) == 0)
        interrupt_disable(IRQ_U3_TX); /* the flag is set while the FIFO is empty */
}

void uart_write(const char *bytes, size_t count) {
    for (; count > 0; count--) {
        /* Rare: the core asks for room before it reads a line (has_room() in app/main.c). An answer is
         * never cut. */
        while (ring_free(&uart.index, UART_OUT_SIZE) == 0) {
            interrupt_enable(IRQ_U3_TX);
            system_watchdog_clear();
        }
        uart.out[uart.index.head % UART_OUT_SIZE] = (uint8_t)*bytes++;
        ring_push(&uart.index);
    }
    interrupt_enable(IRQ_U3_TX);
}

uint32_t uart_room(void) {
    return ring_free(&uart.index, UART_OUT_SIZE);
}

void uart_send_on_backup_clock(const char *text) {
    U3MODE = 0;
    RPR(PIN_SERIAL_TX) = RPA14_IS_U3TX;
    U3BRG = BRG_OF(CLOCK_BACKUP_HZ);
    U3MODE = UMODE_BRGH | UMODE_ON;
    U3STA = USTA_UTXEN;
    while (*text != '\0') {
        while ((U3STA & USTA_UTXBF) != 0) {
        }
        U3TXREG = (uint8_t)*text++;
    }
    while ((U3STA & USTA_TRMT) == 0) {
    }
}
