"""What settings are as registers, by the formulas of the data sheets; and the frames, by their own vectors."""

from __future__ import annotations

import ctypes
import math

import pytest
from c_library import LIB
from driver_grbl import (
    CHOPCONF,
    COOLCONF,
    COOLCONF_2209,
    GCONF,
    GLOBALSCALER,
    IHOLD_IRUN,
    KINDS,
    STEPS_MM,
    TCOOLTHRS,
    TMC2209,
    TMC5160,
    TPWMTHRS,
    DriverGrbl,
    make,
)

CLOCK_HZ = 12e6
SENSE_OHM = {1: 0.11, 2: 0.075, 3: 0.11}


def current_a(grbl: DriverGrbl, kind: int, at: int) -> float:
    """Data sheets, "current setting": I = GS/256 (CS + 1)/32 V/(R + 20 mOhm) / sqrt 2, TMC5160 without the 20 mOhm."""
    scale = (grbl.register(0, IHOLD_IRUN) >> at & 31) + 1
    if kind == TMC5160:
        part = (grbl.register(0, GLOBALSCALER) or 256) / 256
        return part * scale / 32 * 0.325 / SENSE_OHM[kind] / math.sqrt(2)
    full = 0.325 if kind == TMC2209 else 0.32
    volt = 0.18 if grbl.register(0, CHOPCONF) >> 17 & 1 else full
    return scale / 32 * volt / (SENSE_OHM[kind] + 0.02) / math.sqrt(2)


@pytest.mark.parametrize("kind", KINDS)
def test_a_current_is_what_was_asked_for_or_up_to_a_scale_less(kind: int) -> None:
    grbl = make(kind)
    for ma in (100, 250, 500, 800, 979, 980, 1200, 1700):
        assert grbl.after(0.3, f"$140={ma}\n") == "ok\r\n"
        step = 1.0 if kind == TMC5160 else 1.77 / 32 * 1000
        got = current_a(grbl, kind, 8) * 1000
        assert ma - max(step, ma * 0.012) <= got <= ma * 1.0002, (ma, got)
        hold = current_a(grbl, kind, 0) * 1000
        assert got / 2 - 1.77 / 32 * 1000 <= hold <= got / 2 + 1e-6, (ma, hold)


@pytest.mark.parametrize(("kind", "most"), [(1, 1767), (2, 3064), (3, 1740)])
def test_a_current_that_the_resistor_does_not_allow_is_refused(kind: int, most: int) -> None:
    grbl = make(kind)
    assert grbl.after(0.02, f"$140={most + 1}\n") == "error:196\r\n"
    assert grbl.after(0.02, f"$140={most}\n") == "ok\r\n"
    assert grbl.rows()[0][5] == str(most)


@pytest.mark.parametrize("kind", KINDS)
def test_microsteps_are_mres(kind: int) -> None:
    grbl = make(kind)
    for power in range(9):
        assert grbl.after(0.3, f"$150={1 << power}\n") == "ok\r\n"
        assert 256 >> (grbl.register(0, CHOPCONF) >> 24 & 15) == 1 << power
    for wrong in (3, 5, 100, 255):
        assert grbl.after(0.02, f"$150={wrong}\n") == "error:197\r\n"
    assert grbl.after(0.02, "$150=512\n") == "error:2\r\n"  # out of range, as of any setting


@pytest.mark.parametrize("kind", KINDS)
def test_thresholds_are_the_clocks_of_a_256th_at_that_speed(kind: int) -> None:
    grbl = make(kind, "$230=600", "$240=5", "$260=300")
    for register, mm_min in ((TPWMTHRS, 600), (TCOOLTHRS, 300)):
        exact = CLOCK_HZ / (mm_min / 60 * STEPS_MM * 256 / 16)
        assert grbl.register(0, register) == pytest.approx(exact, abs=1)
    assert grbl.register(0, COOLCONF_2209 if kind == TMC2209 else COOLCONF) & 15 == 5


@pytest.mark.parametrize("kind", KINDS)
def test_stealth_chop_is_off_at_0_and_always_on_at_its_maximum(kind: int) -> None:
    grbl = make(kind)
    stealth = 0 if kind == TMC2209 else 4  # bit 2 is en_SpreadCycle there, en_pwm_mode here
    assert grbl.register(0, GCONF) & 4 == 4 - stealth
    assert grbl.after(0.3, "$230=65535\n") == "ok\r\n"
    assert grbl.register(0, GCONF) & 4 == stealth
    assert grbl.register(0, TPWMTHRS) == 0


def crc(data: bytes) -> int:
    """Polynomial division of the bits as they are on the wire."""
    remainder = 0
    for byte in (*data, None):
        for bit in range(8):
            remainder = remainder << 1 | (0 if byte is None else byte >> bit & 1)
            if remainder & 0x100:
                remainder ^= 0x107
    return remainder


@pytest.mark.parametrize("data", [b"\x05\x00\x00", b"\x05\x03\x06", bytes(range(7)), b"\x05\x00\x80\x00\x00\x01\xc0"])
def test_crc_is_the_rest_of_a_division(data: bytes) -> None:
    assert LIB.tmc_crc(data, len(data)) == crc(data)


def test_crc_of_a_known_request() -> None:
    assert LIB.tmc_crc(b"\x05\x00\x00", 3) == 0x48  # a read of GCONF, as every library of this chip sends it


def test_an_answer_is_found_behind_the_echo_and_noise() -> None:
    body = b"\x05\xff\x6f\x80\x10\x00\x01"
    answer = body + bytes([crc(body)])
    value = ctypes.c_uint32()
    for before in (b"", b"\x05\x00\x6f" + bytes([crc(b"\x05\x00\x6f")]), b"\x00\x05\xff"):
        data = before + answer
        assert LIB.tmc_uart_answer(data, len(data), 0x6F, ctypes.byref(value))
        assert value.value == 0x80100001
        for cut in range(len(answer)):
            assert not LIB.tmc_uart_answer(data, len(data) - 1 - cut, 0x6F, ctypes.byref(value))
    assert not LIB.tmc_uart_answer(answer, len(answer), 0x06, ctypes.byref(value))


def test_each_damaged_bit_of_an_answer_is_noticed() -> None:
    body = b"\x05\xff\x6f\x80\x10\x00\x01"
    answer = body + bytes([crc(body)])
    value = ctypes.c_uint32()
    for bit in range(64):
        if bit // 4 == 1:
            continue  # the upper half of the first byte is reserved, and in the CRC all the same
        damaged = bytearray(answer)
        damaged[bit // 8] ^= 1 << bit % 8
        assert not LIB.tmc_uart_answer(bytes(damaged), 8, 0x6F, ctypes.byref(value)), bit


def test_a_time_between_steps_is_never_0() -> None:
    """0 stands for "never" (struct tmc_want), so a speed that is faster than the chip counts is 1."""
    assert LIB.tmc_tstep(1e6, 1) == 1
    assert LIB.tmc_tstep(1000.0, 256) == 12000  # 12 MHz / 1000
    assert LIB.tmc_tstep(0.0, 256) == 0xFFFFF
