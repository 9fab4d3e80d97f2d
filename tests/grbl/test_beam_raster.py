"""Engraved pictures: S changes every 0.05 mm of a row, or more often, and neither the speed nor the places suffer."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from beam_record import BeamRecord
from grbl_host import HZ, Grbl
from numpy.typing import NDArray
from stalls import Side
from test_beam_energy import duty_at

STEPS_PER_MM = 80
FEED_MM_S = 500.0
ACCEL = 3000.0
OVER_MM = 45.0  # of over-scan: more than the way to full speed, 500^2 / 6000


@pytest.fixture
def grbl() -> Iterator[Grbl]:
    controller = Grbl()
    controller.send("")
    fast = {100: STEPS_PER_MM, 110: 60 * FEED_MM_S, 120: ACCEL, 130: 1000}
    controller.settings(**{f"s{base + ax}": value for base, value in fast.items() for ax in range(3)})
    controller.fine("$32=1", "$30=1000")
    yield controller
    controller.close()


def row(power: NDArray[np.int_], pixel_mm: float, over: str = "G1") -> str:
    """A row in +X, from 0, with over-scan on both sides of its pixels."""
    burnt = "".join(f"G1X{OVER_MM + pixel_mm * (n + 1):.4f}S{s}\n" for n, s in enumerate(power))
    return f"{over}X{OVER_MM:g}S0\n{burnt}{over}X{2 * OVER_MM + pixel_mm * len(power):.4f}S0\n"


def stream_disturbed(grbl: Grbl, lines: str) -> None:
    """With a hold, and the feed at 70 and 90 %, on the way."""
    for seconds, character in ((0.9, "!"), (0.4, "~"), (0.2, "\x92\x92\x92"), (0.3, "\x91\x91"), (0.2, "\x90")):
        lines = grbl.stream_for(seconds, lines)
        grbl.flood(character)
    grbl.stream(lines)


def random_pixels(count: int) -> NDArray[np.int_]:
    return np.random.default_rng(count).integers(1, 1001, count)


def row_edges(power: NDArray[np.int_], pixel_steps: int) -> NDArray[np.int_]:
    """Where S changes in row(), in steps."""
    changes = np.flatnonzero(np.diff(np.concatenate(([0], power, [0]))))
    return changes * pixel_steps + round(OVER_MM * STEPS_PER_MM)


def found_edges(record: BeamRecord) -> NDArray[np.float64]:
    """Where X is in the steps with which the duty changes, on the way."""
    times, steps = record.positions(0)
    changes = record.grbl.output_changes()
    t = changes["t"][1:][np.diff(changes["duty"].astype(int)) != 0] / HZ
    return np.asarray(steps[np.searchsorted(times, t, side="right") - 1])


def energies(record: BeamRecord, every: int) -> NDArray[np.float64]:
    """Integral of the duty over each so many steps of X, from the first one on, s."""
    times, _ = record.positions(0)
    return np.diff(duty_at(record, times[::every]))


@pytest.mark.parametrize("pixel_mm", [0.1, 0.05])
def test_rows_take_the_time_of_their_length(grbl: Grbl, pixel_mm: float) -> None:
    """Four rows of 200 mm and their over-scan: little more than 290 mm at 500 mm/s and a stop, each."""
    count = round(200 / pixel_mm)
    grbl.fine("M4F30000")
    record = BeamRecord(grbl)
    back = "".join(f"G1X{200 + OVER_MM - pixel_mm * (n + 1):.4f}S{s}\n" for n, s in enumerate(random_pixels(count)))
    there = row(random_pixels(count), pixel_mm)
    grbl.stream(f"{there}G1Y0.1S0\nX{200 + OVER_MM:g}S0\n{back}X0S0\nY0.2S0\n" * 2)
    times, _ = record.positions(0)
    ideal_s = 4 * ((200 + 2 * OVER_MM) / FEED_MM_S + FEED_MM_S / ACCEL)
    assert ideal_s < 3.0
    assert times[-1] - times[0] <= 3.1


@pytest.mark.parametrize("over", ["G1", "G0"])
@pytest.mark.parametrize("jerk", [0, 100_000])
@pytest.mark.parametrize("pixel_steps", [4, 8, 1])
def test_each_edge_is_at_its_step(grbl: Grbl, pixel_steps: int, jerk: int, over: str) -> None:
    """At 500 mm/s, and as fast as it goes where limited jerk moves each axis to a mean of places."""
    power = random_pixels(400)
    grbl.fine(f"$40={jerk}", "M3F30000")
    record = BeamRecord(grbl)
    grbl.stream(row(power, pixel_steps / STEPS_PER_MM, over))
    want = row_edges(power, pixel_steps)
    if pixel_steps > 1:  # at 40 000 pixels a second some become means
        assert len(found_edges(record)) == len(want)
        assert found_edges(record) == pytest.approx(want, abs=0 if jerk == 0 else 1)
    if jerk == 0:  # the over-scan is too short for full speed with limited jerk
        mean = float(np.mean(power)) / 1000
        whole = float(np.sum(energies(record, 1)))
        assert whole == pytest.approx(mean * 400 * pixel_steps / STEPS_PER_MM / FEED_MM_S, rel=0.01)


def test_edges_through_a_hold_and_overrides(grbl: Grbl) -> None:
    """In the middle of a row, while it brakes and speeds up, too."""
    power = random_pixels(2000)
    grbl.fine("M3F6000")
    record = BeamRecord(grbl)
    stream_disturbed(grbl, row(power, 0.1))
    found, want = found_edges(record), row_edges(power, 8)
    rest = np.flatnonzero(np.diff(found) <= 0)  # dark at rest, and lit again where it rested
    assert len(rest) == 1
    found = np.delete(found, [rest[0], rest[0] + 1])
    assert np.array_equal(found, want)


def test_a_late_task_costs_places_but_no_energy(grbl: Grbl) -> None:
    """In a stop for a late task S is a mean over some ms; before and behind it the edges are exact."""
    power = random_pixels(2000)
    grbl.fine("M4F12000")
    record = BeamRecord(grbl)
    grbl.stall(Side.CONTROLLER, 0.7, 0.25)
    grbl.stream(row(power, 0.1))
    burnt = np.convolve(power, np.ones(100), "valid")[::100] / 100 / 1000
    first = round(OVER_MM * STEPS_PER_MM)
    got = energies(record, 1)
    each = np.add.reduceat(got[first - 1 :], np.arange(0, 2000 * 8, 800))[:20]
    assert each == pytest.approx(burnt * 10 / 200, rel=0.05)
    exact = np.isin(row_edges(power, 8), found_edges(record))
    assert np.mean(exact) > 0.8
    assert exact[:50].all()
    assert exact[-500:].all()


@pytest.mark.parametrize("mode", ["M3", "M4"])
def test_a_row_of_a_hundred_thousand_pixels(grbl: Grbl, mode: str) -> None:
    """Six pixels a step: no line is lost, the row ends where it should, and each mm gets the mean of its pixels."""
    grbl.fine(f"{mode}F6000")
    record = BeamRecord(grbl)
    answers = grbl.stream(row(np.tile([1000, 0, 500, 0], 25_000), 0.002))
    assert answers.count("ok") == 100_002
    assert answers.count("error") == 0
    _, steps = record.positions(0)
    assert steps[-1] == (2 * OVER_MM + 200) * STEPS_PER_MM
    each = np.add.reduceat(energies(record, 1)[3599:], np.arange(0, 16_000, 80))[:200]
    assert each.min() >= 0.98 * 0.375 / 100  # with M3 more where it is slower than F
    assert mode == "M3" or each.max() <= 1.02 * 0.375 / 100


def test_power_follows_a_circle_of_short_chords(grbl: Grbl) -> None:
    """Chords of 0.2 mm, each second one lit: edges within a step and the tolerance of their corners."""
    grbl.fine("M3F3000")
    record = BeamRecord(grbl)
    angles = np.linspace(0, 2 * np.pi, 315)
    corners = np.column_stack((10 * np.cos(angles), 10 * np.sin(angles)))
    grbl.send("G1X10S0\n")
    grbl.stream("".join(f"X{x:.4f}Y{y:.4f}S{900 * (n % 2)}\n" for n, (x, y) in enumerate(corners[1:])))
    (times_x, x), (times_y, y) = record.positions(0), record.positions(1)
    switched = [t for span in record.lit() for t in span]
    places = np.column_stack(
        [np.append(0, s)[np.searchsorted(times, switched, side="right")] for times, s in ((times_x, x), (times_y, y))]
    )
    assert len(places) == 314
    want = corners[1 : len(places) + 1]
    off = np.hypot(*(places / STEPS_PER_MM - want).T)
    assert off.max() <= np.sqrt(2) * 1.5 / STEPS_PER_MM + 0.014


@pytest.mark.parametrize("s", ["S-1", "S1e9", "S"])
def test_an_impossible_power_in_a_row_changes_nothing(grbl: Grbl, s: str) -> None:
    grbl.fine("M4F6000")
    record = BeamRecord(grbl)
    answers = grbl.send(f"G1X10S0\nX10.1S500\nX10.2{s}\nX10.3S500\nX30S0\n")
    assert answers.count("ok") == 4
    assert answers.count("error") == 1
    lit = record.lit()
    assert len(lit) == 1
    _, steps = record.positions(0)
    assert steps[-1] == 30 * STEPS_PER_MM


@pytest.mark.parametrize("jerk", [0, 100_000])
@pytest.mark.parametrize("between", ["", "M5\nM3\n", "G4P0.1\n"])
@pytest.mark.parametrize("beyond_mm", [0, 0.002, 0.005, 0.012])
@pytest.mark.parametrize("sign", [-1, 1])
def test_a_dark_line_from_rest_shows_nothing_of_the_s_before(
    grbl: Grbl, sign: int, beyond_mm: float, between: str, jerk: int
) -> None:
    """Its first step takes 30 ms, and the S before ended at the rest, or less than a step before it."""
    grbl.settings(s40=jerk, s100=10, s120=100)
    grbl.fine("M3F600")
    record = BeamRecord(grbl)
    beyond = f"X{sign * (10 + beyond_mm):g}S0\n" if beyond_mm else ""
    grbl.send(f"G1X{sign * 10}S1000\n{beyond}{between}")
    grbl.after(0.5)
    rests = grbl.time()
    grbl.send(f"G1X{sign * 20}S0\n")
    assert [span for span in record.lit() if span[1] > rests] == []


def test_s_changes_in_its_place_after_half_of_all_places(grbl: Grbl) -> None:
    """Places count to 2^32 in 1/4096 mm: 600 m without a change of S, and then one."""
    grbl.settings(s100=10, s110=600_000, s120=10_000)
    grbl.fine("M3S500F600000")
    record = BeamRecord(grbl)
    rows = "".join(f"G1X{900 * (n % 2)}\n" for n in range(1, 583))
    grbl.stream(f"{rows}X900\nX0\nX0.5\nX400S0\n")
    _, steps = record.positions(0)
    assert steps[-1] == 4000
    assert 4000 - found_edges(record)[-1] == pytest.approx(3995, abs=1)
