"""Building the host library in a small checkout: what is compiled when, and what a failure says."""

from __future__ import annotations

import ctypes
import os
import threading
import time
from pathlib import Path

import pytest
from wificnc.build import host
from wificnc.build.host import HostBuild, build_host, ensure_host_library
from wificnc.errors import BuildError

ROOT = Path(__file__).resolve().parents[2]

SOURCES = {
    "core/config.h": "#define ANSWER 42\n",
    "core/base/a.h": '#include "config.h"\nint a(void);\n',
    "core/base/a.c": '#include "base/a.h"\nint a(void) {\n    return ANSWER;\n}\n',
    "core/base/b.c": "int b(void);\nint b(void) {\n    return 1;\n}\n",
    "targets/pc/c.c": '#include "base/a.h"\nint c(void);\nint c(void) {\n    return a() + 1;\n}\n',
    "targets/pc/main.c": "int main(void) {\n    return 0;\n}\n",
}


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    for name, text in SOURCES.items():
        put(tmp_path, name, text)
    return tmp_path


def put(tree: Path, name: str, text: str) -> None:
    """Write a file and date it a moment ahead, as an edit after the last build would be on any file system."""
    path = tree / name
    path.parent.mkdir(parents=True, exist_ok=True)
    is_edit = path.exists()
    path.write_text(text)
    if is_edit:
        soon = time.time() + 1
        os.utime(path, (soon, soon))


def build(tree: Path, variant: str = "release") -> HostBuild:
    return build_host(variant, root=tree)


def call(result: HostBuild, function: str) -> int:
    return int(getattr(ctypes.CDLL(str(result.library)), function)())


def test_first_build_compiles_all_but_main(tree: Path) -> None:
    result = build(tree)
    assert (result.sources, result.compiled, result.warnings) == (3, 3, "")
    assert call(result, "c") == 43


def test_second_build_does_nothing(tree: Path) -> None:
    build(tree)
    stamp = (tree / "build/host" / host.LIBRARY_NAME).stat().st_mtime_ns
    result = build(tree)
    assert result.compiled == 0 and result.library.stat().st_mtime_ns == stamp


def test_edited_source_alone_is_compiled(tree: Path) -> None:
    build(tree)
    put(tree, "core/base/b.c", SOURCES["core/base/b.c"].replace("1", "2"))
    assert build(tree).compiled == 1


def test_edited_header_recompiles_who_includes_it(tree: Path) -> None:
    build(tree)
    put(tree, "core/config.h", "#define ANSWER 50\n")
    result = build(tree)
    assert result.compiled == 2  # a.c and c.c, through a.h; not b.c


def test_vanished_header_is_no_crash(tree: Path) -> None:
    build(tree)
    put(tree, "core/base/a.c", "int a(void);\nint a(void) {\n    return 7;\n}\n")
    put(tree, "targets/pc/c.c", "int c(void);\nint c(void) {\n    return 8;\n}\n")
    (tree / "core/base/a.h").unlink()
    assert build(tree).compiled == 2


def test_new_and_removed_sources_change_the_library(tree: Path) -> None:
    build(tree)
    put(tree, "core/base/d.c", "int d(void);\nint d(void) {\n    return 5;\n}\n")
    result = build(tree)
    assert result.compiled == 1 and call(result, "d") == 5
    (tree / "core/base/b.c").unlink()
    before = result.library.stat().st_mtime_ns
    result = build(tree)
    assert result.sources == 3 and result.library.stat().st_mtime_ns != before


def test_other_flags_compile_all_again(tree: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    build(tree)
    monkeypatch.setitem(host.VARIANTS, "release", (("-O1",), ()))
    assert build(tree).compiled == 3


def test_failure_shows_the_compilers_first_error(tree: Path) -> None:
    put(tree, "core/base/b.c", "int b(void);\nint b(void) {\n    return nonsense;\n}\n")
    with pytest.raises(BuildError) as caught:
        build(tree)
    assert "1 of 3 files did not compile" in caught.value.message
    assert "b.c:3" in caught.value.message and "nonsense" in caught.value.message


def test_failure_is_not_remembered(tree: Path) -> None:
    put(tree, "core/base/b.c", "int b(void) {")
    with pytest.raises(BuildError):
        build(tree)
    put(tree, "core/base/b.c", SOURCES["core/base/b.c"])
    assert call(build(tree), "b") == 1


def test_warning_of_a_known_compiler_is_an_error(tree: Path) -> None:
    put(
        tree,
        "core/base/b.c",
        "int b(int a);\nint b(int a) {\n    short s = (short)a;\n    char t = s;\n    return t;\n}\n",
    )
    if not build_compiler_is_known(tree):
        pytest.skip("this machine's compiler is newer than those we know")
    with pytest.raises(BuildError, match="onversion"):
        build(tree)


def build_compiler_is_known(tree: Path) -> bool:
    from wificnc.build.compiler import identify_compiler, locate_compiler

    return identify_compiler(locate_compiler()).is_known_clean


def test_warning_of_a_newer_compiler_is_shown(tree: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("wificnc.build.compiler.NEWEST_CLEAN", {})
    put(tree, "core/base/b.c", "int b(int a);\nint b(int a) {\n    char t = a;\n    return t;\n}\n")
    result = build(tree)
    assert result.compiled == 3 and "onversion" in result.warnings


def test_two_builders_take_turns(tree: Path) -> None:
    results: list[HostBuild] = []
    threads = [threading.Thread(target=lambda: results.append(build(tree))) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(result.compiled for result in results) == [0, 0, 0, 3]


def test_variants_live_apart(tree: Path) -> None:
    plain = build(tree)
    checked = build(tree, "tsan")
    assert checked.library.parent.name == "tsan" and plain.library.exists()
    assert build(tree).compiled == 0


def test_unknown_variant(tree: Path) -> None:
    with pytest.raises(BuildError, match="unknown variant 'fast'"):
        build(tree, "fast")


def test_outside_a_checkout(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("wificnc.build.checkout.find_checkout", lambda: None)
    with pytest.raises(BuildError, match="C sources are missing") as caught:
        ensure_host_library()
    assert "git clone" in str(caught.value.hint)


def test_our_core_fits_its_budget() -> None:
    """Static RAM with 50 ms of motion, its stop, and the states to plan it again; the chips have 512 KB."""
    assert 8 * 1024 < host.core_ram_bytes(ensure_host_library()) <= 192 * 1024


def test_broken_library_says_so(tmp_path: Path) -> None:
    (tmp_path / "x.so").write_text("no library")
    with pytest.raises(BuildError, match=r"x\.so cannot be used"):
        host.core_ram_bytes(tmp_path / "x.so")
