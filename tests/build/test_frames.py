"""A stack frame above its limit is an error in each build, whatever its compiler."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from wificnc.build import frames
from wificnc.build.checkout import checkout_root
from wificnc.build.cross import compile_for
from wificnc.build.host import SANITIZED, VARIANTS
from wificnc.build.mips import MipsCompiler, find_compiler
from wificnc.build.pic32mz import _unit
from wificnc.build.platforms import PLATFORMS
from wificnc.errors import BuildError

ROOT = checkout_root()

# As the step interrupt's own memory was cleared: a temporary as large as the structure.
TEMPORARY = "struct step { void *hal; char pool[%d]; };\nvoid step_init(struct step *step, void *hal);\n" + (
    "void fill(char *bytes);\nvoid step_init(struct step *step, void *hal) {\n"
    "    struct step own;\n    fill(own.pool);\n    own.hal = hal;\n    step->hal = own.pool;\n}\n"
)


def compiled(command: list[str], source: Path) -> subprocess.CompletedProcess[str]:
    argv = [*command, "-c", str(source), "-o", str(source.with_suffix(".o"))]
    return subprocess.run(argv, capture_output=True, text=True)


def mips_compilers() -> list[MipsCompiler]:
    found = []
    for name in ("gcc", "zig"):
        try:
            found.append(find_compiler(name))  # type: ignore[arg-type]
        except BuildError:
            continue
    return found


@pytest.mark.parametrize("name", ["core/step/control.c", "core/settings/store.c", "targets/net/net_hub.c"])
def test_the_firmware_of_the_pic32mz(tmp_path: Path, name: str) -> None:
    limit = frames.frame_limit(ROOT / name, ROOT)
    for compiler in mips_compilers():
        flags = [*compiler.flags, *_unit(ROOT, tmp_path, compiler, ROOT / name).flags]
        command = [*compiler.argv, *flags, "-fno-lto", "-O1", "-Wno-dangling-pointer"]
        for size, good in ((limit // 2, True), (limit + 64, False), (43_000, False)):
            (tmp_path / "one.c").write_text(TEMPORARY % size)
            run = compiled(command, tmp_path / "one.c")
            assert (run.returncode == 0) == good, (compiler.name, size, run.stderr)
            assert good or "frame" in run.stderr


def test_the_pc_by_zig(tmp_path: Path) -> None:
    """Wheels are built like this; the host build has the same flags of the same function."""
    source = tmp_path / "core" / "one.c"
    source.parent.mkdir()
    source.write_text(TEMPORARY % 43_000)
    with pytest.raises(BuildError, match="frame"):
        compile_for(PLATFORMS["linux-x86_64"], [source], tmp_path)


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")
def test_gcc_takes_the_limit_with_the_error(tmp_path: Path) -> None:
    (tmp_path / "one.c").write_text(TEMPORARY % 43_000)
    run = compiled(["gcc", *frames.pc_frame_flags(tmp_path / "one.c", tmp_path, family="gcc")], tmp_path / "one.c")
    assert run.returncode != 0 and "frame" in run.stderr


def test_the_esp32s_build_has_the_largest_limit() -> None:
    """tools/xtensa has the limit of each file; ESP-IDF's build one for all."""
    options = (ROOT / "targets/esp32/board.cmake").read_text(encoding="utf-8")
    found = re.findall(r"-Werror=frame-larger-than=(\d+)", options)
    assert found == [str(frames.firmware_limit("esp32"))]


def test_exceptions_are_few_and_of_files_that_exist() -> None:
    assert len(frames.LARGER) < 12
    for name, (size, reason) in frames.LARGER.items():
        assert (ROOT / name).exists() and size > frames.FRAME_BYTES and reason
    assert set(SANITIZED) < set(VARIANTS)
