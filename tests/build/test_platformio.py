"""platformio.ini as PlatformIO reads it; its native environment built and tested without the registry."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from patience import BUILD_S, HANG_S
from pio_standins import make_standins
from wificnc.board.load import find_boards, load_board
from wificnc.build.checkout import checkout_root
from wificnc.build.environments import write_environments
from wificnc.build.mips import COMPILER

pytest.importorskip("platformio")
ROOT = checkout_root()


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """PlatformIO's folders for these tests alone."""
    folder = tmp_path_factory.mktemp("pio")
    make_standins(folder / "core")
    write_environments(ROOT)
    return {
        **os.environ,
        "PLATFORMIO_CORE_DIR": str(folder / "core"),
        "PLATFORMIO_WORKSPACE_DIR": str(folder / "work"),
        "PLATFORMIO_SETTING_ENABLE_TELEMETRY": "no",
        "PLATFORMIO_SETTING_CHECK_PLATFORMIO_INTERVAL": "36500",
    }


def pio(environment: dict[str, str], *arguments: str) -> str:
    command = [sys.executable, "-W", "ignore", "-m", "platformio", *arguments, "-d", str(ROOT)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=BUILD_S, env=environment, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    return run.stdout


def test_there_is_an_environment_for_every_board(environment: dict[str, str]) -> None:
    sections = dict(json.loads(pio(environment, "project", "config", "--json-output")))
    found = {name.removeprefix("env:"): dict(options) for name, options in sections.items() if name.startswith("env:")}
    boards = {path.stem: load_board(path) for path in find_boards()}
    esp32 = {name for name, board in boards.items() if board.target == "esp32"}
    debug = {f"{name}-debug" for name in esp32}
    assert set(found) == {name for name, board in boards.items() if board.target != "host"} | debug | {"native"}
    for name in esp32:
        options, twin = found[name], found[f"{name}-debug"]
        arguments = f"-DWIFICNC_BOARD={name}"
        assert options.pop("board_build.cmake_extra_args") == arguments
        assert twin.pop("board_build.cmake_extra_args") == f"{arguments} -DWIFICNC_KIND=debug"
        assert {**twin, "extends": options["extends"]} == options
        assert ("s3" in options["board"]) == (boards[name].chip == "esp32s3")
        assert (ROOT / options["board_build.partitions"]).is_file()


def test_the_header_of_every_esp32_says_80_mhz(environment: dict[str, str]) -> None:
    """PlatformIO writes it into the image from its own options or its board's manifest, which has 40 MHz for esp32dev,
    and not from ESP-IDF's configuration."""
    sections = dict(json.loads(pio(environment, "project", "config", "--json-output")))
    esp32 = [options for options in map(dict, sections.values()) if options.get("framework") == ["espidf"]]
    assert len(esp32) >= 2 * len([board for board in map(load_board, find_boards()) if board.target == "esp32"])
    for options in esp32:
        assert options["board_build.f_flash"] == "80000000L"


@pytest.mark.slow
@pytest.mark.skipif(shutil.which(COMPILER) is None, reason=f"{COMPILER} is not installed")
def test_the_pic32mz_is_built_by_our_own_build(environment: dict[str, str]) -> None:
    image = ROOT / "build" / "pic32mz2048efh100" / "wificnc.hex"
    image.unlink(missing_ok=True)
    assert "1 succeeded" in pio(environment, "run", "-e", "pic32mz2048efh100")
    assert image.read_text().startswith(":")


@pytest.mark.deep
def test_native_is_the_serving_controller(environment: dict[str, str]) -> None:
    """Not optimised, which takes most of a compiler's time."""
    pio({**environment, "PLATFORMIO_BUILD_FLAGS": "-O0"}, "run", "-e", "native")
    program = Path(environment["PLATFORMIO_WORKSPACE_DIR"]) / "build" / "native" / "program"
    run = subprocess.run([program, "--nonsense"], capture_output=True, text=True, timeout=HANG_S, check=False)
    assert run.returncode == 2 and "--nonsense" in run.stderr


@pytest.mark.deep
def test_native_tests_pass(environment: dict[str, str], tmp_path: Path) -> None:
    said = pio(environment, "test", "-e", "native", "--json-output-path", str(tmp_path / "result.json"))
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["testcase_nums"] >= 1 and result["failure_nums"] == result["error_nums"] == 0, said
