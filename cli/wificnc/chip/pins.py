"""The virtual chip's pins for `wificnc sim --on-chip`: what they did as VCD or CSV, and what is done to them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TextIO

from wificnc.board.model import Board
from wificnc.chip.virtual import CPU_HZ, PORT_WIDTH, VirtualChip, pin_number
from wificnc.errors import UserError
from wificnc.sim.run import parse_at

SUFFIXES = (".csv", ".vcd")
PORTS = "ABCDEFG"
CYCLE_NS = 1_000_000_000 // CPU_HZ
LEVELS = {"low": 0, "high": 1, "open": None}


def pin_labels(board: Board) -> list[str]:
    """Of each pin: what the board has there and its name, step_x_RD3, or the name alone."""
    labels = [f"R{port}{bit}" for port in PORTS for bit in range(PORT_WIDTH)]
    for signal, pin in board.pin_names().items():
        labels[pin_number(pin)] = f"{signal}_{pin}"
    return labels


class PinTrace:
    """Every edge of every output pin from now on, written as it comes."""

    def __init__(self, chip: VirtualChip, file: TextIO, labels: Sequence[str], suffix: str) -> None:
        self._chip, self._file, self._labels, self._is_vcd = chip, file, labels, suffix == ".vcd"
        self._begin = self._last = chip.cycles
        chip.record_edges(True)
        if self._is_vcd:
            self._head()
        else:
            file.write("t_ns,pin,level\n")

    def _head(self) -> None:
        self._file.write(f"$timescale {CYCLE_NS} ns $end\n$scope module chip $end\n")
        for pin, label in enumerate(self._labels):
            self._file.write(f"$var wire 1 {_code(pin)} {label} $end\n")
        self._file.write("$upscope $end\n$enddefinitions $end\n#0\n$dumpvars\n")
        for pin in range(len(self._labels)):
            self._file.write(f"{self._chip.level(pin)}{_code(pin)}\n")
        self._file.write("$end\n")

    def take(self) -> None:
        """Write what has happened since the last call. Often enough: the chip keeps it until then."""
        for cycle, pin, level in self._chip.edges():
            if not self._is_vcd:
                self._file.write(f"{(cycle - self._begin) * CYCLE_NS},{self._labels[pin]},{level}\n")
                continue
            if cycle != self._last:
                self._file.write(f"#{cycle - self._begin}\n")
                self._last = cycle
            self._file.write(f"{level}{_code(pin)}\n")


def _code(pin: int) -> str:
    """A VCD identifier: printable characters."""
    return chr(33 + pin % 94) + ("!" if pin >= 94 else "")


def drive_pins(chip: VirtualChip, board: Board, events: Sequence[str]) -> None:
    """'2.5s RD3 high', '300ms limit_min_x low' or '1s RB2 open', from now on. Raises UserError."""
    pins = {f"r{port.lower()}{bit}": pin_number(f"R{port}{bit}") for port in PORTS for bit in range(PORT_WIDTH)}
    pins |= {signal: pin_number(pin) for signal, pin in board.pin_names().items()}
    for text in events:
        at = parse_at(text)
        name, _, level = at.action.partition(" ")
        if name not in pins or level not in LEVELS:
            raise UserError(
                f"--at {text!r}: on a chip it is a pin and high, low or open",
                hint=f"'2.5s RD3 high'; `wificnc boards show {board.id}` has its pins and signals",
            )
        chip.drive_at(chip.cycles + round(at.time_s * CPU_HZ), pins[name], LEVELS[level])
