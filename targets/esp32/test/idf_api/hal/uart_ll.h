/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's hal/uart_ll.h, declared again: enough to compile against, checked against the
 * real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include <stdint.h>

typedef enum { UART_INTR_FRAM_ERR = 1 << 3 } uart_intr_t;

typedef struct uart_dev_t uart_dev_t;
extern uart_dev_t UART0;

#define UART_LL_GET_HW(number) ((void)(number), &UART0)

/* Of soc/uart_reg.h, which comes with it: fields of a register, and no names for anything of ours. */
#define UART_RX_SIZE 0x0000000F
#define UART_TX_SIZE 0x0000000F

uint32_t uart_ll_get_rxfifo_len(uart_dev_t *hw);
