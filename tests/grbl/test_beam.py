"""The beam rule of docs/laser.md, from the recorded pins: with $32=1 the beam is on only while cutting motion of a
program is executed, in Run or until a hold rests. Its power comes with the steps: all other pins follow the
controller at 1, 5 and 20 ms, as on a chip, and nothing may come of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from beam_record import BeamRecord, Spans, longest, without
from grbl_host import HZ, Grbl

PERIODS_US = [0, 100, 1000, 5000, 20_000]
SLACK_S = 0.0005  # between two looks of the PC's controller at its own motion
STEP_MM = 1 / 250
MODES = ["M3", "M4"]
SWITCHED = "ok\r\n[MSG:Spindle off: $32 changed]\r\n"
FAST = {f"s{base + ax}": value for base, value in ((110, 5000), (120, 500)) for ax in range(3)}


@pytest.fixture
def grbl() -> Iterator[Grbl]:
    controller = Grbl()
    controller.send("")
    controller.settings(**FAST)
    controller.fine("$32=1")
    yield controller
    controller.close()


def dark_enough(record: BeamRecord, lines: range | list[int] | None = None) -> bool:
    return record.stray_s(lines) <= SLACK_S


# --- where the beam has been lit: each begins with the beam allowed, and ends with it dark ---


def unlock(grbl: Grbl) -> None:
    """After $22=1."""
    grbl.send("\x18")
    grbl.send("$X\n")
    grbl.fine("M3S1000F1200", "G1")


def homing(grbl: Grbl) -> list[int]:
    for axis in range(3):
        grbl.travel(axis, -12_500, 1000)
    grbl.settings(s22=1, s24=100, s25=2000, s26=25, s27=2, s130=40, s131=40, s132=40)
    unlock(grbl)
    assert grbl.send("$H\n").endswith("ok\r\n")
    assert grbl.send("G4P0.1\n") == "ok\r\n"
    return []


def jog(grbl: Grbl) -> list[int]:
    grbl.fine("G1F1200", "$J=G91X-5F600")
    grbl.after(0.3)
    assert grbl.state() == "Idle"
    return []


def cancelled_jog(grbl: Grbl) -> list[int]:
    grbl.fine("G1F1200")
    grbl.after(0.3, "$J=G91X-50F600\n")
    grbl.after(0.5, "\x85")
    assert grbl.state() == "Idle"
    return []


def probing(grbl: Grbl) -> list[int]:
    grbl.surface(-1000)
    assert "[PRB:" in grbl.send("G1F1200\nG38.3Z-10F100\nG1\nG4P0.1\n")
    return []


def rapid(grbl: Grbl) -> list[int]:
    grbl.fine("G1F1200", "G0X-20", "G28", "G1")
    grbl.after(0.2)
    return []


def dwell(grbl: Grbl) -> list[int]:
    first = lines_taken(grbl)
    grbl.send("G1X-5F1200\nG4P0.5\nX-10\n")
    return [first, first + 2]


def wait_for_input(grbl: Grbl) -> list[int]:
    first = lines_taken(grbl)
    grbl.send("G1X-5F1200\nM66P0L3Q0.5\nX-10\n")
    return [first, first + 2]


def last_line(grbl: Grbl) -> list[int]:
    first = lines_taken(grbl)
    grbl.send("G1X-5F1200\nX-6\n")
    grbl.after(0.5)
    return [first, first + 1]


def error_in_a_job(grbl: Grbl) -> list[int]:
    first = lines_taken(grbl)
    assert grbl.send("G1X-5F1200\nG1X-6Q\n").startswith("ok\r\nerror:")
    grbl.after(0.5)
    return [first]


def pause(grbl: Grbl) -> list[int]:
    first = lines_taken(grbl)
    grbl.after(1, "G1X-5F1200\nM0\nX-10\n")
    assert grbl.state() == "Hold:0"
    grbl.send("~")
    return [first, first + 2]


def tool_change(grbl: Grbl) -> list[int]:
    first = lines_taken(grbl)
    grbl.after(1, "G1X-5F1200\nT1M6\nX-10\n")
    assert grbl.state() == "Hold:0"
    grbl.send("~")
    return [first]


def hold(grbl: Grbl) -> list[int]:
    first = lines_taken(grbl)
    grbl.after(0.5, "G1X-20F1200\n")
    grbl.after(1, "!")
    grbl.send("~")
    return [first]


def door(grbl: Grbl) -> list[int]:
    first = lines_taken(grbl)
    grbl.after(0.5, "G1X-20F1200\n")
    grbl.after(1, "\x84")
    grbl.send("~")
    return [first]


def stopped_in_a_hold(grbl: Grbl) -> list[int]:
    first = lines_taken(grbl)
    grbl.after(0.5, "G1X-20F1200\n")
    grbl.after(0.5, "!")
    grbl.after(0.5, "\x9e")
    grbl.send("~")
    return [first]


def starved(grbl: Grbl) -> list[int]:
    """The sender is late: the machine waits for each line at rest."""
    first = lines_taken(grbl)
    for x in range(1, 6):
        grbl.paced(0.4, f"G1X{-x}F3000\n")
    return list(range(first, first + 5))


def check_mode(grbl: Grbl) -> list[int]:
    grbl.fine("G1F1200")
    assert grbl.send("$C\n") == "[MSG:Enabled]\r\nok\r\n"
    grbl.send("G1X-20\nM3S500\nG4P0.1\nX0\n")
    grbl.after(0.5)
    return []


def sleep(grbl: Grbl) -> list[int]:
    grbl.fine("G1F1200")
    grbl.after(0.5, "$SLP\n")
    return []


def reset(grbl: Grbl) -> list[int]:
    first = lines_taken(grbl)
    grbl.after(0.5, "G1X-20F1200\n")
    grbl.after(0.5, "\x18")
    return [first]


def estop(grbl: Grbl) -> list[int]:
    first = lines_taken(grbl)
    grbl.after(0.5, "G1X-20F1200\n")
    grbl.input("estop", True)
    grbl.after(0.5)
    return [first]


def soft_limit(grbl: Grbl) -> list[int]:
    grbl.settings(s22=1, s20=1, s130=100, s131=100, s132=100)
    unlock(grbl)
    first = lines_taken(grbl)
    grbl.after(2, "G1X-20\nX-500\n")
    return [first]


def drilling(grbl: Grbl) -> list[int]:
    """A cycle drills; it is no cut of a laser."""
    grbl.send("G81X-5Z-2R-1F600\nG80\nG1\n")
    grbl.after(0.2)
    return []


def mode_switched(grbl: Grbl) -> list[int]:
    """Without $32 the same M3 would be full power at rest."""
    grbl.fine("G1F1200")
    assert grbl.send("$32=0\n") == SWITCHED
    assert "M5" in grbl.send("$G\n")
    grbl.after(0.5)
    assert grbl.outputs().spindle_direction == 0
    return []


CASES = [
    homing, jog, cancelled_jog, probing, rapid, dwell, wait_for_input, last_line, error_in_a_job, pause, tool_change,
    hold, door, stopped_in_a_hold, starved, check_mode, sleep, reset, estop, soft_limit, drilling, mode_switched,
]  # fmt: skip


def lines_taken(grbl: Grbl) -> int:
    """Number of the line that comes next, as step edges have it."""
    return grbl.lines() + 1


@pytest.mark.parametrize("period_us", PERIODS_US)
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.__name__)
def test_no_beam_where_nothing_cuts(grbl: Grbl, case: Callable[[Grbl], list[int]], mode: str, period_us: int) -> None:
    """Lit only while the cutting lines move."""
    grbl.fine(f"{mode}S1000F1200")
    record = BeamRecord(grbl, period_us)
    lines = case(grbl)
    grbl.after(0.1)
    assert dark_enough(record, lines), without(record.lit(), record.motion(lines))


@pytest.mark.parametrize("period_us", PERIODS_US)
def test_the_cut_is_lit(grbl: Grbl, period_us: int) -> None:
    """What moves in a cut burns, with M3 from its first step to its last; S0 and G0 between do not."""
    grbl.fine("M3S1000F1200")
    record = BeamRecord(grbl, period_us)
    first = lines_taken(grbl)
    grbl.send("G1X-10\nG0X-20\nG1X-30\nX-40S0\nX-50S800\nG2X-60I-5\n")
    cuts = [first, first + 2, first + 4, first + 5]
    assert dark_enough(record, cuts)
    assert record.gap_s(cuts) <= SLACK_S


@pytest.mark.parametrize("mode", MODES)
def test_a_spindle_that_turns_becomes_no_beam(mode: str) -> None:
    """$32=1 while it turns: off, and it stays off until the next M3."""
    grbl = Grbl()
    grbl.send("")
    grbl.fine(f"{mode}S1000F1200", "G1")
    assert grbl.outputs().spindle_duty == 65535
    assert grbl.send("$32=1\n") == SWITCHED
    assert (grbl.outputs().spindle_duty, grbl.outputs().spindle_direction) == (0, 0)
    grbl.fine("M3S1000M8")
    grbl.record_outputs()
    assert grbl.send("$32=0\n") == SWITCHED
    assert grbl.outputs().coolant == 2, "coolant is no part of it"
    assert grbl.output_changes()["duty"].max() == 0, "not for a moment"
    grbl.fine("$32=1", "X-5", "$32=0")  # nothing turns, so nothing is reported
    assert grbl.outputs().spindle_direction == 0
    grbl.close()


@pytest.mark.parametrize("line", ["G93G1X-10F60", "G93G2X-10I-5F60"])
def test_dynamic_power_in_inverse_time(grbl: Grbl, line: str) -> None:
    """M4 in G93: the feed asked for is the way by the time, 10 mm or 5 pi mm a second; at 70 mm/s^2 an arc of 5 mm
    keeps its speed, so that the middle burns with all of S."""
    grbl.fine("M4S1000", "$120=5000", "$121=5000")
    assert rpm_in_the_middle(grbl, line) > 950


@pytest.mark.parametrize("period_us", PERIODS_US)
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("stop", ["\x84", "\x18", "door", "estop"])
def test_dark_from_the_moment_of_a_stop(grbl: Grbl, stop: str, mode: str, period_us: int) -> None:
    """Not when the machine is at rest: what burns must stop burning, also while it brakes."""
    grbl.fine(f"{mode}S1000F1200")
    record = BeamRecord(grbl, period_us)
    grbl.after(0.5, "G1X-20\n")
    assert grbl.outputs().spindle_duty == 65535
    if len(stop) > 1:
        grbl.input(stop, True)
    stopped_s = grbl.time()
    grbl.after(0.5, stop if len(stop) == 1 else "")
    assert record.lit()[-1][1] - stopped_s <= SLACK_S


@pytest.mark.parametrize("period_us", PERIODS_US)
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("stop", ["!", "hold"])
def test_a_hold_leaves_no_gap(grbl: Grbl, stop: str, mode: str, period_us: int) -> None:
    """The cut is burnt while the machine brakes, dark at rest, and continues where it was: `~` repeats nothing."""
    grbl.fine(f"{mode}S1000F1200")
    record = BeamRecord(grbl, period_us)
    first = lines_taken(grbl)
    grbl.after(0.5, "G1X-20\n")
    if len(stop) > 1:
        grbl.input(stop, True)
    grbl.after(0.5, stop if len(stop) == 1 else "")
    assert grbl.outputs().spindle_duty == 0, "at rest"
    if len(stop) > 1:
        grbl.input(stop, False)
    grbl.after(2, "~")
    assert lit_mm(record) == pytest.approx(20, abs=STEP_MM)
    assert dark_enough(record, [first])


def rpm_in_the_middle(grbl: Grbl, line: str) -> float:
    """S on the pins half way through the line's motion."""
    record = BeamRecord(grbl)
    first = lines_taken(grbl)
    grbl.send(line + "\n")
    start_s, end_s = record.motion([first])[0]
    changes = grbl.output_changes()
    return rpm_of(changes["duty"][int(changes["t"].searchsorted((start_s + end_s) / 2 * HZ)) - 1])


