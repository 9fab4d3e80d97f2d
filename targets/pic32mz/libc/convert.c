/* SPDX-License-Identifier: MIT
 * 64-bit integers to floating point and back, by the names that clang calls for; gcc makes these instructions
 * itself. All round as IEEE 754 says, once. */
#include <stdint.h>
#include <string.h>

#define TWO_63 9223372036854775808.0

double __floatdidf(int64_t value);
float __floatdisf(int64_t value);
double __floatundidf(uint64_t value);
float __floatundisf(uint64_t value);
int64_t __fixdfdi(double value);
int64_t __fixsfdi(float value);
uint64_t __fixunsdfdi(double value);

/* The bits of an integer in a register of the FPU, which has the type of what lies in it. */
static double in_fpu(int64_t value) {
    double bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

double __floatdidf(int64_t value) {
    double result;
    __asm__("cvt.d.l %0, %1" : "=f"(result) : "f"(in_fpu(value)));
    return result;
}

float __floatdisf(int64_t value) {
    float result;
    __asm__("cvt.s.l %0, %1" : "=f"(result) : "f"(in_fpu(value)));
    return result;
}

/* Half of it, with the bit that is lost kept in the last one, so that it is rounded as the whole would be. */
static int64_t half(uint64_t value) {
    return (int64_t)(value >> 1 | (value & 1));
}

double __floatundidf(uint64_t value) {
    return (int64_t)value >= 0 ? __floatdidf((int64_t)value) : 2.0 * __floatdidf(half(value));
}

float __floatundisf(uint64_t value) {
    return (int64_t)value >= 0 ? __floatdisf((int64_t)value) : 2.0f * __floatdisf(half(value));
}

int64_t __fixdfdi(double value) {
    double bits;
    int64_t result;
    __asm__("trunc.l.d %0, %1" : "=f"(bits) : "f"(value));
    memcpy(&result, &bits, sizeof result);
    return result;
}

int64_t __fixsfdi(float value) {
    return __fixdfdi((double)value);
}

uint64_t __fixunsdfdi(double value) {
    if (value < TWO_63)
        return (uint64_t)__fixdfdi(value);
    return (uint64_t)__fixdfdi(value - TWO_63) + ((uint64_t)1 << 63);
}
