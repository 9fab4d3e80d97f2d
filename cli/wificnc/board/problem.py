"""A problem in a board file: where, which rule, why, and what would be legal instead."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wificnc.board.paths import shown
from wificnc.errors import BoardError

KeyPath = tuple[str | int, ...]

# Every rule and what it protects. A problem of any other rule cannot be made; each has a file that breaks it in
# tests/boards/invalid.
RULES = {
    "unreadable": "the file can be read and is UTF-8",
    "syntax": "the file is TOML",
    "schema-first": "`schema = 1` comes before anything a reader may not understand",
    "unknown-key": "no key is misspelt or made up",
    "missing-key": "every required key is there",
    "bad-value": "every value has its type and range",
    "unknown-chip": "the target has a pin table for the chip",
    "memory-mode": "the chip comes with this flash and PSRAM",
    "header-name": "a header carries pins of the chip, power and reset",
    "no-such-pin": "the chip has the pin",
    "input-only": "an output is on a pin that can drive",
    "output-only": "an input is on a pin that can be read",
    "no-pull": "a pull resistor that is asked for exists",
    "used-twice": "a pin has one use",
    "taken": "a pin is not the flash's, the PSRAM's or the clock's",
    "not-brought-out": "a pin is on a header, or soldered to its use",
    "strapping": "nothing hangs unconsidered on a pin that decides how the chip starts",
    "boot-level": "spindle, coolant and motors are off from reset until the firmware runs",
    "boot-glitch": "spindle, coolant and motors are off while the supply rises",
    "usb": "the USB port keeps its pins",
    "console": "boot messages, console and flasher keep their pins",
    "debug": "a debugger keeps its pins",
    "fast-path": "the step interrupt can write step and direction pins",
    "axis-order": "axes count from X on without a gap",
    "limit-kind": "an axis has one limit line, or one for each end",
    "spi-host": "the chip has the SPI host for Ethernet",
    "timer-hz": "the step timer can count at this rate",
    "timer-tick": "pulse times are whole timer ticks",
    "pulse-timing": "pulse, pause and direction set-up fit into the shortest step",
    "unknown-allow": "only rules about risks can be allowed",
    "stale-allow": "an allow suppresses something",
    "stale-deviation": "a deviation deviates",
}


def key_text(path: KeyPath) -> str:
    """("output", "misc", 1) -> output.misc[1]"""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


@dataclass(frozen=True)
class Finding:
    """What a rule found, before the file and the line are known."""

    rule: str
    path: KeyPath
    reason: str
    hint: str | None = None


@dataclass(frozen=True)
class Problem:
    """One problem, ready to be shown."""

    file: Path
    line: int
    rule: str
    key: str
    reason: str
    hint: str | None = None

    def __post_init__(self) -> None:
        assert self.rule in RULES, self.rule

    def __str__(self) -> str:
        key = f"{self.key}: " if self.key else ""
        text = f"{shown(self.file)}:{self.line}: {key}{self.reason} [{self.rule}]"
        return f"{text}\n  hint: {self.hint}" if self.hint else text

    def as_json(self) -> dict[str, Any]:
        return {
            "file": shown(self.file),
            "line": self.line,
            "rule": self.rule,
            "key": self.key,
            "reason": self.reason,
            "hint": self.hint,
        }


class BoardProblems(BoardError):
    """A board file that breaks rules: all of them, in the order of the file."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems: Sequence[Problem] = tuple(problems)
        super().__init__("\n".join(str(problem) for problem in self.problems), "run: wificnc boards check")
