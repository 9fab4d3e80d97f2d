"""Laser mode, $32: issue "laser mode ($32, M4 dynamic power)". Each test quotes its line."""

from __future__ import annotations

import pytest
from grbl_host import Grbl


@pytest.fixture
def laser(grbl: Grbl) -> Grbl:
    grbl.fine("$32=1", "M3S1000F1200")
    return grbl


def test_laser_power_follows_the_speed(grbl: Grbl) -> None:
    """$32 and M4: power follows the speed and is off at rest and in rapids; M3 is constant."""
    grbl.fine("$32=1", "M4S1000F3000")
    assert grbl.outputs().spindle_duty == 0
    seen = []
    grbl.put("G1X-20\n")
    for _ in range(40):
        grbl.after(0.01)
        seen.append(grbl.outputs().spindle_duty)
    assert max(seen) == 65535 and any(0 < duty < 60000 for duty in seen)
    grbl.send("")
    assert grbl.outputs().spindle_duty == 0
    grbl.after(0.1, "G0X0\n")
    assert grbl.outputs().spindle_duty == 0


def test_laser_power_comes_with_its_line(grbl: Grbl) -> None:
    """$32: S words change the beam without a stop, when their own line runs and not when it is read."""
    grbl.fine("$32=1", "M3S0F1200")
    before = grbl.time()
    grbl.put("".join(f"G1X{-x}S{100 * x}\n" for x in range(1, 9)))
    wrong = 0
    for _ in range(38):
        grbl.after(0.01)
        x = -grbl.stands()[0] / 250
        wrong += round(250 * x) % 250 != 0 and 0 < x < 8 and grbl.laser_s() != 100 * (int(x) + 1)
    assert wrong == 0
    grbl.send("")
    assert grbl.time() - before < 8 / 20 + 0.1  # no stop between the lines
    assert grbl.outputs().spindle_duty == 0  # at rest it is dark, M3 too
    assert "M3" in grbl.send("$G\n") and "S800" in grbl.send("$G\n")


@pytest.mark.parametrize("stop", ["!", "\x84", "M0\n"])
def test_no_beam_while_held(laser: Grbl, stop: str) -> None:
    """Grbl switches a laser off in a hold, M3 too, and on again when the cycle starts: never at rest."""
    laser.after(0.5, "G1X-20\n" if stop != "M0\n" else "G1X-12\nM0\nX-20\n")
    assert laser.outputs().spindle_duty == 65535
    laser.after(1, stop if stop != "M0\n" else "")
    assert laser.state() in ("Hold:0", "Door:0") and laser.outputs().spindle_duty == 0
    held = laser.stands()
    laser.put("~")
    lit_s = 0.0
    while laser.stands() == held:
        lit_s += 0.0005 * (laser.outputs().spindle_duty > 0)
        laser.after(0.0005)
    first_step_s = (2 * (1 / 250) / 500) ** 0.5  # from rest at 500 mm/s2
    assert lit_s <= first_step_s + 0.0005
    laser.after(0.01)
    assert laser.outputs().spindle_duty == 65535
    laser.send("")
    assert laser.stands()[0] == -5000


def test_no_beam_while_held_in_a_rapid(laser: Grbl) -> None:
    """A hold in G0 with G1 read ahead: dark at rest, dark in the rest of the rapid."""
    laser.after(0.3, "G0X-20\nG1X-21\n")
    assert laser.outputs().spindle_duty == 0
    laser.after(1, "!")
    assert laser.state() == "Hold:0" and laser.outputs().spindle_duty == 0
    laser.put("~")
    while laser.stands()[0] > -4990:
        assert laser.outputs().spindle_duty == 0
        laser.after(0.002)


def test_no_beam_before_a_rapid_begins(laser: Grbl) -> None:
    """G0 then G1 in one go: reading G1 ahead lights nothing where the machine is still at rest."""
    laser.put("G0X-5\nG1X-6\n")
    while laser.stands()[0] > -1200:
        assert laser.outputs().spindle_duty == 0
        laser.after(0.001)


def test_no_run_up_behind_the_door(laser: Grbl) -> None:
    """Grbl: in laser mode no spin-up delay after the door; on when the cycle starts."""
    laser.after(0.5, "G1X-20\n")
    laser.after(1, "\x84")
    laser.after(0.1, "~")
    assert laser.state() == "Run"


@pytest.mark.parametrize("line", ["$J=G91X-5F600", "$SLP", "G38.3Z-1F100", "G4P1", "G0X-5", "$C"])
def test_constant_power_only_cuts(laser: Grbl, line: str) -> None:
    """M3 is dark at rest, where Grbl is lit in G1; and in what is no cut of a program."""
    laser.after(0.5, "G1X-20\n")
    assert laser.outputs().spindle_duty == 65535
    laser.send("")
    assert laser.outputs().spindle_duty == 0 and "M3" in laser.send("$G\n")
    laser.after(0.2, line + "\n")
    assert laser.outputs().spindle_duty == 0
    laser.send("")
    assert laser.outputs().spindle_duty == 0


@pytest.mark.parametrize("power", [1, 5000, 7869, 9277, 9977, 10_000])
def test_the_report_says_s_whatever_the_pwm_rounds(laser: Grbl, power: int) -> None:
    """FS: of a PWM whose counts are half as many S: the S of the program, not the next lower one."""
    laser.fine("$30=10000")
    laser.after(0.5, f"G1X-20S{power}\n")
    assert laser.status().split("FS:")[1].split("|")[0] == f"1200,{power}"
