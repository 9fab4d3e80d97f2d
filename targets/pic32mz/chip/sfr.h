/* SPDX-License-Identifier: MIT
 * The registers of the PIC32MZ EF that this firmware touches, by their names in the data sheet (DS60001320).
 *
 * Addresses are those of KSEG1: never cached. Every register but OFFx has three shadows: writing +4 clears,
 * +8 sets and +C inverts the bits written as 1, in one bus access, so that an interrupt and a task may write
 * different bits of one register. */
#ifndef WIFICNC_PIC32MZ_SFR_H
#define WIFICNC_PIC32MZ_SFR_H

#include <stdint.h>

#define SFR(address) (*(volatile uint32_t *)(uintptr_t)(address))

/* a register's shadows */
#define SFR_CLR(address) SFR((address) + 0x4u)
#define SFR_SET(address) SFR((address) + 0x8u)
#define SFR_INV(address) SFR((address) + 0xCu)

/* ---- system, Tables 34-2 and 8-2 */
#define CFGCON_ADDRESS 0xBF800000u
#define SYSKEY         SFR(0xBF800030u)
#define WDTCON_ADDRESS 0xBF800800u
#define WDTCON_KEY     (*(volatile uint16_t *)0xBF800802u) /* a 16-bit write of WDTCLRKEY clears the timer */
#define OSCCON         SFR(0xBF801200u)
#define RCON           SFR(0xBF801240u)
#define RSWRST_ADDRESS 0xBF801250u
#define PB2DIV         SFR(0xBF801310u)
#define PB3DIV         SFR(0xBF801320u)
#define PRECON         SFR(0xBF8E0000u)

#define CFGCON_OCACLK   (1u << 16) /* OC1 .. OC3 run on timer 4 or 5, OC7 .. OC9 on timer 6 or 7 */
#define CFGCON_JTAGEN   (1u << 3)
#define PBDIV_READY     (1u << 11)
#define PBDIV_ON        (1u << 15)
#define WDTCON_ON       (1u << 15)
#define WDTCON_CLEAR    0x5743u
#define OSCCON_COSC(n)  ((n) >> 12 & 7u) /* what the CPU's clock comes from */
#define COSC_PLL        1u
#define RCON_POR        (1u << 0)
#define RCON_BOR        (1u << 1)
#define RCON_WDTO       (1u << 4)
#define RCON_DMTO       (1u << 5)
#define RCON_EXTR       (1u << 7)
#define RSWRST_SWRST    1u
#define PRECON_PREFETCH (3u << 4) /* of instructions and data */

/* ---- flash controller, Table 5-1 */
#define NVMCON          SFR(0xBF800600u)
#define NVMCON_ADDRESS  0xBF800600u
#define NVMKEY          SFR(0xBF800610u)
#define NVMADDR         SFR(0xBF800620u)
#define NVMDATA(n)      SFR(0xBF800630u + 0x10u * (n)) /* 0 .. 3 */
#define NVMCON_WR       (1u << 15)
#define NVMCON_WREN     (1u << 14)
#define NVMCON_WRERR    (1u << 13)
#define NVMCON_LVDERR   (1u << 12)
#define NVMOP_QUAD_WORD 2u
#define NVMOP_ERASE     4u

/* ---- peripheral pin select, Tables 12-21 and 12-22; pin = 16 * port + bit */
#define U2RXR    SFR(0xBF801470u)
#define U3RXR    SFR(0xBF801478u)
#define RPR(pin) SFR(0xBF801500u + 4u * (pin))

/* ---- interrupts, Tables 7-2 and 7-3 */
#define INTCON_ADDRESS 0xBF810000u
#define PRISS          SFR(0xBF810010u)
#define IFS_ADDRESS(n) (0xBF810040u + 0x10u * (n))
#define IEC_ADDRESS(n) (0xBF8100C0u + 0x10u * (n))
#define IPC_ADDRESS(n) (0xBF810140u + 0x10u * (n))
#define OFF(irq)       SFR(0xBF810540u + 4u * (irq))
#define INTCON_MVEC    (1u << 12)

