"""A sender at the serial port of the virtual chip. Virtual time only."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from wificnc.board.model import Board
from wificnc.build.image import Block
from wificnc_chips.pic32mz import CPU_HZ, STEP_DTYPE, Stop, motor_wire, pin_number, wired_chip

BANNER = "\r\nGrbl 1.1h ['$' for help]\r\n"
SLICE_S = 0.001
IN_FLIGHT = 1000  # bytes a character-counting sender may have on their way


class PowerIsOff(Exception):
    """cut_power() has struck."""


class Controller:
    """The chip, and what a sender and a machine do with it."""

    def __init__(self, board: Board, image: tuple[Block, ...]) -> None:
        self.board = board
        self.chip = wired_chip(board, image)
        self.heard = ""

    def __enter__(self) -> Controller:
        return self

    def __exit__(self, *_: object) -> None:
        self.chip.close()

    def run(self, seconds: float) -> str:
        """Let time pass; what was answered meanwhile."""
        stop = self.chip.run(seconds)
        said = self.chip.read().decode("latin-1")
        self.heard += said
        if stop == Stop.DARK:
            raise PowerIsOff
        return said

    def boot(self) -> str:
        """What is answered up to the banner."""
        said = self.run(0.02)
        assert said.endswith(BANNER), said
        return said

    def send(self, line: str, seconds: float = 10.0) -> str:
        """One line, and everything that is answered until it is answered."""
        self.chip.write(line.encode("latin-1") + b"\n")
        said = ""
        for _ in range(round(seconds / SLICE_S)):
            said += self.run(SLICE_S)
            if any(line == "ok" or line.startswith("error:") for line in said.split("\r\n")[:-1]):
                return said
        raise AssertionError(f"{line!r} has no answer in {seconds} s: {said!r}")

    def fine(self, *lines: str) -> None:
        """Lines that are answered ok and nothing else."""
        for line in lines:
            assert self.send(line) == "ok\r\n", line

    def realtime(self, byte: str, seconds: float = 0.02) -> str:
        self.chip.write(byte.encode("latin-1"))
        return self.run(seconds)

    def status(self) -> str:
        said = self.realtime("?")
        for _ in range(10):
            if ">" in said:
                break
            said += self.run(0.02)
        return said[said.index("<") : said.index(">") + 1]

    def state(self) -> str:
        return self.status()[1:].split("|")[0]

    def position(self) -> list[float]:
        """Machine position as reported, mm."""
        return [float(word) for word in self.status().split("MPos:")[1].split("|")[0].split(",")]

    def stands(self) -> list[int]:
        """Where the motors really stand, steps."""
        return [self.chip.position(axis) for axis in range(len(self.board.axes))]

    def stream(self, lines: list[str]) -> list[str]:
        """A job by character counting; ends when all is answered. @return answers"""
        waiting: list[int] = []
        answers: list[str] = []
        rest = ""
        for line in lines:
            while sum(waiting) + len(line) + 1 > IN_FLIGHT:
                rest = self._take(rest, waiting, answers)
            self.chip.write(line.encode("latin-1") + b"\n")
            waiting.append(len(line) + 1)
        while waiting:
            rest = self._take(rest, waiting, answers)
        return answers

    def _take(self, rest: str, waiting: list[int], answers: list[str]) -> str:
        *lines, rest = (rest + self.run(SLICE_S)).split("\r\n")
        for line in lines:
            if line == "ok" or line.startswith("error:"):
                waiting.pop(0)
                answers.append(line)
        return rest

    def rest(self, seconds: float = 60.0) -> None:
        """Until nothing moves any more."""
        for _ in range(round(seconds / 0.1)):
            if self.state() == "Idle":
                return
            self.run(0.1)
        raise AssertionError(f"it is still {self.state()}")

    def steps(self) -> NDArray[np.void]:
        return np.frombuffer(self.chip.steps(), dtype=np.dtype(STEP_DTYPE))

    def switches(self, axis: int, low: int | None, high: int | None) -> None:
        """Limit switches at these steps, as the machine really is."""
        self.chip.set_axis(axis, motor_wire(self.board, axis, low, high))

    def pin(self, signal: str) -> int:
        """Number of a signal's pin."""
        return pin_number(self.board.pin_names()[signal])

    def at(self, seconds: float, signal: str, level: int | None) -> None:
        """Drive a pin, this long from now."""
        self.chip.drive_at(self.chip.cycles + round(seconds * CPU_HZ), self.pin(signal), level)
