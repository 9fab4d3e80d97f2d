"""The aiming beam of docs/laser.md: $89 and $90. Off by default, weak, short, only at rest and only when asked for."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from grbl_host import Grbl

FAST = {f"s{base + ax}": value for base, value in ((110, 5000), (120, 500)) for ax in range(3)}
CAP = 50.0  # 5 % of $30=1000


@pytest.fixture
def grbl() -> Iterator[Grbl]:
    controller = Grbl()
    controller.send("")
    controller.settings(**FAST)
    controller.fine("$32=1", "$89=5", "$90=10")
    yield controller
    controller.close()


@pytest.mark.parametrize("lines", [["M3S10", "G1F1000"], ["G1F1000", "M3S10"], ["G1F1000", "M3S0", "S10"]])
def test_lit_at_rest_when_asked(grbl: Grbl, lines: list[str]) -> None:
    """As LightBurn's Fire and LaserGRBL's focus buttons write it, in either order; FS: shows it."""
    for line in lines:
        grbl.after(0.1, line + "\n")
    assert grbl.laser_s() == 10 and grbl.outputs().spindle_duty > 0
    assert grbl.status().split("FS:")[1].startswith("0,10")
    grbl.after(0.1, "M5\n")
    assert grbl.outputs().spindle_duty == 0


def test_arcs_are_cuts_too(grbl: Grbl) -> None:
    """As in Grbl: after a G2 or G3 the next axis word would be one."""
    for line in ("G3X-2I-1F1000", "M3S10"):
        grbl.after(1.0, line + "\n")
    assert grbl.laser_s() == 10


def test_a_spindle_does_not_aim() -> None:
    """$32=0: M3 is a spindle at its speed, and nothing waits for $90."""
    grbl = Grbl()
    grbl.send("")
    grbl.fine("$89=5", "G1F1000")
    grbl.after(0.1, "M3S500\n")
    assert grbl.outputs().spindle_rpm == 500 and grbl.sleeps()
    grbl.close()


@pytest.mark.parametrize("line", ["M5", "M4S10", "M4"])
def test_another_spindle_word_ends_it(grbl: Grbl, line: str) -> None:
    """And nothing is left that waits for $90."""
    grbl.after(0.1, "G1F1000\nM3S10\n")
    assert grbl.outputs().spindle_duty > 0
    grbl.after(0.1, line + "\n")
    assert grbl.outputs().spindle_duty == 0 and grbl.sleeps()


def test_off_by_default() -> None:
    grbl = Grbl()
    grbl.send("")
    grbl.fine("$32=1", "G1F1000")
    grbl.after(0.1, "M3S10\n")
    assert grbl.outputs().spindle_duty == 0
    grbl.close()


@pytest.mark.parametrize("more", ["", "\x9a" * 10])
def test_never_above_its_limit(grbl: Grbl, more: str) -> None:
    """Whatever S and the override say."""
    grbl.after(0.1, "G1F1000\nM3S800\n" + more)
    assert grbl.laser_s() == CAP


def test_an_output_that_knows_only_on_and_off_does_not_aim(grbl: Grbl) -> None:
    """$30 = $31 makes every S full power."""
    grbl.fine("$31=1000", "G1F1000")
    grbl.after(0.1, "M3S10\n")
    assert grbl.outputs().spindle_duty == 0


def test_it_goes_out_by_itself(grbl: Grbl) -> None:
    grbl.after(0.1, "G1F1000\nM3S10\n")
    said = grbl.after(9.8)
    assert (said, grbl.outputs().spindle_duty > 0) == ("", True)
    assert grbl.after(0.3) == "[MSG:Aiming beam off after $90: M3 or S switches it on again]\r\n"
    assert grbl.outputs().spindle_duty == 0
    grbl.after(0.1, "G1F500\nG1S10\n")  # nothing new of M3 or S
    assert grbl.outputs().spindle_duty == 0
    grbl.after(0.1, "S12\n")  # asked for again
    assert grbl.laser_s() == 12


def test_without_an_end(grbl: Grbl) -> None:
    """$90=0: as in Grbl it stays on, at S up to $89 of $30, until something ends it; and it needs no polls."""
    grbl.fine("$89=100", "$90=0", "G1F1000")
    grbl.after(0.1, "M3S800\n")
    assert grbl.laser_s() == 800
    assert grbl.after(3600) == "" and grbl.laser_s() == 800 and grbl.sleeps()
    grbl.after(1.0, "G1X-1\n")
    assert grbl.outputs().spindle_duty == 0, "not behind motion: nothing has asked for it"
    grbl.after(0.1, "S300\n")
    assert grbl.laser_s() == 300
    grbl.after(0.1, "\x18")
    assert grbl.outputs().spindle_duty == 0


def test_motion_burns_as_programmed_when_its_time_is_over(grbl: Grbl) -> None:
    grbl.after(11, "G1F1200\nM3S800\n")
    assert grbl.outputs().spindle_duty == 0
    grbl.after(0.3, "X-20\n")
    assert grbl.laser_s() == 800


def test_nothing_else_wakes_the_controller(grbl: Grbl) -> None:
    """A beam whose time is over is no reason to poll on."""
    grbl.after(0.1, "G1F1000\nM3S10\n")
    grbl.after(11)
    assert grbl.sleeps()


@pytest.mark.parametrize(
    "line", ["M4S10", "M3S0", "M3S10G0", "M3S10G4P2", "$J=G91X-0.01F100", "$C", "$SLP", "M3S10\nG80"]
)
def test_dark_in_all_else(grbl: Grbl, line: str) -> None:
    """M4 is dark at rest, G0 and G80 are no cut, a dwell is none, and so on."""
    grbl.after(0.1, "G1F1000\n")
    grbl.after(0.2, line + "\n")
    assert grbl.outputs().spindle_duty == 0
    grbl.after(2.5)
    assert grbl.outputs().spindle_duty == 0


@pytest.mark.parametrize("event", ["G1X-1\n", "G0X-1\n", "$J=G91X-1F1000\n", "!", "\x84", "\x18", "G4P0.1\n"])
def test_motion_and_stops_end_it(grbl: Grbl, event: str) -> None:
    """It does not come back when they are over: only M3 or S asks for it."""
    grbl.after(0.1, "G1F1000\nM3S10\n")
    assert grbl.outputs().spindle_duty > 0
    assert "Aiming" not in grbl.after(1.0, event)  # that is reported of $90 alone
    assert grbl.outputs().spindle_duty == 0
    if event in "!\x84":
        grbl.after(6.0, "~")
    assert grbl.state() == "Idle" and grbl.outputs().spindle_duty == 0


def test_dark_while_motors_wake_up() -> None:
    """A move waits for its motors' drivers: it is not lit before its first step, nor is the aiming beam any more."""
    grbl = Grbl(motors_wake_us=50_000)
    grbl.send("")
    grbl.fine("$32=1", "$89=5", "$90=10", "$1=10", "G1F1000", "X1")
    grbl.after(1.0)
    grbl.after(0.1, "M3S10\n")
    assert grbl.outputs().spindle_duty > 0 and not grbl.outputs().motors
    grbl.after(0.02, "G1X2\nM0\n")
    assert grbl.outputs().motors and grbl.outputs().spindle_duty == 0
    grbl.close()


def test_a_job_leaves_none_behind(grbl: Grbl) -> None:
    """S words of a job come with motion: nothing is lit at its end, though $89 allows it."""
    grbl.send("M3S800\nG1X-5F1200\nX-10S200\n")
    assert grbl.state() == "Idle" and grbl.outputs().spindle_duty == 0


def test_limits_of_the_settings(grbl: Grbl) -> None:
    """A share of $30, and 5 minutes at most where it has an end."""
    for line in ("$89=101", "$90=301"):
        assert grbl.send(line + "\n") == "error:2\r\n", line
