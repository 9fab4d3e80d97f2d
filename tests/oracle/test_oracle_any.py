"""Programs that no one wrote: modes, offsets and moves in any order, and LinuxCNC goes the same way.

Left out is what the two mean differently.
- By Grbl's rules: F with G20 or G21 (LinuxCNC takes it in the old units); G53 in G91 (refused by one of them); half
  circles by R (Grbl has no tolerance).
- LinuxCNC says again where it is at a G28 without axis words, has a least feed in inverse time, and does not convert a
  tool length when the units change.
- Canned cycles: from G99 to G98 in a row LinuxCNC goes up on the way to the next hole; pecks smaller than the lift lift
  it above R; G89 leaves the hole at feed as far as the level of G98; G92 within a row.
"""

from __future__ import annotations

import math
from ctypes import CDLL
from pathlib import Path

import pytest
from canon import rs274
from compare import check_same
from gcode_core import XYZABC
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from ours import Ours

EXAMPLES = 150
PLANES = {"G17": ("XYZ", "IJ"), "G18": ("ZXY", "KI"), "G19": ("YZX", "JK")}
SETTERS = ("units", "select_plane", "distance", "centres", "system", "offset", "shift", "length", "home")
MOVES = (
    "line",
    "modal",
    "centre_arc",
    "radius_arc",
    "circle",
    "go_home",
    "machine_move",
    "inverse_time",
    "holes",
    "dwell",
)


def hundredths(low: float, high: float) -> st.SearchStrategy[float]:
    return st.integers(round(100 * low), round(100 * high)).map(lambda n: n / 100)