/* ---- UARTs 2 and 3, Table 22-1 */
#define U2MODE        SFR(0xBF822200u)
#define U2STA         SFR(0xBF822210u)
#define U2STA_ADDRESS 0xBF822210u
#define U2TXREG       SFR(0xBF822220u)
#define U2RXREG       SFR(0xBF822230u)
#define U2BRG         SFR(0xBF822240u)
#define U3MODE        SFR(0xBF822400u)
#define U3STA         SFR(0xBF822410u)
#define U3STA_ADDRESS 0xBF822410u
#define U3TXREG       SFR(0xBF822420u)
#define U3RXREG       SFR(0xBF822430u)
#define U3BRG         SFR(0xBF822440u)
#define UMODE_ON      (1u << 15)
#define UMODE_BRGH    (1u << 3)
#define UMODE_EVEN    (1u << 1) /* PDSEL: 8 bits and parity */
#define UMODE_ODD     (2u << 1)
#define USTA_URXEN    (1u << 12)
#define USTA_UTXEN    (1u << 10)
#define USTA_UTXBF    (1u << 9)
#define USTA_TRMT     (1u << 8) /* nothing is being sent */
#define USTA_FERR     (1u << 2)
#define USTA_OERR     (1u << 1)
#define USTA_URXDA    (1u << 0)
#define USTA_TX_SENT  (1u << 14) /* UTXISEL: interrupt when all was sent */
#define USTA_TX_EMPTY (2u << 14) /* UTXISEL: interrupt while the transmit FIFO is empty */

/* ---- timers and output compare, Tables 14-1 and 18-2 */
#define T4CON_ADDRESS 0xBF840600u
#define TMR4          SFR(0xBF840610u)
#define PR4           SFR(0xBF840620u)
#define T6CON         SFR(0xBF840A00u)
#define TMR6          SFR(0xBF840A10u)
#define PR6           SFR(0xBF840A20u)
#define T8CON         SFR(0xBF840E00u)
#define TMR8          SFR(0xBF840E10u)
#define PR8           SFR(0xBF840E20u)
#define T9CON         SFR(0xBF841000u)
#define PR9           SFR(0xBF841020u)
#define TMR9          SFR(0xBF841010u)
#define OC1CON        SFR(0xBF844000u)
#define OC1R          SFR(0xBF844010u)
#define OC1RS         SFR(0xBF844020u)
#define OC8CON        SFR(0xBF844E00u)
#define OC8R          SFR(0xBF844E10u)
#define OC8RS         SFR(0xBF844E20u)
#define TCON_ON       (1u << 15)
#define TCON_PRESCALE 4u /* bits 6:4: the clock is divided by 1, 2, 4 .. 64 */
#define OCCON_ON      (1u << 15)
#define OCM_PULSES    5u /* dual compare, continuous pulses */
#define OCM_PWM       6u

/* ---- ports A .. G, Table 12-3 ff.; port = 0 .. 6 */
#define PORT_REGISTER(port, offset) (0xBF860000u + 0x100u * (port) + (offset))
#define ANSEL_ADDRESS(port)         PORT_REGISTER(port, 0x00u)
#define TRIS_ADDRESS(port)          PORT_REGISTER(port, 0x10u)
#define PORT_ADDRESS(port)          PORT_REGISTER(port, 0x20u)
#define LAT_ADDRESS(port)           PORT_REGISTER(port, 0x30u)
#define CNPU_ADDRESS(port)          PORT_REGISTER(port, 0x50u)
#define CNPD_ADDRESS(port)          PORT_REGISTER(port, 0x60u)
#define CNCON_ADDRESS(port)         PORT_REGISTER(port, 0x70u)
#define CNEN_ADDRESS(port)          PORT_REGISTER(port, 0x80u) /* rising edges */
#define CNNE_ADDRESS(port)          PORT_REGISTER(port, 0xA0u) /* falling edges */
#define CNF_ADDRESS(port)           PORT_REGISTER(port, 0xB0u) /* edges seen */
#define CNCON_ON                    (1u << 15)
#define CNCON_EDGE_DETECT           (1u << 11)

enum { PORT_COUNT = 7, PORT_WIDTH = 16 };

#endif
