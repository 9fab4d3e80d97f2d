"""Canned cycles: holes, levels and order of moves as RS274/NGC 3.5.16 describes them."""

from __future__ import annotations

import math
from ctypes import CDLL, byref

import pytest
from gcode_core import (
    ACTION_DWELL,
    ACTION_FEED,
    ACTION_RAPID,
    CYCLE,
    SPINDLE_START,
    SPINDLE_STOP,
    XYZABC,
    Action,
    Axes,
    Command,
    Controller,
    Cycle,
)
from hypothesis import given
from hypothesis import strategies as st

LIFT = 0.254
NAMES = {ACTION_RAPID: "rapid", ACTION_FEED: "feed", SPINDLE_STOP: "stop", SPINDLE_START: "start"}
Step = tuple[object, ...]


def steps(cnc: Controller, *lines: str) -> list[Step]:
    """What the last of these lines does: ("rapid", x, y, z), ("dwell", seconds), ("stop",) …"""
    for line in lines[:-1]:
        cnc.run(line)
    start = Axes(*cnc.state.position_mm)
    command = cnc.run(lines[-1])
    cycle, action, found = Cycle(), Action(), []
    cnc.lib.cycle_begin(byref(cycle), start, byref(command.move))
    while cnc.lib.cycle_next(byref(cycle), byref(action)):
        assert len(found) < 10_000
        found.append(_step(action))
    assert list(cycle.at_mm) == list(command.move.target_mm), "the cycle ends where the line ends"
    return found


def _step(action: Action) -> Step:
    if action.kind == ACTION_DWELL:
        return ("dwell", round(action.dwell_s, 6))
    name = NAMES[action.kind]
    if name in ("stop", "start"):
        return (name,)
    return (name, *(round(value, 9) + 0.0 for value in list(action.target_mm)[:3]))


@pytest.fixture
def drill(cnc: Controller) -> Controller:
    """At 1,2,3 with a feed: where the examples of RS274/NGC begin."""
    cnc.run("F60", "G0X1Y2Z3")
    return cnc


# -- the examples of RS274/NGC 3.5.16.2


def test_example_1(drill: Controller) -> None:
    """`G90 G81 G98 X4 Y5 Z1.5 R2.8`: over the hole at Z3, down to 2.8, feed to 1.5, back to 3."""
    assert steps(drill, "G90G81G98X4Y5Z1.5R2.8") == [
        ("rapid", 4, 5, 3),
        ("rapid", 4, 5, 2.8),
        ("feed", 4, 5, 1.5),
        ("rapid", 4, 5, 3),
    ]


def test_example_2(drill: Controller) -> None:
    """`G91 G81 G98 X4 Y5 Z-0.6 R1.8 L3`: R is 4.8, so clear is 4.8; holes at 5,7 9,12 13,17."""
    assert steps(drill, "G91G81G98X4Y5Z-0.6R1.8L3") == [
        ("rapid", 1, 2, 4.8),
        ("rapid", 5, 7, 4.8),
        ("feed", 5, 7, 4.2),
        ("rapid", 5, 7, 4.8),
        ("rapid", 9, 12, 4.8),
        ("feed", 9, 12, 4.2),
        ("rapid", 9, 12, 4.8),
        ("rapid", 13, 17, 4.8),
        ("feed", 13, 17, 4.2),
        ("rapid", 13, 17, 4.8),
    ]


# -- each cycle


def test_g82_dwells(drill: Controller) -> None:
    assert steps(drill, "G82X4Z0R1P1.25")[2:] == [("feed", 4, 2, 0), ("dwell", 1.25), ("rapid", 4, 2, 3)]


def test_g83_leaves_the_hole(drill: Controller) -> None:
    """Pecks of 4 from R1 to -9: -3, -7, -9; between them out to R and back to 0.254 above the last."""
    assert steps(drill, "G83X4Z-9R1Q4G99")[2:] == [
        ("feed", 4, 2, -3),
        ("rapid", 4, 2, 1),
        ("rapid", 4, 2, -3 + LIFT),
        ("feed", 4, 2, -7),
        ("rapid", 4, 2, 1),
        ("rapid", 4, 2, -7 + LIFT),
        ("feed", 4, 2, -9),
        ("rapid", 4, 2, 1),
    ]


def test_g73_lifts_a_little(drill: Controller) -> None:
    assert steps(drill, "G73X4Z-5R1Q3")[2:] == [
        ("feed", 4, 2, -2),
        ("rapid", 4, 2, -2 + LIFT),
        ("feed", 4, 2, -5),
        ("rapid", 4, 2, 3),
    ]


def test_pecks_smaller_than_the_lift_stay_below_r(drill: Controller) -> None:
    found = steps(drill, "G83X4Z0.7R1Q0.1G99")
    assert found[2:6] == [("feed", 4, 2, 0.9), ("rapid", 4, 2, 1), ("feed", 4, 2, 0.8), ("rapid", 4, 2, 1)]
    assert found[-2:] == [("feed", 4, 2, 0.7), ("rapid", 4, 2, 1)]


