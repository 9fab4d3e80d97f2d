"""What is kept over a power cut, and what damage does to it."""

from __future__ import annotations

from pathlib import Path

import pytest
from grbl_host import BANNER, Grbl

EVERYTHING = ["$110=1234.5", "$22=1", "$20=1", "$10=3", "G10L2P3X1.5Y-2", "G0X1", "G28.1", "$N1=G21", "$I=SHOP 4"]
SHOWN = [
    "$110=1234.500",
    "$20=1",
    "$22=1",
    "$10=3",
    "[G56:1.500,-2.000,0.000]",
    "[G28:1.000,0.000,0.000]",
    "$N1=G21",
    ":SHOP4]",
]


def talk(store: Path, *lines: str) -> str:
    controller = Grbl(store=store)
    said = controller.send("") + "".join(controller.send(line + "\n") for line in lines)
    controller.close()
    return said


def test_everything_survives(tmp_path: Path) -> None:
    store = tmp_path / "kept"
    lines = [line for line in EVERYTHING if not line.startswith(("$22", "$20"))]
    assert "error" not in talk(store, *lines, "$22=1", "$20=1")
    said = talk(store, "$X", "$$", "$#", "$N", "$I")
    assert "error" not in said
    assert all(text in said for text in SHOWN), said


@pytest.mark.parametrize("curve", [(45, 55, 65, 85), (5, 10, 15, 18), (30, 35, 70, 75), (96, 97, 98, 99)])
def test_a_laser_curve_survives(tmp_path: Path, curve: tuple[int, ...]) -> None:
    """Whatever its points are, none of them is in the way of another as they are loaded."""
    store = tmp_path / "kept"
    up = [f"${number}={number + 2}" for number in (97, 96, 95, 94)]
    down = [f"${94 + n}={pct}" for n, pct in enumerate(curve)]
    assert "error" not in talk(store, *up, *down)
    said = talk(store, "$X", "$$")
    assert "error" not in said and "MSG:Damaged" not in said
    assert all(f"{line}\r\n" in said for line in down), said


def test_nothing_is_written_before_something_is_stored(tmp_path: Path) -> None:
    talk(tmp_path / "kept", "G0X1", "G92X0", "$$", "$X")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("cut", range(0, 700, 37))
def test_a_cut_or_damaged_file_gives_defaults_and_says_so(tmp_path: Path, cut: int) -> None:
    """Never a mix within a value; never a value that no one typed."""
    store = tmp_path / "kept"
    talk(store, "$110=1234.5", "G10L2P3X1.5Y-2", "$N1=G21")
    whole = store.read_bytes()
    for image in (whole[:cut], whole[:cut] + bytes([whole[cut % len(whole)] ^ 0x40]) + whole[cut + 1 :]):
        store.write_bytes(image)
        said = talk(store, "$$", "$#", "$N")
        assert "$110=1234.500" in said or "$110=500.000" in said
        assert "[G56:1.500,-2.000,0.000]" in said or "[G56:0.000,0.000,0.000]" in said
        assert ("error:7" in said.split(BANNER)[0]) or all(
            text in said or len(image) < len(whole) for text in ("$110=1234.500", "[G56:1.500", "$N1=G21")
        )


def test_a_file_that_cannot_be_written_is_said(tmp_path: Path) -> None:
    said = talk(tmp_path / "no" / "such" / "folder", "$110=77")
    assert said.endswith("[MSG:Not stored]\r\nok\r\n")