def rpm_of(duty: float) -> float:
    """With $30=1000 and $31=0."""
    return float(duty) / 65535 * 1000


@pytest.mark.parametrize("mode", MODES)
def test_the_spindle_override_is_one_of_power(grbl: Grbl, mode: str) -> None:
    grbl.fine(f"{mode}S800F1200")
    grbl.after(0.1, "\x9b" * 5)
    assert rpm_in_the_middle(grbl, "G1X-20") == pytest.approx(400, rel=0.01)


@pytest.mark.parametrize("override", ["", "\x92" * 5, "\x91" * 5])
def test_dynamic_power_belongs_to_the_feed_in_force(grbl: Grbl, override: str) -> None:
    """M4 at 50 and 150 % feed: the material gets the power that S asks for, in proportion to the feed in force."""
    grbl.fine("M4S800F1200")
    grbl.after(0.1, override)
    assert rpm_in_the_middle(grbl, "G1X-20") == pytest.approx(800, rel=0.01)


def test_dynamic_power_where_the_feed_is_never_reached(grbl: Grbl) -> None:
    """M4: 10 mm at 500 mm/s^2 reach 70.7 mm/s in their middle; of F6000 that is 71 % of S, and never more than S."""
    grbl.settings(s110=10_000)
    grbl.fine("M4S800F6000")
    assert rpm_in_the_middle(grbl, "G1X-10") == pytest.approx(800 * 0.707, rel=0.03)
    assert rpm_of(grbl.output_changes()["duty"].max()) <= 800


