"""Homing, probing and reports: the tool's coordinates outside, joints inside."""

from __future__ import annotations

import re
from math import hypot

import pytest
from grbl_host import Grbl
from kinematics_core import COREXY, POLAR, SCARA

SPM = 100
PULL_OFF_MM = 2


def machine_of(kind: int, **more: float) -> Grbl:
    grbl = Grbl()
    grbl.send("")
    grbl.settings(**{f"s{base + ax}": v for base, v in ((100, SPM), (110, 5000), (120, 500)) for ax in range(3)})
    grbl.settings(s80=kind, s81=60, s82=50, s10=1, **more)
    return grbl


def reported_mm(grbl: Grbl) -> list[float]:
    found = re.search(r"MPos:([-\d.,]+)", grbl.status())
    assert found
    return [float(number) for number in found[1].split(",")][:3]


HOMING = {"s22": 1, "s24": 100, "s25": 2000, "s26": 25, "s27": PULL_OFF_MM, "s44": 4, "s45": 3, "s130": 100, "s131": 80}


@pytest.mark.parametrize("mask", [0, 1, 2, 3])
@pytest.mark.parametrize("start", [(-3000, 1111), (500, -700), (0, 0)])
def test_corexy_homes_the_tool_to_its_switches(mask, start):
    """The switches are those of X and Y; both belts move for each of them. Steps of X: (A + B) / 2."""
    grbl = machine_of(COREXY, **HOMING, s23=mask)
    high, low = (1000, 1500, 900), (-9000, -6500, -9100)
    for axis in range(3):
        grbl.travel(axis, low[axis], high[axis])
    grbl.place([start[0] + start[1], start[0] - start[1], -100, 0, 0, 0])
    assert grbl.send("$H\n") == "ok\r\n"
    a, b = grbl.stands()[:2]
    back = PULL_OFF_MM * SPM
    ends = [low[i] + back if mask >> i & 1 else high[i] - back for i in range(2)]
    assert [(a + b) / 2, (a - b) / 2] == pytest.approx(ends, abs=1)
    travels = (100, 80)
    there = [PULL_OFF_MM - travels[i] if mask >> i & 1 else -PULL_OFF_MM for i in range(2)]
    assert reported_mm(grbl)[:2] == pytest.approx(there, abs=0.001)
    grbl.close()


def test_corexy_homes_one_axis_alone_and_leaves_the_other():
    grbl = machine_of(COREXY, **HOMING)
    for axis in range(3):
        grbl.travel(axis, -9000, 1000)
    assert grbl.send("$X\nG0X-3Y-7\n").count("ok") >= 1
    assert "ok" in grbl.send("$HX\n")
    assert reported_mm(grbl)[:2] == pytest.approx([-PULL_OFF_MM, -7], abs=0.011)
    grbl.close()


def test_the_radius_of_a_polar_machine_homes_to_its_centre():
    """The switch at the low end is R = 0; the table turns without an end and homes not at all."""
    grbl = machine_of(POLAR, **{**HOMING, "s45": 1, "s131": 0, "s23": 1})
    grbl.travel(0, -1200, 20000)
    grbl.travel(2, -9000, 1000)
    grbl.place([700, 1234, 0, 0, 0, 0])
    assert grbl.send("$H\n") == "ok\r\n"
    assert grbl.stands()[0] == -1200 + PULL_OFF_MM * SPM and grbl.stands()[1] == 1234
    assert hypot(*reported_mm(grbl)[:2]) == pytest.approx(PULL_OFF_MM, abs=0.001)
    grbl.close()


@pytest.mark.parametrize("kind", [COREXY, POLAR, SCARA])
def test_reports_say_where_the_tool_is(kind):
    grbl = machine_of(kind, s130=150, s131=0)
    grbl.fine("G0X60Y-50Z-3", "G1X40Y60Z-4F3000", "G4P0")
    assert reported_mm(grbl) == pytest.approx([40, 60, -4], abs=0.02)
    assert "[PRB" in grbl.send("$#\n")
    grbl.close()


@pytest.mark.parametrize("kind", [COREXY, POLAR, SCARA])
def test_a_probe_says_where_the_tool_touched(kind):
    """Straight down, and on a long slanting way that is cut into many pieces."""
    for line in ("G38.2Z-20F600\n", "G38.2X60Y50Z-20F600\n"):
        grbl = machine_of(kind, s130=150, s131=0)
        grbl.fine("G0X60Y-50", "G4P0")
        grbl.surface(-500)
        answer = grbl.send(line)
        found = re.search(r"PRB:([-\d.,]+):1", answer)
        assert found, answer
        x, y, z = (float(number) for number in found[1].split(",")[:3])
        assert z == pytest.approx(-5, abs=0.011)
        assert (x, y) == pytest.approx((60, -50 if "Y" not in line else -25), abs=0.05)
        grbl.close()


def test_corexy_keeps_soft_limits_of_the_tool():
    grbl = machine_of(COREXY, **HOMING)
    for axis in range(3):
        grbl.travel(axis, -9000, 1000)
    assert "ok" in grbl.send("$H\n")
    grbl.settings(s20=1)
    assert grbl.send("$J=G53X-99Y-79F5000\n") == "ok\r\n"
    assert grbl.send("$J=G53X-50Y-81F5000\n") == "error:15\r\n"
    grbl.close()


def test_changing_the_machine_keeps_the_joints_and_moves_the_tool():
    grbl = machine_of(0)
    grbl.fine("G0X30Y10", "G4P0")
    grbl.settings(s80=COREXY)
    assert reported_mm(grbl)[:2] == pytest.approx([20, 10], abs=0.001)
    assert grbl.position()[:2] == [3000, 1000]
    grbl.close()


def test_a_clamped_jog_ends_at_the_tools_travel_of_corexy():
    """$56: on its own line, where the first of the tool's axes ends; the belts have no ends."""
    grbl = machine_of(COREXY, **HOMING)
    for axis in range(3):
        grbl.travel(axis, -9000, 1000)
    assert "ok" in grbl.send("$H\n")
    grbl.settings(s20=1, s56=1)
    grbl.fine("$J=G53X-50Y-40F5000", "G4P0", "$J=G91X-200Y-80F5000", "G4P0")
    assert reported_mm(grbl)[:2] == pytest.approx([-100, -60], abs=0.02)
    grbl.fine("$J=G91X500Y500F5000", "G4P0")
    assert reported_mm(grbl)[:2] == pytest.approx([-40, 0], abs=0.02)
    grbl.close()


@pytest.mark.parametrize("kind", [POLAR, SCARA])
def test_a_clamped_jog_ends_at_the_travel_of_a_straight_axis(kind):
    """Z of a machine whose other joints turn: X stops with it. What the arms do not reach is refused as ever."""
    grbl = machine_of(kind, s20=0, s22=1, s56=1, s130=150, s131=0, s132=20)
    grbl.fine("G0X60Y-50Z-10", "G4P0", "$20=1", "$J=G91X10Z-100F1000", "G4P0")
    assert reported_mm(grbl) == pytest.approx([61, -50, -20], abs=0.03)
    assert grbl.send("$J=G91X9000F1000\n") == "error:140\r\n"
    grbl.close()
