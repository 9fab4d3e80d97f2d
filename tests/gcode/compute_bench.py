"""tests/gcode/compute.c by ctypes: expressions, parameters and programs without a machine."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from ctypes import (
    CDLL,
    POINTER,
    byref,
    c_bool,
    c_char_p,
    c_double,
    c_int,
    c_int32,
    c_uint8,
    c_uint32,
    c_void_p,
)

from gcode_core import XYZ, Axes, status_table

NUMBER = {name: number for number, (name, _) in status_table().items()}
LINE, DONE, FAILED = range(3)
PLENTY = 100_000

_PROTOTYPES: dict[str, tuple[object, tuple[object, ...]]] = {
    "bench_create": (c_void_p, (c_uint8,)),
    "bench_destroy": (None, (c_void_p,)),
    "bench_clear": (None, (c_void_p,)),
    "bench_probe": (None, (c_void_p, Axes, c_bool)),
    "bench_value": (c_int, (c_void_p, c_char_p, POINTER(c_double))),
    "bench_line": (c_int, (c_void_p, c_char_p)),
    "bench_plain": (c_char_p, (c_void_p,)),
    "bench_position": (None, (c_void_p, Axes)),
    "bench_program": (c_int, (c_void_p, c_char_p, c_uint32, c_uint32, c_int32)),
    "bench_fail_at": (None, (c_void_p, c_int32)),
    "bench_step": (c_int, (c_void_p,)),
    "bench_status": (c_int, (c_void_p,)),
    "bench_line_number": (c_uint32, (c_void_p,)),
}


def stored(text: str) -> bytes:
    """A line as the line reader stores it."""
    return text.replace(" ", "").upper().encode()


class ProgramError(Exception):
    """An O word or a line that cannot be. args: name of the error, line."""


class Bench:
    """An interpreter at power-on."""

    def __init__(self, lib: CDLL, axes: int = XYZ) -> None:
        for name, (result, arguments) in _PROTOTYPES.items():
            function = getattr(lib, name)
            function.restype, function.argtypes = result, arguments
        self._lib = lib
        self._bench = lib.bench_create(axes)

    def __del__(self) -> None:
        self._lib.bench_destroy(self._bench)

    def value(self, text: str) -> float | str:
        """What an expression gives: its value, or the name of the error."""
        value = c_double()
        status = self._lib.bench_value(self._bench, stored(text), byref(value))
        assert status >= 0, f"{text} was not read to its end"
        return value.value if status == 0 else status_table()[status][0]

    def answer(self, line: str) -> str:
        """Carry a line out; the name of its answer."""
        return status_table()[self._lib.bench_line(self._bench, stored(line))][0]

    def run(self, *lines: str) -> Bench:
        """Carry out lines that must be fine."""
        for line in lines:
            assert self.answer(line) == "OK", line
        return self

    def plain(self, line: str) -> str:
        """The plain line that a line means; it is carried out."""
        self.run(line)
        return self._lib.bench_plain(self._bench).decode()

    def clear(self) -> None:
        self._lib.bench_clear(self._bench)

    def probe(self, mm: Sequence[float], ok: bool) -> None:
        self._lib.bench_probe(self._bench, Axes(*mm), ok)

    def position(self) -> list[float]:
        mm = Axes()
        self._lib.bench_position(self._bench, mm)
        return list(mm)

    def program(self, text: str | bytes, lines_max: int = PLENTY, fails_at: int = -1) -> Iterator[tuple[int, str]]:
        """Carry out a program: (line of the file, plain line) of each line that is not only computed.

        Raises:
            ProgramError: it ended with an error.
        """
        self._text = text.encode() if isinstance(text, str) else text
        size = len(self._text)
        status = self._lib.bench_program(self._bench, self._text, size, lines_max, fails_at)
        if status != 0:
            raise ProgramError(status_table()[status][0], self._lib.bench_line_number(self._bench))
        while (result := self._lib.bench_step(self._bench)) == LINE:
            yield self._lib.bench_line_number(self._bench), self._lib.bench_plain(self._bench).decode()
        if result == FAILED:
            name = status_table()[self._lib.bench_status(self._bench)][0]
            raise ProgramError(name, self._lib.bench_line_number(self._bench))
