"""The lints that keep core/machine in parts: they find what they are for."""

from __future__ import annotations

from pathlib import Path

import pytest
from lint.circles import check_circles, check_firmware
from lint.owners import check_owners


def write(root: Path, name: str, text: str) -> None:
    path = root / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


@pytest.mark.parametrize(
    ("line", "whose"),
    [
        ("machine->overrides.feed_pct = 100;", "overrides"),
        ("machine->task.stage = TASK_NONE;", "task"),
        ("machine->trust.losses++;", "drive"),
        ("machine->edges.latch[FIRST_MOTOR] |= 1;", "inputs"),
        ("    struct machine_outputs *outputs = &machine->outputs;", "outputs"),
    ],
)
def test_a_part_is_written_by_its_owner_alone(tmp_path: Path, line: str, whose: str) -> None:
    write(tmp_path, "core/machine/other.c", line + "\n")
    (problem,) = check_owners(tmp_path)
    assert f"{whose}.c" in problem.message
    (tmp_path / "core/machine/other.c").rename(tmp_path / f"core/machine/{whose}.c")
    assert check_owners(tmp_path) == []


@pytest.mark.parametrize(
    "line",
    [
        "if (machine->task.stage == TASK_NONE)",
        "    const struct machine_outputs *outputs = &machine->outputs;",
        "machine->hal = hal;",
    ],
)
def test_reading_is_free(tmp_path: Path, line: str) -> None:
    write(tmp_path, "core/machine/other.c", line + "\n")
    assert check_owners(tmp_path) == []


def test_nobody_outside_sees_the_parts(tmp_path: Path) -> None:
    write(tmp_path, "core/session/other.c", '#include "machine/parts.h"\n')
    write(tmp_path, "targets/sim/monitor.c", '#include "machine/parts.h"\n')
    assert [problem.path.as_posix() for problem in check_owners(tmp_path)] == ["core/session/other.c"]


def test_a_circle_of_files_is_found(tmp_path: Path) -> None:
    for name, calls in {"a": "b", "b": "c", "c": "a", "d": "a", "e": "f", "f": "e"}.items():
        write(tmp_path, f"core/room/{name}.c", f"void {calls}(void);\nvoid {name}(void) {{\n    {calls}();\n}}\n")
    (problem,) = check_circles(tmp_path)
    assert "core/room/a, core/room/b, core/room/c" in problem.message


def test_an_inline_function_calls_for_its_room(tmp_path: Path) -> None:
    write(tmp_path, "core/room/a.h", "static inline void a_in(void) {\n    b();\n}\n")
    write(tmp_path, "core/room/a.c", "void a(void) {\n}\n")
    write(
        tmp_path,
        "core/room/b.c",
        "void c(void); /* prototypes and a() in comments are no calls */\nvoid b(void) {\n    c();\n}\n",
    )
    write(tmp_path, "core/room/c.c", "void c(void) {\n}\n")
    assert check_circles(tmp_path) == []
    write(tmp_path, "core/room/c.c", "void c(void) {\n    a_in();\n}\n")
    (problem,) = check_circles(tmp_path)
    assert "core/room/a, core/room/b, core/room/c" in problem.message


def test_what_no_firmware_calls_is_not_the_cores(tmp_path: Path) -> None:
    for name, calls in {"a": "b", "b": "a", "c": "d", "d": "c"}.items():
        write(tmp_path, f"core/room/{name}.c", f"void {calls}(void);\nvoid {name}(void) {{\n    {calls}();\n}}\n")
    write(tmp_path, "targets/pic32mz/main.c", "int main(void) {\n    a();\n}\n")
    write(tmp_path, "targets/pc/main.c", "int main(void) {\n    c();\n}\n")
    assert [problem.path.name for problem in check_firmware(tmp_path)] == ["c.c", "d.c"]
