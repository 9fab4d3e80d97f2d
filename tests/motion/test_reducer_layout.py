"""tools/motion/reducer.py has struct reduce as C has it: what it left out, C would write into other memory."""

from __future__ import annotations

import ctypes

from layouts import HOST
from motion.reducer import Reduce


def test_its_structure_is_that_of_c() -> None:
    in_c = HOST._found("structs", "reduce")  # it has vectors, which ctypes cannot express
    assert ctypes.sizeof(Reduce) == in_c["size"]
    assert {name: getattr(Reduce, name).offset for name, _ in Reduce._fields_} == {
        row["name"]: row["at"] for row in in_c["fields"]
    }