def test_g85_feeds_out_to_r(drill: Controller) -> None:
    assert steps(drill, "G85X4Z0R1")[2:] == [("feed", 4, 2, 0), ("feed", 4, 2, 1), ("rapid", 4, 2, 3)]


def test_g89_dwells_and_feeds_out(drill: Controller) -> None:
    assert steps(drill, "G89X4Z0R1P0G99")[2:] == [("feed", 4, 2, 0), ("dwell", 0), ("feed", 4, 2, 1)]


def test_g86_stops_the_spindle(drill: Controller) -> None:
    assert steps(drill, "M3S100", "G86X4Z0R1P0.5")[2:] == [
        ("feed", 4, 2, 0),
        ("dwell", 0.5),
        ("stop",),
        ("rapid", 4, 2, 3),
        ("start",),
    ]


@given(st.integers(1, 50_000), st.integers(50, 20_000), st.sampled_from(["G73", "G83"]))
def test_pecks(lib: CDLL, depth_um: int, q_um: int, code: str) -> None:
    """ceil(depth/Q) pecks, none deeper than Q, the last one at the bottom."""
    cnc = Controller(lib)
    cnc.run("F60", "G0Z5")
    found = steps(cnc, f"G99{code}X1Z{-depth_um / 1000:.3f}R0Q{q_um / 1000:.3f}")
    feeds = [step[3] for step in found if step[0] == "feed"]
    assert len(feeds) == math.ceil(depth_um / q_um)
    assert feeds == [pytest.approx(max(-depth_um, -q_um * (i + 1)) / 1000, abs=1e-9) for i in range(len(feeds))]


# -- levels


def test_g98_goes_back_to_where_the_row_of_cycles_began(drill: Controller) -> None:
    """`the position that axis was in just before this series of contiguous canned cycles was started`."""
    assert steps(drill, "G99G81X4Z0R1")[-1] == ("rapid", 4, 2, 1)
    assert steps(drill, "X5") == [("rapid", 5, 2, 1), ("feed", 5, 2, 0), ("rapid", 5, 2, 1)]
    assert steps(drill, "G98X6")[-1] == ("rapid", 6, 2, 3)
    assert steps(drill, "G99G85X7Z0R2")[-1] == ("feed", 7, 2, 2)
    assert steps(drill, "G98X8")[-1] == ("rapid", 8, 2, 3), "another cycle does not begin another row"
    assert steps(drill, "G80", "G0Z10", "G81X9Z0R2")[-1] == ("rapid", 9, 2, 10)


def test_below_r_it_rises_first(drill: Controller) -> None:
    assert steps(drill, "G0Z-1", "G81X4Z0R1L2") == [
        ("rapid", 1, 2, 1),
        ("rapid", 4, 2, 1),
        ("feed", 4, 2, 0),
        ("rapid", 4, 2, 1),
        ("feed", 4, 2, 0),
        ("rapid", 4, 2, 1),
    ]


def test_offsets_and_inches(drill: Controller) -> None:
    drill.run("G10L2P2X100Y50Z-20", "G10L1P3Z5", "G55G43H3")
    assert steps(drill, "G20G81X1Y1Z-1R0.5G99F1") == [
        ("rapid", 125.4, 75.4, 3),
        ("rapid", 125.4, 75.4, -2.3),
        ("feed", 125.4, 75.4, -40.4),
        ("rapid", 125.4, 75.4, -2.3),
    ]


def test_the_feed_is_a_length_even_if_only_z_moves(drill: Controller) -> None:
    """In inches F of a move without X, Y, Z counts degrees; a hole drilled on the spot is none."""
    drill.run("G20F1")
    assert drill.run("G81Z0R0.01").move.feed_mm_s == pytest.approx(25.4 / 60)


@pytest.mark.parametrize(
    ("plane", "line", "hole"),
    [
        ("G17", "G81X4Y5Z-1R6", [(4, 5, 6), (4, 5, -1)]),
        ("G18", "G81X4Y-1Z5R6", [(4, 6, 5), (4, -1, 5)]),
        ("G19", "G81X-1Y4Z5R6", [(6, 4, 5), (-1, 4, 5)]),
    ],
)
def test_planes(drill: Controller, plane: str, line: str, hole: list[tuple[float, ...]]) -> None:
    found = steps(drill, plane, "G99" + line)
    assert found[2:] == [("feed", *hole[1]), ("rapid", *hole[0])]


# -- words


