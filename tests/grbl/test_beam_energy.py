"""What each stretch of a cut gets, from the recorded steps and duty: with M4 in proportion to its length whatever the
speed does, with M3 to its time; and that the edges of pixels are where they were programmed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from beam_record import BeamRecord
from grbl_host import HZ, Grbl
from numpy.typing import NDArray
from stalls import Side

STEPS_PER_MM = 250
FULL = 65535
TASKS_US = [100, 1000, 20_000]


@pytest.fixture
def grbl() -> Iterator[Grbl]:
    controller = Grbl()
    controller.send("")
    controller.settings(**{f"s{base + ax}": value for base, value in ((110, 40_000), (120, 3000)) for ax in range(3)})
    controller.fine("$32=1", "$30=1000")
    yield controller
    controller.close()


def duty_at(record: BeamRecord, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Integral of the duty (0 .. 1) from the first change to each time, s."""
    changes = record.grbl.output_changes()
    t = changes["t"] / HZ
    duty = np.where(changes["direction"] != 0, changes["duty"], 0) / FULL
    sums = np.concatenate(([0.0], np.cumsum(duty[:-1] * np.diff(t))))
    at = np.maximum(np.searchsorted(t, times, side="right") - 1, 0)
    return sums[at] + duty[at] * (times - t[at])


def energy_of_stretches(record: BeamRecord, length_mm: float) -> NDArray[np.float64]:
    """Energy by length in each stretch of X, as parts of full power for a second at 1 mm/s."""
    times, _ = record.positions(0)
    every = round(length_mm * STEPS_PER_MM)
    marks = np.concatenate(([times[0] - (times[1] - times[0]) / 2], times[every - 1 :: every]))
    return np.diff(duty_at(record, marks)) / length_mm


@pytest.mark.parametrize("feed", [600, 6000, 30_000])
@pytest.mark.parametrize("task_us", TASKS_US)
def test_dynamic_power_burns_by_length(grbl: Grbl, feed: int, task_us: int) -> None:
    """S1000 at F: each mm gets 60 / F of a second at full power, where the machine speeds up and slows down, too."""
    grbl.fine(f"M4S1000F{feed}")
    record = BeamRecord(grbl, task_us)
    grbl.send("G1X40\n")
    found = energy_of_stretches(record, 0.5)
    assert len(found) == 80
    assert found == pytest.approx(60 / feed, rel=0.02)


def test_dynamic_power_through_a_hold_and_overrides(grbl: Grbl) -> None:
    grbl.fine("M4S1000F6000")
    record = BeamRecord(grbl)
    grbl.after(0.2, "G1X100\n")
    grbl.after(0.3, "!")
    grbl.after(0.3, "~")
    found = energy_of_stretches(record, 0.5)
    grbl.after(3)
    found = energy_of_stretches(record, 0.5)
    assert len(found) == 200
    assert found == pytest.approx(60 / 6000, rel=0.03)


def test_constant_power_burns_by_time(grbl: Grbl) -> None:
    grbl.fine("M3S500F6000")
    record = BeamRecord(grbl)
    grbl.send("G1X40\n")
    times, _ = record.positions(0)
    lit = record.lit()
    assert len(lit) == 1
    assert set(grbl.output_changes()["duty"]) == {0, 32768}
    half_step_s = float(np.sqrt(1 / STEPS_PER_MM / 3000))  # from the last edge to rest, at 3000 mm/s^2
    assert lit[0][1] - times[-1] <= half_step_s + 0.0001


