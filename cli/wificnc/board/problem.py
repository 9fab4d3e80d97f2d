"""The rules of board files, and the error that lists what breaks them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from wificnc.errors import BoardError
from wificnc.files.problem import Problem

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
    "second-switch": "a second motor has a limit or a home switch only where the first one has one, at the same end",
    "second-motor": "the firmware has pulses and inputs for the motors: six, second ones included",
    "charge-pump": "the chip's timer makes the frequency of the charge pump",
    "servo": "the firmware has an output for the RC servo",
    "dial": "its axes exist, x100 comes with x10, and both lines have the same active level",
    "pendant": "the firmware has the UART for a pendant, and nothing else uses it",
    "drivers": "motor drivers with registers have a bus that reaches them, each its own place, DIAG a limit input",
    "spindle-bus": "the firmware has the UART for a spindle drive on RS-485",
    "spi-host": "the chip has the SPI host for Ethernet",
    "step-engine": "what makes the step pulses has a channel for every axis",
    "shift-register": "shift registers have the engine that drives them, and what they can do in its words",
    "timer-hz": "the step timer can count at this rate",
    "timer-tick": "pulse times are whole timer ticks",
    "default-pulse": "$0 starts at no less than the board's shortest pulse",
    "pulse-timing": "pulse, pause and direction set-up fit into the shortest step",
    "unknown-allow": "only rules about risks can be allowed",
    "stale-allow": "an allow suppresses something",
    "stale-deviation": "a deviation deviates",
}


class BoardProblems(BoardError):
    """A board file that breaks rules: all of them, in the order of the file."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems: Sequence[Problem] = tuple(problems)
        unnamed = {problem.rule for problem in self.problems} - RULES.keys()
        assert not unnamed, unnamed
        super().__init__("\n".join(str(problem) for problem in self.problems), "run: wificnc boards check")
