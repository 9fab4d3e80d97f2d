"""What each stretch of a cut gets, from the recorded steps and duty: with M4 in proportion to its length whatever the
speed does, with M3 to its time; and that the edges of pixels are where they were programmed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from beam_record import BeamRecord
from grbl_host import HZ, Grbl
from numpy.typing import NDArray

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
