"""$94 to $97: power that a laser burns with is not proportional to its duty. Duty is a share of 65535."""

from __future__ import annotations

import numpy as np
import pytest
from beam_record import BeamRecord
from grbl_host import HZ, Grbl

FULL = 65535
COUNT = FULL / 10_000 + 1  # of the coarsest PWM at 5 kHz, and rounding
CURVE = (30.0, 45.0, 55.0, 70.0)  # duty of 20, 40, 60, 80 % of full power
POWERS = (0, 20, 40, 60, 80, 100)


def set_curve(grbl: Grbl, curve: tuple[float, ...] = CURVE) -> None:
    grbl.fine(*(f"${number}={pct:g}" for number, pct in zip((97, 96, 95, 94), (99, 98, 97, 2), strict=True)))
    grbl.fine(*(f"${94 + n}={pct:g}" for n, pct in enumerate(curve)))


def duty_for(power: float, least: float = 0, full: float = 100) -> float:
    """Share of the period for a share of full power."""
    return (least + (full - least) / 100 * float(np.interp(100 * power, POWERS, (0, *CURVE, 100)))) / 100


def burning(grbl: Grbl, powers: tuple[int, ...]) -> list[int]:
    """Duty in a cut with each S."""
    found = []
    for n, s in enumerate(powers):
        grbl.after(0.2, f"M3S{s}G1X{10 - 10 * (n % 2)}F600\n")
        found.append(grbl.outputs().spindle_duty)
        grbl.send("M5\n")
    return found


@pytest.fixture
def laser(grbl: Grbl) -> Grbl:
    grbl.settings(**{f"s{base + ax}": value for base, value in ((110, 6000), (120, 500)) for ax in range(3)})
    grbl.fine("$32=1", "$30=1000")
    return grbl


@pytest.mark.parametrize(("least", "full"), [(0, 100), (10, 60)])
def test_s_is_power(laser: Grbl, least: int, full: int) -> None:
    """At each point, between two, and at both ends."""
    set_curve(laser)
    laser.fine(f"$36={full}", f"$35={least}")
    powers = (1, 101, 201, 301, 400, 499, 600, 701, 800, 851, 1000)
    want = [FULL * duty_for(s / 1000, least, full) for s in powers]
    assert burning(laser, powers) == pytest.approx(want, abs=COUNT)


def test_a_straight_curve_changes_nothing(laser: Grbl) -> None:
    powers = (1, 333, 500, 999, 1000)
    assert burning(laser, powers) == pytest.approx([s / 1000 * FULL for s in powers], abs=COUNT)


def test_every_power_has_its_duty_and_none_is_dark(grbl: Grbl) -> None:
    """Whatever the curve is: ascending, without a gap, and FS: shows the S that was asked for."""
    grbl.settings(s110=6000, s120=500)
    grbl.fine("$32=1", "$30=1000", "F1200G91")
    set_curve(grbl, (1, 2, 98, 99))
    for s in (1, 150, 300, 500, 700, 999):
        grbl.after(0.2, f"M3G1X5S{s}\n")
        assert grbl.outputs().spindle_duty > 0
        shown = grbl.status().split("FS:")[1].split("|")[0].strip(">\r\n")
        assert float(shown.split(",")[1]) == pytest.approx(s, abs=7)
        grbl.send("")


def test_power_follows_the_speed() -> None:
    """M4: what a mm gets is the same where the machine is slow, by the power and not by the duty."""
    host = Grbl()
    host.send("")
    host.fine("$110=6000", "$120=500", "$32=1")
    set_curve(host)
    record = BeamRecord(host)
    host.stream("M4S900F6000\nG1X60\nM5\n")
    changes = record.grbl.output_changes()
    power = np.interp(changes["duty"] / FULL * 100, (0, *CURVE, 100), POWERS) / 100
    times, _ = record.positions(0)
    energy = np.append(0, np.cumsum(np.diff(changes["t"] / HZ) * power[:-1]))
    each = np.diff(np.interp(times[::250], changes["t"] / HZ, energy))
    assert each == pytest.approx(0.9 / 100, rel=0.01)
    host.close()


def test_the_aiming_beam_is_as_weak_as_asked(laser: Grbl) -> None:
    """$89 is power, too."""
    set_curve(laser)
    laser.fine("$89=10", "G1F1000")
    laser.after(0.1, "M3S1000\n")
    assert laser.outputs().spindle_duty / FULL == pytest.approx(duty_for(0.1), abs=1e-3)
    assert laser.status().split("FS:")[1].startswith("0,100")


def test_a_spindle_has_no_curve(grbl: Grbl) -> None:
    set_curve(grbl)
    grbl.fine("M3S200")
    assert grbl.outputs().spindle_duty / FULL == pytest.approx(0.2, abs=2e-3)


@pytest.mark.parametrize("line", ["$94=0", "$94=97", "$95=1", "$96=99", "$97=100", "$98=2001"])
def test_out_of_range(grbl: Grbl, line: str) -> None:
    before = grbl.send("$$\n")
    assert grbl.send(line + "\n") == "error:2\r\n"
    assert grbl.send("$$\n") == before


@pytest.mark.parametrize("line", ["$94=40", "$95=20", "$95=60", "$96=85", "$97=59"])
def test_a_curve_that_does_not_ascend_is_refused(laser: Grbl, line: str) -> None:
    before = laser.send("$$\n")
    assert laser.send(line + "\n") == "error:163\r\n"
    assert laser.send("$$\n") == before


@pytest.mark.parametrize("line", ["$94=30", "$97=81", "$98=500"])
def test_only_at_rest_and_without_a_beam(laser: Grbl, line: str) -> None:
    before = laser.send("$$\n")
    laser.fine("M3S500")
    assert laser.send(line + "\n") == "error:162\r\n"
    laser.fine("M5")
    assert "error:8\r\n" in laser.after(0.1, "M4S500G1X20F600\n" + line + "\n")
    laser.send("")
    assert laser.send("$$\n") == before
