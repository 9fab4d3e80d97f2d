"""targets/sim/expand.h seen from Python: a program with O words and expressions -> the plain lines it executes."""

from __future__ import annotations

import ctypes
from ctypes import POINTER, c_char_p, c_int, c_size_t, c_uint32, c_void_p
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path

from wificnc.connection.words import ERRORS
from wificnc.errors import BuildError, JobError
from wificnc.job.ending import Ending
from wificnc.job.rebuild import ProgramEnd
from wificnc.job.refusal import refusal_hint

LINES_MAX = 1_000_000  # executed lines, before a program counts as endless
MACHINE_ONLY = 129
ENDLESS = 127
HINTS = {
    MACHINE_ONLY: "a program may read the modes and positions that it has set itself (G21 G90 G0 X0 ...), but no "
    "offsets and probe results",
    ENDLESS: "--max-lines N allows more",
}


class Start(IntEnum):
    """enum expand_start"""

    ANYWHERE = 0  # nothing is known of the machine
    AT_ZERO = 1  # as after power-on: position 0, no offsets, G21 G90 G17 ...


@dataclass(frozen=True)
class Expanded:
    """What a program executes."""

    text: bytes  # plain lines, each with its LF
    numbers: tuple[int, ...]  # of the file, 1-based: where each line came from
    comments: bytes = b""  # of each of them, with its LF: as in the file, but with the values of PRINT and DEBUG
    ending: Ending = field(default_factory=Ending)  # what of the file is not run


def expand(library: ctypes.CDLL, name: str, text: bytes, start: Start, lines_max: int = LINES_MAX) -> Expanded:
    """Run a program, without a machine.

    Raises:
        JobError: an O word or an expression that cannot be, or a program that depends on what is not known.
    """
    handle = library.expand_create(text, len(text), start, lines_max)
    if not handle:
        raise MemoryError("expand_create")
    try:
        if code := library.expand_error(handle):
            place = f"{name}:{library.expand_error_line(handle)}"
            raise JobError(f"{place}: error:{code} {ERRORS[code]}", hint=HINTS.get(code) or refusal_hint(code))
        size = c_size_t()
        numbers = POINTER(c_uint32)()
        data = library.expand_text(handle, ctypes.byref(size))
        count = library.expand_lines(handle, ctypes.byref(numbers))
        text = ctypes.string_at(data, size.value) if size.value else b""
        said = library.expand_comments(handle, ctypes.byref(size))
        comments = ctypes.string_at(said, size.value) if size.value else b""
        return Expanded(text, tuple(numbers[:count]), comments, library.expand_end(handle).contents.ending)
    finally:
        library.expand_destroy(handle)


def needs_expansion(library: ctypes.CDLL, text: bytes) -> bool:
    """It has O words: a stream cannot jump."""
    return bool(library.expand_is_needed(text, len(text)))


def load_expand(path: Path) -> ctypes.CDLL:
    """Load the host library and tell ctypes the types of expand.h. Raises BuildError."""
    types: dict[str, tuple[object, tuple[object, ...]]] = {
        "expand_create": (c_void_p, (c_char_p, c_size_t, c_int, c_uint32)),
        "expand_destroy": (None, (c_void_p,)),
        "expand_error": (c_int, (c_void_p,)),
        "expand_error_line": (c_uint32, (c_void_p,)),
        "expand_text": (c_void_p, (c_void_p, POINTER(c_size_t))),
        "expand_comments": (c_void_p, (c_void_p, POINTER(c_size_t))),
        "expand_lines": (c_size_t, (c_void_p, POINTER(POINTER(c_uint32)))),
        "expand_end": (POINTER(ProgramEnd), (c_void_p,)),
        "expand_is_needed": (c_int, (c_char_p, c_size_t)),
    }
    try:
        library = ctypes.CDLL(str(path))
        for name, (result, arguments) in types.items():
            function = getattr(library, name)
            function.restype, function.argtypes = result, arguments
    except (OSError, AttributeError) as err:
        raise BuildError(f"{path.name} cannot be used: {err}", hint="`wificnc build host` builds it again") from err
    return library
