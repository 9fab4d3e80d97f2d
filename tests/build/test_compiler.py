"""Which compiler is taken, and what it is reported to be."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest
from wificnc.build.compiler import Compiler, locate_compiler, parse_version
from wificnc.errors import BuildError


def put_tool(directory: Path, name: str) -> Path:
    path = directory / name
    path.write_text("#!/bin/sh\n")
    path.chmod(0o755)
    return path


@pytest.mark.parametrize(
    ("present", "taken"), [(("cc", "gcc", "clang"), "cc"), (("clang", "gcc"), "gcc"), (("clang",), "clang")]
)
def test_first_of_the_usual_names(tmp_path: Path, present: tuple[str, ...], taken: str) -> None:
    for name in present:
        put_tool(tmp_path, name)
    assert locate_compiler({"PATH": str(tmp_path)}) == (str(tmp_path / taken),)


def test_cc_variable_wins_and_may_have_options(tmp_path: Path) -> None:
    put_tool(tmp_path, "cc")
    put_tool(tmp_path, "mycc")
    assert locate_compiler({"PATH": str(tmp_path), "CC": "mycc -m64"}) == ("mycc", "-m64")


def test_cc_variable_that_names_nothing(tmp_path: Path) -> None:
    with pytest.raises(BuildError, match="compiler not found: 'nothing'"):
        locate_compiler({"PATH": str(tmp_path), "CC": "nothing"})


def test_zig_of_pypi_when_there_is_no_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: object())
    assert locate_compiler({"PATH": str(tmp_path)}) == (sys.executable, "-m", "ziglang", "cc")


def test_no_compiler_says_how_to_get_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(BuildError) as caught:
        locate_compiler({"PATH": str(tmp_path)})
    assert "apt-get install gcc" in str(caught.value.hint) and "ziglang" in str(caught.value.hint)


VERSIONS = [
    ("gcc (Debian 12.2.0-14+deb12u1) 12.2.0\nCopyright", "gcc", "12.2.0", True),
    ("cc (Ubuntu 13.2.0-23ubuntu4) 13.2.0\n", "gcc", "13.2.0", True),
    ("x86_64-linux-gnu-gcc-14 (GCC) 14.1.0\n", "gcc", "14.1.0", True),
    ("gcc (GCC) 99.1.0\n", "gcc", "99.1.0", False),
    ("Debian clang version 14.0.6\nTarget: x86_64", "clang", "14.0.6", True),
    ("Apple clang version 15.0.0 (clang-1500.3.9.4)\n", "clang", "15.0.0", True),
    ("Tiny C Compiler\n", "unknown", "Tiny C Compiler", False),
]


@pytest.mark.parametrize(("text", "family", "version", "clean"), VERSIONS)
def test_version_is_read(text: str, family: str, version: str, clean: bool) -> None:
    compiler = parse_version(("cc",), text)
    assert (compiler.family, compiler.version, compiler.is_known_clean) == (family, version, clean)


def test_title_says_zig() -> None:
    assert Compiler(("python", "-m", "ziglang", "cc"), "clang", "20.1.2").title == "zig cc, clang 20.1.2"
