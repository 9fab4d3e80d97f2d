"""$98: the light of a laser comes some time after its signal, so each change of S goes out that much earlier."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from beam_record import BeamRecord
from grbl_host import HZ, Grbl
from numpy.typing import NDArray
from stalls import Side
from test_beam_raster import FEED_MM_S, OVER_MM, STEPS_PER_MM, row, row_edges, stream_disturbed

FULL = 65535

FAST = {100: STEPS_PER_MM, 110: 60 * FEED_MM_S, 120: 3000, 130: 1000}
COUNT, PIXEL_STEPS = 200, 8
PIXEL_MM = PIXEL_STEPS / STEPS_PER_MM
END_MM = 2 * OVER_MM + COUNT * PIXEL_MM


@pytest.fixture
def grbl() -> Iterator[Grbl]:
    controller = Grbl()
    controller.send("")
    controller.settings(**{f"s{base + ax}": value for base, value in FAST.items() for ax in range(3)})
    controller.fine("$32=1", "$30=1000")
    yield controller
    controller.close()


def changes(record: BeamRecord, late_s: float) -> NDArray[np.float64]:
    """Where X is when the signal changes, or the light of a laser that is so late; steps are halfway."""
    times, steps = record.positions(0)
    found = record.grbl.output_changes()
    t = found["t"][1:][np.abs(np.diff(found["duty"].astype(int))) > 0.05 * FULL] / HZ
    return np.asarray(np.interp(t + late_s, times, steps - 0.5 * np.diff(steps, prepend=0)))


def pixels(count: int) -> NDArray[np.int_]:
    """Each differs from its neighbours by 20 % of full power or more."""
    return np.cumsum(np.random.default_rng(count).integers(1, 4, count)) % 4 * 200 + 200


def row_back(power: NDArray[np.int_], over: str) -> str:
    burnt = "".join(f"G1X{END_MM - OVER_MM - PIXEL_MM * (n + 1):.4f}S{s}\n" for n, s in enumerate(power))
    return f"{over}X{END_MM - OVER_MM:g}S0\n{burnt}{over}X0S0\n"


@pytest.mark.parametrize("mode", ["M3", "M4"])
@pytest.mark.parametrize("over", ["G1", "G0"])
@pytest.mark.parametrize("jerk", [0, 400_000])
@pytest.mark.parametrize("rise_us", [317, 2000])
def test_rows_burn_in_their_place_both_ways(grbl: Grbl, rise_us: int, jerk: int, over: str, mode: str) -> None:
    """A signal is v r before its place, so that what a late laser burns is in the same place both ways."""
    power = pixels(COUNT)
    grbl.fine(f"$98={rise_us}", f"$40={jerk}", f"{mode}F12000")
    record = BeamRecord(grbl)
    grbl.stream(row(power, PIXEL_MM, over) + row_back(power[::-1], over))
    want = row_edges(power, PIXEL_STEPS)
    both = np.append(want, want[::-1])
    assert len(changes(record, 0)) == len(both)
    ahead = np.append(np.full(len(want), 200e-6), np.full(len(want), -200e-6)) * rise_us * STEPS_PER_MM
    within = 0.65 if jerk == 0 else 1  # half a step, what counts as the middle between two, and the grain of places
    assert changes(record, 0) == pytest.approx(both - ahead, abs=within)
    assert changes(record, rise_us * 1e-6) == pytest.approx(both, abs=within)


def test_through_a_hold_and_overrides(grbl: Grbl) -> None:
    """While it brakes and speeds up, too; at rest it is dark, and the rest continues where it stopped."""
    power = pixels(2000)
    rise_s = 500e-6
    grbl.fine("$98=500", "M3F6000")
    record = BeamRecord(grbl)
    stream_disturbed(grbl, row(power, 0.1))
    found, want = changes(record, rise_s), row_edges(power, 8)
    off = np.abs(found[:, None] - want[None, :]).min(axis=1)
    assert np.count_nonzero(off > 1) <= 2  # dark at rest, and lit again where it rested
    assert np.abs(want[:, None] - found[None, :]).min(axis=1).max() <= 1


@pytest.mark.parametrize("jerk", [0, 400_000])
@pytest.mark.parametrize("between", ["", "G4P0.05\n", "Y1\n", "G0Y1\n"])
def test_starts_and_stops(grbl: Grbl, between: str, jerk: int) -> None:
    """At a stop the places are exact: nothing burns beyond it or in a rapid that begins or ends at rest."""
    grbl.fine("$98=2000", f"$40={jerk}", "M3F6000")
    record = BeamRecord(grbl)
    lines = ["G61.1", "G0X5Z1", f"G1X10S700\n{between}G0X20", "G1Z2S0", "G1X25S700", "G0X30", "G1X31S0", "M5"]
    grbl.stream("".join(line + "\n" for line in lines))
    lit = record.lit()
    times, steps = record.positions(0)
    places = [tuple(np.interp(span, times, steps) / STEPS_PER_MM) for span in lit]
    assert len(places) == 2
    assert np.array(places) == pytest.approx(np.array([(5, 10), (20, 25)]), abs=1 / STEPS_PER_MM)


@pytest.mark.parametrize("mode", ["M3", "M4"])
def test_a_rapid_ends_dark_for_the_light(grbl: Grbl, mode: str) -> None:
    """A rapid that becomes a cut without a stop ends with the signal; the light begins and ends with the cut."""
    grbl.fine("$98=800", f"{mode}F30000")
    record = BeamRecord(grbl)
    grbl.stream("G0X50\nG1X60S500\nG0X120\n")
    assert changes(record, 0) == pytest.approx(np.array([4000, 4800]) - 0.4 * STEPS_PER_MM, abs=0.65)
    assert changes(record, 800e-6) == pytest.approx([4000, 4800], abs=0.65)


def test_nothing_burns_after_the_end(grbl: Grbl) -> None:
    """The end of what is known is at rest: its S does not pass it, and a later line begins with its own."""
    grbl.fine("$98=2000", "M3F30000")
    record = BeamRecord(grbl)
    grbl.send("G1X100S500\n")
    grbl.after(0.6)
    rests = grbl.time()
    assert grbl.outputs().spindle_duty == 0
    assert record.lit()[-1][1] < rests
    grbl.send("G1X200S0\n")
    assert record.lit()[-1][1] < rests


@pytest.mark.parametrize("mode", ["M3", "M4"])
def test_a_late_task_costs_no_energy(grbl: Grbl, mode: str) -> None:
    """Marks of the stop that a late task needs come back with it."""
    power = pixels(2000)
    grbl.fine("$98=1000", f"{mode}F12000")
    record = BeamRecord(grbl)
    grbl.stall(Side.CONTROLLER, 0.7, 0.25)
    grbl.stream(row(power, 0.1))
    found, want = changes(record, 1e-3), row_edges(power, 8)
    exact = np.abs(want[:, None] - found[None, :]).min(axis=1) <= 1
    assert np.mean(exact) > 0.8
    assert exact[:50].all()
    assert exact[-500:].all()
