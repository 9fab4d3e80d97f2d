"""The driver of the second motor of an axis: registers of its own, settings of its axis, faults by its name."""

from __future__ import annotations

import pytest
from driver_grbl import (
    CHOPCONF,
    GLOBALSCALER,
    HOT,
    IHOLD_IRUN,
    KINDS,
    NO_SUPPLY,
    SECOND,
    SHORT,
    STEPS_MM,
    TMC2209,
    TMC5160,
    TPWMTHRS,
    UNWIRED,
    DriverGrbl,
    make,
)

Y, Y2 = 1, 1 + SECOND
REGISTERS = (IHOLD_IRUN, CHOPCONF, TPWMTHRS, GLOBALSCALER)


def gantry(kind: int, *more: str, **how: object) -> DriverGrbl:
    return make(kind, *more, seconds=(Y,), **how)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("chained", [True, False])
def test_it_has_registers_of_its_own_and_the_settings_of_its_axis(kind: int, chained: bool) -> None:
    grbl = gantry(kind, "$141=650", "$151=64", "$221=30", "$231=900", chained=chained)
    assert [row[0] for row in grbl.rows()] == ["X", "Y", "Z", "Y2"]
    assert [row[3] for row in grbl.rows()] == ["ok"] * 4
    written = [grbl.register(Y, register) for register in REGISTERS]
    assert [grbl.register(Y2, register) for register in REGISTERS] == written
    assert [grbl.register(0, register) for register in REGISTERS] != written
    assert grbl.rows()[3][4:8] == ["650", grbl.rows()[1][5], "30", "64"]
    assert grbl.after(0.5, "$141=400\n") == "ok\r\n"
    now = [grbl.register(Y2, register) for register in REGISTERS]
    assert now == [grbl.register(Y, register) for register in REGISTERS] != written


@pytest.mark.parametrize("kind", [TMC2209, TMC5160])
def test_its_fault_has_its_name_and_stops_the_axes(kind: int) -> None:
    grbl = gantry(kind)
    grbl.after(0.5, "G1 Y200 F3000\n")
    grbl.faults(Y2, SHORT)
    said = grbl.until("ALARM:54", 1.0)[0]
    assert "[MSG:Driver Y2: short circuit" in said
    assert "[MSG:Driver Y:" not in said
    grbl.after(1.0, "\x18")
    assert [row[3] for row in grbl.rows()] == ["ok", "ok", "ok", "short"]


def test_a_fault_of_both_motors_is_one_message() -> None:
    grbl = gantry(TMC2209)
    for motor in (Y, Y2):
        grbl.faults(motor, HOT)
    said = grbl.after(1.0)
    assert said.count("[MSG:Driver") == 1
    assert "[MSG:Driver Y Y2: it becomes too hot" in said


@pytest.mark.parametrize("fault", [NO_SUPPLY, UNWIRED])
def test_motion_does_not_begin_on_one_motor_alone(fault: int) -> None:
    grbl = DriverGrbl(TMC2209, seconds=(Y,))
    grbl.faults(Y2, fault)
    grbl.after(3.0)
    for line in ("$141=800", "$111=5000", "$121=500", "$131=300"):
        grbl.after(0.3, line + "\n")
    said = grbl.after(1.0, "G1 Y20 F3000\n")
    assert "Driver Y2: no answer" in said + grbl.after(0.5) or "silent" in grbl.rows()[3][3]
    grbl.after(3.0)
    assert abs(grbl.position()[1]) < 1.0 * STEPS_MM, "it stops immediately, if it began at all"
    assert grbl.state() == "Alarm"


def test_a_current_that_one_of_both_resistors_does_not_allow_is_refused() -> None:
    """220 mOhm in place of 110: 0.325 V / (0.22 + 0.02) Ohm / sqrt 2."""
    grbl = gantry(TMC2209, second_mohm=220)
    assert [row[5] for row in grbl.rows()] == ["1767", "1767", "1767", "957"]
    assert grbl.after(0.1, "$141=958\n") == "error:196\r\n"
    assert grbl.after(0.1, "$141=957\n") == "ok\r\n"
    assert grbl.after(0.1, "$140=958\n") == "ok\r\n"


HOMING = ("$22=1", "$23=0", "$24=1500", "$25=2400", "$26=10", "$27=2", "$44=7", "$45=0")


@pytest.mark.parametrize("kind", KINDS)
def test_a_gantry_is_squared_by_stallguard(kind: int) -> None:
    grbl = gantry(kind, *HOMING, *(f"$25{ax}=80" for ax in range(3)))
    for ax in range(3):
        grbl.travel(ax, -100_000, 20_000)
    skew = 300
    grbl.skew(Y, skew)
    said = grbl.after(60.0, "$H\n")
    assert "ok\r\n" in said, said
    first, second = grbl.stands()[Y], grbl.second_stands()[Y]
    assert abs(first - second) <= 2, (first, second)
