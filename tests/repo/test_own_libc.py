"""The PIC32MZ's own C library has what its firmware calls: seen without a cross compiler."""

from __future__ import annotations

import re

import pytest
from wificnc.build.checkout import checkout_root
from wificnc.build.pic32mz import FOLDERS

STRING_CALL = re.compile(r"\b((?:mem|strn?)(?:r?chr|cmp|cpy|move|set|cat|c?spn|len|pbrk|str|tok))\(")
MATH_CALL = re.compile(
    r"(?<![\w.>])((?:a?(?:cos|sin|tan)h?|atan2|cbrt|ceil|copysign|exp2?|expm1|fabs|fdim|floor|fma|fmax|fmin|fmod|frexp|"
    r"hypot|l?l?r(?:ound|int)|ldexp|log(?:10|1p|2|b)?|modf|nearbyint|pow|remainder|scalbn|sqrt|trunc)f?)\("
)


@pytest.mark.parametrize(("header", "call_of"), [("string.h", STRING_CALL), ("math.h", MATH_CALL)])
def test_it_has_what_the_firmware_calls(header: str, call_of: re.Pattern[str]) -> None:
    """A function that only a computer's C library has is an image that cannot be built."""
    root = checkout_root()
    declared = set(re.findall(r"(\w+)\(", (root / "targets/pic32mz/libc" / header).read_text(encoding="utf-8")))
    sources = [path for folder in FOLDERS for path in (root / folder).rglob("*.[ch]")]
    used = {
        name: path.name
        for path in sources
        for name in call_of.findall(re.sub(r"/\*.*?\*/|//[^\n]*", "", path.read_text(encoding="utf-8"), flags=re.S))
    }
    assert len(used) > 4
    assert {name: file for name, file in used.items() if name not in declared} == {}