class Writer:
    """Writes a program line by line, each of which our parser carries out, so that arcs begin where the tool is."""

    def __init__(self, lib: CDLL, draw: st.DrawFn) -> None:
        self.ours = Ours(lib, XYZABC)
        self.lines: list[str] = []
        self._draw = draw
        self._plane = "G17"
        self._inches = self._absolute_centres = self._incremental = False
        self.put("G21G17G90G91.1G94G98F100M3S100")

    def put(self, line: str) -> None:
        self.ours.run(line)
        self.lines.append(line)

    def write(self, what: str) -> None:
        getattr(self, f"_{what}")()

    # -- modes and offsets

    def _units(self) -> None:
        self._inches = self._draw(st.booleans())
        self.put("G49")
        self.put("G20" if self._inches else "G21")
        self.put(f"F{self._draw(st.integers(1, 500))}")

    def _select_plane(self) -> None:
        self._plane = self._draw(st.sampled_from(sorted(PLANES)))
        self.put(self._plane)

    def _distance(self) -> None:
        self._incremental = self._draw(st.booleans())
        self.put("G91" if self._incremental else "G90")

    def _centres(self) -> None:
        self._absolute_centres = self._draw(st.booleans())
        self.put("G90.1" if self._absolute_centres else "G91.1")

    def _system(self) -> None:
        self.put(self._draw(st.sampled_from(["G54", "G55", "G57", "G59", "G59.2"])))

    def _offset(self) -> None:
        row, kind = self._draw(st.integers(0, 9)), self._draw(st.sampled_from(["L2", "L20"]))
        self.put(f"G10{kind}P{row}{self._words('XYZA')}")

    def _shift(self) -> None:
        self.put(self._draw(st.sampled_from([f"G92{self._words('XYZB')}", "G92.1", "G92.2", "G92.3"])))

    def _length(self) -> None:
        self.put(self._draw(st.sampled_from([f"G43.1Z{self._number(-20, 20)}", "G49"])))

    def _home(self) -> None:
        self.put(self._draw(st.sampled_from(["G28.1", "G30.1"])))

    # -- moves

    def _line(self) -> None:
        rapid = self._draw(st.booleans())
        self.put(f"{'G0' if rapid else 'G1'}{self._words('XYZABC' if rapid else 'XYZ')}")

    def _modal(self) -> None:
        self._line()
        self.put(self._words("XYZ"))

    def _go_home(self) -> None:
        self.put(f"{self._draw(st.sampled_from(['G28', 'G30']))}{self._words('XYZA')}")

    def _machine_move(self) -> None:
        if not self._incremental:
            self.put(f"G53{self._draw(st.sampled_from(['G0', 'G1']))}{self._words('XYZ')}")

    def _inverse_time(self) -> None:
        way = f"{self._draw(st.sampled_from('XYZ'))}{self._draw(hundredths(1, 9))}"
        self.put(f"G91G93G1{way}F{self._draw(st.integers(1, 50))}")
        self._incremental = True
        self.put("G94F100")

    def _dwell(self) -> None:
        self.put(f"G4P{self._number(0, 2)}")

    def _centre_arc(self) -> None:
        """About a centre, by an angle that is neither nothing nor a whole turn."""
        first, second = self._draw(hundredths(-50, 50)), self._draw(hundredths(1, 50))
        angle = math.radians(self._draw(st.integers(3, 357)))
        sin, cos = math.sin(angle), math.cos(angle)
        end = (first - first * cos + second * sin, second - first * sin - second * cos)
        self._arc(end, self._centre_words((first, second)))

    def _radius_arc(self) -> None:
        """Wider than half a circle by a tenth at least."""
        end = (self._draw(hundredths(-50, 50)), self._draw(hundredths(1, 50)))
        radius = math.hypot(*end) * self._draw(hundredths(0.55, 4))
        sign = self._draw(st.sampled_from(["", "-"]))
        self._arc(end, f"R{sign}{radius:.3f}")

    def _circle(self) -> None:
        """G91 alone says exactly that it ends where it begins."""
        axes, centres = PLANES[self._plane]
        radius = self._draw(hundredths(0.5, 50))
        centre = f"{centres[0]}{radius:.2f}"
        self.put("G91G91.1")
        self.put(f"{self._turn()}{axes[0]}0{axes[1]}0{centre}{self._helix()}")
        self._incremental, self._absolute_centres = True, False

    def _holes(self) -> None:
        """A row of one cycle, from the words of its first line on."""
        axes, _ = PLANES[self._plane]
        cycle = self._draw(st.sampled_from(["G73Q.7", "G81", "G82P.5", "G83Q1.1", "G85", "G86P1", "G89P.2"]))
        levels = "R-1.5" if self._incremental else "R2.25"
        depth = self._draw(hundredths(-6, -1))
        level = "G99" if cycle.startswith("G89") else self._draw(st.sampled_from(["G98", "G99"]))
        self.put(f"{level}{cycle}{self._words(axes[:2])}{levels}{axes[2]}{depth}")
        for _ in range(self._draw(st.integers(0, 2))):
            self.put(f"{self._words(axes[:2])}{self._draw(st.sampled_from(['', 'L2', 'L3']))}")
        self.put("G80")
        self.put("G0")

    # -- words

    def _number(self, low: float, high: float) -> str:
        """In the ways that people write them."""
        number = self._draw(hundredths(low, high))
        text = self._draw(st.sampled_from([f"{number:.2f}", f"{number:g}", f"{number:+.4f}", f"{number:07.3f}"]))
        return text

    def _words(self, axes: str) -> str:
        chosen = self._draw(st.lists(st.sampled_from(axes), min_size=1, unique=True))
        return "".join(f"{axis}{self._number(-90, 90)}" for axis in chosen)

    def _turn(self) -> str:
        return str(self._draw(st.sampled_from(["G2", "G3"])))

    def _helix(self) -> str:
        axis = PLANES[self._plane][0][2]
        return f"{axis}{self._number(-9, 9)}" if self._draw(st.booleans()) else ""

    def _here(self, letters: str) -> list[float]:
        """Where the tool is, in the program's units and coordinates."""
        unit, offset = 25.4 if self._inches else 1.0, self.ours.work_offset_mm()
        at = ["XYZ".index(letter) for letter in letters]
        return [(self.ours.cnc.state.position_mm[axis] - offset[axis]) / unit for axis in at]

    def _centre_words(self, centre: tuple[float, float]) -> str:
        axes, letters = PLANES[self._plane]
        base = self._here(axes[:2]) if self._absolute_centres else [0.0, 0.0]
        return "".join(f"{letter}{at + by:.6f}" for letter, at, by in zip(letters, base, centre, strict=True))

    def _arc(self, end: tuple[float, float], how: str) -> None:
        axes, _ = PLANES[self._plane]
        base = [0.0, 0.0] if self._incremental else self._here(axes[:2])
        ends = "".join(f"{axis}{at + by:.6f}" for axis, at, by in zip(axes, base, end, strict=False))
        self.put(f"{self._turn()}{ends}{how}{self._helix()}")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("programs")


# Not shrunk: one program takes a while, and the failure says which call differs.
@pytest.mark.slow
@settings(max_examples=EXAMPLES, derandomize=True, phases=[Phase.generate], suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_any_program(lib: CDLL, folder: Path, data: st.DataObject) -> None:
    writer = Writer(lib, data.draw)
    for what in data.draw(st.lists(st.sampled_from(SETTERS + MOVES), min_size=10, max_size=40)):
        writer.write(what)
    program = "\n".join([*writer.lines, "M2", ""])
    try:
        check_same(writer.ours.calls, rs274(program, folder))
    except Exception as err:
        raise AssertionError(f"{err}\n{program}") from err
