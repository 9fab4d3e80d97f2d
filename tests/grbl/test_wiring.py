"""Codes and settings that need an output or input: refused where the board file wires none, and nothing changes.

Every shipped board, from its own file; docs/boards.md has the same as a table.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from grbl_host import BANNER, Grbl
from needs import loaded, pc_board
from wificnc.board.abilities import ABILITIES
from wificnc.board.load import find_boards
from wificnc.board.model import Board

PASSES, NO_PWM, NO_PORT, NO_OUTPUT, NO_TOOLSETTER, NO_ENCODER, NO_BUS = 0, 17, 131, 135, 136, 150, 190
FLOOD, MIST = "This board has no flood output", "This board has no mist output"


@pytest.fixture(params=[path.stem for path in find_boards()])
def board(request: pytest.FixtureRequest) -> Board:
    return loaded(str(request.param))


def started(board: Board) -> Grbl:
    controller = Grbl(board=pc_board(board.id))
    controller.send("")
    controller.fine("$110=5000", "F600")
    return controller


@pytest.fixture
def grbl(board: Board) -> Iterator[Grbl]:
    controller = started(board)
    yield controller
    controller.close()


def when(there: object, error: int) -> int:
    return PASSES if there else error


# the line | what must be there, else which error
Needs = Callable[[Board], int]
LINES: list[tuple[str, Needs]] = [
    ("M3S100", lambda b: when(b.output.spindle_enable or b.output.spindle_pwm, NO_OUTPUT)),
    ("M4S100", lambda b: when(b.output.spindle_dir, NO_OUTPUT)),
    ("M5", lambda _: PASSES),
    ("M7", lambda b: when(b.output.coolant_mist, NO_OUTPUT)),
    ("M8", lambda b: when(b.output.coolant_flood, NO_OUTPUT)),
    ("M9", lambda _: PASSES),
    ("M8G1X5", lambda b: when(b.output.coolant_flood, NO_OUTPUT)),
    ("M64P0", lambda b: when(b.output.misc, NO_PORT)),
    ("M62P4", lambda b: when(len(b.output.misc) > 4, NO_PORT)),
    ("M66P0L0", lambda b: when(b.input.misc, NO_PORT)),
    ("M67E0Q50", lambda b: when(b.has_analog, NO_PORT)),
    ("M68E3Q50", lambda b: when(b.has_analog, NO_PORT)),
    ("$32=1", lambda b: when(b.output.spindle_pwm, NO_PWM)),
    ("$32=0", lambda _: PASSES),
    ("$83=1", lambda b: when(b.output.misc, NO_OUTPUT)),
    ("$83=0", lambda _: PASSES),
    ("$744=1", lambda b: when(b.input.misc, NO_PORT)),
    ("$744=8", lambda b: when(len(b.input.misc) > 3, NO_PORT)),
    ("$747=1", lambda b: when(b.input.misc, NO_PORT)),
    ("$748=1", lambda _: PASSES),
    ("$85=1", lambda b: when(b.output.servo, NO_OUTPUT)),
    ("$395=3", lambda b: when(b.spindle_bus, NO_BUS)),
    ("$395=0", lambda _: PASSES),
    ("$88=4096", lambda b: when(b.encoder, NO_ENCODER)),
    ("G65P5Q1", lambda b: when(b.input.toolsetter, NO_TOOLSETTER)),
    ("G95", lambda _: NO_ENCODER),  # $88 is 0
]


def test_what_a_board_lacks_is_refused(board: Board) -> None:
    """Each line in a controller of its own."""
    for line, needs in LINES:
        grbl = started(board)
        grbl.fine("$91=0")
        modes, settings = grbl.send("$G\n"), grbl.send("$$\n")
        error = needs(board)
        assert grbl.send(line + "\n") == (f"error:{error}\r\n" if error else "ok\r\n"), line
        if error:
            after = (grbl.send("$G\n"), grbl.send("$$\n"), grbl.position())
            assert after == (modes, settings, [0] * 6), line
        grbl.close()


# of each ability of docs/boards.md, a line that needs it
TRIED = {
    "spindle on and off": "M3S1",
    "laser": "$32=1",
    "spindle direction": "M4S1",
    "flood coolant": "M8",
    "mist coolant": "M7",
    "digital outputs": "M64P0",
    "digital inputs": "M66P0L0",
    "analog inputs and outputs": "M67E0Q1",
    "RC servo": "$85=1",
    "tool setter": "G65P5Q1",
    "spindle encoder": "$88=400",
    "spindle drive on RS-485": "$395=5",
}


def test_the_table_of_boards_is_what_the_controller_answers(board: Board, grbl: Grbl) -> None:
    """docs/boards.md and `wificnc boards show`. S needs nothing: a relay has one speed."""
    assert {*TRIED} == {ability.name for ability in ABILITIES} - {"spindle speed"}
    grbl.fine("S100")
    for ability in ABILITIES:
        if ability.name not in TRIED:
            continue
        grbl.fine("M5")
        said = grbl.send(TRIED[ability.name] + "\n").strip()
        assert (said == "ok") == ability.has(board), ability.name
        answer = "[MSG:" if ability.without.startswith("a message") else re.match(r"error:\d+|$", ability.without)[0]
        assert said == "ok" or said.startswith(answer), ability.name
        grbl.send("M5\n$32=0\n$395=0\n")


def test_laser_power_needs_no_direction(board: Board, grbl: Grbl) -> None:
    """With $32 M4 is a kind of power. Back without it, it is a direction again."""
    if board.output.spindle_pwm is None:
        return
    grbl.fine("$32=1", "M4S100", "M5", "$32=0")
    assert grbl.send("M4\n") == ("ok\r\n" if board.output.spindle_dir else "error:135\r\n")


def test_a_tap_needs_the_way_back() -> None:
    """G33.1 without a direction output would break the tap; G33 needs none."""
    grbl = Grbl(lacks=4, encoder=True)
    grbl.send("")
    grbl.fine("$30=1000", "$88=4096", "M3S100")
    assert grbl.send("G33.1Z-5K1\n") == "error:135\r\n"
    grbl.close()


def coolant_of(grbl: Grbl) -> int:
    return int(grbl.outputs().coolant)


@pytest.mark.parametrize(("line", "lacks", "text"), [("M8", 8, FLOOD), ("M7", 16, MIST)])
def test_check_mode_says_it_once(line: str, lacks: int, text: str) -> None:
    grbl = Grbl(lacks=lacks)
    grbl.send("")
    grbl.send("$C\n")
    assert grbl.send(f"{line}\n") == f"[MSG:{text}]\r\nok\r\n"
    assert grbl.send(f"M9\n{line}\n") == "ok\r\nok\r\n"
    grbl.close()


def test_coolant_is_refused_when_asked_to() -> None:
    """$91=0: a cut without coolant is a decision of the user."""
    grbl = Grbl(lacks=24)
    grbl.send("")
    grbl.fine("$91=0")
    assert grbl.send("M8\nM7\n") == 2 * f"error:{NO_OUTPUT}\r\n"
    grbl.close()


def test_cam_files_run_without_coolant(board: Board, grbl: Grbl) -> None:
    """Said once in a job, and nothing is on; neither `$G` nor `A:` says that it were."""
    said = grbl.send("M8\nG1X1\nM9\nM8\nM7\nG1X2\nM9\n")
    outputs = board.output
    missing = [text for text, wire in ((FLOOD, outputs.coolant_flood), (MIST, outputs.coolant_mist)) if not wire]
    assert said.count("[MSG:") == len(missing) and said.count("ok") == 7 and "error" not in said
    assert all(said.count(f"[MSG:{text}]\r\n") == 1 for text in missing)
    grbl.send("M7\nM8\n")
    on = (2 if board.output.coolant_flood else 0) | (1 if board.output.coolant_mist else 0)
    modes = grbl.send("$G\n")
    assert coolant_of(grbl) == on
    assert ("M8" in modes, "M7" in modes) == (bool(on & 2), bool(on & 1))


@pytest.mark.parametrize("end", ["\x18", "M2\n", "M30\n"])
def test_the_next_job_is_told_again(end: str) -> None:
    grbl = Grbl(lacks=8)
    grbl.send("")
    assert FLOOD in grbl.send("M8\n") and FLOOD not in grbl.send("M8\n")
    grbl.send(end)
    assert FLOOD in grbl.send("M8\n")
    grbl.close()


@pytest.mark.parametrize(("byte", "bit", "lacks"), [("\xa0", 2, 8), ("\xa1", 1, 16)])
def test_real_time_coolant(byte: str, bit: int, lacks: int) -> None:
    """0xA0 and 0xA1 switch what is there, and say so where it is not."""
    for missing in (0, lacks):
        grbl = Grbl(lacks=missing)
        grbl.send("")
        said = grbl.send(byte)
        assert coolant_of(grbl) == (0 if missing else bit)
        assert said == ("[MSG:This board has no output for that coolant]\r\n" if missing else "")
        grbl.close()


@pytest.mark.parametrize("setting", ["$32=1", "$83=16", "$85=3", "$88=400"])
def test_settings_of_another_board(tmp_path: Path, setting: str) -> None:
    """Stored by firmware for a board that has it: off at power-on, and said before the banner."""
    store = tmp_path / "store"
    full = Grbl(store=store, encoder=True)
    full.send("")
    full.fine(setting)
    full.close()
    poor = Grbl(store=store, lacks=63, outputs=2)
    number = setting.split("=")[0]
    assert poor.send("") == f"[MSG:{number}=0: this board has no pin for it]\r\n{BANNER}"
    assert f"{number}=0\r\n" in poor.send("$$\n")
    poor.close()
