"""$73, the frequency of the charge pump: the board's at first, and only what its timer makes."""

from __future__ import annotations

from pathlib import Path

import pytest
from grbl_host import Grbl
from wificnc.simulator.library import HostBoard

NO_OUTPUT, NO_FREQUENCY, BAD_NUMBER = "error:135", "error:164", "error:2"
CLOCK_HZ = 20_000_000


def board(hz: int = 12_500, clock_hz: int = CLOCK_HZ, least: int = 256, most: int = 262_143) -> HostBoard:
    pump = {"pump_hz": hz, "pump_clock_hz": clock_hz, "pump_ticks_min": least, "pump_ticks_max": most}
    return HostBoard(20_000_000, 1000, 500, 500_000, 3, **pump)


def start(board: HostBoard | None = None, store: Path | None = None) -> Grbl:
    grbl = Grbl(board=board, store=store)
    grbl.send("\n")
    return grbl


def setting(grbl: Grbl) -> str:
    return next(line for line in grbl.send("$$\n").splitlines() if line.startswith("$73="))


def test_it_starts_at_the_boards_frequency() -> None:
    grbl = start(board())
    assert setting(grbl) == "$73=12500"
    assert grbl.outputs().pump_ticks == CLOCK_HZ // 12_500


@pytest.mark.parametrize("hz", [77, 500, 10_000, 12_345, 20_000])
def test_a_wave_is_the_nearest_whole_number_of_ticks(hz: int) -> None:
    grbl = start(board())
    grbl.fine(f"$73={hz}")
    assert grbl.outputs().pump_ticks == round(CLOCK_HZ / hz)
    assert setting(grbl) == f"$73={hz}"


def test_0_is_off() -> None:
    grbl = start(board())
    grbl.fine("$73=0")
    assert grbl.outputs().pump_ticks == 0


@pytest.mark.parametrize(("hz", "error"), [(76, NO_FREQUENCY), (1, NO_FREQUENCY), (20_001, BAD_NUMBER)])
def test_what_cannot_be_is_refused_and_changes_nothing(hz: int, error: str) -> None:
    grbl = start(board())
    assert error in grbl.send(f"$73={hz}\n")
    assert setting(grbl) == "$73=12500" and grbl.outputs().pump_ticks == CLOCK_HZ // 12_500


def test_a_coarse_timer_makes_what_is_within_1_percent() -> None:
    """A tick of 1 ms: 500 Hz, 333.3 Hz and 250 Hz are on its grid, 400 Hz is not."""
    grbl = start(board(500, 1000, 1, 1000))
    for hz, is_made in ((500, True), (333, True), (250, True), (400, False), (340, False), (1000, True), (1200, False)):
        answer = grbl.send(f"$73={hz}\n")
        assert (NO_FREQUENCY not in answer) == is_made, hz


def test_a_board_without_it_refuses_it_and_takes_0() -> None:
    grbl = start()
    assert setting(grbl) == "$73=0"
    assert NO_OUTPUT in grbl.send("$73=10000\n")
    grbl.fine("$73=0")


def test_defaults_are_the_boards_again() -> None:
    grbl = start(board())
    grbl.fine("$73=0")
    grbl.send("$RST=$\n")
    assert setting(grbl) == "$73=12500" and grbl.outputs().pump_ticks == CLOCK_HZ // 12_500


def test_it_is_stored(tmp_path: Path) -> None:
    store = tmp_path / "store"
    first = start(board(), store=store)
    first.fine("$73=11000")
    first.close()
    again = start(board(), store=store)
    assert setting(again) == "$73=11000" and again.outputs().pump_ticks == round(CLOCK_HZ / 11_000)
    again.close()
    poor = Grbl(store=store)
    assert "[MSG:$73=0: this board has no pin for it]" in poor.send("\n")
    assert setting(poor) == "$73=0"