def test_dynamic_power_is_never_above_s(grbl: Grbl) -> None:
    """M4: while the machine slows down from 200 to 100 % feed it is faster than asked."""
    grbl.fine("M4S500F2400")
    grbl.after(0.1, "\x91" * 10)
    grbl.record_outputs()
    grbl.after(0.5, "G1X-60\n")
    grbl.after(0.5, "\x90")
    assert rpm_of(grbl.output_changes()["duty"].max()) == pytest.approx(500, abs=0.01)


def lit_mm(record: BeamRecord) -> float:
    """Way of X on which the beam was lit."""
    times, steps = record.positions(0)
    way = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(steps, prepend=0.0)))))
    return sum(float(way[times.searchsorted(t1)] - way[times.searchsorted(t0)]) for t0, t1 in record.lit()) * STEP_MM


def edge_errors_mm(record: BeamRecord, edges_mm: list[float]) -> list[float]:
    """How far from each edge (X falls) the beam is switched, mm. It is switched with the step that ends there."""
    times, steps = record.positions(0)
    switched: Spans = record.lit()
    at = [-float(steps[max(0, times.searchsorted(t, side="right") - 1)]) / 250 for span in switched for t in span]
    assert len(at) == len(edges_mm), at
    return [abs(found - edge) for found, edge in zip(at, edges_mm, strict=True)]


@pytest.mark.parametrize("period_us", PERIODS_US)
def test_an_edge_is_where_it_was_programmed(grbl: Grbl, period_us: int) -> None:
    """Within a step, at any period of the tasks."""
    grbl.fine("M3S0F1200", "G1")
    record = BeamRecord(grbl, period_us)
    grbl.send("".join(f"X{-5 * n}S{1000 * (n % 2)}\n" for n in range(1, 8)))
    assert max(edge_errors_mm(record, [0, 5, 10, 15, 20, 25, 30, 35])) <= STEP_MM + 1e-9


def test_a_lit_stretch_ends_in_the_dark_without_a_step(grbl: Grbl) -> None:
    """longest() and without() themselves: they find what is outside, or the tests above could not fail."""
    assert without([(0.0, 1.0), (2.0, 3.0)], [(0.5, 2.5)]) == [(0.0, 0.5), (2.5, 3.0)]
    assert longest([(0.0, 0.5), (2.5, 2.6)]) == 0.5
    assert without([(0.0, 1.0)], []) == [(0.0, 1.0)]