@pytest.mark.parametrize("mode", ["M3", "M4"])
@pytest.mark.parametrize("feed", [600, 6000, 30_000])
@pytest.mark.parametrize("task_us", TASKS_US)
def test_each_pixel_is_as_long_as_programmed(grbl: Grbl, mode: str, feed: int, task_us: int) -> None:
    """Pixels of 0.1 mm, each second one lit, with 20 mm of over-scan: every edge within a step of its place."""
    grbl.fine(f"{mode}S0F{feed}")
    record = BeamRecord(grbl, task_us)
    rows = ["G1X20S0"] + [f"X{20 + 0.1 * (n + 1):.1f}S{800 * (n % 2)}" for n in range(100)] + ["X50S0"]
    grbl.send("\n".join(rows) + "\n")
    times, steps = record.positions(0)
    at = [steps[np.searchsorted(times, t, side="right") - 1] / STEPS_PER_MM for span in record.lit() for t in span]
    want = [20 + 0.1 * (n + 1) for n in range(100)]
    assert len(at) == len(want)
    assert np.array(at) == pytest.approx(np.array(want), abs=1.001 / STEPS_PER_MM)


def cutting_time_s(mode: str, acceleration: float) -> float:
    grbl = Grbl()
    grbl.send("")
    grbl.settings(s32=1, s110=40_000, s120=acceleration)
    grbl.fine(f"{mode}S1000F6000")
    record = BeamRecord(grbl)
    grbl.send("G1X100\n")
    times, _ = record.positions(0)
    grbl.close()
    return float(times[-1] - times[0])


@pytest.mark.parametrize("acceleration", [10, 50, 200])
def test_dynamic_power_takes_no_more_time(acceleration: float) -> None:
    """Long stops: their spans, which a laser makes shorter, still fit, so that motion keeps its speed."""
    assert cutting_time_s("M4", acceleration) == pytest.approx(cutting_time_s("M3", acceleration), rel=0.001)


def test_an_output_that_knows_only_on_and_off_is_not_modulated(grbl: Grbl) -> None:
    """$30 = $31 makes every S full power, with M4 at each speed."""
    grbl.fine("$31=1000", "M4S500F6000")
    record = BeamRecord(grbl)
    grbl.send("G1X40\nG3X0I-20\n")
    assert set(grbl.output_changes()["duty"]) == {0, FULL}
    assert len(record.lit()) == 1


def past_corner_mm(record: BeamRecord, turn: float) -> list[float]:
    """Where the edges of what was lit are, along the middle direction of a turn at X20."""
    (times_x, x), (times_y, y) = record.positions(0), record.positions(1)
    middle = turn / 2
    along = []
    for t in (t for span in record.lit() for t in span):
        steps = [np.append(0, s)[np.searchsorted(times, t, side="right")] for times, s in ((times_x, x), (times_y, y))]
        along.append((steps[0] / STEPS_PER_MM - 20) * np.cos(middle) + steps[1] / STEPS_PER_MM * np.sin(middle))
    return along


@pytest.mark.parametrize("lines", ["G1X20S800\n{}S0\n", "G1X20S0\n{}S800\n", "G1X20S800\nG0{}\n", "G0X20\nG1{}S800\n"])
@pytest.mark.parametrize("degrees", [3, 20, 90, 150])
def test_power_changes_in_the_middle_of_a_rounded_corner(grbl: Grbl, lines: str, degrees: float) -> None:
    """Where S changes at a corner that is passed at speed."""
    turn = np.radians(degrees)
    grbl.fine("M3F6000")
    record = BeamRecord(grbl)
    grbl.send(lines.format(f"X{20 + 20 * np.cos(turn):.4f}Y{20 * np.sin(turn):.4f}"))
    edges = past_corner_mm(record, turn)
    assert min(map(abs, edges)) < 1.5 / STEPS_PER_MM, edges


@pytest.mark.parametrize("jerk", [0, 20_000, 100_000])
def test_dynamic_power_in_a_stop_that_a_late_task_makes(grbl: Grbl, jerk: float) -> None:
    """Its samples are longer than those of other motion."""
    grbl.fine(f"$40={jerk}", "M4S1000F6000")
    record = BeamRecord(grbl)
    grbl.stall(Side.CONTROLLER, 0.6, 0.25)
    grbl.stall(Side.CONTROLLER, 1.3, 0.9)
    grbl.send("".join(f"G1X{10 * k}\n" for k in range(1, 16)))
    found = energy_of_stretches(record, 0.5)
    assert len(found) == 300
    assert found == pytest.approx(60 / 6000, rel=0.02)
