"""The layouts that tests take from the compiler (tests/support/layouts.py)."""

from __future__ import annotations

import ctypes
from pathlib import Path

import pytest
from layouts import HOST, LayoutError, Layouts
from wificnc.build.host import ensure_host_library

HEADER = """
enum colour { RED = -1, GREEN = 5 };
struct unknown;
struct pair { double mm[2][3]; };
struct sample {
    char text[8];
    const char *name;
    _Bool on : 1;
    unsigned count : 7;
    enum colour colour;
    struct pair pair;
    struct sample *next;
    struct unknown *other;
    int (*call)(void *ctx, double mm);
};
struct wide { double v __attribute__((vector_size(32))); };
struct sample *sample_make(const char *name, struct unknown *other, const double mm[3], unsigned char flags);
static inline int sample_twice(int n) { return 2 * n; }
"""


def layouts(folder: Path, text: str = HEADER) -> Layouts:
    (folder / "sample.h").write_text(text)
    return Layouts("test", [str(folder)], [])


def test_a_structure_has_the_fields_of_c(tmp_path: Path) -> None:
    sample = layouts(tmp_path).struct("sample")
    made = sample(b"seven", b"name", True, 100, -1)
    made.pair.mm[1][2] = 2.5
    assert (made.text, made.name, made.on, made.count, made.colour) == (b"seven", b"name", True, 100, -1)
    assert not made.call and not made.next and made.other is None
    assert sample.call.offset + ctypes.sizeof(ctypes.c_void_p) == ctypes.sizeof(sample) == 96


def test_a_field_that_c_does_not_have_is_an_error(tmp_path: Path) -> None:
    made = layouts(tmp_path).struct("sample")()
    with pytest.raises(AttributeError):
        made.colur = 1


def test_what_a_header_says_now_counts(tmp_path: Path) -> None:
    assert list(layouts(tmp_path).enum("colour")) == [-1, 5]
    assert list(layouts(tmp_path, HEADER.replace("RED = -1", "RED = 3")).enum("colour")) == [3, 5]


def test_a_prototype_has_the_types_of_c(tmp_path: Path) -> None:
    found = layouts(tmp_path)
    assert found.functions() == ["sample_make"]
    result, (name, other, mm, flags) = found.prototype("sample_make")
    assert (result, name, flags) == (ctypes.c_void_p, ctypes.c_char_p, ctypes.c_uint8)
    assert issubclass(other, ctypes.c_void_p) and issubclass(mm, ctypes.c_void_p)


@pytest.mark.parametrize("name", ["unknown", "nowhere", "wide"])
def test_what_cannot_be_had_is_named(tmp_path: Path, name: str) -> None:
    with pytest.raises(LayoutError, match="vector" if name == "wide" else name):
        layouts(tmp_path).struct(name)


def test_most_functions_of_the_host_library_are_declared() -> None:
    library = ctypes.CDLL(str(ensure_host_library()))
    assert sum(hasattr(library, name) for name in HOST.functions()) > 500
