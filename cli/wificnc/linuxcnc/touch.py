"""After a probe has touched: from where the machine stands back to what LinuxCNC commands. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence


class Clearance:
    """Commands run ahead of the machine. When the probe touches, the controller stops it, and the command is
    already somewhat behind the contact. That way must not be made up for: it lies inside the workpiece.

    So the machine keeps its distance from the command. What the command moves back along that distance shortens it,
    and the machine stands meanwhile; all else of the command's motion is followed. A retreat ends it.
    """

    def __init__(self, count: int) -> None:
        self.offset = [0.0] * count
        self._command: list[float] | None = None

    def begin(self, stands: Sequence[float], command: Sequence[float]) -> None:
        """The machine stands there, in units, while it is commanded to be elsewhere."""
        self.offset = [at - asked for at, asked in zip(stands, command, strict=True)]
        self._command = list(command)

    def shift(self, believed: Sequence[float], stands: Sequence[float]) -> None:
        """The machine stands there, and not where it was believed to; as long as it keeps a distance."""
        if any(self.offset):
            ways = zip(self.offset, believed, stands, strict=True)
            self.offset = [way + at - thought for way, thought, at in ways]

    def follow(self, command: Sequence[float]) -> list[float]:
        """Where the machine shall be."""
        size = math.hypot(*self.offset)
        before, self._command = self._command, list(command)
        if before is not None and size > 0.0:
            unit = [part / size for part in self.offset]
            back = sum((new - old) * way for new, old, way in zip(command, before, unit, strict=True))
            left = max(0.0, size - max(0.0, back))
            self.offset = [way * left for way in unit]
        return [asked + part for asked, part in zip(command, self.offset, strict=True)]
