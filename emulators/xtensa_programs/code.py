"""Instructions of Xtensa as bytes: what tests need of an assembler. Xtensa ISA Reference Manual, chapter Opcodes."""

from __future__ import annotations


def wide(op0: int, t: int = 0, s: int = 0, r: int = 0, op1: int = 0, op2: int = 0) -> bytes:
    """24 bits, RRR."""
    return (op0 | t << 4 | s << 8 | r << 12 | op1 << 16 | op2 << 20).to_bytes(3, "little")


def narrow(op0: int, t: int, s: int, r: int) -> bytes:
    """16 bits, RRRN."""
    return (op0 | t << 4 | s << 8 | r << 12).to_bytes(2, "little")


def immediate(op0: int, t: int, s: int, r: int, imm8: int) -> bytes:
    """RRI8."""
    return wide(op0, t, s, r, imm8 & 15, imm8 >> 4 & 15)


def l32i(t: int, s: int, offset: int) -> bytes:
    return immediate(2, t, s, 2, offset // 4)


def s32i(t: int, s: int, offset: int) -> bytes:
    return immediate(2, t, s, 6, offset // 4)


def lsi(f: int, s: int, offset: int) -> bytes:
    return immediate(3, f, s, 0, offset // 4)


def ssi(f: int, s: int, offset: int) -> bytes:
    return immediate(3, f, s, 4, offset // 4)


def rsr(t: int, number: int) -> bytes:
    return wide(0, t, number & 15, number >> 4, 3, 0)


def wsr(t: int, number: int) -> bytes:
    return wide(0, t, number & 15, number >> 4, 3, 1)


def addi(t: int, s: int, value: int) -> bytes:
    return immediate(2, t, s, 12, value & 255)


def addmi(t: int, s: int, value: int) -> bytes:
    return immediate(2, t, s, 13, value >> 8 & 255)


def movi(t: int, value: int) -> bytes:
    return immediate(2, t, value >> 8 & 15, 10, value & 255)


def add(r: int, s: int, t: int) -> bytes:
    return wide(0, t, s, r, 0, 8)


def jump(distance: int) -> bytes:
    """@param distance  from this instruction"""
    return (6 | (distance - 4 & 0x3FFFF) << 6).to_bytes(3, "little")


def call0(place: int, target: int) -> bytes:
    """@param target  a multiple of 4"""
    return (5 | ((target - (place & ~3) - 4) // 4 & 0x3FFFF) << 6).to_bytes(3, "little")


def l32r(t: int, place: int, literal: int) -> bytes:
    """@param literal  a multiple of 4 before `place`"""
    return (1 | t << 4 | ((literal - (place + 3 & ~3)) // 4 & 0xFFFF) << 8).to_bytes(3, "little")


def padded(code: bytes, size: int) -> bytes:
    """With nop."""
    missing = size - len(code)
    assert missing >= 0 and missing != 1
    code += NOP_N * (-missing % 3)
    return code + NOP * ((size - len(code)) // 3)


SIMCALL = wide(0, 0, 1, 5)  # of QEMU
NOP, NOP_N = wide(0, 15, 0, 2), narrow(13, 3, 0, 15)
RET, RFE, RSYNC = wide(0, 8), wide(0, 0, 0, 3), wide(0, 1, 0, 2)

# special registers
SAR, BR, SCOMPARE1, ACCLO, ACCHI, M0 = 3, 4, 12, 16, 17, 32
ATOMCTL, EPC1, EXCSAVE1, CPENABLE = 99, 177, 209, 224
PS, VECBASE, EXCCAUSE, CCOUNT = 230, 231, 232, 234


# ---- windows ----


def l32e(t: int, s: int, offset: int) -> bytes:
    """@param offset  -64 .. -4"""
    return wide(0, t, s, (offset + 64) // 4, 9, 0)


def s32e(t: int, s: int, offset: int) -> bytes:
    return wide(0, t, s, (offset + 64) // 4, 9, 4)


RFWO, RFWU = wide(0, 0, 4, 3), wide(0, 0, 5, 3)


def entry(s: int, size: int) -> bytes:
    return (6 | 3 << 4 | s << 8 | size // 8 << 12).to_bytes(3, "little")


def call(n: int, place: int, target: int) -> bytes:
    """call4, call8, call12. @param target  a multiple of 4"""
    return (5 | n // 4 << 4 | ((target - (place & ~3) - 4) // 4 & 0x3FFFF) << 6).to_bytes(3, "little")


RETW = wide(0, 9)


def window_vectors() -> bytes:
    """The handlers that the ABI prescribes, at their places from VECBASE on."""
    basic = [(0, -16), (1, -12), (2, -8), (3, -4)]
    places = [
        b"".join(s32e(t, 5, at) for t, at in basic) + RFWO,
        b"".join(l32e(t, 5, at) for t, at in basic) + RFWU,
        s32e(0, 9, -16)
        + l32e(0, 1, -12)
        + b"".join(s32e(t, 9, at) for t, at in basic[1:])
        + b"".join(s32e(4 + n, 0, -32 + 4 * n) for n in range(4))
        + RFWO,
        b"".join(l32e(t, 9, at) for t, at in basic[:3])
        + l32e(7, 1, -12)
        + l32e(3, 9, -4)
        + b"".join(l32e(4 + n, 7, -32 + 4 * n) for n in range(4))
        + RFWU,
        s32e(0, 13, -16)
        + l32e(0, 1, -12)
        + b"".join(s32e(t, 13, at) for t, at in basic[1:])
        + b"".join(s32e(4 + n, 0, -48 + 4 * n) for n in range(8))
        + RFWO,
        b"".join(l32e(t, 13, at) for t, at in basic[:3])
        + l32e(11, 1, -12)
        + l32e(3, 13, -4)
        + b"".join(l32e(4 + n, 11, -48 + 4 * n) for n in range(8))
        + RFWU,
    ]
    return b"".join(place.ljust(0x40, b"\0") for place in places)
