"""Homing by StallGuard: the end is found by the driver, and only at speeds at which that can be trusted."""

from __future__ import annotations

import pytest
from driver_grbl import GCONF, KINDS, SGTHRS, STEPS_MM, TCOOLTHRS, TMC2209, DriverGrbl, make

HOMING = ("$22=1", "$23=0", "$24=1500", "$25=2400", "$26=10", "$27=2", "$44=7", "$45=0")
STALL = tuple(f"$25{ax}=80" for ax in range(3))
LOW, HIGH = -100_000, 20_000
OWN_SLOWEST = 60 * 100 * 16 / STEPS_MM  # half a turn: 100 full steps in a second


def ready(kind: int, *more: str) -> DriverGrbl:
    grbl = make(kind, *HOMING, *STALL, *more)
    for ax in range(3):
        grbl.travel(ax, LOW, HIGH)
    return grbl


@pytest.mark.parametrize("kind", KINDS)
def test_it_finds_the_end_and_is_a_pull_off_away_from_it(kind: int) -> None:
    grbl = ready(kind)
    said = grbl.after(40.0, "$H\n")
    assert "ok\r\n" in said, said
    assert [round(steps / STEPS_MM, 1) for steps in grbl.stands()[:3]] == [HIGH / STEPS_MM - 2] * 3
    assert grbl.state() == "Idle"
    assert grbl.register(0, TCOOLTHRS) == 0, "a stall in a job is no limit switch"
    if kind == TMC2209:
        assert grbl.register(0, SGTHRS) == 0
    else:
        assert grbl.register(0, GCONF) & 0x100 == 0


@pytest.mark.parametrize(("setting", "value"), [("$24", 300), ("$25", 383), ("$110", 383)])
def test_a_speed_below_the_slowest_is_refused_with_the_reason(setting: str, value: int) -> None:
    grbl = ready(TMC2209)
    assert OWN_SLOWEST == 384
    assert grbl.after(0.1, f"{setting}={value}\n") == "ok\r\n"
    said = grbl.after(0.5, "$H\n")
    assert said == (
        "[MSG:StallGuard of axis X: below 384 mm/min it cannot be trusted. Raise $24 and $25, or lower $260 ..]\r\n"
        "error:198\r\n"
    )
    assert grbl.position()[:3] == [0, 0, 0]


def test_the_slowest_speed_is_a_setting() -> None:
    grbl = ready(TMC2209, "$260=1600")
    assert grbl.after(0.5, "$H\n").endswith("error:198\r\n")
    assert grbl.after(0.1, "$260=1400\n") == "ok\r\n"
    assert "ok\r\n" in grbl.after(40.0, "$H\n")


def test_it_needs_diag_and_a_current() -> None:
    grbl = make(TMC2209, *HOMING, *STALL, diag=False)
    assert grbl.after(0.5, "$H\n") == "error:199\r\n"
    grbl = make(TMC2209, *HOMING, *STALL, "$140=0")
    assert grbl.after(0.5, "$H\n") == "error:199\r\n"
