/* SPDX-License-Identifier: MIT */
#include "link/bus2.h"

#include "base/ring.h"
#include "chip/clock.h"
#include "chip/interrupts.h"
#include "hal/hal.h"
#include "io/pin.h"
#include "pin_config.h"

#include <stddef.h>

#define CLOCKS_A_BIT 16u /* BRGH = 0 */

/* Tables 12-21 and 12-22 */
#define RPB14_IS_U2TX 2u
#define U2RX_IS_RPG6  1u
#define PIN_RB14      (16u * 1u + 14u)
#define PIN_RG6       (16u * 6u + 6u)

_Static_assert(!BOARD_HAS_SPINDLE_BUS || (PIN_BUS_TX == PIN_RB14 && PIN_BUS_RX == PIN_RG6),
               "other pins have other PPS numbers");

enum { OUT_SIZE = 16, IN_SIZE = 64 };

static struct {
    struct ring in_index; /* the receive interrupt fills, the task empties */
    uint8_t in[IN_SIZE];
    uint8_t out[OUT_SIZE];
    volatile uint8_t out_count, out_at;
    volatile bool sends;
} bus;

static void enable_driver(bool on) {
    if (PIN_BUS_DE != PIN_NONE)
        pin_write((uint8_t)PIN_BUS_DE, on);
}

/* What is in the receiver, and its overrun. */
static void drop_received(void) {
    while ((U2STA & USTA_URXDA) != 0)
        (void)U2RXREG;
    SFR_CLR(U2STA_ADDRESS) = USTA_OERR;
}

void on_bus_rx(void) {
    while ((U2STA & USTA_URXDA) != 0) {
        const uint8_t byte = (uint8_t)U2RXREG;
        if (!bus.sends && ring_free(&bus.in_index, IN_SIZE) > 0) {
            bus.in[bus.in_index.head % IN_SIZE] = byte;
            ring_push(&bus.in_index);
        }
    }
    SFR_CLR(U2STA_ADDRESS) = USTA_OERR; /* a frame with a gap has a wrong CRC */
    interrupt_clear(IRQ_U2_RX);
}

/* First while the FIFO is empty; when all bytes are in it, at the end of the last stop bit. */
void on_bus_tx(void) {
    while (bus.out_at < bus.out_count && (U2STA & USTA_UTXBF) == 0)
        U2TXREG = bus.out[bus.out_at++];
    if (bus.out_at < bus.out_count) {
        interrupt_clear(IRQ_U2_TX);
        return;
    }
    SFR_CLR(U2STA_ADDRESS) = USTA_TX_EMPTY;
    SFR_SET(U2STA_ADDRESS) = USTA_TX_SENT;
    interrupt_clear(IRQ_U2_TX);
    if ((U2STA & USTA_TRMT) == 0)
        return;
    interrupt_disable(IRQ_U2_TX);
    enable_driver(false);
    drop_received();
    bus.sends = false;
}

static bool configure(struct hal *hal, const struct hal_bus_format *format) {
    static const uint32_t parity[] = {
        [HAL_BUS_NONE] = 0, [HAL_BUS_EVEN] = UMODE_EVEN, [HAL_BUS_ODD] = UMODE_ODD};
    (void)hal;
    U2MODE = 0;
    U2BRG = (CLOCK_BUS_HZ + CLOCKS_A_BIT * format->baud / 2u) / (CLOCKS_A_BIT * format->baud) - 1u;
    U2STA = USTA_URXEN | USTA_UTXEN;
    U2MODE = parity[format->parity] | UMODE_ON;
    while (ring_held(&bus.in_index) > 0)
        ring_pop(&bus.in_index);
    interrupt_clear(IRQ_U2_RX);
    interrupt_enable(IRQ_U2_RX);
    return true;
}

static void send_bytes(struct hal *hal, const uint8_t *bytes, size_t count) {
    (void)hal;
    if (bus.sends || count > OUT_SIZE) /* not before its answer is lost: spindle/vfd.c */
        return;
    for (size_t n = 0; n < count; n++)
        bus.out[n] = bytes[n];
    bus.out_at = 0;
    bus.out_count = (uint8_t)count;
    bus.sends = true;
    enable_driver(true);
    SFR_CLR(U2STA_ADDRESS) = USTA_TX_SENT;
    SFR_SET(U2STA_ADDRESS) = USTA_TX_EMPTY;
    interrupt_enable(IRQ_U2_TX);
}

static size_t receive_bytes(struct hal *hal, uint8_t *bytes, size_t size) {
    size_t count = 0;
    (void)hal;
    for (; count < size && ring_held(&bus.in_index) > 0; count++) {
        bytes[count] = bus.in[bus.in_index.tail % IN_SIZE];
        ring_pop(&bus.in_index);
    }
    return count;
}

const struct hal_bus *bus_init(void) {
    static const struct hal_bus ops = {.configure = configure, .send = send_bytes, .receive = receive_bytes};
    if (BOARD_HAS_SPINDLE_BUS == 0)
        return NULL;
    if (PIN_BUS_DE != PIN_NONE)
        pin_make_output((uint8_t)PIN_BUS_DE, false);
    pin_make_input((uint8_t)PIN_BUS_RX, PIN_PULL_UP);
    pin_make_output((uint8_t)PIN_BUS_TX, true);
    RPR(PIN_BUS_TX) = RPB14_IS_U2TX;
    U2RXR = U2RX_IS_RPG6;
    return &ops;
}
