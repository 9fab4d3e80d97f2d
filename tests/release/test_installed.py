"""The wheel in an empty environment, outside the checkout: boards, sim and flash work."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest
from chip import mock_chip
from installed import missing
from patience import BUILD_S
from quick_compiler import quick_compiler
from release_tree import ESP32_BOARDS, PAGE, PIC32MZ_BOARD, ROOT, Tree
from wificnc import __version__
from wificnc.errors import Exit
from wificnc.firmware.flash.device import open_device
from wificnc.firmware.flash.plan import Region
from wificnc.linuxcnc.source import FILE_NAME, component_source

pytestmark = pytest.mark.slow  # what the package carries is looked at in test_release, too


@pytest.fixture(scope="module")
def installed(dist: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The command, as pip installs it."""
    folder = tmp_path_factory.mktemp("installed") / "venv"
    venv.create(folder, with_pip=False, symlinks=True)
    python = folder / "bin" / "python"
    wheel = dist / f"wificnc-{__version__}-py3-none-any.whl"
    pip = [sys.executable, "-m", "pip", "--python", str(python), "install", "-q", "--no-compile"]
    pip += ["--disable-pip-version-check", str(wheel)]
    run = subprocess.run(pip, timeout=BUILD_S, env=clean_environment(), capture_output=True, text=True, check=False)
    if run.returncode != 0:
        missing(f"the package's dependencies cannot be installed:\n{run.stderr[-2000:]}")
    return folder / "bin" / "wificnc"


def clean_environment(**more: str) -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")} | more


