"""Wheels for one kind of computer: the package, and a library and a server program that need no compiler."""

from __future__ import annotations

import base64
import csv
import hashlib
import io
import json
import os
import re
import socket
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest
from elftools.elf.elffile import ELFFile
from installed import missing
from packaging.utils import parse_wheel_filename
from patience import BUILD_S, HANG_S
from release_tree import ROOT, Tree
from slow import deep_but
from wificnc import __version__
from wificnc.build.host import ensure_host_library
from wificnc.build.platforms import PLATFORMS
from wificnc.firmware.release.plan import Source, plan_release
from wificnc.firmware.release.wheel import native_files, platform_wheel, wheel_tag
from wificnc.simulator.run import SimOptions, simulate
from wificnc.simulator.serve.server import serve_program

HERE = "linux-x86_64"
IS_HERE = sys.platform == "linux" and os.uname().machine == "x86_64"
JOB, PROFILE = ROOT / "examples" / "pcb_outline.nc", ROOT / "examples" / "machines" / "shapeoko3.toml"
LARGEST_MB = 4.0  # without firmware and page
ONE_OF_EACH_SYSTEM = (HERE, "macos-arm64", "windows-x86_64")
FILES = {  # what a wheel has and the package for all computers has not
    "linux": {"wificnc/native/libwificnc.so", "wificnc/native/wificnc-serve"},
    "macos": {"wificnc/native/libwificnc.dylib", "wificnc/native/wificnc-serve"},
    "windows": {"wificnc/native/wificnc.dll", "wificnc/native/wificnc-serve.exe"},
}


def wanted_files(name: str) -> set[str]:
    return FILES[name.partition("-")[0]]


def pure_wheel(dist: Path) -> Path:
    return dist / f"wificnc-{__version__}-py3-none-any.whl"


def check_wheel(data: bytes, pure: Path, name: str) -> None:
    """The package's files as they are, this platform's next to them, and their sums."""
    info = f"wificnc-{__version__}.dist-info"
    changed = {f"{info}/WHEEL", f"{info}/RECORD"}
    with zipfile.ZipFile(io.BytesIO(data)) as wheel, zipfile.ZipFile(pure) as package:
        assert wheel.testzip() is None
        names = wheel.namelist()
        assert len(names) == len(set(names)) and names[-1] == f"{info}/RECORD"
        assert set(names) == set(package.namelist()) | wanted_files(name)
        assert all(wheel.read(each) == package.read(each) for each in set(package.namelist()) - changed)
        said = wheel.read(f"{info}/WHEEL").decode().splitlines()
        assert f"Tag: {wheel_tag(PLATFORMS[name])}" in said and "Root-Is-Purelib: false" in said
        assert sum(line.startswith("Tag:") for line in said) == 1
        rows = {row[0]: row[1:] for row in csv.reader(io.StringIO(wheel.read(f"{info}/RECORD").decode()))}
        assert rows.pop(f"{info}/RECORD") == ["", ""] and set(rows) == set(names) - {f"{info}/RECORD"}
        for each, (digest, size) in rows.items():
            sha256 = base64.urlsafe_b64encode(hashlib.sha256(wheel.read(each)).digest()).decode().rstrip("=")
            assert (digest, size) == (f"sha256={sha256}", str(len(wheel.read(each)))), each
        modes = {wheel.getinfo(each).external_attr >> 16 for each in wanted_files(name)}
        assert modes == {0o100755}  # pip makes them executable


@pytest.mark.slow
@pytest.mark.parametrize("name", deep_but(ONE_OF_EACH_SYSTEM.__contains__, sorted(PLATFORMS)))
def test_a_wheel_is_the_package_with_two_files_more(dist: Path, name: str) -> None:
    """Here two files that are no programs."""
    files = {each.rpartition("/")[2]: each.encode() for each in sorted(wanted_files(name))}
    data = platform_wheel(pure_wheel(dist), wheel_tag(PLATFORMS[name]), files)
    check_wheel(data, pure_wheel(dist), name)
    assert data == platform_wheel(pure_wheel(dist), wheel_tag(PLATFORMS[name]), files)


def test_a_release_plans_a_wheel_for_each_computer() -> None:
    plan = plan_release(Source(__version__, "abcdef012345", 1_700_000_000), [], {}, platforms=list(PLATFORMS))
    wheels = [name for asset in plan.assets if (name := asset.name).startswith("wificnc-") and name.endswith(".whl")]
    tags = {str(tag) for wheel in wheels for tag in parse_wheel_filename(wheel)[3]}
    assert tags == {"py3-none-any", *(f"py3-none-{platform.wheel_tag}" for platform in PLATFORMS.values())}


def test_an_unknown_computer_is_refused(tree: Tree) -> None:
    said = tree.release("--platforms", "linux-x86_64,amiga", "--dry-run", code=5).stderr
    assert "unknown platform: amiga" in said and "windows-arm64" in said


def check_promises(data: bytes, pure: Path, name: str, compiled_in: Path) -> None:
    """It is no larger than it may be, names no folder, and runs where its tag says."""
    check_wheel(data, pure, name)
    with zipfile.ZipFile(io.BytesIO(data)) as wheel:
        files = [wheel.read(each) for each in sorted(wanted_files(name))]
    added = len(data) - pure.stat().st_size
    print(f"{name}: {len(data) / 1e6:.2f} MB, {added / 1e6:.2f} MB more than the package for all")
    assert added < LARGEST_MB * 1e6
    assert all(str(compiled_in).encode() not in content for content in files)
    if name.startswith("linux"):
        assert max(needed_glibc(content) for content in files) <= promised_glibc(name)


