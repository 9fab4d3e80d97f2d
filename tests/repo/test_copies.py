"""Large structures are not copied by value: the lint finds each way to do it, with the compiler of this machine."""

from __future__ import annotations

from pathlib import Path

import pytest
from lint.copies import MAX_BYTES, check_copies, check_file
from wificnc.build.checkout import checkout_root
from wificnc.build.cross import zig_cc

HEAD = "#include <string.h>\nstruct room { int *hal; char bytes[%d]; };\nstruct room a, b;\n"
BY_VALUE = {
    "temporary": "void f(struct room *r, int *hal) { *r = (struct room){.hal = hal}; }",
    "assignment": "void f(struct room *r) { a = *r; }",
    "local copy": "int f(const struct room *r) { struct room own = *r; return own.bytes[2]; }",
    "returned": "struct room f(void) { return a; }",
    "argument": "int g(struct room r); int f(void) { return g(a); }",
}
IN_PLACE = {
    "cleared": "void f(struct room *r, int *hal) { memset(r, 0, sizeof *r); r->hal = hal; }",
    "copied": "void f(struct room *r) { memcpy(&a, r, sizeof a); }",
    "by pointer": "int g(const struct room *r); int f(void) { return g(&a); }",
}


def found(tmp_path: Path, code: str, size: int) -> list[str]:
    (tmp_path / "one.c").write_text(HEAD % size + code + "\n")
    return [str(problem) for problem in check_file(zig_cc(), tmp_path, Path("one.c"))]


@pytest.mark.parametrize("way", BY_VALUE)
def test_a_large_one_is_found(tmp_path: Path, way: str) -> None:
    (said,) = found(tmp_path, BY_VALUE[way], MAX_BYTES)
    assert said.startswith("one.c:4: ") and "by value" in said


@pytest.mark.parametrize("code", [*IN_PLACE.values(), BY_VALUE["assignment"].replace("a = *r", "a.hal = r->hal")])
def test_in_place_is_good(tmp_path: Path, code: str) -> None:
    assert found(tmp_path, code, 40_000) == []


def test_a_small_one_is_good(tmp_path: Path) -> None:
    assert found(tmp_path, BY_VALUE["assignment"], MAX_BYTES - 8) == []


@pytest.mark.slow
def test_the_core_has_none() -> None:
    assert check_copies(checkout_root()) == []
