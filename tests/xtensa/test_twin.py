"""An object that is taken from the other chip's folder is the one that would be compiled here."""

from __future__ import annotations

from pathlib import Path

import pytest
import xtensa.compile
from xtensa.compile import Object, compile_all
from xtensa.headers import Headers
from xtensa.toolchain import Toolchain

SOURCES = {"same.c": "int same(void) {\n    return 1;\n}\n", "own.c": '#include "pins.h"\nint own = PINS;\n'}


@pytest.fixture
def root(tmp_path: Path) -> Path:
    (tmp_path / "targets/esp32").mkdir(parents=True)
    (tmp_path / "targets/esp32/board.cmake").write_text('wificnc_call0 INCLUDE REGEX "none"')
    for name, text in SOURCES.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def compiled(
    tools: Toolchain, root: Path, chip: str, pins: int, twin: str = "", flags: tuple[str, ...] = ()
) -> dict[str, Object]:
    output = root / chip
    output.mkdir(exist_ok=True)
    (output / "pins.h").write_text(f"#define PINS {pins}\n")
    sources = [root / name for name in SOURCES]
    objects = compile_all(tools, root, Headers(output, (), flags), sources, output, root / twin if twin else None)
    assert not [made.said for made in objects if made.said]
    return {made.source.name: made for made in objects}


@pytest.fixture
def ran(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The sources that clang has compiled."""
    found: list[str] = []
    run = xtensa.compile._run

    def watched(command: list[str]) -> object:
        found.extend(Path(command[-1]).name for _ in [0] if command[-1].endswith(".c"))
        return run(command)

    monkeypatch.setattr(xtensa.compile, "_run", watched)
    return found


def test_only_what_reads_generated_headers_is_compiled_twice(tools: Toolchain, root: Path, ran: list[str]) -> None:
    first = compiled(tools, root, "chip", 3)
    ran.clear()
    second = compiled(tools, root, "chips3", 4, twin="chip")
    assert ran == ["own.c"]
    assert second["same.c"].path.read_bytes() == first["same.c"].path.read_bytes()
    assert second["same.c"].assembly.read_bytes() == first["same.c"].assembly.read_bytes()
    assert second["own.c"].assembly.read_text() != first["own.c"].assembly.read_text()
    ran.clear()
    compiled(tools, root, "chips3", 4)
    assert ran == []


def test_a_changed_source_or_command_is_compiled(tools: Toolchain, root: Path, ran: list[str]) -> None:
    compiled(tools, root, "chip", 3)
    (root / "same.c").write_text("int same(void) {\n    return 2;\n}\n")
    ran.clear()
    changed = compiled(tools, root, "chips3", 4, twin="chip")["same.c"]
    assert sorted(ran) == ["own.c", "same.c"] and ", 2" in changed.assembly.read_text()
    compiled(tools, root, "chip", 3)
    ran.clear()
    compiled(tools, root, "third", 4, twin="chip", flags=("-DOTHER",))
    assert sorted(ran) == ["own.c", "same.c"]
