"""Every input that the fuzzers start from or once found, through the same harnesses, with any compiler."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest
from harnesses import HERE, NAMES, WITH_MACHINE, build_harness
from patience import BUILD_S
from slow import cases_but
from wificnc.build.checkout import checkout_root
from wificnc.build.compiler import locate_compiler
from wificnc.build.host import build_program

PLAIN, SANITIZED = "release", "asan"


def inputs(name: str) -> list[Path]:
    """What is committed for one harness."""
    return sorted(path for kind in ("corpus", "regressions") for path in (HERE / kind / name).glob("*"))


@pytest.fixture(scope="module")
def folder() -> Path:
    return checkout_root() / "build" / "tests" / "fuzz"


def replayed(folder: Path, name: str, variant: str, files: list[Path]) -> subprocess.CompletedProcess[str]:
    """Plain checks always; what sanitizers see is seen by make fuzz, and where the compiler is gcc or clang here."""
    build, alone = built_as(variant), name not in WITH_MACHINE
    program = build_harness(name, folder / build / name, build, HERE / "replay.c", alone=alone and build == SANITIZED)
    return subprocess.run([program, *files], capture_output=True, text=True, timeout=BUILD_S)


def built_as(variant: str) -> str:
    """zig brings no sanitizer runtime."""
    return PLAIN if "zig" in " ".join(locate_compiler()) else variant


def is_kept(name: str, variant: str) -> bool:
    """CI compiles the parsers with sanitizers; the whole controller takes a minute."""
    return (variant == PLAIN) == (name in WITH_MACHINE)


@pytest.mark.parametrize(("name", "variant"), cases_but(is_kept, NAMES, (PLAIN, SANITIZED)))
def test_committed_inputs(folder: Path, name: str, variant: str) -> None:
    files = inputs(name)
    run = replayed(folder, name, variant, files)
    assert run.returncode == 0, run.stderr
    assert run.stderr.splitlines() == [str(path) for path in files], "each was replayed"


@pytest.mark.slow  # the whole ones are looked at above
@pytest.mark.parametrize("name", NAMES)
def test_inputs_cut_anywhere(folder: Path, tmp_path: Path, name: str) -> None:
    """Half an input is an input too."""
    cut = []
    for path in inputs(name):
        data = path.read_bytes()
        for part in (0, 1, len(data) // 3, 2 * len(data) // 3):
            cut.append(tmp_path / f"{path.name}-{part}")
            cut[-1].write_bytes(data[:part])
    run = replayed(folder, name, SANITIZED, cut)
    assert run.returncode == 0, run.stderr


def test_a_false_claim_ends_the_run(folder: Path, tmp_path: Path) -> None:
    """A harness that cannot fail proves nothing."""
    liar = tmp_path / "liar.c"
    liar.write_text(
        '#include "fuzz.h"\n'
        "int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {\n"
        '    CLAIM(size == 0 || data[0] != 7, "a seven");\n    return 0;\n}\n'
    )
    seven = tmp_path / "seven"
    seven.write_bytes(b"\x07")
    program = build_program([liar, HERE / "replay.c"], tmp_path / "liar", built_as(SANITIZED), [f"-I{HERE}"], ())
    run = subprocess.run([program, seven], capture_output=True, text=True)
    assert run.returncode != 0 and "a seven" in run.stderr


def test_without_clang_it_says_what_to_install(tmp_path: Path) -> None:
    environment = {**os.environ, "PATH": str(tmp_path), "CLANG": ""}
    run = subprocess.run([sys.executable, HERE / "run.py"], env=environment, capture_output=True, text=True)
    assert run.returncode == 1
    assert "there is no clang here" in run.stderr and "apt-get install clang libclang-rt-dev" in run.stderr


def test_the_dictionary_knows_every_code(tmp_path: Path) -> None:
    spec = importlib.util.spec_from_file_location("fuzz_run", HERE / "run.py")
    assert spec and spec.loader
    fuzz_run = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(fuzz_run)
    words = fuzz_run.dictionary(tmp_path).read_text().splitlines()
    assert {'"G0"', '"G38.2"', '"G92.3"', '"M30"', '"X"'} <= set(words)
