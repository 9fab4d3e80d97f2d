"""The same sources give the same object in any folder, also through targets/esp32, where most sources lie outside of
the project's folder."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import cmake
import pytest
from patience import HANG_S
from wificnc.board.header import pin_header_text
from wificnc.board.load import load_board
from wificnc.build.checkout import checkout_root
from wificnc.build.compiler import locate_compiler

ROOT = checkout_root()
SCRIPT = Path(__file__).with_name("options.cmake")
SOURCES = ("core/base/pow.c", "core/input/line_reader.c", "core/motion/path.c", "targets/esp32/io/pin_map.c")
# Says its own place, as ESP_ERROR_CHECK and assert() do.
PLACE = "targets/chip/place.c"


def copy(to: Path) -> Path:
    for folder in ("core", "targets"):
        shutil.copytree(ROOT / folder, to / folder)
    (to / PLACE).write_text("const char *place(void) { return __FILE__; }\n")
    generated = to / "targets/esp32/build/wificnc"
    generated.mkdir(parents=True)
    (generated / "pin_config.h").write_text(pin_header_text(load_board("esp32-wroom32")))
    return to


def options_of(tree: Path) -> list[str]:
    """What board.cmake adds; the program that it calls for headers does nothing here."""
    program = shutil.which("true") or "true"
    argv = [Path(cmake.CMAKE_BIN_DIR) / "cmake", f"-DTREE={tree}", f"-DWIFICNC_COMMAND={program}", "-P", SCRIPT]
    done = subprocess.run(argv, capture_output=True, text=True, timeout=HANG_S, check=False)
    assert done.returncode == 0, done.stderr
    return [line.removeprefix("-- option ") for line in done.stdout.splitlines() if line.startswith("-- option ")]


def idf_options(project: Path) -> list[str]:
    """Those of ESP-IDF v5.5.3, tools/cmake/prefix_map.cmake, for a build in the project's folder build."""
    return [
        f"-fmacro-prefix-map={project}=.",
        f"-fdebug-prefix-map={project}=/IDF_PROJECT",
        f"-fdebug-prefix-map={project}/build=/IDF_BUILD",
        f"-fdebug-prefix-map={project}/main=/COMPONENT_MAIN_DIR",
    ]


def objects(tree: Path, ours: bool) -> dict[str, bytes]:
    """Each source compiled as a build through targets/esp32 does, with debug information."""
    project, found = tree / "targets/esp32", {}
    options = [*idf_options(project), *(options_of(tree) if ours else [])]
    folders = [f"-I{tree / name}" for name in ("core", "targets/esp32", "targets/chip", "targets/esp32/build/wificnc")]
    flags = ["-std=gnu11", "-g", "-O2", "-w", *folders, *options]
    output = project / "build" / "one.o"
    for name in (*SOURCES, PLACE):
        argv = [*locate_compiler(), *flags, "-c", str(tree / name), "-o", str(output)]
        subprocess.run(argv, cwd=output.parent, timeout=HANG_S, check=True)
        found[name] = output.read_bytes()
    return found


@pytest.fixture(scope="module")
def trees(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    return copy(tmp_path_factory.mktemp("one")), copy(tmp_path_factory.mktemp("another") / "of_a_longer_name")


def test_two_folders_give_the_same_objects(trees: tuple[Path, Path]) -> None:
    first, second = (objects(tree, ours=True) for tree in trees)
    assert [name for name in first if first[name] != second[name]] == []
    for tree, made in zip(trees, (first, second), strict=True):
        assert not any(str(tree).encode() in data for data in made.values())


def test_without_our_options_they_differ(trees: tuple[Path, Path]) -> None:
    """So the test above sees what was wrong."""
    first, second = (objects(tree, ours=False) for tree in trees)
    assert {name for name in first if first[name] != second[name]} >= {"core/base/pow.c", PLACE}
