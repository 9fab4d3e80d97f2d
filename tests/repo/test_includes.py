"""The include-direction lint: what it lets through, and each thing it must catch."""

from __future__ import annotations

from graphlib import TopologicalSorter
from pathlib import Path

import pytest
from lint.includes import ALLOWED, TARGETS, check_includes
from tools_here import needs_git

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A small core with one header in every room."""
    for room in ALLOWED:
        (tmp_path / "core" / room).mkdir(parents=True)
        (tmp_path / "core" / room / f"{room}.h").write_text("int x;\n")
    (tmp_path / "core" / "config.h").write_text("\n")
    return tmp_path


def lint_one(tree: Path, name: str, text: str) -> list[str]:
    (tree / name).write_text(text)
    return [problem.message for problem in check_includes(tree)]


@pytest.mark.parametrize(
    ("name", "include"),
    [
        ("core/motion/a.c", '"segment/segment.h"'),
        ("core/motion/a.c", '"base/base.h"'),
        ("core/step/a.c", '"hal/hal_step.h"'),
        ("core/hal/contract.c", '"hal/hal_step.h"'),
        ("core/settings/a.c", '"gcode/status.h"'),
        ("core/machine/a.c", '"gcode/gcode.h"'),
        ("core/input/a.c", '"config.h"'),
        ("core/base/a.c", "<math.h>"),
    ],
)
def test_include_along_the_data_is_allowed(tree: Path, name: str, include: str) -> None:
    assert lint_one(tree, name, f"#include {include}\n") == []


@pytest.mark.parametrize(
    ("name", "include", "message"),
    [
        ("core/segment/a.c", '"motion/motion.h"', 'core/segment may not include "motion/motion.h"'),
        ("core/gcode/a.c", '"machine/machine.h"', 'core/gcode may not include "machine/machine.h"'),
        ("core/base/a.c", '"gcode/gcode.h"', 'core/base may not include "gcode/gcode.h"'),
        ("core/settings/a.c", '"gcode/gcode.h"', "it may include: settings, base, gcode/status.h"),
        ("core/motion/a.c", '"host.h"', '"host.h" is not the core\'s'),
        ("core/motion/a.c", '"../../targets/pc/host.h"', "is not the core's"),
        ("core/motion/a.c", '"motion/absent.h"', "is not in core/"),
        ("core/motion/a.c", "<stdio.h>", "the core prints nothing"),
        ("core/motion/a.c", "<stdlib.h>", "the core does not allocate"),
        ("core/motion/a.c", "<pthread.h>", "no operating system"),
    ],
)
def test_other_include_is_caught(tree: Path, name: str, include: str, message: str) -> None:
    (found,) = lint_one(tree, name, f"int a;\n#include {include}\n")
    assert message in found


TARGET_HEADERS = {"chip": "task_periods.h", "net": "net_hub.h", "esp32": "io/inputs.h", "pc": "host.h", "sim": "sim.h"}


@pytest.fixture
def targets(tree: Path) -> Path:
    """Targets with one header each."""
    for target, name in TARGET_HEADERS.items():
        path = tree / "targets" / target / name
        path.parent.mkdir(parents=True)
        path.write_text("int x;\n")
    return tree


@pytest.mark.parametrize(
    ("name", "include"),
    [("sim/a.c", "host.h"), ("pc/a.c", "net_hub.h"), ("pc/a.c", "host.h"), ("esp32/io/a.c", "inputs.h"),
     ("esp32/net/a.c", "io/inputs.h"), ("net/a.c", "base/base.h"), ("esp32/net/a.c", "driver/gpio.h")],
)  # fmt: skip
def test_a_target_includes_what_is_below_it(targets: Path, name: str, include: str) -> None:
    (targets / "targets/esp32/net").mkdir()
    assert lint_one(targets, f"targets/{name}", f'#include "{include}"\n') == []


@pytest.mark.parametrize(
    ("name", "include", "whose"),
    [("pc/a.c", "sim.h", "sim"), ("net/a.c", "host.h", "pc"), ("chip/a.c", "io/inputs.h", "esp32")],
)
def test_a_target_that_includes_upwards_is_caught(targets: Path, name: str, include: str, whose: str) -> None:
    (found,) = lint_one(targets, f"targets/{name}", f'#include "{include}"\n')
    assert f'may not include "{include}" of {whose}' in found


def test_a_header_that_each_target_supplies_is_free(targets: Path) -> None:
    for target in ("esp32", "pc"):
        (targets / "targets" / target / "sizes.h").write_text("int x;\n")
    assert lint_one(targets, "targets/net/a.c", '#include "sizes.h"\n') == []


def test_a_new_target_may_include_no_other_one(targets: Path) -> None:
    (targets / "targets/attic").mkdir(parents=True)
    (targets / "targets/net/sockets.h").write_text("int x;\n")
    assert lint_one(targets, "targets/attic/a.c", "int a;\n") == []
    assert "may not include" in lint_one(targets, "targets/attic/a.c", '#include "sockets.h"\n')[0]


def test_no_two_rooms_include_each_other() -> None:
    TopologicalSorter(TARGETS).prepare()
    TopologicalSorter({room: {name.split("/")[0] for name in names} for room, names in ALLOWED.items()}).prepare()


def test_problem_names_file_and_line(tree: Path) -> None:
    (tree / "core/segment/a.c").write_text('int a;\n#include "step/step.h"\n')
    (problem,) = check_includes(tree)
    assert str(problem).startswith("core/segment/a.c:2: ")


def test_allocation_is_caught_even_without_its_header(tree: Path) -> None:
    assert lint_one(tree, "core/base/a.c", "void *f(void) {\n    return malloc(4);\n}\n") == [
        "malloc() has no place in the core"
    ]


def test_allocation_in_a_comment_is_only_talk(tree: Path) -> None:
    assert lint_one(tree, "core/base/a.c", "int a; /* no malloc() here */\n/* never\n * free() it */\n") == []


def test_new_room_needs_its_line(tree: Path) -> None:
    (tree / "core/attic").mkdir()
    assert "no known room" in lint_one(tree, "core/attic/a.c", "int a;\n")[0]


@needs_git
def test_our_core_follows_the_data() -> None:
    assert check_includes(ROOT) == []
