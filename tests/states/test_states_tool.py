"""The state Tool: every line of the table, before the operator's first line and behind it; and what bytes do there."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from generate.states_table import ToolRow, load_states
from grbl_host import Grbl
from state_machine import answers
from test_switches import make_homing

TABLE = load_states()
AHEAD_S = 3.0  # a lift, a jog and a measurement are over
FIRST = "$J=G91Z-1F600"
QUICK = (*(f"${110 + axis}=5000" for axis in range(3)), *(f"${120 + axis}=500" for axis in range(3)))
IN_TRAVEL = {"jog_line": "$J=G91X5F600", "probe": "G91G38.2Z-5F600"}  # of a homed machine with soft limits


def lines_of(row: ToolRow) -> list[str]:
    return [row.line] if row.line else [IN_TRAVEL.get(name, TABLE.inputs[name].line or "") for name in row.inputs]


CASES = [(row, line) for row in TABLE.tool for line in lines_of(row)]
EACH = pytest.mark.parametrize(("row", "line"), CASES, ids=[line or "empty" for _, line in CASES])


@pytest.fixture
def waiting() -> Iterator[Grbl]:
    """M6 has lifted Z, and waits for its tool."""
    grbl = Grbl()
    grbl.send("")
    make_homing(grbl)
    grbl.fine(*QUICK, "$20=1", "$342=2", "$343=50", "$344=400", "$H", "$341=1", "G53G0X-10Y-10Z-10", "G10L20P1X0Y0Z0")
    assert answers(grbl.after(AHEAD_S, "T1M6\n")) == [] and grbl.state() == "Tool"
    yield grbl
    grbl.close()


def check(grbl: Grbl, line: str, answer: str) -> None:
    """The line's answer, and that the machine still waits for its tool."""
    said = grbl.after(AHEAD_S, line + "\n")
    wanted = {"waits": [], "list": ["ok"]}.get(answer, [answer])
    assert answers(said) == wanted, said
    assert grbl.state() == "Tool"


@EACH
def test_before_the_operators_first_line(waiting: Grbl, row: ToolRow, line: str) -> None:
    check(waiting, line, row.answer)


@EACH
def test_behind_it(waiting: Grbl, row: ToolRow, line: str) -> None:
    assert answers(waiting.after(AHEAD_S, FIRST + "\n")) == ["ok"]
    check(waiting, line, row.after)


def test_a_probing_move_is_the_operators_behind_it(waiting: Grbl) -> None:
    waiting.after(AHEAD_S, FIRST + "\n")
    assert answers(waiting.after(AHEAD_S, IN_TRAVEL["probe"] + "\n")) == ["error:171"]  # nothing is there
    assert waiting.state() == "Tool"


def test_every_line_of_the_table_has_a_row() -> None:
    """G38 has one with the words that begin an operator's line."""
    named = [name for row in TABLE.tool for name in row.inputs]
    assert sorted([*named, "probe"]) == sorted(entry.name for entry in TABLE.lines)


def test_bytes_are_those_of_a_parked_hold(waiting: Grbl) -> None:
    """A hold and a jog's cancel find nothing to stop, the door stops and `~` behind it returns to Tool's job."""
    for byte in "!\x85":
        assert waiting.after(AHEAD_S, byte) == "" and waiting.state() == "Tool"
    assert "[MSG:Check Door]" in waiting.after(AHEAD_S, "\x84") and waiting.state() == "Door:0"


def test_resume_continues_the_job_and_reset_drops_it(waiting: Grbl) -> None:
    assert answers(waiting.after(AHEAD_S, "~")) == ["ok"] and waiting.state() == "Idle"
    waiting.after(AHEAD_S, "T2M6\n")
    assert waiting.state() == "Tool"
    assert "Grbl 1.1h" in waiting.after(AHEAD_S, "\x18") and waiting.state() in ("Idle", "Alarm")
