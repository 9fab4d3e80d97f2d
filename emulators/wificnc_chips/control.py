"""The control port of a virtual chip (`wificnc serve --control`): hands at its pins, its cable and its switch.

A line is answered by one line: `ok`, `error: why`, or what was asked for.
"""

from __future__ import annotations

import socket
from collections.abc import Callable
from typing import Protocol

from wificnc.board.model import Board

from wificnc_chips.esp32.machine import SHIFT_PIN
from wificnc_chips.pins import LEVELS
from wificnc_chips.wired import Wired, number_of, pin_numbers

LINE_MAX = 256
HELP = "PIN or SIGNAL high, low or open; pins; position; link up or down; power"
STATES = {"up": True, "down": False}


class Hands(Protocol):
    """What else they reach."""

    def power(self) -> None: ...

    def plug(self, up: bool) -> bool: ...


class Control:
    """Understands lines. Pins have the chip's names and the board's: `GPIO36 low`, `limit_min_x open`."""

    def __init__(self, chip: Wired, board: Board, hands: Hands) -> None:
        self._chip, self._board, self._hands = chip, board, hands
        names = {name.lower(): number for name, number in pin_numbers(board).items()}
        self._signals = {signal: number_of(board, pin) for signal, pin in board.pin_names().items()}
        self._pins = names | self._signals
        self._outputs = {number for name, number in names.items() if name.startswith(SHIFT_PIN.lower())}

    def obey(self, line: str) -> str:
        """@return the answer"""
        words = line.lower().split()
        if not words:
            return "ok"
        if words == ["pins"]:
            return " ".join(f"{signal} {self._chip.level(pin)}" for signal, pin in self._signals.items())
        if words == ["position"]:
            return " ".join(str(self._chip.position(motor)) for motor in range(len(self._board.axis.motors())))
        if words == ["power"]:
            self._hands.power()
            return "ok"
        if words[0] == "link" and len(words) == 2 and words[1] in STATES:
            return "ok" if self._hands.plug(STATES[words[1]]) else "error: this chip has no cable (--network)"
        if len(words) == 2 and words[0] in self._pins and words[1] in LEVELS:
            return self._drive(words[0], words[1])
        return f"error: {line.strip()!r} is not one of: {HELP}"

    def _drive(self, name: str, level: str) -> str:
        if self._pins[name] in self._outputs:
            return f"error: {name} is an output of a shift register, and cannot be driven"
        self._chip.drive(self._pins[name], LEVELS[level])
        return "ok"


class ControlClient:
    """A connection that is read line by line."""

    def __init__(self, client: socket.socket, obey: Callable[[str], str]) -> None:
        self._client, self._obey, self._said = client, obey, b""

    def read(self) -> bytes | None:
        """Take and answer what has come. @return nothing for the chip; None: it is gone"""
        try:
            data = self._client.recv(LINE_MAX)
        except BlockingIOError:
            return b""
        except OSError:
            return None
        *lines, self._said = (self._said + data).split(b"\n")
        for line in lines:
            try:
                self._client.sendall(self._obey(line.decode("utf-8", "replace")).encode() + b"\n")
            except OSError:  # no one reads there
                return None
        return b"" if data and len(self._said) < LINE_MAX else None
