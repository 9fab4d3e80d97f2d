"""`$SPINDLES`: the spindles that `$395` can choose, in the rows of grblHAL's `$SPINDLESH`."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from grbl_host import Grbl
from wificnc.tables.vfd import load_vfds

ROW = re.compile(r"\[SPINDLE:(\d+)\|(-|0)\|(\d)\|(\*?)([SDLV]*)\|([^|\]]+)\]\r\n")
RELAY, PWM, REVERSE = 1, 2, 4  # BOARD_OUTPUT_ bits
Start = Callable[..., Grbl]


@pytest.fixture
def start():
    started: list[Grbl] = []

    def one(**board: object) -> Grbl:
        started.append(Grbl(**board))
        started[-1].send("")
        return started[-1]

    yield one
    for grbl in started:
        grbl.close()


def rows(grbl: Grbl) -> list[tuple[str, ...]]:
    said = grbl.send("$SPINDLES\n")
    assert ROW.sub("", said) == "ok\r\n"
    return [match.groups() for match in ROW.finditer(said)]


@pytest.mark.parametrize(
    ("lacks", "row"),
    [
        (0, ("0", "0", "0", "*", "DLV", "PWM")),
        (REVERSE, ("0", "0", "0", "*", "LV", "PWM")),
        (PWM | REVERSE, ("0", "0", "1", "*", "", "Relay")),
        (RELAY | PWM | REVERSE, None),
    ],
)
def test_the_boards_own_output(start: Start, lacks: int, row: tuple[str, ...] | None) -> None:
    assert rows(start(lacks=lacks)) == ([row] if row else [])


def test_every_number_that_the_setting_takes_has_a_row(start: Start) -> None:
    grbl = start(spindle_bus=True)
    table = load_vfds().vfd
    assert [(row[0], row[5]) for row in rows(grbl)[1:]] == [(str(vfd.number), vfd.title) for vfd in table]
    for vfd in table:
        grbl.fine(f"$395={vfd.number}")
        chosen = [row for row in rows(grbl) if row[3]]
        assert [(row[0], row[1], row[2]) for row in chosen] == [(str(vfd.number), "0", "2")]
        assert ("S" in chosen[0][4]) == (vfd.read_speed is not None), "its speed can be waited for"


def test_it_is_refused_where_other_lists_are(start: Start) -> None:
    grbl = start()
    assert grbl.after(0.1, "G1X9F100\n$SPINDLES\n") == "ok\r\nerror:8\r\n"
