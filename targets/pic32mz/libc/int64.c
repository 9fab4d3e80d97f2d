/* SPDX-License-Identifier: MIT
 * What the compiler calls for 64-bit integers on a 32-bit machine. The libgcc of a Linux cross compiler is
 * built for position independent code, which this image is not. */
#include <stdint.h>

uint64_t __udivmoddi4(uint64_t n, uint64_t d, uint64_t *rest);
uint64_t __udivdi3(uint64_t n, uint64_t d);
uint64_t __umoddi3(uint64_t n, uint64_t d);
int64_t __divdi3(int64_t n, int64_t d);
int64_t __moddi3(int64_t n, int64_t d);
uint64_t __ashldi3(uint64_t value, int count);
uint64_t __lshrdi3(uint64_t value, int count);
int64_t __ashrdi3(int64_t value, int count);
int __cmpdi2(int64_t a, int64_t b);
int __ucmpdi2(uint64_t a, uint64_t b);

/* Shifts by 32 are moves of a word, and call nothing. */
#define HIGH(value)     ((uint32_t)((uint64_t)(value) >> 32))
#define PAIR(high, low) ((uint64_t)(high) << 32 | (uint32_t)(low))

/* One digit of schoolbook division, base 2^16, after Hacker's Delight 9-4: @return floor((high:low) / d),
 * high < d
 */
static uint32_t divide_64_by_32(uint32_t high, uint32_t low, uint32_t d, uint32_t *rest) {
    int shift = __builtin_clz(d);
    d <<= shift;
    uint32_t d1 = d >> 16, d0 = d & 0xFFFFu;
    uint32_t n32 = shift == 0 ? high : high << shift | low >> (32 - shift);
    uint32_t n10 = low << shift, n1 = n10 >> 16, n0 = n10 & 0xFFFFu;
    uint32_t q1 = n32 / d1, r = n32 - q1 * d1;
    while (q1 > 0xFFFFu || q1 * d0 > (r << 16 | n1)) {
        q1--;
        r += d1;
        if (r > 0xFFFFu)
            break;
    }
    uint32_t n21 = (n32 << 16 | n1) - q1 * d;
    uint32_t q0 = n21 / d1;
    r = n21 - q0 * d1;
    while (q0 > 0xFFFFu || q0 * d0 > (r << 16 | n0)) {
        q0--;
        r += d1;
        if (r > 0xFFFFu)
            break;
    }
    *rest = ((n21 << 16 | n0) - q0 * d) >> shift;
    return (q1 << 16) + q0;
}

/* Divisors above 2^32 are rare here: bit by bit. */
static uint64_t divide_by_large(uint64_t n, uint64_t d, uint64_t *rest) {
    uint64_t quotient = 0;
    int shift = __builtin_clz((uint32_t)(d >> 32)) - (n >> 32 == 0 ? 32 : __builtin_clz((uint32_t)(n >> 32)));
    for (; shift >= 0; shift--) {
        quotient <<= 1;
        if (n >= d << shift) {
            n -= d << shift;
            quotient |= 1;
        }
    }
    *rest = n;
    return quotient;
}

uint64_t __udivmoddi4(uint64_t n, uint64_t d, uint64_t *rest) {
    uint32_t small = (uint32_t)d, left;
    if (d >> 32 != 0)
        return divide_by_large(n, d, rest);
    uint32_t high = (uint32_t)(n >> 32), quotient_high = high / small;
    uint32_t quotient_low = divide_64_by_32(high % small, (uint32_t)n, small, &left);
    *rest = left;
    return (uint64_t)quotient_high << 32 | quotient_low;
}

uint64_t __udivdi3(uint64_t n, uint64_t d) {
    uint64_t rest;
    return __udivmoddi4(n, d, &rest);
}

uint64_t __umoddi3(uint64_t n, uint64_t d) {
    uint64_t rest;
    (void)__udivmoddi4(n, d, &rest);
    return rest;
}

static uint64_t magnitude(int64_t x) {
    return x < 0 ? 0 - (uint64_t)x : (uint64_t)x;
}

/* Towards 0, as C has it; the sign of a remainder is that of n. */
int64_t __divdi3(int64_t n, int64_t d) {
    uint64_t quotient = __udivdi3(magnitude(n), magnitude(d));
    return (int64_t)((n < 0) != (d < 0) ? 0 - quotient : quotient);
}

int64_t __moddi3(int64_t n, int64_t d) {
    uint64_t rest = __umoddi3(magnitude(n), magnitude(d));
    return (int64_t)(n < 0 ? 0 - rest : rest);
}

/* @return 0, 1, 2: less, equal, greater */
int __cmpdi2(int64_t a, int64_t b) {
    int32_t high_a = (int32_t)(a >> 32), high_b = (int32_t)(b >> 32);
    if (high_a != high_b)
        return high_a < high_b ? 0 : 2;
    uint32_t low_a = (uint32_t)a, low_b = (uint32_t)b;
    return low_a < low_b ? 0 : low_a == low_b ? 1 : 2;
}

int __ucmpdi2(uint64_t a, uint64_t b) {
    uint32_t high_a = (uint32_t)(a >> 32), high_b = (uint32_t)(b >> 32);
    if (high_a != high_b)
        return high_a < high_b ? 0 : 2;
    uint32_t low_a = (uint32_t)a, low_b = (uint32_t)b;
    return low_a < low_b ? 0 : low_a == low_b ? 1 : 2;
}

/* Shifts by 0 .. 63, in words: a shift of the whole would call these again. */

uint64_t __ashldi3(uint64_t value, int count) {
    uint32_t low = (uint32_t)value, high = HIGH(value);
    if (count >= 32)
        return PAIR(low << (count - 32), 0);
    return count == 0 ? value : PAIR(high << count | low >> (32 - count), low << count);
}

uint64_t __lshrdi3(uint64_t value, int count) {
    uint32_t low = (uint32_t)value, high = HIGH(value);
    if (count >= 32)
        return PAIR(0, high >> (count - 32));
    return count == 0 ? value : PAIR(high >> count, low >> count | high << (32 - count));
}

int64_t __ashrdi3(int64_t value, int count) {
    uint32_t low = (uint32_t)value;
    int32_t high = (int32_t)HIGH(value);
    if (count >= 32)
        return (int64_t)PAIR((uint32_t)(high >> 31), (uint32_t)(high >> (count - 32)));
    return count == 0
               ? value
               : (int64_t)PAIR((uint32_t)(high >> count), low >> count | (uint32_t)high << (32 - count));
}