@pytest.mark.deep
@pytest.mark.parametrize("name", sorted(PLATFORMS))
def test_a_compiled_wheel_has_what_it_promises(dist: Path, name: str) -> None:
    data = platform_wheel(pure_wheel(dist), wheel_tag(PLATFORMS[name]), native_files(ROOT, PLATFORMS[name]))
    check_promises(data, pure_wheel(dist), name, ROOT)


def promised_glibc(name: str) -> tuple[int, int]:
    """By the tag: manylinux2014 is manylinux_2_17 (PEP 600)."""
    tag = PLATFORMS[name].wheel_tag.replace("manylinux2014", "manylinux_2_17")
    found = re.match(r"manylinux_(\d+)_(\d+)_", tag)
    assert found
    return int(found[1]), int(found[2])


def needed_glibc(content: bytes) -> tuple[int, int]:
    """The newest version of the C library that a symbol of an ELF file asks for."""
    section = ELFFile(io.BytesIO(content)).get_section_by_name(".gnu.version_r")
    asked = [str(one.name) for _, versions in section.iter_versions() for one in versions]
    found = [re.fullmatch(r"GLIBC_(\d+)\.(\d+)(?:\.\d+)?", name) for name in asked]
    return max((int(one[1]), int(one[2])) for one in found if one)


@pytest.fixture(scope="module")
def wheel(tree: Tree, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of a release, for this computer."""
    if not IS_HERE:
        pytest.skip("another system than Linux on x86-64")
    made = tmp_path_factory.mktemp("wheels") / "dist"
    tree.release("--platforms", HERE, "--boards", "esp32s3-zero", "-o", made)
    (wheel,) = made.glob(f"*-{wheel_tag(PLATFORMS[HERE])}.whl")
    return wheel


@pytest.mark.deep  # it compiles all of it by zig; two files that are no programs stand for them above
def test_a_released_wheel_has_what_it_promises(wheel: Path, tree: Tree) -> None:
    check_promises(wheel.read_bytes(), pure_wheel(wheel.parent), HERE, tree.root)


@pytest.mark.deep  # it compiles all of it for a second time; test_the_same_commit_gives_the_same_bytes is deep, too
def test_another_folder_compiles_the_same_bytes(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as released:
        for name, content in native_files(ROOT, PLATFORMS[HERE]).items():
            assert released.read(f"wificnc/native/{name}") == content, name


@pytest.fixture(scope="module")
def wheel_made_here(dist: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """With what the tests' own compiler made for other tests, in place of what zig makes for a release."""
    native = {each.name: each.read_bytes() for each in (ensure_host_library(), serve_program())}
    assert {f"wificnc/native/{name}" for name in native} == wanted_files(HERE)
    name = f"wificnc-{__version__}-{wheel_tag(PLATFORMS[HERE])}.whl"
    wheel = tmp_path_factory.mktemp("wheels") / name
    wheel.write_bytes(platform_wheel(pure_wheel(dist), wheel_tag(PLATFORMS[HERE]), native))
    return wheel


@pytest.fixture(scope="module", params=deep_but("wheel_made_here".__eq__, ["wheel_made_here", "wheel"]))
def command(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel in an empty environment, as pip installs it."""
    if not IS_HERE:
        pytest.skip("another system than Linux on x86-64")
    wheel = request.getfixturevalue(request.param)
    folder = tmp_path_factory.mktemp("empty") / "venv"
    venv.create(folder, with_pip=False, symlinks=True)
    pip = [sys.executable, "-m", "pip", "--python", str(folder / "bin" / "python"), "install", "-q", "--no-compile"]
    run = subprocess.run([*pip, str(wheel)], timeout=BUILD_S, capture_output=True, text=True, check=False)
    if run.returncode != 0:
        missing(f"the package's dependencies cannot be installed:\n{run.stderr[-2000:]}")
    return folder / "bin" / "wificnc"


def bare(command: Path, folder: Path) -> dict[str, str]:
    """Nothing in the path but the environment's own commands: no compiler."""
    return {"PATH": str(command.parent), "HOME": str(folder), "WIFICNC_CACHE": str(folder / "cache"), "LANG": "C.UTF-8"}


@pytest.mark.slow
def test_sim_makes_the_checkouts_steps_without_a_compiler(command: Path, tmp_path: Path) -> None:
    words = ["sim", str(JOB), "--machine", "shapeoko3", "--trace", "steps.csv", "--json", "-"]
    run = subprocess.run(
        [str(command), *words], cwd=tmp_path, env=bare(command, tmp_path), capture_output=True, timeout=HANG_S,
        check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    simulate(SimOptions(JOB, machine=str(PROFILE), trace=tmp_path / "ours.csv"))
    steps = (tmp_path / "steps.csv").read_bytes()
    assert steps.count(b"\n") > 10_000 and steps == (tmp_path / "ours.csv").read_bytes()
    assert json.loads(run.stdout)["lines"] > 100
    assert not (tmp_path / "cache").exists()


@pytest.mark.slow
def test_serve_answers_without_a_compiler(command: Path, tmp_path: Path) -> None:
    words = [str(command), "serve", "--tcp", "127.0.0.1:0", "--machine", "shapeoko3"]
    with subprocess.Popen(
        words, cwd=tmp_path, env=bare(command, tmp_path), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as server:
        try:
            assert server.stdout and server.stderr
            door = server.stdout.readline().split()
            assert door[:1] == ["tcp"], server.stderr.read()
            host, _, port = door[1].rpartition(":")
            with socket.create_connection((host, int(port)), HANG_S) as client, client.makefile("rwb") as both:
                both.write(b"$I\n")
                both.flush()
                assert any(line.startswith(b"[VER:") for line in both)
        finally:
            server.terminate()
        assert server.wait(HANG_S) == 0
    assert not (tmp_path / "cache").exists()
