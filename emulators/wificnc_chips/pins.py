"""The virtual chip's pins for `wificnc sim --on-chip`: what they did as VCD or CSV, and what is done to them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TextIO

from wificnc.board.model import Board
from wificnc.errors import UserError
from wificnc.simulator.run import parse_at

from wificnc_chips.esp32.machine import SHIFT_PIN
from wificnc_chips.wired import Wired, number_of, pin_numbers

SUFFIXES = (".csv", ".vcd")
NS_PER_S = 1_000_000_000
LEVELS = {"low": 0, "high": 1, "open": None}


def pin_labels(board: Board) -> dict[int, str]:
    """Of each pin: what the board has there and its name, step_x_RD3, or the name alone."""
    labels = {number: name for name, number in pin_numbers(board).items()}
    for signal, pin in board.pin_names().items():
        labels[number_of(board, pin)] = f"{signal}_{pin}"
    return labels


class PinTrace:
    """Every edge of every output pin from now on, written as it comes."""

    def __init__(self, chip: Wired, file: TextIO, labels: Mapping[int, str], suffix: str) -> None:
        self._chip, self._file, self._labels, self._is_vcd = chip, file, labels, suffix == ".vcd"
        self._begin = self._last = chip.cycles
        # of a cycle; where it is no whole number of ns, times are rounded to one
        self._unit_ns = NS_PER_S // chip.cpu_hz if NS_PER_S % chip.cpu_hz == 0 else 1
        chip.record_edges(True)
        if self._is_vcd:
            self._head()
        else:
            file.write("t_ns,pin,level\n")

    def _head(self) -> None:
        self._file.write(f"$timescale {self._unit_ns} ns $end\n$scope module chip $end\n")
        for pin, label in self._labels.items():
            self._file.write(f"$var wire 1 {_code(pin)} {label} $end\n")
        self._file.write("$upscope $end\n$enddefinitions $end\n#0\n$dumpvars\n")
        for pin in self._labels:
            self._file.write(f"{self._chip.level(pin)}{_code(pin)}\n")
        self._file.write("$end\n")

    def take(self) -> None:
        """Write what has happened since the last call. Often enough: the chip keeps it until then."""
        for cycle, pin, level in self._chip.edges():
            if not self._is_vcd:
                self._file.write(f"{self._ns(cycle)},{self._labels[pin]},{level}\n")
                continue
            if cycle != self._last:
                self._file.write(f"#{self._ns(cycle) // self._unit_ns}\n")
                self._last = cycle
            self._file.write(f"{level}{_code(pin)}\n")

    def _ns(self, cycle: int) -> int:
        return ((cycle - self._begin) * NS_PER_S + self._chip.cpu_hz // 2) // self._chip.cpu_hz


def _code(pin: int) -> str:
    """A VCD identifier: printable characters."""
    return chr(33 + pin % 94) + ("!" if pin >= 94 else "")


def drive_pins(chip: Wired, board: Board, events: Sequence[str]) -> None:
    """'2.5s RD3 high', '300ms limit_min_x low' or '1s RB2 open', from now on. Raises UserError."""
    pins = {name.lower(): number for name, number in pin_numbers(board).items()}
    pins |= {signal: number_of(board, pin) for signal, pin in board.pin_names().items()}
    outputs = {number for pin, number in pin_numbers(board).items() if pin.startswith(SHIFT_PIN)}
    example = board.pin_names()["step_x"]
    for text in events:
        at = parse_at(text)
        name, _, level = at.action.partition(" ")
        if name not in pins or level not in LEVELS:
            raise UserError(
                f"--at {text!r}: on a chip it is a pin and high, low or open",
                hint=f"'2.5s {example} high'; `wificnc boards show {board.id}` has its pins and signals",
            )
        if pins[name] in outputs:
            raise UserError(f"--at {text!r}: {name} is an output of a shift register, and cannot be driven")
        chip.drive_at(chip.cycles + round(at.time_s * chip.cpu_hz), pins[name], LEVELS[level])