def test_words_are_sticky(drill: Controller) -> None:
    drill.run("M3S1", "G83G99X1Z-2R1Q2")
    assert steps(drill, "Y7") == steps(standing(drill, 1, 2, 1), "F60", "G83G99Y7Z-2R1Q2")
    assert steps(drill, "X3Q1.5")[1] == ("feed", 3, 7, -0.5)
    assert steps(drill, "X4")[1] == ("feed", 4, 7, -0.5)
    assert steps(drill, "X4Z-1R0.5")[-2:] == [("feed", 4, 7, -1), ("rapid", 4, 7, 0.5)]
    assert steps(drill, "Y1")[-2:] == [("feed", 4, 1, -1), ("rapid", 4, 1, 0.5)]
    assert steps(drill, "G82X1Z0R1P3", "X2")[-2:] == [("dwell", 3), ("rapid", 2, 1, 1)]


def standing(other: Controller, *position: float) -> Controller:
    """A new one that is at rest there."""
    cnc = Controller(other.lib)
    cnc.state.position_mm = Axes(*position)
    return cnc


def test_l_is_not_sticky(drill: Controller) -> None:
    assert drill.run("G91G81X1Z-1R0L4").move.drill.repeats == 4
    assert drill.run("X1").move.drill.repeats == 1


@pytest.mark.parametrize("again", ["X1", "X1R-1", "X1Z-1", "X1R-1Z-1"])
def test_incremental_r_counts_from_the_level_before_the_row(drill: Controller, again: str) -> None:
    """Not from where G99 left the tool: each hole would begin deeper than the one before. As LinuxCNC."""
    assert steps(drill, "G91G99G81X1Z-1R-1", again) == [("rapid", 3, 2, 2), ("feed", 3, 2, 1), ("rapid", 3, 2, 2)]


@pytest.mark.parametrize("between", ["G18", "G91", "G82X1Z0R1P1", "G0X5", "G80"])
def test_words_are_forgotten(drill: Controller, between: str) -> None:
    """After another plane, distance mode, cycle or motion R and the depth must be given again."""
    drill.run("G81X1Z0R1", between)
    assert drill.answer("G81X2") == 28
    assert drill.answer("G81X2Y-2Z-2R1") == 0


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("G81X1Z0", 28),  # R missing
        ("G81X1R1", 28),  # Z missing
        ("G81", 26),
        ("G81R1", 26),
        ("G83X1Z0R1", 28),  # Q missing
        ("G83X1Z0R1Q-1", 4),
        ("G83X1Z0R1Q0", 2),
        ("G83X1Z-2000R1Q0.0001", 2),  # 20 million pecks
        ("G82X1Z0R1", 28),  # P missing
        ("G82X1Z0R1P-1", 4),
        ("G89X1Z0R1", 28),
        ("G86X1Z0R1P1", 28),  # the spindle is stopped
        ("G81X1Z0R1L0", 2),
        ("G81X1Z0R1L-1", 4),
        ("G81X1Z0R1L1.5", 23),
        ("G81X1Z0R1L65536", 2),
        ("G81X1Z2R1", 33),  # the bottom above R
        ("G18G81X1Z0R1", 28),  # Y is the depth there
        ("G93G81X1Z0R1F1", 20),
        ("G81X1Z0R1Q1", 20),  # Q without a use
        ("G81X1Z0R1P1", 36),
        ("G81X1Z0R1I1", 36),
        ("G53G81X1Z0R1", 30),
        ("G81X1Z0R200000", 33),
        ("G81X1Z-200000R1", 33),
        ("G91G81X60000Z-1R0L2", 33),
        ("G80G80", 21),
        ("G98G99", 21),
        ("G84X1Z0R1", 20),
        ("G87X1Z0R1", 20),
        ("G88X1Z0R1P1", 20),
        ("Q1", 20),
    ],
)
def test_errors_change_nothing(drill: Controller, line: str, answer: int) -> None:
    before = bytes(drill.state)
    assert drill.answer(line) == answer
    assert bytes(drill.state) == before


def test_errors_keep_the_sticky_words(drill: Controller) -> None:
    drill.run("G83X1Z-2R1Q2")
    assert drill.answer("X2Q0.5Z9") == 33
    assert [step[3] for step in steps(drill, "X3") if step[0] == "feed"] == [-1, -2]


def test_without_feed(cnc: Controller) -> None:
    assert cnc.answer("G81X1Z0R1") == 22


def test_rotary_words(lib: CDLL) -> None:
    """`It is an error if rotational axes move in a canned cycle`."""
    assert Controller(lib, XYZABC).answer("F1", "G81X1A1Z0R1") == 31


def test_the_move_covers_all_of_it(drill: Controller) -> None:
    """The machine asks the end of the line and the bottom of the last hole for the travel."""
    move = drill.run("G91G81X10Y-1Z-5R-1L3").move
    assert (move.motion, list(move.target_mm)[:3], list(move.via_mm)[:3]) == (CYCLE, [31, -1, 3], [31, -1, -3])


def test_program_end_leaves_the_cycle(drill: Controller) -> None:
    command: Command = drill.run("G81X1Z0R1M2")
    assert (command.move.motion, command.next.motion) == (CYCLE, 1)