@pytest.fixture(scope="module")
def compiler(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A folder for PATH."""
    return f"{quick_compiler(tmp_path_factory.mktemp('compiler')).parent}{os.pathsep}"


def wificnc(installed: Path, folder: Path, *arguments: object, path: str = "", **more: str) -> str:
    """Run there; what it says on stdout, and no word of a checkout. @param more  of the environment"""
    environment = clean_environment(WIFICNC_CACHE=str(folder / "cache"), **more)
    environment["PATH"] = path + environment["PATH"]
    command = [str(installed), *map(str, arguments)]
    run = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=BUILD_S, check=False
    )
    assert run.returncode == 0, run.stdout + run.stderr
    assert str(ROOT) not in run.stdout + run.stderr
    return run.stdout


def test_boards_and_flash_need_no_checkout(installed: Path, tmp_path: Path, tree: Tree) -> None:
    boards = json.loads(wificnc(installed, tmp_path, "boards", "list", "--json"))
    assert {"host", *ESP32_BOARDS, PIC32MZ_BOARD} <= {board["id"] for board in boards}

    for board, at in (("esp32s3-zero", "0x000000"), ("esp32-wroom32", "0x001000")):
        said = wificnc(installed, tmp_path, "flash", board, "--dry-run").splitlines()
        assert [line.split()[0] for line in said[:4]] == [at, "0x008000", "0x00F000", "0x020000"]
    assert not (tmp_path / "cache").exists()  # nothing had to be built for that


def test_without_the_virtual_chips_what_needs_them_names_them(installed: Path, tmp_path: Path) -> None:
    (tmp_path / "part.nc").write_text("G1X1F600\n")
    command = [str(installed), "sim", "part.nc", "--board", PIC32MZ_BOARD, "--on-chip"]
    run = subprocess.run(
        command, cwd=tmp_path, env=clean_environment(), capture_output=True, text=True, timeout=BUILD_S, check=False
    )
    assert (run.returncode, run.stdout) == (Exit.USAGE, "") and "pip install 'wificnc[chips]'" in run.stderr


@pytest.mark.deep  # compiles all of the core, and the virtual chip
def test_the_other_wheel_runs_the_releases_image(installed: Path, dist: Path, tmp_path: Path, tree: Tree) -> None:
    if PIC32MZ_BOARD not in tree.boards:
        pytest.skip("gcc-mipsel-linux-gnu is not installed")
    (tmp_path / "part.nc").write_text("G21G91\nG1X1F600\n")
    with zipfile.ZipFile(dist / f"wificnc_chips-{__version__}-py3-none-any.whl") as wheel:
        wheel.extractall(tmp_path / "site")
    image = dist / f"wificnc-{__version__}-{PIC32MZ_BOARD}.hex"
    words = ("sim", "part.nc", "--board", PIC32MZ_BOARD, "--on-chip", image)
    said = wificnc(installed, tmp_path, *words, PYTHONPATH=str(tmp_path / "site"))
    assert ", 0 refused" in said and "step events 250 " in said and "the same steps" in said


@pytest.mark.deep  # compiles all of the core; test_wheels.py has a wheel with it
def test_sim_needs_a_compiler_and_no_checkout(installed: Path, tmp_path: Path, compiler: str) -> None:
    (tmp_path / "part.nc").write_text("G21 G90\nG0 X10 Y5\nG1 Z-1 F100\nG2 X20 Y5 I5 J0 F600\nM2\n")
    words = ("sim", "part.nc", "--machine", "shapeoko3", "--json", "-")
    report = json.loads(wificnc(installed, tmp_path, *words, path=compiler))
    ends = {axis: report["final_position_mm"][axis] for axis in "XYZ"}
    assert ends == pytest.approx({"X": 20, "Y": 5, "Z": -1}, abs=0.02)


def test_the_linuxcnc_component_comes_with_it(installed: Path, tmp_path: Path, tree: Tree) -> None:
    wificnc(installed, tmp_path, "linuxcnc", "component")
    assert (tmp_path / FILE_NAME).read_text() == component_source(tree.root)


def test_a_pic32mz_is_written_from_the_package(installed: Path, tmp_path: Path, tree: Tree) -> None:
    if PIC32MZ_BOARD not in tree.boards:
        pytest.skip("gcc-mipsel-linux-gnu is not installed")
    tools = tmp_path / "tools"
    tools.mkdir()
    (tools / "mikro_hb").write_text("#!/bin/sh\n")
    (tools / "mikro_hb").chmod(0o755)
    said = wificnc(installed, tmp_path, "flash", PIC32MZ_BOARD, "--dry-run", path=f"{tools}{os.pathsep}")
    program, image = said.split()
    assert program == str(tools / "mikro_hb") and Path(image).parent.name == PIC32MZ_BOARD
    assert Path(image).read_bytes() == (tree.root / "dist" / f"wificnc-{__version__}-{PIC32MZ_BOARD}.hex").read_bytes()


@pytest.mark.parametrize("board", ESP32_BOARDS)
def test_the_packages_firmware_arrives_in_a_chip(installed: Path, dist: Path, tmp_path: Path, board: str) -> None:
    """Flashed by the installed command at a mock of the loader: what the flash then holds is the merged image."""
    pytest.importorskip("esp32_mock_bootloader")
    merged = (dist / f"wificnc-{__version__}-{board}-merged.bin").read_bytes()
    with mock_chip(ESP32_BOARDS[board], tmp_path / "mock") as chip:
        wificnc(installed, tmp_path, "flash", board, "--port", chip.port, "--wait", "0")
        with open_device(chip.port) as device:
            device.verify([Region("merged", 0, merged)])  # raises when the digest of what the chip holds is another


def test_the_page_that_serve_offers_comes_with_it(installed: Path, tmp_path: Path) -> None:
    code = "from wificnc.simulator.serve.page import page_folder; print(page_folder())"
    command = [str(installed.with_name("python")), "-c", code]
    said = subprocess.run(command, cwd=tmp_path, env=clean_environment(), capture_output=True, text=True, check=True)
    page = Path(said.stdout.strip())
    assert page.is_relative_to(installed.parents[1])
    assert {name: (page / name).read_text() for name in PAGE} == PAGE
