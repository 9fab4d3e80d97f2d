"""M66 .. M68 on the running controller: inputs that are waited for, analog inputs and outputs. Virtual time."""

from __future__ import annotations

import pytest
from grbl_host import Grbl

SLICE_S = 0.02  # of a dwell: an input ends it within this
# A chip's main loop looks every ms: the line is taken, its time begins, its end is seen. And line and answer are 11
# characters at 115,200 baud.
DWELL_S = 0.003 + 11 * 10 / 115_200
STEPS_MM = 250


def result(grbl: Grbl) -> float:
    """#5399, as an axis tells it."""
    grbl.fine("G90G0X#5399")
    return grbl.position()[0] / STEPS_MM


def seconds_of(grbl: Grbl, line: str) -> float:
    """From the line to its answer."""
    said, seconds = grbl.answer_to(line)
    assert said == "ok\r\n", said
    return seconds


def test_an_input_as_it_is(grbl: Grbl) -> None:
    """`Mode 0: IMMEDIATE - no waiting, returns immediately. The current value is stored in parameter #5399`"""
    assert result(grbl) == 0
    grbl.input("input-2", True)
    assert seconds_of(grbl, "M66P2") <= 0.002 and result(grbl) == 1
    assert seconds_of(grbl, "M66P1L0Q9") <= 0.002 and result(grbl) == 0


@pytest.mark.parametrize(
    ("mode", "begin", "changes", "after", "value"),
    [
        (1, False, [(0.5, True)], 0.5, 1),
        (1, True, [(0.3, False), (0.6, True)], 0.6, 1),  # a rise, not a level
        (2, True, [(0.5, False)], 0.5, 0),
        (2, False, [(0.3, True), (0.6, False)], 0.6, 0),
        (3, False, [(0.5, True)], 0.5, 1),
        (3, True, [], 0.0, 1),
        (4, True, [(0.5, False)], 0.5, 0),
        (4, False, [], 0.0, 0),
    ],
)
def test_waiting_for_an_input(
    grbl: Grbl, mode: int, begin: bool, changes: list[tuple[float, bool]], after: float, value: int
) -> None:
    """`L1 waits for a rise event, L2 for a fall, L3 until it is high, L4 until it is low`"""
    grbl.input("input-0", begin)
    for when, level in changes:
        grbl.input_in(when, "input-0", level)
    assert after <= seconds_of(grbl, f"M66P0L{mode}Q3") <= after + SLICE_S + 0.003 + grbl.input_delay_s
    assert result(grbl) == value


@pytest.mark.parametrize("mode", [1, 2, 3, 4])
def test_a_wait_ends_after_q_seconds(grbl: Grbl, mode: int) -> None:
    """`If the timeout is exceeded the wait is interrupted, and #5399 will hold -1`"""
    grbl.input("input-3", mode == 4)
    assert seconds_of(grbl, f"M66P3L{mode}Q1.5") == pytest.approx(1.5, abs=DWELL_S)
    assert result(grbl) == -1


def test_the_input_is_looked_at_when_motion_has_come_there(grbl: Grbl) -> None:
    grbl.input_in(0.3, "input-0", True)
    grbl.put("F600\nG1X5\nM66P0\n")  # half a second
    assert grbl.after(0.4) == "ok\r\n" * 2, "not yet: it moves"
    grbl.after(1)
    assert result(grbl) == 1


def test_a_hold_stops_the_clock_of_a_wait(grbl: Grbl) -> None:
    grbl.after(1, "M66P0L3Q2\n")
    assert grbl.state() == "Run"
    grbl.after(10, "!")
    assert grbl.state().startswith("Hold")
    assert grbl.after(0.9, "~") == ""
    assert grbl.after(0.2) == "ok\r\n" and result(grbl) == -1


def test_a_wait_then_the_move_of_its_line(grbl: Grbl) -> None:
    grbl.put("M66P0L3Q9G0X3\n")
    assert grbl.after(1) == "" and grbl.position()[0] == 0
    grbl.input("input-0", True)
    assert grbl.after(1) == "ok\r\n" and grbl.position()[0] == 3 * STEPS_MM


def test_reset_while_it_waits(grbl: Grbl) -> None:
    """No motion, so no alarm; and the next dwell is none that an input ends."""
    grbl.after(1, "M66P0L3Q9\n")
    assert "ALARM" not in grbl.after(1, "\x18") and grbl.state() == "Idle"
    grbl.input("input-0", True)
    assert seconds_of(grbl, "G4P1") == pytest.approx(1, abs=DWELL_S)


def test_a_dwell_after_a_wait_is_not_cut_short(grbl: Grbl) -> None:
    grbl.input("input-0", True)
    assert seconds_of(grbl, "M66P0L3Q9") < SLICE_S and seconds_of(grbl, "G4P1") == pytest.approx(1, abs=DWELL_S)


def test_analog_inputs(grbl: Grbl) -> None:
    grbl.analog(1, 37.5)
    assert seconds_of(grbl, "M66E1") <= 0.002 and result(grbl) == 37.5
    grbl.fine("M66E0L0")
    assert result(grbl) == 0


def test_analog_outputs_in_step_and_at_once(grbl: Grbl) -> None:
    """M67 when motion has come there, M68 immediately; a reset leaves them."""
    grbl.put("F600\nG1X5\nM68E3Q100\nM67E0Q25\nG1X10\n")
    seen = []
    for _ in range(150):
        grbl.after(0.01)
        seen.append((*grbl.outputs().analog_pct, grbl.position()[0] / STEPS_MM))
    assert seen[0][3] == 100 and seen[0][4] < 5
    assert all((first == 25) == (x >= 5) for first, _, _, _, x in seen if x != 5)
    assert seen[-1] == (25, 0, 0, 100, 10)
    grbl.after(1, "\x18")
    assert tuple(grbl.outputs().analog_pct) == (25, 0, 0, 100)


def test_check_mode_waits_for_nothing_and_sets_nothing(grbl: Grbl) -> None:
    grbl.send("$C\n")
    assert seconds_of(grbl, "M66P0L3Q9") <= 0.002
    grbl.fine("M66E0", "M67E0Q50", "M68E1Q50")
    assert tuple(grbl.outputs().analog_pct) == (0, 0, 0, 0)


def test_a_board_without_them_says_so() -> None:
    grbl = Grbl(ports=False)
    try:
        lines = ("M66P0", "M66E0", "M67E0Q1", "M68E0Q1")
        assert [grbl.send(line + "\n").split()[-1] for line in lines] == ["error:131"] * 4
        assert grbl.send("M64P4\n") == "ok\r\n"
    finally:
        grbl.close()
