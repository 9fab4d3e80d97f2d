"""Text -> block: words and codes come back as they were written."""

from __future__ import annotations

import re
from ctypes import CDLL, byref

from gcode_core import ROOT, Block
from hypothesis import given
from hypothesis import strategies as st

FREE = "ABCIJKLRXYZ"
NOT_NEGATIVE = "FHNPQST"
CODE_ROW = re.compile(r"^CODE\((\w),\s*(\d+),\s*(\w+),\s*([\w()| ]+?),\s*(AXES_\w+),", re.MULTILINE)
CODES = [
    (f"{letter}{int(x10) // 10}" + (f".{int(x10) % 10}" if int(x10) % 10 else ""), group, axes)
    for letter, x10, group, _, axes in CODE_ROW.findall((ROOT / "core/gcode/codes.def").read_text())
]


def number_texts(negative: bool) -> st.SearchStrategy[str]:
    """Numbers as people and CAM write them: up to 9 digits, 6 decimals."""
    sign = "[+-]?" if negative else r"\+?"
    return st.from_regex(sign + r"([0-9]{1,9}(\.[0-9]{0,6})?|\.[0-9]{1,6})", fullmatch=True)


@st.composite
def lines(draw: st.DrawFn) -> tuple[list[str], dict[str, str], list[str]]:
    """Parts of a line in any order, its words, and its codes: one of each group, one that takes axes."""
    letters = draw(st.lists(st.sampled_from(FREE + NOT_NEGATIVE), unique=True))
    words = {letter: draw(number_texts(letter in FREE)) for letter in letters}
    if "T" in words:
        words["T"] = str(draw(st.integers(0, 255)))
    chosen: list[tuple[str, str, str]] = []
    for code in draw(st.lists(st.sampled_from(CODES), max_size=8)):
        groups = {group for _, group, _ in chosen}
        takes_axes = any(axes != "AXES_FREE" for *_, axes in chosen)
        if code[1] not in groups and not (takes_axes and code[2] != "AXES_FREE"):
            chosen.append(code)
    codes = [_spelled(draw, text) for text, *_ in chosen]
    parts = draw(st.permutations([*(letter + number for letter, number in words.items()), *codes]))
    return parts, words, [group for _, group, _ in chosen]


def _spelled(draw: st.DrawFn, code: str) -> str:
    """G1 G01 G1. G1.0: one code, many spellings."""
    zeros = "0" * draw(st.integers(0, 2))
    tail = draw(st.sampled_from(["", "0"] if "." in code else ["", ".", ".0", ".00"]))
    return code[0] + zeros + code[1:] + tail


@given(lines())
def test_round_trip(lib: CDLL, line: tuple[list[str], dict[str, str], list[str]]) -> None:
    parts, words, groups = line
    block = Block()
    assert lib.gcode_parse("".join(parts).encode(), byref(block)) == 0
    assert block.words == sum(1 << ord(letter) - ord("A") for letter in words)
    assert {letter: block.number[ord(letter) - ord("A")] for letter in words} == {
        letter: float(number) for letter, number in words.items()
    }
    assert block.groups.bit_count() == len(groups)


def test_the_table_is_read_whole() -> None:
    rows = (ROOT / "core/gcode/codes.def").read_text().count("\nCODE(")
    assert len(CODES) == rows > 40
    assert len({code for code, *_ in CODES}) == rows


def test_only_codes_of_the_table_are_known(lib: CDLL) -> None:
    known = {code for code, *_ in CODES}
    for letter in "GM":
        for x10 in range(1100):
            code = f"{letter}{x10 // 10}" + (f".{x10 % 10}" if x10 % 10 else "")
            status = lib.gcode_parse(code.encode(), byref(Block()))
            assert (status == 0) == (code in known), code
            assert status in (0, 20, 23)


def test_hundredths_are_no_code(lib: CDLL) -> None:
    for x100 in range(11000):
        if x100 % 10:
            assert lib.gcode_parse(b"G%d.%02d" % divmod(x100, 100), byref(Block())) in (20, 23)
