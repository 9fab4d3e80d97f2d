"""Where a program ends in its file: at M2 or M30, or at the % that closes it (RS274/NGC 3.6.1).

The rule of targets/sim/program_end.h, for senders that have no compiled core; protocol/vectors/program_end.json binds
them. Pure.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

PERCENT = re.compile(rb"(?:N[0-9]+)?%")
NUMBER = re.compile(rb"(?:N[0-9]+)?[O:][0-9]+")
# The ends of a tape and the number of the program (core/gcode/parse.c): not every controller takes them.
MARK = re.compile(rb"%.*|" + PERCENT.pattern + rb"|" + NUMBER.pattern, re.DOTALL)
NAME = re.compile(rb"<[^>]*>?")
EXPRESSION = re.compile(rb"\[[^][]*\]?")
BRACKET = re.compile(rb"\[([^][]*)\]")  # without another one in it
TERM = rb"[-+]*(?:[0-9]+\.?[0-9]*|\.[0-9]+)"
SUM = re.compile(rb"(" + TERM + rb")((?:[-+*/]" + TERM + rb")*)")
NEXT_TERM = re.compile(rb"([-+*/])(" + TERM + rb")")
COMPUTED_CODE = re.compile(rb"M\+?(\[.*)")
END_CODE = re.compile(rb"M\+?0*(?:2|30)(?:\.0*)?(?![0-9.])")
# It could end a program, and does nothing else.
END_ALONE = re.compile(rb"/*(?:N[0-9.]*)?/*(?:" + END_CODE.pattern + rb")*")


@dataclass
class Ending:
    """What of a file is not run; lines are 1-based in the file, 0 = none."""

    line: int = 0  # the M2, M30 or % that ends the program
    unrun: int = 0  # lines with code after it, from `first` on
    first: int = 0  # the first line after it that is more than an M2 or M30
    second: int = 0  # where another program begins
    _mark: int = 0  # the first % or program number after the end, before `first`
    _has_code: bool = False
    _is_open: bool = False

    def take(self, code: bytes, number: int, by_code: bool = True) -> bool:
        """The next line, without blanks and comments, upper case.

        Args:
            by_code: M2 and M30 end it; of a program with O words they do where they are executed.

        Returns:
            Whether it belongs to the program; its end does.
        """
        if self.line:
            self._take_after(code, number)
            return False
        if PERCENT.fullmatch(code):
            self.line = number if self._has_code else 0
            self._is_open = not self._has_code
        elif code and not MARK.fullmatch(code):
            self._has_code = True
            if by_code and has_end_code(code):
                self.line = number
        return True

    def _take_after(self, code: bytes, number: int) -> None:
        if PERCENT.fullmatch(code) and self._is_open:
            self._is_open = False  # it closes the program that has ended by M2 or M30
        elif PERCENT.fullmatch(code) or NUMBER.fullmatch(code):
            self._mark = self._mark or number
        elif code and not self.unrun and END_ALONE.fullmatch(code):
            self._mark = 0  # the program that began there has no code
        elif code and not MARK.fullmatch(code):
            if self.unrun == 0:
                self.first, self.second = number, self._mark
            self.unrun += 1
            if not self.second and has_end_code(code):
                self.second = self.first

    @property
    def words(self) -> str:
        """For people; "" when all of the file is run."""
        if not self.unrun:
            return ""
        lines = "1 line is" if self.unrun == 1 else f"{self.unrun:,} lines are"
        text = f"the program ends in line {self.line}: {lines} not run, from line {self.first} on"
        return f"{text}; another program begins in line {self.second}" if self.second else text

    @property
    def hint(self) -> str | None:
        """How the rest can be run."""
        if not self.unrun:
            return None
        first = self.second or self.first
        return f"to run them, save the file from line {first} on as a separate file, or take out what ends the program"


def has_end_code(code: bytes) -> bool:
    """M2 or M30, however it is written, also as M[1+1]; what parameters and functions make is not known by reading."""
    if code.startswith(b"$"):
        return False
    code = NAME.sub(b"", code)
    if any(_value_at(found[1]) in (2, 30) for found in COMPUTED_CODE.finditer(code)):
        return True
    while b"[" in code:
        code = EXPRESSION.sub(b"", code)
    return END_CODE.search(code) is not None


def _value_at(text: bytes) -> float | None:
    """Of the bracket that the text begins with: numbers with + - * / between them; None: anything else."""
    while bracket := BRACKET.search(text):
        value = _sum(bracket[1])
        if value is None or bracket.start() == 0:
            return value
        text = text[: bracket.start()] + b"%.15f" % value + text[bracket.end() :]
    return None


def _sum(text: bytes) -> float | None:
    found = SUM.fullmatch(text)
    if not found:
        return None
    terms = [_number(found[1])]
    for operator, term in NEXT_TERM.findall(found[2]):
        value = _number(term)
        if operator in b"+-":
            terms.append(value if operator == b"+" else -value)
        elif operator == b"*":
            terms[-1] *= value
        elif value:
            terms[-1] /= value
        else:
            return None
    return sum(terms)


def _number(text: bytes) -> float:
    """With any signs before it."""
    size = float(text.lstrip(b"+-"))
    return -size if text.count(b"-") % 2 else size
