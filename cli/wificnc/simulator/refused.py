"""Lines of a program that the controller refuses, by the controller itself in check mode: nothing moves."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Iterable
from dataclasses import astuple, dataclass

from wificnc.simulator.job import LEFT_OUT, Timing
from wificnc.simulator.library import HostBoard, Simulation

LOSES_POSITION = re.compile(r"\$J=|\$H|.*G38(?![0-9])")  # where the machine is afterwards, check mode does not know
NEEDS_POSITION = (33, 34)  # errors of arcs


@dataclass(frozen=True)
class Refused:
    """A line, by its index, and why."""

    index: int
    code: int
    message: str


def refused_lines(library: ctypes.CDLL, timing: Timing, lines: Iterable[str]) -> list[Refused]:
    """Plain lines, from the state after power-on.

    $ lines are refused in check mode, so another controller gets them, but for those that no simulation can do.
    """
    *numbers, dial, driver = astuple(timing)
    board = HostBoard(*numbers, driver=driver, dial=dial)
    found: list[Refused] = []
    is_lost = False
    with Simulation(library, board) as checks, Simulation(library, board) as runs:
        for sim in (checks, runs):
            sim.command("$341=0")  # what is simulated has not been homed
        checks.command("$C")
        for index, line in enumerate(lines):
            is_lost = is_lost or LOSES_POSITION.match(line) is not None
            if line.encode().startswith(tuple(LEFT_OUT)):
                continue
            code = (runs if line.startswith("$") else checks).command(line)
            if code and not (is_lost and code in NEEDS_POSITION):
                found.append(Refused(index, code, checks.status_text(code)))
    return found
