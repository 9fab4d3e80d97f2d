"""What a program means, in few words: rapids, feeds, arcs, probes and dwells in machine mm, and who reported it.

`rs274` is LinuxCNC's interpreter alone (Debian: linuxcnc-uspace). It prints canonical calls in the program's units
and coordinates, four decimals each; the offsets that lead to the machine are calls of their own.
"""

from __future__ import annotations

import os
import re
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

from patience import HANG_S

AXES = 6
PLANES = {"CANON_PLANE_XY": (0, 1, 2), "CANON_PLANE_XZ": (2, 0, 1), "CANON_PLANE_YZ": (1, 2, 0)}
MM = {"CANON_UNITS_MM": 1.0, "CANON_UNITS_INCHES": 25.4}
CALL = re.compile(r"^\s*\d+ N\S*\s+(\w+)\((.*)\)$")
LAST_DIGIT = 0.5e-4
MESSAGES = 12  # lines of a failure that are shown
TOOLS = 9  # in the table, all of length 0


@dataclass(frozen=True)
class Call:
    """One thing that a machine does. `what`: rapid, feed, arc, probe, dwell. Machine mm and degrees, mm/min, s."""

    what: str
    target: tuple[float, ...] = ()
    feed: float = 0.0  # 0 where it means nothing: rapids, dwells. Inverse time is length by time
    center: tuple[float, float] = (0.0, 0.0)  # in the order of PLANES
    plane: tuple[int, int, int] = (0, 1, 2)
    turns: int = 0  # > 0: counterclockwise, with one for a part or whole of a turn
    seconds: float = 0.0
    tolerance: float = 0.0  # of every number in mm, as far as it was printed


class Refused(Exception):
    """The interpreter stopped, and why."""


@dataclass
class _Reader:
    """Canonical calls, line by line, into Calls."""

    unit: float = 1.0
    plane: tuple[int, int, int] = (0, 1, 2)
    feed: float = 0.0
    offsets: dict[str, list[float]] = field(default_factory=dict)
    offset_units: dict[str, float] = field(default_factory=dict)  # that they were printed in
    calls: list[Call] = field(default_factory=list)

    def take(self, name: str, words: list[str]) -> None:
        handler = getattr(self, f"_{name.lower()}", None)
        if handler:
            handler(words)

    def _lengths(self, words: list[str]) -> list[float]:
        """X Y Z in mm, A B C in degrees."""
        return [float(word) * (self.unit if n < 3 else 1.0) for n, word in enumerate(words[:AXES])]

    def _offset(self, axis: int) -> float:
        return sum(offset[axis] for offset in self.offsets.values())

    def _add(self, what: str, target: list[float], **more: object) -> None:
        machine = tuple(value + self._offset(axis) for axis, value in enumerate(target))
        tolerance = LAST_DIGIT * (self.unit + sum(self.offset_units.values()))
        feed = 0.0 if what == "rapid" else self.feed
        self.calls.append(Call(what, machine, feed, plane=self.plane, tolerance=tolerance, **more))

    def _set_offset(self, name: str, words: list[str]) -> None:
        self.offsets[name] = self._lengths(words)
        self.offset_units[name] = self.unit

    def _use_length_units(self, words: list[str]) -> None:
        self.unit = MM[words[0]]

    def _select_plane(self, words: list[str]) -> None:
        self.plane = PLANES[words[0]]

    def _set_g5x_offset(self, words: list[str]) -> None:
        self._set_offset("g5x", words[1:])

    def _set_g92_offset(self, words: list[str]) -> None:
        self._set_offset("g92", words)

    def _use_tool_length_offset(self, words: list[str]) -> None:
        self._set_offset("tool", words)

    def _set_feed_rate(self, words: list[str]) -> None:
        self.feed = float(words[0]) * self.unit

    def _straight_traverse(self, words: list[str]) -> None:
        self._add("rapid", self._lengths(words))

    def _straight_feed(self, words: list[str]) -> None:
        self._add("feed", self._lengths(words))

    def _straight_probe(self, words: list[str]) -> None:
        self._add("probe", self._lengths(words))

    def _dwell(self, words: list[str]) -> None:
        self.calls.append(Call("dwell", seconds=float(words[0]), tolerance=LAST_DIGIT))

    def _arc_feed(self, words: list[str]) -> None:
        first, second, normal = self.plane
        target = [0.0] * 3 + [float(word) for word in words[6:9]]
        ends = [float(word) * self.unit for word in (words[0], words[1], words[5])]
        for axis, end in zip((first, second, normal), ends, strict=True):
            target[axis] = end
        center = (
            float(words[2]) * self.unit + self._offset(first),
            float(words[3]) * self.unit + self._offset(second),
        )
        self._add("arc", target, center=center, turns=int(words[4]))


def rs274(program: str, folder: Path) -> list[Call]:
    """What LinuxCNC's interpreter makes of a program; all offsets begin at zero. Raises Refused."""
    path, variables, tools = folder / "program.ngc", folder / "rs274.var", folder / "rs274.tbl"
    path.write_text(program)
    variables.write_text("5161\t0\n5220\t1\n")
    tools.write_text("".join(f"T{n} P{n} Z0\n" for n in range(1, TOOLS + 1)))
    command = ["rs274", "-g", "-t", str(tools), "-v", str(variables), str(path)]
    alone = {**os.environ, "HOME": str(folder)}  # its .tool.mmap: two at the same time in one home end in a bus error
    run = subprocess.run(command, capture_output=True, text=True, timeout=HANG_S, env=alone)
    assert run.returncode >= 0, f"rs274 crashed: signal {-run.returncode}"
    if run.returncode != 0:
        raise Refused("\n".join(run.stderr.splitlines()[-MESSAGES:]))
    reader = _Reader()
    for line in run.stdout.splitlines():
        found = CALL.match(line)
        if found:
            reader.take(found[1], re.split(r"[,\s]+", found[2].strip()))
    return reader.calls
