"""Writing a PIC32MZ: the programs of others that can, each as a class, and our own end of the board's bootloader
(uhb.py). What is sent to them is pure; none is guessed at.

A programmer (pic32prog, MPLAB IPE) writes everything, the configuration words too. A bootloader (mikro_hb) writes the
program, keeps its own start and configuration words, and must be started on the board within its first seconds.
"""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path
from typing import ClassVar

from wificnc.board.model import Board
from wificnc.build.image import Block, read_hex
from wificnc.errors import BuildError, FlashError

Which = Callable[[str], str | None]


class Runner(ABC):
    """A program that writes a HEX file to this chip."""

    name: ClassVar[str]
    programs: ClassVar[tuple[str, ...]]  # names it goes by, the first one found is taken
    hint: ClassVar[str]  # what must be connected

    def find(self, which: Which = shutil.which) -> str | None:
        """The program's path, None: it is not installed."""
        return next(filter(None, map(which, self.programs)), None)

    @abstractmethod
    def argv(self, program: str, image: Path, board: Board) -> list[str]:
        """The command that writes and verifies."""


class MikroBootloader(Runner):
    """Board default USB HID bootloader, by mikro_hb."""

    name = "mikro_hb"
    programs = ("mikro_hb",)
    hint = "connect the board by USB and reset it: the bootloader waits a few seconds for mikro_hb"

    def argv(self, program: str, image: Path, board: Board) -> list[str]:
        return [program, str(image)]


class Pic32Prog(Runner):
    """PICkit 2 and 3 and others, by pic32prog, which finds the programmer itself."""

    name = "pic32prog"
    programs = ("pic32prog",)
    hint = "connect a PICkit 3 or another programmer that pic32prog knows"

    def argv(self, program: str, image: Path, board: Board) -> list[str]:
        return [program, str(image)]


class MplabIpe(Runner):
    """A PICkit 4 by the command line of MPLAB IPE."""

    name = "ipecmd"
    programs = ("ipecmd.sh", "ipecmd", "ipecmd.exe")
    hint = "connect a PICkit 4; ipecmd comes with MPLAB X and must be on the PATH"

    def argv(self, program: str, image: Path, board: Board) -> list[str]:
        part = board.chip.removeprefix("pic").upper()
        return [program, "-TPPK4", f"-P{part}", "-M", f"-F{image}", "-OL"]


OWN = "uhb"  # uhb.py


def is_own(wanted: str | None, which: Which = shutil.which, has_hid: Callable[[], bool] | None = None) -> bool:
    """Whether uhb.py writes: it was asked for, or nothing else can."""
    if wanted is not None:
        return wanted == OWN
    found = has_hid or (lambda: importlib.util.find_spec("hid") is not None)
    return not any(runner.find(which) for runner in RUNNERS) and found()


RUNNERS: tuple[Runner, ...] = (MikroBootloader(), Pic32Prog(), MplabIpe())


def choose_runner(wanted: str | None, which: Which = shutil.which) -> tuple[Runner, str]:
    """The runner that was asked for, or the first one installed, and its program. Raises FlashError."""
    names = ", ".join(runner.name for runner in RUNNERS)
    candidates = [runner for runner in RUNNERS if wanted in (None, runner.name)]
    for runner in candidates:
        if program := runner.find(which):
            return runner, program
    if wanted is not None and candidates:
        raise FlashError(f"{wanted} is not installed", hint=f"use one of these: {names}")
    hint = f"pip install hidapi, for the board's own USB bootloader; or install one of: {names}"
    raise FlashError("no programmer software for this chip is installed", hint=hint)


def require_image(board: Board, image: Path) -> None:
    """Raises FlashError."""
    if not image.is_file():
        raise FlashError(f"no build found for {board.id} in {image.parent}", hint=f"wificnc build {board.id}")


def read_image(board: Board, image: Path) -> tuple[Block, ...]:
    """What is in the HEX file. Raises FlashError."""
    require_image(board, image)
    hint = f"wificnc build {board.id}"
    try:
        blocks = read_hex(image.read_text(encoding="ascii"))
    except UnicodeDecodeError as err:
        raise FlashError(f"{image}: not an Intel HEX file", hint=hint) from err
    except OSError as err:
        raise FlashError(f"cannot read {image}: {err.strerror}", hint=hint) from err
    except BuildError as err:
        raise FlashError(f"{image}: {err.message}", hint=hint) from err
    if not blocks:
        raise FlashError(f"{image}: the HEX file has no data", hint=hint)
    return blocks


def plan_flash(board: Board, image: Path, wanted: str | None = None, which: Which = shutil.which) -> list[str]:
    """The exact command. Raises FlashError."""
    require_image(board, image)
    runner, program = choose_runner(wanted, which)
    return runner.argv(program, image, board)


def run_flash(command: list[str], wanted: str | None = None) -> None:
    """Write, with the program's own words on stderr. Raises FlashError."""
    if subprocess.run(command, stdout=sys.__stderr__, check=False).returncode != 0:
        runner, _ = choose_runner(wanted)
        raise FlashError(f"{runner.name} could not write the board", hint=runner.hint)
