"""`wificnc flash --verify-boot`: whether an image starts, before it is written to a board."""

from __future__ import annotations

import re
import tempfile
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from wificnc.board.model import Board
from wificnc.errors import BuildError, FlashError, UserError
from wificnc.files.paths import shown
from wificnc.simulator.run import SimOptions

from wificnc_chips.job import run_on_chip
from wificnc_chips.wired import Wired, greet, wire

JOB = "G21G91\nG1X2F600\n"
BANNER = re.compile(r"Grbl \S+ \['\$' for help\]")
VERSION = re.compile(r"\[VER:[^\]]*\]")
ANSWER_S, LOOK_S = 2.0, 0.01  # of the chip's time


@dataclass(frozen=True)
class Verified:
    """What the image did."""

    banner: str
    version: str  # the line of $I
    events: int  # step events of the G1, all of them the host's


def verify_boot(board: Board, image: Path) -> Verified:
    """Start it in the virtual chip and ask for banner, `$I` and a G1 with the host's steps.

    Raises:
        FlashError: it failed, and where.
        BuildError: there is no virtual chip here.
    """
    try:
        with closing(wire(board, image)) as chip:
            banner = _find(BANNER, greet(chip), "Grbl's banner")
            version = _find(VERSION, _ask(chip, "$I"), "a version in the answer to $I")
        return Verified(banner, version, _steps(board, image))
    except (FlashError, BuildError):
        raise
    except UserError as err:
        raise FlashError(f"this firmware fails in the virtual chip: {err.message}", err.hint) from err


def _find(what: re.Pattern[str], said: str, name: str) -> str:
    found = what.search(said)
    if found is None:
        raise FlashError(f"this firmware fails in the virtual chip: {name} is missing in {said.strip()!r}")
    return found[0]


def _ask(chip: Wired, line: str) -> str:
    chip.write(line.encode() + b"\n")
    said, end = "", chip.cycles + round(ANSWER_S * chip.cpu_hz)
    while chip.cycles < end and not re.search(r"^(ok|error:\d+)\r\n", said, re.MULTILINE):
        chip.run(LOOK_S)
        said += chip.read().decode("latin-1")
    return said


def _steps(board: Board, image: Path) -> int:
    """A G1 whose steps are the host's. @return how many events. Raises FlashError."""
    with tempfile.TemporaryDirectory() as folder:
        job = Path(folder) / "verify.nc"
        job.write_text(JOB, encoding="ascii")
        done = run_on_chip(board, SimOptions(job, str(board.path)), [], image=image)
    if done.errors:
        raise FlashError(f"this firmware fails in the virtual chip: {JOB.split()[1]} is refused, {done.errors[0]}")
    if done.first_difference is not None:
        raise FlashError(
            f"this firmware fails in the virtual chip: G1X2 makes {done.events} step events, "
            f"and event {done.first_difference} is not the one of `wificnc sim --board {shown(board.path)}`"
        )
    return done.events
